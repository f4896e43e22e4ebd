# twinmesh field, and twinmesh mesh on scenes.

bats_require_minimum_version 1.5.0

setup() {
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
    cat >two.json <<'END'
{
  "comment": "two drops meet, and one leaves the domain",
  "frames": [5, 9], "fps": 12,
  "domain": [[-1.5, -0.9, -0.9], [1.5, 0.9, 0.9]], "voxel": 0.1,
  "elements": [
    {"points": [[0, 0, 0]], "radius": 0.5, "translate": {"keys": [[5, [-0.9, 0, 0]], [9, [-0.1, 0, 0]]]}},
    {"points": [[0.7, 0, 0]], "radius": 0.4, "kernel": "compact", "norm": 4, "translate": {"keys": [[5, [0, 0, 0]], [9, [0.6, 0, 0]]]}}
  ]
}
END
}

field() { run --separate-stderr "$twinmesh" field two.json "$@"; }
mesh() { run --separate-stderr "$twinmesh" mesh --format ply "$@"; }

expect() { # status, words on standard error...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr"; return 1; }
    shift
    local word
    for word in "$@"; do [[ $stderr == *"$word"* ]] || { echo "no '$word' in: $stderr"; return 1; }; done
}

same_meshes() { # two prefixes
    local file n=0
    for file in "$1".*.ply; do cmp "$file" "$2${file#"$1"}" && n=$((n + 1)) || return 1; done
    [ "$n" -eq 10 ]
}

@test "field names what it wrote, on standard output" {
    field -o phi.##.vdb --frames 6-8x2
    expect 0 "--spacing 0.1 --origin -1.5,-0.9,-0.9"
    [ "$output" = $'phi.06.vdb\nphi.08.vdb' ]
    [ -s phi.06.vdb ] && [ ! -e phi.05.vdb ] && [ ! -e phi.07.vdb ]
}

@test "one frame needs no pattern, several do" {
    field -o one.npy --frames 7 -q
    expect 0 && [ -z "$stderr" ] && [ -s one.npy ]
    field -o all.npy
    expect 2 "####"
    [ ! -e all.npy ]
}

@test "the same bytes with any number of threads" {
    for ending in vdb npy exr; do
        field -o a.#.$ending --threads 1 -q
        expect 0
        field -o b.#.$ending --threads 2 -q
        expect 0
        for frame in 5 6 7 8 9; do cmp a.$frame.$ending b.$frame.$ending; done
    done
}

@test "an .exr has a part for each slice" {
    field -o a.#.exr --frames 5 -q
    expect 0
    # magic and flags of a multi-part file; 31 x 19 floats in each of 19 slices
    [ "$(head -c 8 a.5.exr | od -An -tx1 | tr -d ' ')" = 762f310102100000 ]
    [ "$(grep -aoE 'z00[0-9]{2}' a.5.exr | sort -u | wc -l)" -eq 19 ]
    [ "$(stat -c %s a.5.exr)" -gt $((31 * 19 * 19 * 4)) ]
}

@test "mesh makes of the files what it makes of the scene" {
    mesh two.json -o scene --projection trilinear
    expect 0
    field -o phi.####.vdb -q && mesh phi.####.vdb -o vdb --fps 12
    expect 0 && same_meshes scene vdb
    field -o phi.####.npy -q && mesh phi.####.npy --spacing 0.1 --origin -1.5,-0.9,-0.9 -o npy --fps 12
    expect 0 && same_meshes scene npy
    "$twinmesh" field two.json -q -o pipe.####.vdb | "$twinmesh" mesh - --format ply -q --fps 12 -o pipe
    same_meshes scene pipe
}

@test "mesh on a scene: its frames, its rate, its topology, with any number of threads" {
    mesh two.json -o out --threads 1 -q
    expect 0
    [ -s out.geometric.0005.ply ] && [ -s out.geometric.0009.ply ] && [ ! -e out.geometric.0004.ply ]
    grep -q '"fps":12' out.report.jsonl
    [ "$(grep -c '"wrong_components":0' out.report.jsonl)" -ge 5 ]
    mesh two.json -o again --threads 2 -q
    same_meshes out again
    mesh two.json -o part --frames 8-30 -q
    expect 0
    [ "$(ls part.geometric.*.ply | tr '\n' ' ')" = "part.geometric.0008.ply part.geometric.0009.ply " ]
}

@test "what does not go with a scene is said" {
    mesh two.json -o out --iso 1
    expect 2 --iso two.json
    mesh two.json two.json -o out
    expect 2 "name it alone"
    mesh two.json -o out --frames 1-4
    expect 2 "5 to 9"
    field
    expect 2 "-o PATTERN"
    field -o phi.####.raw
    expect 2 ".vdb, .npy or .exr"
    field -o phi.####.npy --edge 3
    expect 2 --edge "help field"
    field -o no/phi.####.npy
    expect 4 "no/phi.0005.npy" "folder"
}

@test "an .exr says where its samples are" {
    field -o a.#.exr --frames 5 -q
    field -o a.#.vdb --frames 5 -q
    run bash -c "diff <('$twinmesh' mesh a.5.exr -o e --inside below --format ply -q && sha256sum < e.geometric.5.ply) <('$twinmesh' mesh a.5.vdb -o v --format ply -q && sha256sum < v.geometric.5.ply)"
    [ "$status" -eq 0 ]
}

@test "info tells of a scene" {
    run --separate-stderr "$twinmesh" info --json two.json
    expect 0
    [[ $output == *'"format":"scene","elements":2,"frames":{"first":5,"last":9,'* ]]
    sed -i 's/"norm": 4/"norm": -4/' two.json
    run --separate-stderr "$twinmesh" info two.json
    expect 3 'two.json:7: element 2, "norm"'
}

@test "a mistake is one sentence with file, line, element and field" {
    sed -i 's/"norm": 4/"norm": -4/' two.json
    mesh two.json -o out
    expect 3 'two.json:7: element 2, "norm"' "0.1 to 100"
    [ "$(wc -l <<<"$stderr")" -eq 1 ]
    [ ! -e out.report.jsonl.part ]
    field -o phi.#.vdb
    expect 3 'two.json:7: element 2, "norm"'
    run --separate-stderr "$twinmesh" field none.json -o phi.#.vdb
    expect 3 none.json
}
