# twinmesh mesh as its users meet it: exit codes, messages, files.

bats_require_minimum_version 1.5.0

setup() {
    samples=$(realpath "$BATS_TEST_DIRNAME/../../data-samples")
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
    cp "$samples"/balls/balls.*.npy "$samples"/balls/balls.0001.raw .
    ls >before
}

# The small run most tests vary.
mesh() { run --separate-stderr "$twinmesh" mesh -o out --threads 2 --iso 0 --inside below --format ply "$@"; }

expect() { # status, words on standard error...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr"; return 1; }
    shift
    local word
    for word in "$@"; do [[ $stderr == *"$word"* ]] || { echo "no '$word' in: $stderr"; return 1; }; done
}

# Nothing is left but what was there, and what matches the pattern.
left() { ls | grep -vxFf before | grep -vx before | tr '\n' ' '; }
no_parts() { [ -z "$(find . -name '*.part')" ]; }
frame_of() { grep "\"frame\":\"$1\"" out.report.jsonl; }

# Overwrites four bytes at an offset.
poke() { printf "$3" | dd of="$1" bs=1 seek="$2" conv=notrunc status=none; }

# --- usage ----------------------------------------------------------------------------------------

@test "no command, an unknown one" {
    run --separate-stderr "$twinmesh"
    expect 2 "no command"
    run --separate-stderr "$twinmesh" melt
    expect 2 "melt"
}

@test "help and version go to standard output" {
    run --separate-stderr "$twinmesh" --version
    expect 0 && [[ $output =~ ^twinmesh\ [0-9.]+$ ]]
    run --separate-stderr "$twinmesh" --help
    expect 0 && [[ $output == *mesh* ]] && [ -z "$stderr" ]
    run --separate-stderr "$twinmesh" help mesh
    expect 0 && [[ $output == *--edge* ]] && [ -z "$stderr" ]
}

@test "help that cannot be written" {
    run --separate-stderr bash -c "'$twinmesh' help mesh >/dev/full"
    expect 4 "standard output"
}

@test "no prefix, no frames, a folder as prefix" {
    run --separate-stderr "$twinmesh" mesh balls.0001.npy
    expect 2 "-o PREFIX"
    run --separate-stderr "$twinmesh" mesh -o out
    expect 2 "frames"
    run --separate-stderr "$twinmesh" mesh -o ./ balls.0001.npy
    expect 2 "folder"
}

@test "wrong values name the option, the value and what is allowed" {
    mesh balls.0001.npy --angle 200
    expect 2 --angle 200 "0 to 180"
    mesh balls.0001.npy --passes 1.5
    expect 2 --passes 1.5 "whole number"
    mesh balls.0001.npy --edge 2vv
    expect 2 --edge 2vv
    mesh balls.0001.npy --iso nan
    expect 2 --iso nan
    mesh balls.0001.npy --inside left
    expect 2 --inside left "above or below"
    mesh balls.0001.npy --format ply,obj
    expect 2 --format "ply, glb, gltf or vat"
    mesh balls.0001.npy --dims 1,2
    expect 2 --dims
    mesh balls.0001.npy --threads 0
    expect 2 --threads "1 to 256"
    mesh balls.0001.npy --e-min 3
    expect 2 --e-min --e-max
    mesh balls.0001.npy --frames banana
    expect 2 banana
}

@test "wrong options" {
    mesh balls.0001.npy --colour red
    expect 2 --colour "no such option"
    mesh balls.0001.npy -x
    expect 2 -x "no such option"
    mesh balls.0001.npy --angle
    expect 2 --angle missing
    mesh balls.0001.npy --print=yes
    expect 2 --print "takes no value"
}

@test "what is not in this version says so" {
    mesh balls.0001.npy --interpolation
    expect 2 "not in this version"
}

@test "the papers' topology follows balls that merge" {
    mesh 'balls.####.npy' --frames 1-6 --topology papers
    expect 0
    [ "$(ls out.geometric.*.ply | wc -l)" -eq 6 ]
    ! grep -q '"wrong_components":[1-9]' out.report.jsonl
}

@test "compressed glTF: smaller, the same surface, the same bytes from any number of threads" {
    mesh 'balls.####.npy' --frames 1-6 --format ply,glb
    expect 0
    for how in quantize meshopt; do
        run --separate-stderr "$twinmesh" mesh 'balls.####.npy' --frames 1-6 --inside below --format glb,gltf -o $how --compress $how --threads 1
        expect 0
        grep -q "\"compress\":\"$how\"" $how.report.jsonl
        for kind in mechanical geometric; do
            "$twinmesh" diff $how.$kind.glb out --kind $kind --tolerance 0.001 --normals 1 --quiet
            "$twinmesh" diff $how.$kind.glb $how.$kind.gltf --quiet
        done
        "$twinmesh" info $how.geometric.glb | grep -q 'to: 21.9'
    done
    [ "$(stat -c %s quantize.geometric.glb)" -lt $(($(stat -c %s out.geometric.glb) * 7 / 10)) ]
    [ "$(stat -c %s meshopt.geometric.glb)" -lt $(($(stat -c %s quantize.geometric.glb) * 7 / 10)) ]
    "$twinmesh" mesh 'balls.####.npy' --frames 1-6 --inside below --format glb -o again --compress meshopt --threads 4 --quiet
    cmp again.geometric.glb meshopt.geometric.glb
}

@test "vertex animation textures: a table, and three files a run" {
    mesh 'balls.####.npy' --frames 1-6 --format vat --print
    expect 0
    [ "$output" = $'out.mechanical.vat.json\nout.geometric.vat.json' ]
    for kind in mechanical geometric; do
        [ "$(jq '[.runs[].frames] | add' out.$kind.vat.json)" -eq 6 ]
        for file in $(jq -r '.runs[] | .base, .position, .normal' out.$kind.vat.json); do [ -s "$file" ]; done
        [ "$(ls out.$kind.*.exr | wc -l)" -eq $(($(jq '.runs | length' out.$kind.vat.json) * 2)) ]
    done
    [ -z "$(find . -name '*.part')" ]
}

@test "option syntax: =, joined, --, after operands" {
    run --separate-stderr "$twinmesh" mesh --iso=0 -qoout --inside=below -- balls.0001.npy
    expect 0
    [ -s out.geometric.glb ] && [ -z "$stderr" ]
}

# --- outputs --------------------------------------------------------------------------------------

@test "the files of a run, and their names" {
    mesh balls.0001.npy balls.0002.npy --format ply,glb,gltf
    expect 0
    [ "$(ls out.*.ply | tr '\n' ' ')" = "out.geometric.0001.ply out.geometric.0002.ply out.mechanical.0001.ply out.mechanical.0002.ply " ]
    for file in out.geometric.glb out.mechanical.glb out.geometric.gltf out.mechanical.gltf out.report.jsonl out.events.jsonl out.timings.jsonl; do [ -s $file ]; done
    no_parts
    [ "$(wc -l <out.report.jsonl)" -eq 4 ]
    [ "$(head -c 3 out.geometric.0001.ply)" = ply ]
    [ "$(head -c 4 out.geometric.glb)" = glTF ]
    [ -z "$output" ]
}

@test "the report is free of times, paths and threads" {
    mesh "$PWD/balls.0001.npy"
    expect 0
    ! grep -qF "$PWD" out.report.jsonl
    ! grep -qE 'seconds|threads|balls' out.report.jsonl
    grep -q '"complete":true' out.report.jsonl
}

@test "the events: a line a frame, a line an event, free of times and paths" {
    mesh "$PWD"/balls.000[123456].npy
    expect 0 "topology events           1 blend"
    no_parts
    # JSON as far as it can be seen without a parser: one object a line, of known keys in their order
    local frame='\{"frame":"[0-9]+","kind":' numbers='\[[0-9,]*\]' point='\[[-0-9.e]+,[-0-9.e]+,[-0-9.e]+\]'
    local components="$frame\"components\",\"since\":(null|\"[0-9]+\"),\"before\":$numbers,\"after\":$numbers,\"links\":\[[][0-9,]*\]\}"
    local event="$frame\"[a-z-]+\",\"place\":$point,\"before\":$numbers,\"after\":$numbers,\"replaced\":[0-9]+,\"count\":[0-9]+,\"places\":\[$point(,$point)*\]\}"
    ! sed '$d' out.events.jsonl | grep -vxE "$components|$event"
    [[ $(tail -n 1 out.events.jsonl) == '{"totals":{"complete":true,"frames":6,"events":{"blend":1,'*'}}}' ]]
    [ "$(grep -c '"kind":"components"' out.events.jsonl)" -eq 6 ]
    [ "$(head -n 1 out.events.jsonl | cut -d, -f1-4)" = '{"frame":"0001","kind":"components","since":null,"before":[]' ]
    [ "$(grep -c '"kind":"blend"' out.events.jsonl)" -eq 1 ]
    [ "$(tail -n 1 out.report.jsonl | grep -c '"events":{"blend":1,')" -eq 1 ]
    jq -e . out.events.jsonl >/dev/null
}

@test "the surface chosen is said once, --quiet says nothing, --verbose a line a frame" {
    mesh balls.000[123].npy
    expect 0
    [ "$(grep -c 'inside is below 0' <<<"$stderr")" -eq 1 ]
    mesh balls.000[123].npy --quiet
    expect 0 && [ -z "$stderr" ]
    mesh balls.000[123].npy --verbose
    expect 0 && [ "$(grep -c 'frame 000[123]:' <<<"$stderr")" -eq 3 ]
}

@test "--json-log says the same to programs" {
    mesh balls.0001.npy balls.0009.npy --json-log --verbose
    expect 3
    jq -es 'map(.level) == ["note", "detail", "progress", "problem", "problem"]' <<<"$stderr"
    jq -es '.[2] == {level: "progress", done: 1, total: 2} and (.[3].message | contains("balls.0009.npy"))' <<<"$stderr"
}

@test "a progress bar on a terminal only" {
    command -v script >/dev/null || skip "script is not installed"
    run script -qec "'$twinmesh' mesh balls.000[123].npy -o out --format ply" /dev/null
    [ "$status" -eq 0 ] && [[ $output == *"] 3/3 frames"*"frames/s"*"left"* ]]
    run script -qec "'$twinmesh' mesh balls.000[123].npy -o out --format ply --quiet" /dev/null
    [ "$status" -eq 0 ] && [ -z "$output" ]
    mesh balls.000[123].npy
    [[ $stderr != *frames/s* ]]
}

@test "--print names each file once it is there" {
    mesh balls.0001.npy balls.0002.npy --print --format ply,glb
    expect 0
    [ "$(tr '\n' ' ' <<<"$output")" = "out.mechanical.0001.ply out.geometric.0001.ply out.mechanical.0002.ply out.geometric.0002.ply out.mechanical.glb out.geometric.glb " ]
    for file in $output; do [ -s "$file" ]; done
}

@test "--render pictures the frames as twinmesh render does afterwards" {
    mesh balls.000[123].npy --render pic.####.exr --fps 30 -- --size 64x48 --png --layers beauty,motion
    expect 0
    [ "$(ls pic.* | tr '\n' ' ')" = "pic.0001.exr pic.0001.png pic.0002.exr pic.0002.png pic.0003.exr pic.0003.png " ]
    printf '%s\n' out.geometric.000[123].ply | "$twinmesh" render - -o later.####.exr --size 64x48 --layers beauty,motion --fps 30 --quiet
    for n in 1 2 3; do cmp pic.000$n.exr later.000$n.exr; done
}

@test "--render that fails costs no mesh; what it does not go with" {
    mesh balls.000[12].npy --render gone/pic.####.exr
    expect 4 "gone/pic.0001.exr" "the meshes are all there"
    [ "$(grep -c '"frame"' out.report.jsonl)" -eq 2 ] && [ -s out.geometric.0002.ply ] && no_parts
    mesh balls.000[12].npy --render pic.####.exr -- --sice 64x48
    expect 2 "no such option" "not all pictures"
    mesh balls.0001.npy --render pic.####.exr --format glb
    expect 2 "--format ply"
    mesh balls.0001.npy --render pic.####.exr --resume
    expect 2 "--resume"
}

@test "--print to a full device and to a reader that went away" {
    run --separate-stderr bash -c "'$twinmesh' mesh balls.000[12].npy -o out --format ply --print >/dev/full"
    expect 4 "standard output"
    run --separate-stderr bash -c "'$twinmesh' mesh balls.000[1234].npy -o out --format ply --print | true; exit \${PIPESTATUS[0]}"
    expect 4 "standard output"
}

@test "the same bytes for 1 and 2 threads" {
    mesh balls.000[123].npy --format ply,glb --threads 1 -o one
    mesh balls.000[123].npy --format ply,glb --threads 2 -o two
    for file in one.*.ply one.*.glb one.report.jsonl one.events.jsonl; do cmp "$file" "two${file#one}"; done
}

@test "--angle 180 makes the geometric mesh a copy" {
    mesh balls.0001.npy --angle 180 --deviation 0
    expect 0
    line=$(frame_of 0001)
    [[ $line =~ triangles_mechanical\":([0-9]+) ]] && mechanical=${BASH_REMATCH[1]}
    [[ $line =~ triangles_geometric\":([0-9]+) ]] && [ "$mechanical" -gt 0 ] && [ "$mechanical" -eq "${BASH_REMATCH[1]}" ]
}

# The bounds of a mesh: x y z of its lowest corner, then of its highest.
bounds_of() { "$twinmesh" info --json "$1" | sed -E 's/.*"bounds":\{"from":\[([^]]*)\],"to":\[([^]]*)\]\}.*/\1,\2/' | tr , ' '; }

@test "--up and --scale turn both PLY and glTF" {
    mesh balls.000[12].npy -o plain --format ply,glb --origin -5,1,2
    expect 0
    mesh balls.000[12].npy -o up --format ply,glb --origin -5,1,2 --up y --scale 2
    expect 0
    for ending in geometric.0002.ply geometric.glb mechanical.glb; do
        awk -v a="$(bounds_of plain.$ending)" -v b="$(bounds_of up.$ending)" 'function abs(x) { return x < 0 ? -x : x }
        BEGIN {
            split(a, p); split(b, q)
            for (i = 1; i <= 6; i++) q[i] /= 2 # z is y now, and -y z
            off = abs(q[1] - p[1]) + abs(q[4] - p[4]) + abs(q[2] - p[3]) + abs(q[5] - p[6]) + abs(q[3] + p[5]) + abs(q[6] + p[2])
            exit !(off < 1e-5 && p[4] - p[1] > 5)
        }'
    done
    mesh balls.000[12].npy -o z --format ply --origin -5,1,2 --up z
    expect 0
    ! cmp -s z.geometric.0001.ply plain.geometric.0001.ply
    cmp <(tail -n +2 plain.report.jsonl) <(tail -n +2 up.report.jsonl) # lengths are the grid's; how to get from one to the other is told
    [ "$(head -n 1 up.report.jsonl | jq -c '[.settings.up, .settings.scale]')" = '["y",2]' ]
    [ "$(head -n 1 plain.report.jsonl | jq -c '[.settings.up, .settings.scale]')" = '[null,null]' ]
    mesh balls.0001.npy --up x
    expect 2 --up "y or z"
    mesh balls.0001.npy --scale 0
    expect 2 --scale
}

@test "--rest gives vertices their places in the first frame" {
    mesh "$samples"/splash/fluid.001[89].vdb --velocity velocity --attribute phi --rest --format ply,glb
    [ "$status" -eq 0 ]
    run "$twinmesh" info out.mechanical.0019.ply out.geometric.glb
    [[ $output == *"rest_x rest_y rest_z rest_frame phi"* ]]
    [[ $output == *"_PHI _REST_FRAME _REST_X _REST_Y _REST_Z"* ]]
}

@test "--attribute samples grids onto the vertices" {
    mesh "$samples/splash/fluid.0018.vdb" --velocity velocity --attribute phi,velocity --format ply,glb
    expect 0
    run --separate-stderr "$twinmesh" info out.geometric.0018.ply out.mechanical.glb
    [[ $output == *"attributes: velocity mechanical phi velocity_x velocity_y velocity_z"* ]]
    [[ $output == *"attributes: NORMAL POSITION _ID _PHI _VELOCITY _VELOCITY_X _VELOCITY_Y _VELOCITY_Z"* ]]
    mesh "$samples/splash/fluid.0018.vdb" --attribute heat
    expect 3 heat "velocity"
    mesh balls.0001.npy --attribute a,,b
    expect 2 --attribute
    mesh balls.0001.npy --attribute a
    expect 2 balls.0001.npy "without a name"
}

# --- naming frames --------------------------------------------------------------------------------

@test "patterns of three kinds, a folder, a step" {
    for pattern in 'balls.####.npy' 'balls.%04d.npy' 'balls.$F4.npy'; do
        mesh "$pattern" --frames 2-4x2
        expect 0
        [ "$(ls out.geometric.*.ply | tr '\n' ' ')" = "out.geometric.0002.ply out.geometric.0004.ply " ]
        rm out.*
    done
    mesh 'balls.####.npy'
    expect 0 && [ "$(ls out.geometric.*.ply | wc -l)" -eq 6 ]
    rm out.*
    mkdir folder && mv balls.000[12].npy folder
    mesh folder
    expect 0 && [ "$(ls out.geometric.*.ply | wc -l)" -eq 2 ]
}

@test "names on standard input, as they arrive" {
    mkfifo names printed
    "$twinmesh" mesh - -o out --iso 0 --inside below --format ply --print <names >printed 2>err &
    exec 5>names 6<printed
    echo balls.0001.npy >&5
    read -r -t 60 first <&6
    [ "$first" = out.mechanical.0001.ply ]
    read -r -t 60 second <&6
    echo balls.0002.npy >&5
    read -r -t 60 third <&6
    [ "$third" = out.mechanical.0002.ply ]
    exec 5>&-
    wait $!
    grep -q '^2 frames' err
}

@test "standard input without names, a pattern that matches nothing, an empty folder" {
    run --separate-stderr bash -c "'$twinmesh' mesh - -o out </dev/null"
    expect 3
    mesh 'nothing.####.npy'
    expect 3 "nothing."
    mkdir folder
    mesh folder
    expect 3 folder
    [ "$(left)" = "folder " ]
}

@test "raw grids need their dimensions" {
    mesh balls.0001.raw
    expect 2 --dims balls.0001.raw
    [ -z "$(left)" ]
    mesh balls.0001.raw --dims 24,24,24 -o raw
    expect 0
    mesh balls.0001.npy -o npy
    cmp raw.geometric.0001.ply npy.geometric.0001.ply
    mesh balls.0001.raw --dims 24,24,25
    expect 3 balls.0001.raw
}

@test "frames far apart are bridged by the fields between them, so the last one is still there" {
    mesh --frames 1-5x4 balls.####.npy
    expect 0
    [[ $(frame_of 0005) == *'"predict_substeps":4,'*'"projections_lost":0,'* ]] || { frame_of 0005; return 1; }
}

@test "a real level set with its velocity" {
    run --separate-stderr "$twinmesh" mesh "$samples/splash/fluid.0018.vdb" "$samples/splash/fluid.0019.vdb" -o out --velocity velocity
    expect 0 "below 0" "2.5 voxels"
    [[ $(frame_of 0019) == *'"wrong_components":0'* ]]
}

# --- bad input ------------------------------------------------------------------------------------

# Three frames of which the second is bad: the first is whole, exit 3, and what --resume needs stays.
bad_second() { # words...
    mesh balls.0001.npy balls.0002.npy balls.0003.npy --format ply,glb
    expect 3 balls.0002.npy "frame 0002" "$@"
    [ "$(left | tr ' ' '\n' | grep -v 'part$' | tr '\n' ' ')" = "out.events.jsonl out.geometric.0001.ply out.geometric.glb out.mechanical.0001.ply out.mechanical.glb out.report.jsonl out.state out.timings.jsonl " ]
    [ "$(head -c 4 out.geometric.glb)" = glTF ]
    grep -q '"complete":false' out.report.jsonl
}

@test "a missing frame" {
    rm balls.0002.npy
    bad_second
    rm out.*
    mesh 'balls.####.npy' --frames 1-3
    expect 3 balls.0002.npy
}

@test "a frame that holds NaN" {
    poke balls.0002.npy 4000 '\000\000\300\177'
    bad_second
}

@test "a truncated array" {
    truncate -s 2000 balls.0002.npy
    bad_second
}

@test "a first frame that is bad leaves nothing" {
    truncate -s 100 balls.0001.npy
    mesh balls.0001.npy balls.0002.npy
    expect 3 balls.0001.npy
    [ -z "$(left)" ]
}

@test "VDB files: truncated, none at all, a grid that is not there" {
    cp "$samples/splash/fluid.0018.vdb" whole.vdb
    for bytes in 0 10 100 5000 300000; do
        head -c $bytes whole.vdb >cut.0001.vdb
        mesh cut.0001.vdb
        expect 3 cut.0001.vdb
    done
    cp "$BATS_TEST_DIRNAME/mesh.bats" text.0001.vdb
    mesh text.0001.vdb
    expect 3 text.0001.vdb
    mesh whole.vdb --grid pressure
    expect 3 whole.vdb pressure phi
    mesh whole.vdb --velocity wind
    expect 3 whole.vdb wind
    [ "$(left)" = "cut.0001.vdb text.0001.vdb whole.vdb " ]
}

@test "a frame without surface is valid and empty, and tracking goes on" {
    truncate -s 128 balls.0002.npy
    truncate -s 55424 balls.0002.npy
    mesh balls.0001.npy balls.0002.npy balls.0003.npy --format ply,glb
    expect 0
    grep -qa 'element vertex 0' out.geometric.0002.ply
    grep -qa 'element face 0' out.mechanical.0002.ply
    [[ $(frame_of 0003) =~ triangles_mechanical\":[1-9] ]]
}

@test "a sequence without any surface" {
    for n in 1 2; do
        truncate -s 128 balls.000$n.npy
        truncate -s 55424 balls.000$n.npy
    done
    mesh balls.0001.npy balls.0002.npy --format ply,glb
    expect 0
    grep -qa 'element vertex 0' out.geometric.0001.ply
    [ "$(head -c 4 out.geometric.glb)" = glTF ]
}

@test "--on-error skip: time goes on, no PLY" {
    rm balls.0002.npy
    mesh balls.0001.npy balls.0002.npy balls.0003.npy --on-error skip --format ply,glb
    expect 0 balls.0002.npy "frame 0002 is skipped"
    [ "$(ls out.geometric.*.ply | tr '\n' ' ')" = "out.geometric.0001.ply out.geometric.0003.ply " ]
    [[ $(frame_of 0002) == *'"fate":"skipped"'* ]]
    ! grep -q '"frame":"0002"' out.events.jsonl
    grep -q '"frame":"0003","kind":"components","since":"0001"' out.events.jsonl
}

@test "--on-error hold: the last meshes again" {
    rm balls.0002.npy
    mesh balls.0001.npy balls.0002.npy balls.0003.npy --on-error hold --format ply,glb
    expect 0 balls.0002.npy "frame 0002 is held"
    cmp out.geometric.0001.ply out.geometric.0002.ply
    [[ $(frame_of 0002) == *'"fate":"held"'* ]]
    [[ $(frame_of 0003) == *'"fate":"tracked"'* ]]
    ! grep -q '"frame":"0002"' out.events.jsonl
    grep -q '"frame":"0003","kind":"components","since":"0001"' out.events.jsonl
}

@test "--on-error skip with nothing that can be read" {
    rm balls.000[12].npy
    mesh balls.0001.npy balls.0002.npy --on-error skip
    expect 3
    [ -z "$(left)" ]
}

# --- outputs that cannot be written ---------------------------------------------------------------

@test "a folder that is not there, a file in its place" {
    mesh balls.0001.npy -o nowhere/out
    expect 4 nowhere "folder"
    mesh balls.0001.npy -o balls.0002.npy/out
    expect 4 balls.0002.npy
    [ -z "$(left)" ]
}

@test "a folder without permission" {
    [ "$(id -u)" -ne 0 ] || skip "root may write anywhere"
    mkdir locked && chmod a-w locked
    mesh balls.0001.npy -o locked/out
    expect 4 locked
}

@test "a file that passes the size limit" {
    run --separate-stderr bash -c "ulimit -f 4; '$twinmesh' mesh balls.000[123].npy -o out --format ply,glb"
    expect 4
    no_parts
    [ -z "$(find . -name 'out.*' -size -1c)" ]
}

@test "a full disk" {
    mkdir disk
    mount -t tmpfs -o size=96k tmpfs disk 2>/dev/null || skip "mounting needs root"
    mesh balls.000[123456].npy -o disk/out --format ply,glb
    local parts
    parts=$(find disk -name '*.part')
    for file in disk/*.ply; do [ "$(head -c 3 "$file")" = ply ] || parts+=$file; done
    umount disk
    expect 4 full
    [ -z "$parts" ]
}

@test "a signal ends the run after the frame at hand, with all files whole and one to go on with" {
    mkfifo names printed
    "$twinmesh" mesh - -o out --iso 0 --inside below --format ply,glb --print <names >printed 2>err &
    pid=$!
    exec 5>names 6<printed
    echo balls.0001.npy >&5
    read -r -t 60 first <&6
    read -r -t 60 second <&6
    kill -TERM $pid
    status=0
    wait $pid || status=$?
    exec 5>&- 6<&-
    [ "$status" -eq 143 ]
    [ "$(head -c 4 out.geometric.glb)" = glTF ]
    grep -q '"complete":false' out.report.jsonl
    grep -q -- "--resume" err
}

@test "a frame whose samples are the last one's has its meshes, also after one that cannot be read" {
    for f in 0002 0003 0005; do cp balls.0001.npy balls.$f.npy; done
    echo nothing >balls.0004.npy
    cp balls.0006.npy balls.0007.npy
    mesh balls.####.npy --frames 1-7 --on-error skip
    expect 0
    for f in 0002 0003 0005 0007; do [ "$(frame_of $f | jq '.frozen_vertices == .vertices_mechanical and .relax_steps == 0')" = true ]; done
    [ "$(frame_of 0006 | jq .relax_steps)" = 3 ]
    for kind in mechanical geometric; do
        for f in 0002 0003 0005; do cmp out.$kind.0001.ply out.$kind.$f.ply; done
        run ! cmp -s out.$kind.0005.ply out.$kind.0006.ply
    done
}
