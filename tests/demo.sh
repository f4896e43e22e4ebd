#!/usr/bin/env bash
# The main job on the sample caches: meshes into build/demo, then the names of the files and what was measured.
set -eu
cd "$(dirname "$0")/.."
twinmesh=$1
out=build/demo
rm -rf "$out"
mkdir -p "$out"

echo "--- splash: a level set with its velocity"
"$twinmesh" mesh 'data-samples/splash/fluid.####.vdb' -o "$out/splash" --velocity velocity --format glb,ply
echo "--- smoke: a density"
"$twinmesh" mesh 'data-samples/smoke/density.####.vdb' -o "$out/smoke"
echo

# From the last line of each report; report_write_totals writes one flat object and the runs behind it.
figure() { tail -n 1 "$1" | grep -oE "\"$2\":[^,}]*" | head -n 1 | cut -d: -f2; }
row() {
    printf '%-34s' "$1"
    for name in splash smoke; do
        awk -v x="$(figure "$out/$name.report.jsonl" "$2")" -v n="$(figure "$out/$name.report.jsonl" "${3:-frames}")" \
            -v mean="${4:-0}" -v format="${5:-%d}" 'BEGIN { printf "%16s", x == "null" ? "-" : sprintf(format, mean ? x / n : x) }'
    done
    echo
}
printf '%-34s%16s%16s\n' 'measured' splash smoke
row 'frames' frames
row 'frames of exact topology' exact
row 'mechanical triangles a frame' triangles_mechanical frames 1
row 'geometric triangles a frame' triangles_geometric frames 1
row 'minimum angle, 5th percentile' min_angle_p5_mean frames 0 '%.1f deg'
row 'minimum angle, median' min_angle_p50_mean frames 0 '%.1f deg'
row 'mean edge / asked' edge_mean_over_asked frames 0 %.3f
row 'distance, mean' distance_mean_vox frames 0 '%.3f voxel'
row 'identities kept a frame' ids_kept_mean frames 0 %.3f
row 'inverted triangles left' inverted_left
echo
echo 'Files written:'
(cd "$out" && du -h -- *.glb *.jsonl) | sed "s|\t|  $out/|;s|^|  |"
echo "  and $(find "$out" -name '*.ply' | wc -l) PLY files, $out/splash.*.NNNN.ply"
