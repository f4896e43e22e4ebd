#!/usr/bin/env bash
# Bundles viewer.js with what it needs of three.js into one script; empty, after saying so, where npm cannot be had.
#   src/page/bundle.sh OUT
# The packages are installed beside OUT once, and again when package-lock.json changes. The same sources give the same bytes.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$(dirname "$1")"
tool=$(cd "$(dirname "$1")" && pwd)
out=$tool/$(basename "$1")

without() {
    echo "twinmesh: $1: PAGES OF twinmesh report WILL HAVE NO VIEWER; install npm and run make again" >&2
    : >"$out"
    exit 0
}

if [ ! -d "$tool/node_modules" ] || ! cmp -s "$here/package-lock.json" "$tool/package-lock.json"; then
    command -v npm >/dev/null || without 'npm is not installed'
    cp "$here/package.json" "$here/package-lock.json" "$tool"
    if ! (cd "$tool" && timeout 300 npm ci --no-audit --no-fund --fetch-retries=1 --fetch-timeout=20000 --ignore-scripts) >"$tool/npm.log" 2>&1; then
        rm -rf "$tool/node_modules" "$tool/package-lock.json"
        tail -n 5 "$tool/npm.log" >&2
        without 'npm cannot install three and esbuild'
    fi
fi
cp "$here/viewer.js" "$tool/source.js" # modules are looked for beside the script
"$tool/node_modules/.bin/esbuild" "$tool/source.js" --bundle --minify --format=iife --target=es2022 --legal-comments=inline \
    --charset=ascii --log-level=warning --outfile="$out.part"
three=$tool/node_modules/three
{
    printf '/*! three.js\n\n'
    cat "$three/LICENSE"
    printf '\nWith the decoder of packed meshes, under the same licence:\n'
    sed -n '1,2s,^// ,,p' "$three/examples/jsm/libs/meshopt_decoder.module.js"
    printf '*/\n'
    cat "$out.part"
} >"$out.whole"
mv "$out.whole" "$out"
rm "$out.part"
