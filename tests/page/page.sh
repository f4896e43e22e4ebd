#!/usr/bin/env bash
# The page of twinmesh report in headless Chromium: it loads, plays, scrubs, shows what the report and the PLYs say.
#   tests/page/page.sh TWINMESH
# Exit 0 good, 1 not, 77 where chromium or npm cannot be had.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
top=$(cd "$here/../.." && pwd)
twinmesh=$(realpath "$1")
tool=$top/build/page-test

skip() {
    echo "SKIPPED: $1: NO PAGE WAS LOOKED AT"
    exit 77
}
chromium=$(command -v chromium) || skip 'chromium is not installed'
[ -s "$top/build/page/viewer.js" ] || skip 'this build has no viewer'
. "$top/tests/npm.sh"
npm_packages "$here" "$tool" 'NO PAGE WAS LOOKED AT'
cp "$here/page.mjs" "$tool" # modules are looked for beside the script

out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
cd "$out"
"$twinmesh" mesh "$top/data-samples/balls/balls.####.npy" --inside below --up y --scale 2 -o balls --format glb,ply --quiet
"$twinmesh" report balls
"$twinmesh" report balls --link -o linked.html
"$twinmesh" mesh "$top/data-samples/balls/balls.####.npy" --inside below -o packed --format glb --compress meshopt --quiet
"$twinmesh" report packed
for name in balls.events balls.timings balls.mechanical balls.geometric; do for file in "$name".{jsonl,glb}; do
    [ -f "$file" ] && ln "$file" "cut${file#balls}"
done; done
cp "$top"/data-samples/balls/balls.000[12345].npy .
truncate -s 300 balls.0001.npy balls.0003.npy
"$twinmesh" mesh 'balls.####.npy' --inside below --on-error skip -o skip --quiet 2>skipped
"$twinmesh" report skip
head -n 4 balls.report.jsonl >cut.report.jsonl
"$twinmesh" report cut
node "$tool/page.mjs" "$chromium" "$out"
