# twinmesh info: what it tells of volumes and meshes, and what mesh would decide.

bats_require_minimum_version 1.5.0

setup() {
    samples=$(realpath "$BATS_TEST_DIRNAME/../../data-samples")
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
}

info() { run --separate-stderr "$twinmesh" info "$@"; }
says() { # words on standard output...
    local word
    [ "$status" -eq 0 ] || { echo "exit $status: $stderr"; return 1; }
    for word in "$@"; do [[ $output == *"$word"* ]] || { echo "no '$word' in: $output"; return 1; }; done
}

@test "a volume: its grids, and what mesh would take" {
    info "$samples/splash/fluid.0018.vdb"
    says "format: OpenVDB" "name: phi" "class: level set" "voxel: 0.03125 0.03125 0.03125" "samples: 96 48 48" \
        "name: velocity" "class: staggered" "components: 3" "inside: below" "taken for a level set"
    info --json "$samples/splash/fluid.0018.vdb"
    says '"grids":[{"name":"phi"' '"lowest":[-7.0],"highest":[5.0]' '"mesh":{"grid":"phi","iso":0.0,"inside":"below"'
    [ "$(wc -l <<<"$output")" -eq 1 ]
    jq -e '.grids[1].active.samples[0] == 51' <<<"$output"
    info --json --iso 1 --inside above "$samples/splash/fluid.0018.vdb"
    says '"iso":1.0,"inside":"above"'
    info "$samples/smoke/density.0025.vdb"
    says "iso: 0.1" "inside: above" "density"
}

@test "each format says what it is" {
    "$(dirname "$twinmesh")/tests/test_formats" --write .
    info a.npy raw.nrrd head.nhdr a.vdb zip.nvdb mnt3_0001.uni stacked.exr --json
    says "NumPy array" '"NRRD"' "NRRD header" OpenVDB NanoVDB Mantaflow "OpenEXR slices"
    [ "$(grep -c '"samples":\[21,18,24\]' <<<"$output")" -eq 7 ]
    [ "$(grep -c '"lowest":\[-4.26833773\],"highest":\[12.6194658\]' <<<"$output")" -eq 7 ]
    info a.raw --dims 21,18,24 --json
    says '"samples":[21,18,24]'
}

@test "meshes: counts, bounds, runs" {
    "$twinmesh" mesh "$samples"/balls/balls.000[12].npy -o out --format ply,glb,gltf --quiet --iso 0 --inside below
    info out.geometric.0001.ply out.geometric.0001.ply out.geometric.0002.ply
    says "format: PLY" "attributes: mechanical" "frames: 3" "first: out.geometric.0001.ply"
    [ "$(grep -c -- '- frames: ' <<<"$output")" -eq 2 ]
    vertices=$(grep -m1 -o 'vertices: .*' <<<"$output")
    info out.geometric.glb
    says "format: binary glTF" "$vertices" "attributes: NORMAL POSITION _ID" "seconds: 0.0833" "targets: 1"
    glb=$(sed 1,2d <<<"$output")
    info out.geometric.gltf
    says "format: glTF" "$glb"
}

@test "what cannot be read is named, the rest is told" {
    cp "$samples/balls/balls.0001.npy" .
    head -c 500 balls.0001.npy >cut.npy
    printf 'glTF' >cut.glb
    printf '{"asset":' >cut.gltf
    printf '{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"indices":9e9,"attributes":{"POSITION":-1}}]}],"accessors":7}' >odd.gltf
    info cut.npy balls.0001.npy nothing.ply cut.glb cut.gltf thing.obj
    [ "$status" -eq 3 ] && [[ $output == *balls.0001.npy* ]]
    for file in cut.npy nothing.ply cut.glb cut.gltf thing.obj; do [[ $stderr == *"$file"* ]] || { echo "$file: $stderr"; return 1; }; done
    info odd.gltf
    says "vertices: 0"
    info
    [ "$status" -eq 2 ] && [[ $stderr == *"no files"* ]]
    info --colour
    [ "$status" -eq 2 ] && [[ $stderr == *"no such option"*"help info"* ]]
    info balls.0001.npy --help
    says --json
}
