#!/usr/bin/env bash
# The bytes of all outputs but timings, held to the hashes in this folder: over thread counts and runs.
#   tests/golden/golden.sh [--quick] PROGRAM     --quick: the small grids and scenes only, for builds without optimisation
#   UPDATE=1 tests/golden/golden.sh PROGRAM      writes the hashes anew; the commit says why they changed
set -u
cd "$(dirname "$0")/../.." || exit 1
quick=
[ "$1" = --quick ] && { quick=1; shift; }
program=$1
[ -x "$program" ] || { echo "$program is not there: is its compiler installed?"; exit 77; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
bad=0

hashes() { (cd "$1" && sha256sum -- *.ply *.glb *.gltf *.bin *.report.jsonl *.events.jsonl 2>/dev/null | LC_ALL=C sort -k2); }

run() { # name, threads, arguments...
    local name=$1 threads=$2
    shift 2
    local out=$scratch/$name.$threads.$RANDOM
    mkdir "$out"
    "$program" mesh "$@" -o "$out/$name" --threads "$threads" --quiet >&2 || { echo "$name: exit $?" >&2; bad=1; }
    hashes "$out"
    rm -rf "$out"
}

golden() { # name, arguments...
    local name=$1 expected=tests/golden/$1.sha256 threads
    for threads in 1 2 2; do
        run "$name" "$threads" "${@:2}" >"$scratch/got"
        if [ -n "${UPDATE:-}" ] && [ "$threads" = 1 ]; then cp "$scratch/got" "$expected"; fi
        if ! diff "$expected" "$scratch/got" >"$scratch/diff"; then
            echo "$name with $threads threads: other bytes than $expected"
            head -n 6 "$scratch/diff"
            bad=1
        fi
    done
}

# A picture's bytes are not kept here, as they are the zlib's too: other builds make the release's.
pictures() {
    local release=build/release/twinmesh build
    [ -x "$release" ] && [ "$(realpath "$release")" != "$(realpath "$program")" ] || return
    "$release" mesh 'data-samples/balls/balls.####.npy' --inside below --iso 0 --rest --format ply -o "$scratch/balls" --quiet || bad=1
    for build in "$release" "$program"; do
        mkdir -p "$scratch/pictures"
        "$build" render "$scratch/balls" -o "$scratch/pictures/p.####.exr" --png --size 320x240 --wire mechanical --texture checker --orbit 30 --quiet || bad=1
        (cd "$scratch/pictures" && sha256sum -- *) >"$scratch/pictures.$(dirname "$build" | tr / -)"
        rm -r "$scratch/pictures"
    done
    cmp "$scratch"/pictures.* || { echo 'pictures: other bytes than those of build/release'; bad=1; }
}

golden balls 'data-samples/balls/balls.####.npy' --inside below --iso 0 --format ply,glb
golden crossing data-samples/scenes/rr6128-figure1.json --frames 12-20 --format ply,glb
golden blades data-samples/scenes/rr6128-figure13b.json --frames 1-3 --format ply
pictures
if [ -z "$quick" ]; then
    golden splash 'data-samples/splash/fluid.####.vdb' --frames 18-23 --velocity velocity --format ply,glb
    golden smoke 'data-samples/smoke/density.####.vdb' --frames 20-23
fi
exit $bad
