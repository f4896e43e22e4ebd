# twinmesh diff: what is the same, what is not, and what is trouble.

bats_require_minimum_version 1.5.0

setup_file() {
    local root
    root=$(realpath "$BATS_TEST_DIRNAME/../..")
    cd "$BATS_FILE_TMPDIR" || exit 1
    "$(realpath "${TWINMESH:-$root/build/release/twinmesh}")" mesh "$root"/data-samples/balls/balls.####.npy --frames 1-3 -o a --quiet --iso 0 --inside below \
        --format ply,glb,gltf
}

setup() {
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
    cp "$BATS_FILE_TMPDIR"/a.* .
    for file in a.*; do cp "$file" "b${file#a}"; done
}

compare() { run --separate-stderr "$twinmesh" diff "$@"; }
expect() { # status, words...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr $output"; return 1; }
    shift
    local word
    for word in "$@"; do [[ "$output $stderr" == *"$word"* ]] || { echo "no '$word' in: $stderr $output"; return 1; }; done
}
poke() { printf "$3" | dd of="$1" bs=1 seek="$2" conv=notrunc status=none; }

@test "a copy is identical" {
    compare a b
    expect 0 "the same: identical 6, within the tolerance 0, different 0, on one side only 0"
    compare a.geometric.glb b.geometric.glb
    expect 0 "identical 1"
    compare a.geometric.0001.ply b.geometric.0001.ply --json
    expect 0 '"verdict":"identical"' '"same":true'
    compare a b --quiet
    expect 0 && [ -z "$output" ]
}

@test "a vertex that moved a little" {
    header=$(grep -a -b -o end_header b.geometric.0002.ply | head -n 1 | cut -d: -f1)
    byte=$(od -An -tu1 -j $((header + 11)) -N 1 b.geometric.0002.ply) # the lowest of the first x
    poke b.geometric.0002.ply $((header + 11)) "\\x$(printf %02x $((byte ^ 1)))"
    compare a b
    expect 1 "0002: different" "vertex 0" "identical 5"
    compare a b --tolerance 1e-3
    expect 0 "0002: within, places" "within the tolerance 1"
    compare a b --kind mechanical
    expect 0 "identical 3"
    compare a b -t 1e-3 --json --threads 3
    expect 0 '"verdict":"within","same_triangles":true'
}

@test "glTF beside PLY and beside its other form" {
    compare a.geometric.glb a.geometric.####.ply -t 1e-6
    expect 0 "0001: within" "0003: within" "different 0"
    compare a.geometric.####.ply a.geometric.gltf -t 1e-6
    expect 0 "within the tolerance 3"
    compare a.geometric.glb a.geometric.gltf
    expect 0 "different 0"
    compare a.geometric.glb a.mechanical.glb
    expect 1 "different 3"
}

@test "other triangles: distances, components" {
    compare a.geometric.0001.ply a.geometric.0003.ply
    expect 1 "triangles" "components" "Euler" "A to B" "at most"
    compare a.geometric.0001.ply a.mechanical.0001.ply --surface -t 1 --json
    expect 0 '"same_triangles":false' '"at_most"' '"components"'
    compare a.geometric.0001.ply a.mechanical.0001.ply --surface -t 1e-4
    expect 1 "different"
}

@test "frames on one side only" {
    rm b.geometric.0002.ply
    compare a b
    expect 1 "geometric 0002: only in A" "on one side only 1"
    compare b a
    expect 1 "geometric 0002: only in B"
}

@test "trouble" {
    compare a
    expect 2 "two meshes"
    compare a nothing
    expect 2 "nothing.geometric"
    compare a.geometric.0001.ply nothing.ply
    expect 2 "nothing.ply"
    head -c 200 a.geometric.0001.ply >cut.ply
    compare a.geometric.0001.ply cut.ply
    expect 2 "cut.ply"
    head -c 2000 a.geometric.glb >cut.glb
    compare a.geometric.glb cut.glb
    expect 2 "cut.glb"
    compare a b --tolerance -1
    expect 2 "--tolerance"
    run --separate-stderr bash -c "'$twinmesh' diff a b >/dev/full"
    expect 2 "standard output"
    compare --help
    expect 0 "--surface"
}
