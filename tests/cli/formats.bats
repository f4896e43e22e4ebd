# Every volume format that twinmesh reads: the same samples give the same meshes, byte for byte.

bats_require_minimum_version 1.5.0

setup() {
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
    "$(dirname "$twinmesh")/tests/test_formats" --write .
}

# The hashes of the meshes of a file, without names.
meshes_of() {
    "$twinmesh" mesh "$@" -o out --threads 2 --format ply,glb --quiet --iso 0 --inside below || return 1
    cat out.mechanical.*.ply out.geometric.*.ply out.mechanical.glb out.geometric.glb | sha256sum
    rm out.*
}

@test "the same samples give the same bytes from each format" {
    local place="--spacing 0.5,0.25,0.5 --origin 1,-2,3" want file
    want=$(meshes_of a.npy $place)
    [ "$(meshes_of a.raw --dims 21,18,24 $place)" = "$want" ]
    for file in *.uni; do [ "$(meshes_of $file $place)" = "$want" ] || { echo "$file"; return 1; }; done
    for file in *.nrrd *.nhdr *.vdb *.nvdb *.exr; do
        [ "$(meshes_of $file)" = "$want" ] || { echo "$file"; return 1; }
    done
    [ "$(meshes_of a.npy)" != "$want" ]
}

@test "--spacing and --origin overrule a NRRD's and an OpenEXR's own" {
    local want
    want=$(meshes_of a.npy --spacing 2 --origin 0,5,0)
    [ "$(meshes_of raw.nrrd --spacing 2 --origin 0,5,0)" = "$want" ]
    [ "$(meshes_of parts.exr --spacing 2 --origin 0,5,0)" = "$want" ]
}

@test "a sequence may be of any of them, and a file that is cut short says so" {
    cp raw.nrrd b.0001.nrrd && cp gzip.nrrd b.0002.nrrd
    run --separate-stderr "$twinmesh" mesh 'b.####.nrrd' -o out --format ply
    [ "$status" -eq 0 ] && [ -s out.geometric.0002.ply ]
    for file in raw.nrrd mnt3_0001.uni zip.nvdb parts.exr; do
        head -c 2000 $file >cut.${file##*.}
        run --separate-stderr "$twinmesh" mesh cut.${file##*.} -o out
        [ "$status" -eq 3 ] && [[ $stderr == *cut.${file##*.}* ]] || { echo "$status $stderr"; return 1; }
    done
}
