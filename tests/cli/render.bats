# twinmesh render: which pictures of which meshes, the same bytes however they are made, and what is said where there are none.

bats_require_minimum_version 1.5.0

setup_file() {
    root=$(realpath "$BATS_TEST_DIRNAME/../..")
    twinmesh=$(realpath "${TWINMESH:-$root/build/release/twinmesh}")
    export twinmesh root preload=$BATS_FILE_TMPDIR/preload.so
    # a sanitizer must be the first of all libraries
    grep -qa __asan_init "$twinmesh" || grep -qa __tsan_init "$twinmesh" || cc -shared -fPIC -O1 -o "$preload" "$root/tests/faults/preload.c" -ldl
    cd "$BATS_FILE_TMPDIR" || exit 1
    "$twinmesh" mesh "$root"/data-samples/balls/balls.####.npy --frames 1-4 -o balls --quiet --iso 0 --inside below --rest --format ply,glb
}

setup() { mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" && ln -s "$BATS_FILE_TMPDIR"/balls.* .; }

render() { run --separate-stderr "$twinmesh" render --size 64x48 --quiet "$@"; }
expect() { # status, words...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr $output"; return 1; }
    shift
    local word
    for word in "$@"; do [[ "$output $stderr" == *"$word"* ]] || { echo "no '$word' in: $stderr $output"; return 1; }; done
}
channels() { exrinfo "$1" | sed -nE "s/^ +'([^']+)': (uint|half|float) .*/\1 \2/p"; }

@test "an EXR a frame, its layers named and typed" {
    render balls -o p.####.exr --layers beauty,depth,normal,position,motion,id,rest
    expect 0
    [ "$(ls)" = "$(printf '%s\n' balls.* p.000{1,2,3,4}.exr)" ]
    exrinfo p.0002.exr | grep -q '64 x 48' && exrinfo p.0002.exr | grep -q "compression: 'zip'"
    [ "$(channels p.0002.exr | tr '\n' ,)" = "A float,B float,G float,R float,Z float,backward.a float,backward.u float,backward.v float,forward.a float,forward.u float,forward.v float,normal.X float,normal.Y float,normal.Z float,objectId.X uint,position.X float,position.Y float,position.Z float,rest.X float,rest.Y float,rest.Z float,vertexId.X uint," ]
    render balls -o h.exr --frames 3 --half --layers beauty,depth
    expect 0
    [ "$(channels h.exr | tr '\n' ,)" = "A half,B half,G half,R half,Z float," ]
}

@test "the same bytes with any number of threads, of PLY and glTF" {
    render balls -o a.####.exr --threads 1 --wire mechanical --png
    expect 0
    render balls -o b.####.exr --threads 3 --wire mechanical --png
    expect 0
    for kind in exr png; do for frame in 1 2 3 4; do cmp a.000$frame.$kind b.000$frame.$kind; done; done
    render balls.geometric.glb -o g.####.exr --layers beauty,depth
    expect 0
    render balls.geometric.####.ply -o p.####.exr --layers beauty,depth
    expect 0
    cmp g.0000.exr p.0001.exr # a glTF alone does not know its frames' numbers
}

@test "PNG beside, alone, and names printed" {
    render balls -o p.####.png --frames 2-4x2 --print
    expect 0
    [ "$output" = $'p.0002.png\np.0004.png' ]
    render balls -o q.####.exr --frames 2 --png
    expect 0
    cmp p.0002.png q.0002.png && [ -s q.0002.exr ]
    [ "$(head -c 8 p.0002.png | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ]
}

@test "frames by pipe, as they come" {
    "$twinmesh" mesh "$root"/data-samples/balls/balls.####.npy --frames 1-3 -o live --quiet --iso 0 --inside below --format ply --print |
        "$twinmesh" render - -o l.####.exr --size 64x48 --camera 12,-40,30,12,12,12 --print >names
    [ "$(cat names)" = $'l.0001.exr\nl.0002.exr\nl.0003.exr' ]
    render balls -o s.####.exr --camera 12,-40,30,12,12,12 --frames 1-2
    expect 0
    cmp l.0001.exr s.0001.exr && cmp l.0002.exr s.0002.exr
    ls balls.*.ply | "$twinmesh" render - -o m.####.png --size 64x48 --kind mechanical
    render balls -o n.####.png --kind mechanical --camera 12,-40,30,12,12,12
    expect 0
    [ -s m.0004.png ]
    # a frame is pictured before the next is there, where motion does not need it
    mkfifo pipe
    "$twinmesh" render - -o early.####.exr --size 64x48 --layers beauty <pipe &
    exec 7>pipe
    echo balls.geometric.0001.ply >&7
    for _ in $(seq 100); do [ -e early.0001.exr ] && break; sleep 0.1; done
    [ -e early.0001.exr ]
    exec 7>&-
    wait $!
}

@test "the papers' three columns" {
    render balls -o p.exr --style papers --size 120x40 --frames 2 --png
    expect 0
    [ "$(channels p.exr | tr '\n' ,)" = "A float,B float,G float,R float," ]
    ls balls.*.ply | "$twinmesh" render - -o q.####.exr --style papers --size 120x40
    [ -s q.0004.exr ]
    render balls.geometric.####.ply -o r.####.exr --style papers
    expect 2 "PREFIX"
    render balls -o r.####.exr --style papers --wire geometric
    expect 2 "leave out"
}

@test "looks differ" {
    for look in "" "--texture checker" "--wire geometric" "--wire mechanical" "--kind mechanical" "--samples 1" "--fov 50" "--up y"; do
        render balls -o p.png --frames 3 $look
        expect 0
        sha256sum <p.png >>sums
    done
    [ "$(sort -u sums | wc -l)" -eq 8 ]
    render balls -o o.####.png --orbit 360
    expect 0
    render balls -o s.####.png --orbit 0.0001
    ! cmp -s o.0003.png s.0003.png
}

@test "what is wrong is said" {
    render
    expect 2 "one sequence of meshes"
    render balls
    expect 2 "-o PATTERN is missing"
    render balls -o p.####.jpg
    expect 2 ".exr or .png"
    render balls -o p.exr
    expect 2 "p.exr"
    render balls -o p.####.exr --size 0x5
    expect 2 "--size 0x5"
    render balls -o p.####.exr --size 64x
    expect 2 "--size 64x"
    render balls -o p.####.exr --camera 1,2,3,4,5
    expect 2 "--camera"
    render balls -o p.####.exr --camera 1,2,3,1,2,3
    expect 2 "--camera"
    render balls -o p.####.exr --png --layers depth
    expect 2 "beauty"
    render balls -o p.####.exr --kind mechanical --wire geometric
    expect 2 "--wire geometric"
    render balls -o p.####.exr --frames 90-99
    expect 3 "no frames"
    render nobody -o p.####.exr
    expect 3 "nobody"
    render - -o p.####.exr --orbit 90 </dev/null
    expect 2 "--orbit"
    render balls.geometric.glb -o p.####.exr --wire mechanical
    expect 3 "PLY files"
    render balls.geometric.glb -o p.####.exr --layers rest
    expect 3 "--rest"
    render balls -o p.####.exr --camera 1e30,2,3,4,5,6
    expect 2 "--camera"
    printf '%s\n' ply 'format ascii 1.0' 'element vertex 3' 'property float x' 'property float y' 'property float z' 'element face 1' \
        'property list uchar int vertex_indices' end_header '0 0 0' '1 0 0' '0 1e20 0' '3 0 1 2' >balls.far.ply
    render balls.far.ply -o p.exr
    expect 3 "balls.far.ply" "farther than 1e+12"
    render balls -o no/such/p.####.exr --frames 1
    expect 4 "folder"
    [ -z "$(ls | grep -v '^balls')" ]
}

@test "a full disk leaves nothing under a final name" {
    [ -e "$preload" ] || skip "not with a sanitizer"
    local fault
    for fault in fwrite:1 fsync:1 rename:1; do
        run --separate-stderr env FAULT="$fault" LD_PRELOAD="$preload" "$twinmesh" render balls -o p.####.exr --png --frames 2 --size 64x48 --quiet
        expect 4 "cannot be written"
        [ -z "$(ls | grep -v '^balls')" ] || { echo "$fault left: $(ls)"; return 1; }
    done
}
