#!/usr/bin/env bash
# Seconds a frame by stage, beside OpenVDB's volumeToMesh on the same frames in the same run. Prints, asserts nothing.
#   tests/bench/bench.sh build/release [THREADS]     the samples, on all cores or on as many threads
#   CACHE='PATTERN GRID ISO [OPTIONS]' tests/bench/bench.sh build/release     another cache
set -eu
cd "$(dirname "$0")/../.."
build=$1
threads=${2:-$(nproc)}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# Means over the frames of timings.jsonl: "stage seconds" a line. Each line is one flat object.
stages() {
    grep '"frame"' "$1" | tr -d '{}"' | tr ',' '\n' | awk -F: '
        $1 != "frame" { if (!($1 in sum)) order[++n] = $1; sum[$1] += $2; count[$1]++ }
        END { for (i = 1; i <= n; i++) printf "  %-24s %9.1f ms\n", order[i], 1000 * sum[order[i]] / count[order[i]] }'
}

bench() { # title, pattern, grid, iso, options...
    local title=$1 pattern=$2 grid=$3 iso=$4
    shift 4
    local files=(${pattern//\#\#\#\#/[0-9][0-9][0-9][0-9]})
    echo "$title: ${#files[@]} frames, $threads threads, mean of a frame"
    "$build/twinmesh" mesh "$pattern" -o "$scratch/bench" --grid "$grid" --iso "$iso" --threads "$threads" --quiet "$@"
    stages "$scratch/bench.timings.jsonl"
    "$build/tests/volume_to_mesh" "$grid" "$iso" "${files[@]}" | awk '
        { read += $1; mesh += $2; triangles += $3 }
        END { printf "  %-24s %9.1f ms\n  %-24s %9.1f ms   %.0f triangles\n", "OpenVDB reading", 1000 * read / NR,
              "OpenVDB volumeToMesh", 1000 * mesh / NR, triangles / NR }'
    echo
}

if [ -n "${CACHE:-}" ]; then
    read -r pattern grid iso options <<<"$CACHE"
    bench "$pattern" "$pattern" "$grid" "$iso" $options
else
    bench splash 'data-samples/splash/fluid.####.vdb' phi 0 --velocity velocity
    bench smoke 'data-samples/smoke/density.####.vdb' density 0.1
    echo "skin: a ball in n^3 voxels, $threads threads"
    "$build/tests/skin" "$threads"
fi
