#!/usr/bin/env bash
# The Khronos glTF validator over what the program writes, or over the files named.
#   tests/gltf/validate.sh TWINMESH [FILE...]
# The validator is installed with npm under build/ once. Exit 0 clean, 1 not, 77 where npm cannot be reached.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
top=$(cd "$here/../.." && pwd)
twinmesh=$1
shift
tool=$top/build/gltf-validator

. "$top/tests/npm.sh"
npm_packages "$here" "$tool" 'NO glTF FILE WAS VALIDATED'
cp "$here/validate.mjs" "$tool" # modules are looked for beside the script

if [ $# -eq 0 ]; then
    out=$(mktemp -d)
    trap 'rm -rf "$out"' EXIT
    cd "$top"
    "$twinmesh" mesh 'data-samples/balls/balls.####.npy' --frames 1-6 --inside below -o "$out/balls" --format glb --quiet
    "$twinmesh" mesh 'data-samples/balls/balls.####.npy' --frames 1-6 --inside below -o "$out/parts" --format gltf --quiet
    "$twinmesh" mesh 'data-samples/balls/balls.####.npy' --frames 1-6 --inside below -o "$out/step" --format glb \
        --gltf-interpolation step --quiet
    "$twinmesh" mesh data-samples/balls/balls.0001.npy --inside below -o "$out/single" --format glb --quiet
    for compress in quantize meshopt; do
        "$twinmesh" mesh 'data-samples/balls/balls.####.npy' --frames 1-6 --inside below -o "$out/$compress" --format glb,gltf,vat \
            --compress $compress --quiet
    done
    set -- "$out"/*.glb "$out"/*.gltf
fi
node "$tool/validate.mjs" "$@"
