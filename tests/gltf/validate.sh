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

skip() {
    echo "SKIPPED: npm cannot be reached ($1): NO glTF FILE WAS VALIDATED"
    exit 77
}

command -v node >/dev/null || skip 'node is not installed'
mkdir -p "$tool"
if [ ! -d "$tool/node_modules/gltf-validator" ] || ! cmp -s "$here/package-lock.json" "$tool/package-lock.json"; then
    command -v npm >/dev/null || skip 'npm is not installed'
    cp "$here/package.json" "$here/package-lock.json" "$tool"
    if ! (cd "$tool" && timeout 300 npm ci --no-audit --no-fund) >"$tool/npm.log" 2>&1; then
        rm -rf "$tool/node_modules" "$tool/package-lock.json"
        grep -qE 'ENOTFOUND|EAI_AGAIN|ETIMEDOUT|ECONN|ENETUNREACH|EHOSTUNREACH|ERR_SOCKET|E40[37]|E5[0-9][0-9]|ENOTCACHED' \
            "$tool/npm.log" && skip 'its registry does not answer'
        [ -s "$tool/npm.log" ] || skip 'its registry does not answer in time'
        cat "$tool/npm.log"
        exit 1
    fi
fi
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
