#!/usr/bin/env bash
# The papers' tables, ours beside theirs, by the scenes in data-samples/scenes. Prints, asserts nothing. Their figures are of a
# Pentium M at 2 GHz and hold the rendering; ours are of this machine, hold sampling and audits, and no rendering.
#   tests/papers.sh build/release [THREADS]
set -eu
cd "$(dirname "$0")/.."
build=$1
threads=${2:-$(nproc)}
scenes=data-samples/scenes
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
echo "$threads threads"

# The mean over the frames behind the first, which is marching cubes: of a field of report.jsonl, of timings in ms.
mean() { # file, fields with + between
    sed -n '/"frame"/p' "$1" | tail -n +2 | tr -d '{}"' | awk -v fields="$2" '
        { n = split($0, pair, /[,:]/); split(fields, want, "+")
          for (i = 1; i < n; i++) for (k in want) if (pair[i] == want[k]) sum += pair[i + 1] }
        END { printf "%.6f", NR ? sum / NR : 0 }'
}

track() { # scene, options...: leaves $report and $timings; the scene's comment says the edge
    local scene=$scenes/$1.json edge
    shift
    edge=$(grep -oE -m 1 -- '--edge [0-9.]+' "$scene" || true)
    "$build/twinmesh" mesh "$scene" $edge --deviation 0 --threads "$threads" -o "$scratch/run" --quiet "$@" 2>"$scratch/said" || { cat "$scratch/said"; return 1; }
    report=$scratch/run.report.jsonl timings=$scratch/run.timings.jsonl
}
report_mean() { mean "$report" "$1"; }
fps() { awk -v s="$(mean "$timings" whole)" 'BEGIN { printf "%.0f", (s > 0 ? 1 / s : 0) }'; }
whole() { printf '%.0f' "$1"; }

angles() { # title, scene, their triangles at 37, 26, 18, 8 degrees, their frames a second
    local angle i=0 theirs=($3) rate=($4)
    echo
    echo "$1"
    printf '  %-8s %12s %12s %12s %12s %12s\n' alpha_r mechanical geometric theirs frames/s theirs
    for angle in 37 26 18 8; do
        track "$2" --angle $angle
        printf '  %-8s %12s %12s %12s %12s %12s\n' "$angle deg" "$(whole "$(report_mean triangles_mechanical)")" \
            "$(whole "$(report_mean triangles_geometric)")" "${theirs[i]}" "$(fps)" "${rate[i]}"
        i=$((i + 1))
    done
}

angles "GI'07 table 2: the teaser" gi07-teaser "326 1378 2130 12054" "52 22 18 7"
angles "RR-6128 table 3: figure 14, first example" rr6128-figure14-1 "832 1847 3111 12475" "58 38 25 7"

echo
echo "RR-6128 figure 14: particles and mechanical triangles"
printf '  %-8s %12s %12s %12s %12s %12s\n' example vertices theirs mechanical theirs geometric
while read -r example angle particles triangles; do
    track "rr6128-figure14-$example" --angle "$angle"
    printf '  %-8s %12s %12s %12s %12s %12s\n' "$example" "$(whole "$(report_mean vertices_mechanical)")" "$particles" \
        "$(whole "$(report_mean triangles_mechanical)")" "$triangles" "$(whole "$(report_mean triangles_geometric)")"
done <<'END'
1 26 350 690
2 32 180 350
4 37 530 1050
END

echo
echo "RR-6128 table 2: finite elements and springs. ms a step of altering and relaxing, theirs in brackets; changes: splits, collapses"
echo "and flips a frame; inverted: percent of the triangles at the end of as many bare steps, one a frame, without the program's guards"
echo "(limited steps, healing, mending). Theirs: in example 4 springs are not stable at 40 ms, and the mesh is modified more often"
printf '  %-20s %-11s %18s %10s %10s\n' '' '' 'ms' changes inverted
while read -r example dt times; do
    theirs=($times) i=0
    edge=$(grep -oE -m 1 -- '--edge [0-9.]+' $scenes/rr6128-figure14-$example.json | cut -d ' ' -f 2)
    for mechanics in fem spring; do
        for iterations in 2 10; do
            track "rr6128-figure14-$example" --mechanics $mechanics --cg-iterations $iterations --relax-steps 1 --dt "$dt" --angle 180
            inverted=$("$build/tests/steps" "$scenes/rr6128-figure14-$example.json" "$edge" "$dt" $iterations $mechanics)
            printf '  %-20s %-11s %18s %10.1f %10s\n' "example $example, dt $dt" "$mechanics $iterations" \
                "$(awk -v s="$(mean "$timings" alter+relax)" 'BEGIN { printf "%.1f", 1000 * s }') (${theirs[i]})" \
                "$(report_mean splits+collapses+flips)" "$inverted"
            i=$((i + 1))
        done
    done
done <<'END'
1 0.04 9 16 10 20
2 0.04 15 16 12 14
3 0.04 197 215 148 183
4 0.04 90 130 unstable unstable
4 0.01 90 130 110 190
END

echo
echo "GI'07 figure 8: the fewest mechanical triangles (theirs: 4) refined at 20 degrees"
track gi07-figure8 --angle 20
echo "  $(whole "$(report_mean triangles_mechanical)") mechanical, $(whole "$(report_mean triangles_geometric)") geometric"

echo
echo "GI'07 figure 7c: a hernia that the normals do not see: the surface's largest distance from the mesh there, voxels"
hernia() { # title, options...
    local title=$1
    shift
    track gi07-figure7c --format ply "$@"
    printf '  %-44s %8s triangles, %s\n' "$title" "$(whole "$(report_mean triangles_geometric)")" \
        "$("$build/tests/reach" "$scratch/fine.geometric.0012.ply" "$scratch/run.geometric.0012.ply" 0.3 0.2 0.38 0.15 | awk '{ printf "%.3f", $1 / 0.05 }')"
}
"$build/twinmesh" mesh $scenes/gi07-figure7c.json --frames 12 --edge 0.05 --angle 180 --format ply --threads "$threads" -o "$scratch/fine" --quiet
hernia 'not refined' --angle 180
hernia 'by angles between normals, as in the paper' --angle 20
hernia 'by the Hessian' --angle 20 --refine-by hessian
hernia 'by normals and --deviation, the default' --angle 20 --deviation 0.09
hernia 'by the Hessian and --deviation' --angle 20 --deviation 0.09 --refine-by hessian

for figure in 9b 9c; do
    echo
    echo "GI'07 figure $figure, the scene and a volume sampled from it: vertices within 0.3 edges of the ball's ridges, how many of them"
    echo "on a ridge, their distance from it, and how much of the ridges the mechanical mesh cuts off, in voxels"
    "$build/twinmesh" field $scenes/gi07-figure$figure.json --frames 1 -o "$scratch/ball.vdb" --quiet >"$scratch/said"
    "$build/tests/ridges" $scenes/gi07-figure$figure.json "$scratch/ball.vdb"
done
