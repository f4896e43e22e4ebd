#!/usr/bin/env bash
# `twinmesh mesh` beside its peers on the same frames in the same run: the whole process by the clock, its stages, triangles,
# distances from the surface, memory, and the floor: the time only to read the frames and write as many bytes. Prints tables with
# the bars that are to be met, asserts nothing; all figures are in BUILD/bench.json, whose keys stay, so that jq compares two runs.
#   tests/bench/bench.sh BUILD [THREADS]     on all cores or on as many threads; and on one, for what a second brings
# From the environment:
#   CASES='splash96 sample-smoke'   instead of them all: sample-splash, sample-smoke, skin, and generate.cpp's {splash,sphere,still}N
#   CACHE='PATTERN GRID ISO [OPTIONS]'   another cache instead, PATTERN as phi.####.vdb or phi.00[12]?.vdb
#   OPTIONS='--deviation 0.15'      of twinmesh mesh, in all cases; those in CACHE too
#   RUNS=5, BUDGET=30               medians of so many runs; but in each case none beyond the first that would end after so many
#                                   seconds, and where the first alone takes five times as long no larger case of its kind
# twinmesh as near is one that asks for less: whose mean and 95th percentile of distances are no larger than volumeToMesh's at adaptivity 0.
# The peers are told in peer.h; one that was not built is left out. They write their files without syncing them; twinmesh and
# the floor sync. Peaks of memory are those of a run's largest process; the fields' is that of a program that reads the frames,
# keeps as many fields as a run does, and does nothing with them.
set -eu
cd "$(dirname "$0")/../.."
build=$1
threads=${2:-$(nproc)}
runs=${RUNS:-5}
budget=${BUDGET:-30}
cases=${CASES:-sample-splash sample-smoke $(printf '%s ' {splash,sphere,still}{32,64,128,256,512}) skin}
triangles_checked=100000 # of more distances are not measured: that would take minutes, and in voxels they hardly change
[ -z "${CACHE:-}" ] || cases=cache
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
raw=$scratch/raw.jsonl

[ -x "$build/tests/flying_edges" ] || echo "bench: without VTK's flying edges, which libvtk9-dev is wanted for" >&2
[ -x "$build/tests/isotropic" ] || echo "bench: without CGAL's isotropic remeshing, which libcgal-dev is wanted for" >&2

# --- the frames of a case -------------------------------------------------------------------------

use_files() { # pattern, grid, iso, options of mesh...
    files=(${1//\#\#\#\#/[0-9][0-9][0-9][0-9]}) grid=$2 iso=$3 velocity=-
    shift 3
    options=("$@")
    [[ " $*" != *' --velocity '* ]] || velocity=$(sed 's/.*--velocity \([^ ]*\).*/\1/' <<<"$*")
    middle=${files[${#files[@]} / 2]}
    middle_frame=$(sed -E 's/^(.*[^0-9])?([0-9]+)\.[^.]*$/\2/' <<<"$middle")
}

find_frames() { # case
    local n=${1##*[a-z]} frames=8
    rm -rf "$scratch/frames"
    mkdir "$scratch/frames"
    case $1 in
    cache)
        read -ra cache <<<"$CACHE"
        use_files "${cache[@]}"
        ;;
    sample-splash) use_files 'data-samples/splash/fluid.####.vdb' phi 0 --velocity velocity ;;
    sample-smoke) use_files 'data-samples/smoke/density.####.vdb' density 0.1 ;;
    *)
        [[ $1 != still* ]] || frames=24 # the first costs more than all that follow
        [ "$n" -le 128 ] || frames=$((frames / 2))
        "$build/tests/generate" "${1%"$n"}" "$n" $frames "$scratch/frames"
        use_files "$scratch/frames/phi.####.vdb" phi 0
        ;;
    esac
}

# --- one run of a program: a line in $raw ---------------------------------------------------------

record() { # program, threads, JSON of its stages and triangles
    tail -n 1 "$scratch/timed" | jq -c --arg case "$case" --arg program "$1" --argjson threads "$2" --argjson frames ${#files[@]} \
        --argjson more "$3" '{$case, $program, $threads, $frames} + . + $more' >>"$raw"
}

mesh() { # prefix, threads, options and frames...: its clock in $scratch/timed
    local out=$1 threads=$2
    shift 2
    rm -f "$out".*
    "$build/tests/timed" "$scratch/timed" "$build/twinmesh" mesh -o "$out" --format ply --grid "$grid" --iso "$iso" --threads "$threads" \
        --quiet "${options[@]}" ${OPTIONS:-} "$@" 2>"$scratch/said" || { cat "$scratch/said" >&2; return 1; }
}

run_ours() { # what it is called here, prefix, threads, options...
    local program=$1 out=$2 threads=$3
    mesh "$out" "$threads" "${files[@]}" "${@:4}"
    record "$program" "$threads" "$(jq -s 'map(.totals | values) | {triangles: .[0].triangles_geometric, mechanical: .[0].triangles_mechanical,
        stages: .[1] | del(.frames)}' "$out.report.jsonl" "$out.timings.jsonl")"
}

run_peer() { # what it is called here, program, parameter or nothing
    local adaptivity=null
    [ -x "$build/tests/$2" ] || return 0
    [ "$2" != volume_to_mesh ] || adaptivity=$3
    "$build/tests/timed" "$scratch/timed" "$build/tests/$2" "$threads" "$grid" "$iso" "$scratch/$1" ${3:+"$3"} "${files[@]}" \
        >"$scratch/stages"
    record "$1" "$threads" "$(jq -s --argjson adaptivity "$adaptivity" '{triangles: map(.triangles) | add, $adaptivity,
        stages: map(del(.frame, .triangles) | to_entries[]) | group_by(.key)
            | map({key: .[0].key, value: map(.value) | add}) | from_entries}' "$scratch/stages")"
}

run_floor() {
    local written=("$scratch"/ours.*.ply)
    "$build/tests/timed" "$scratch/timed" "$build/tests/floor" "$scratch/floor" "$(cat "${written[@]}" | wc -c)" ${#written[@]} \
        "$grid" "$iso" "$velocity" "${files[@]}"
    rm -f "$scratch"/floor.*
    record floor 1 '{}'
}

run_others() {
    [ "$threads" = 1 ] || run_ours twinmesh "$scratch/ours" 1
    [ -z "$coarser" ] || run_ours twinmesh_as_near "$scratch/near" "$threads" $(coarser $coarser)
    run_peer volume_to_mesh volume_to_mesh 0
    run_peer volume_to_mesh_as_many volume_to_mesh "$as_many"
    [ -z "$as_near" ] || run_peer volume_to_mesh_as_near volume_to_mesh "$as_near"
    run_peer flying_edges flying_edges
    run_peer isotropic isotropic "$edge"
    run_floor
}

# --- distances, on the middle frame ---------------------------------------------------------------

distances() { # prefix: JSON of what twinmesh check measures, or null; a topology that is not the surface's fails no benchmark
    "$build/twinmesh" check "$middle" --meshes "$1.$middle_frame.ply" --grid "$grid" --iso "$iso" --threads "$threads" \
        --json --quiet 2>"$scratch/said" |
        jq -cs 'map(select(.kind))[0] | if . then {topology_errors, self_intersections, min_angle_p5, edge_mean,
            to_surface: {mean: .to_surface_mean, p95: .to_surface_p95, p99: .to_surface_p99},
            from_surface: {mean: .from_surface_mean, p95: .from_surface_p95, p99: .from_surface_p99}} else null end'
}
p99() { distances "$1" | jq '[.to_surface.p99, .from_surface.p99] | max'; }
is_less() { awk -v a="$1" -v b="$2" 'BEGIN { exit !(a + 0 < b + 0) }'; }

adaptive() { "$build/tests/volume_to_mesh" "$threads" "$grid" "$iso" "$scratch/trial" "$1" "$middle"; } # adaptivity
has_as_many() { ! is_less "$(adaptive "$(adaptivity "$1")" | jq .triangles)" "$our_triangles"; }
is_as_near() { adaptive "$(adaptivity "$1")" >"$scratch/stages" && ! is_less "$our_p99" "$(p99 "$scratch/trial")"; }

# Refinement that asks for less: both limits grow, by a twelfth of their tenfold a step.
coarser() { awk -v i="$1" 'BEGIN { s = 10 ^ (i / 12); printf "--deviation %.3g --angle %.3g", 0.085 * s, 20 * s }'; }
is_no_farther() { # coarser by so many steps
    mesh "$scratch/near" "$threads" "${files[@]:0:$((${#files[@]} / 2 + 1))}" $(coarser "$1") &&
        distances "$scratch/near.geometric" |
        jq -e -L tests/bench --argjson theirs "$volume_to_mesh" 'include "near"; is_no_farther($theirs)' >"$scratch/holds"
}

# The largest of 1 ... n - 1 for which it holds, as if for all below that; 0 where it holds for none.
bisect() { # n, what
    local low=0 high=$1 mid
    while [ $((high - low)) -gt 1 ]; do
        mid=$(((low + high) / 2))
        if "$2" $mid; then low=$mid; else high=$mid; fi
    done
    echo $low
}
# 0.0001 to 0.87 at even ratios
adaptivity() { awk -v i="$1" 'BEGIN { printf "%.3g", i ? 10 ^ (i / 16 - 4) : 0 }'; }

find_settings() {
    edge=$(jq -s 'map(.edge_asked // empty)[0]' "$scratch/ours.report.jsonl")
    our_triangles=$(jq --arg frame "$middle_frame" 'select(.frame == $frame).triangles_geometric' "$scratch/ours.report.jsonl")
    as_many=$(adaptivity "$(bisect 64 has_as_many)") as_near='' coarser=''
    if [ "$our_triangles" -le $triangles_checked ]; then
        our_p99=$(p99 "$scratch/ours.geometric")
        as_near=$(adaptivity "$(bisect 64 is_as_near)")
        adaptive 0 >"$scratch/stages"
        volume_to_mesh=$(distances "$scratch/trial")
        coarser=$(bisect 8 is_no_farther)
    fi
}

measure_distances() {
    local program prefix
    [ "$our_triangles" -le $triangles_checked ] || return 0
    for program in twinmesh twinmesh_as_near volume_to_mesh volume_to_mesh_as_many volume_to_mesh_as_near flying_edges isotropic; do
        prefix=$scratch/$program
        [ $program != twinmesh ] || prefix=$scratch/ours.geometric
        [ $program != twinmesh_as_near ] || prefix=$scratch/near.geometric
        [ -f "$prefix.$middle_frame.ply" ] || continue
        jq -nc --arg case "$case" --arg program $program --argjson error "$(distances "$prefix")" '{$case, $program, $error}' >>"$raw"
    done
}

# --- all cases ------------------------------------------------------------------------------------

tables() { jq -r --arg case "$1" -f tests/bench/tables.jq "$build/bench.json"; } # case, or nothing: the bars

# Leaves in round_s the seconds of one run of all programs.
bench() { # case
    local began run
    case=$1
    rm -f "$scratch"/*.ply
    find_frames "$case"
    began=$SECONDS
    run_ours twinmesh "$scratch/ours" "$threads"
    round_s=$((SECONDS - began))
    find_settings
    began=$((SECONDS - round_s))
    for ((run = 1; run <= runs; run++)); do
        [ $run = 1 ] || run_ours twinmesh "$scratch/ours" "$threads"
        run_others
        [ $run != 1 ] || round_s=$((SECONDS - began))
        [ $((SECONDS - began + round_s)) -le "$budget" ] || break
    done
    measure_distances
    "$build/tests/timed" "$scratch/timed" "$build/tests/floor" --fields "$grid" "$iso" "$velocity" "${files[@]}"
    record fields 1 "{\"edge\":$edge}"
    jq -s -L tests/bench --argjson threads "$threads" -f tests/bench/figures.jq "$raw" >"$build/bench.json"
    tables "$case"
}

too_long=' '
for case in $cases; do
    kind=${case%%[0-9]*}
    if [ "$case" = skin ]; then
        echo "skin: a ball in n^3 voxels, $threads threads"
        "$build/tests/skin" "$threads"
        echo
    elif [[ $too_long == *" $kind "* ]]; then
        echo "$case: left out, as one run of all programs took more than $((5 * budget)) seconds with a smaller one"
        echo
    else
        bench "$case"
        [ $round_s -le $((5 * budget)) ] || too_long+="$kind "
    fi
done
[ ! -s "$raw" ] || tables ''
