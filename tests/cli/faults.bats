# What goes wrong around twinmesh mesh: disks that fill, folders that may not be written, files that cannot be read, memory that
# is not there, readers that die, signals. One sentence each, and nothing under a final name that is not whole.

bats_require_minimum_version 1.5.0

setup_file() {
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    export twinmesh samples=$BATS_TEST_DIRNAME/../../data-samples/balls
    export preload=$BATS_FILE_TMPDIR/preload.so
    # a sanitizer must be the first of all libraries
    grep -qa __asan_init "$twinmesh" || grep -qa __tsan_init "$twinmesh" || cc -shared -fPIC -O1 -o "$preload" "$BATS_TEST_DIRNAME/../faults/preload.c" -ldl
    mkdir "$BATS_FILE_TMPDIR/good" && cd "$BATS_FILE_TMPDIR/good" && cp "$samples"/balls.000[12].npy . && "$twinmesh" mesh $options balls.000*.npy
    export good=$BATS_FILE_TMPDIR/good
}

options="-o out --threads 1 --iso 0 --inside below --format ply,glb --quiet"

setup() { mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" && cp "$samples"/balls.000[12].npy .; }

mesh() { run --separate-stderr "$twinmesh" mesh $options balls.0001.npy balls.0002.npy "$@"; }
faulty() { # fault, options...
    local fault=$1
    shift
    [ -e "$preload" ] || skip "not with a sanitizer"
    run --separate-stderr env FAULT="$fault" LD_PRELOAD="$preload" "$twinmesh" mesh $options balls.0001.npy balls.0002.npy "$@"
}

expect() { # status, words on standard error...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr"; return 1; }
    shift
    local word
    for word in "$@"; do [[ $stderr == *"$word"* ]] || { echo "no '$word' in: $stderr"; return 1; }; done
}

# One, but for what can be done about it.
one_sentence() {
    [ "$(grep -vc -e '--resume goes on' <<<"$stderr")" -eq 1 ] && [[ $stderr == twinmesh* ]] || { echo "said: $stderr"; return 1; }
}

# Meshes are those of a good run, the others can be read to their end.
all_whole() {
    local file
    for file in out.*; do
        case $file in
            *.ply) cmp "$file" "$good/$file" || return 1 ;;
            *.glb) "$twinmesh" info "$file" >/dev/null || return 1 ;;
            *.jsonl) python3 -c 'import json, sys; [json.loads(line) for line in open(sys.argv[1])]' "$file" || return 1 ;;
        esac
    done
}

# The same command with --resume ends as if nothing had happened.
goes_on() {
    mesh --resume
    expect 0 || return 1
    local file
    for file in "$good"/out.*; do
        [[ $file == *timings* ]] || cmp "$file" "${file##*/}" || return 1
    done
    [ "$(ls -d out.*)" = "$(cd "$good" && ls -d out.*)" ] || { echo "left: $(ls)"; return 1; }
}

calls="1 2 3 4 5 6 8 11 15 20 27 36 48 64 85 113 150 200"

# Calls of a function in turn, the later ones further apart, until there are no more.
each_call() { # function, what a failure must be
    local n failed=0
    for n in $calls; do
        faulty "$1:$n"
        [ "$status" -eq 0 ] && break
        failed=$n
        { "$2" && all_whole && [ -z "$(find . -name '*.new')" ] && goes_on; } || { echo "at call $n of $1"; return 1; }
        rm -f out.*
    done
    [ "$failed" -gt 0 ]
}

cannot_write() { expect 4 "cannot be written" && one_sentence; }
cannot_read() { expect 3 ".npy" && one_sentence; }
no_memory() { expect 5 "memory" && one_sentence; }

@test "the disk is full at every write" { each_call fwrite cannot_write; }
@test "the disk is full at every flush" { each_call fflush cannot_write; }
@test "the disk is full at every sync" {
    # folders are synced too: where that fails no harm is done
    local n
    for n in 1 2 3 5 7 9 11; do
        faulty "fsync:$n"
        [ "$status" -eq 0 ] || cannot_write || return 1
        all_whole && goes_on || return 1
        rm -f out.*
    done
}
@test "no file can be named" { each_call rename cannot_write; }

@test "killed at every step to the disk" {
    local function n killed
    for function in fwrite fflush fsync rename remove; do
        killed=0
        for n in $calls; do
            faulty "$function:$n:kill"
            [ "$status" -eq 0 ] && break
            [ "$status" -eq 137 ]
            killed=$n
            { all_whole && goes_on; } || { echo "at call $n of $function"; return 1; }
            rm -f out.*
        done
        [ "$killed" -gt 3 ]
    done
}

@test "files may only grow so large" {
    local k
    for k in 1 4 16 64 256; do
        run --separate-stderr bash -c "ulimit -f $k && '$twinmesh' mesh $options balls.0001.npy balls.0002.npy"
        [ "$status" -eq 0 ] || { expect 4 "size limit" && one_sentence; } || return 1
        all_whole && goes_on || return 1
        rm -f out.*
    done
}

@test "a read fails in mid-file" {
    local n
    for n in 1 2 3 4 6; do
        faulty "fread:$n"
        cannot_read && expect 3 "Input/output error" && all_whole || return 1
        rm -f out.*
    done
}

@test "a reader dies" {
    faulty fread:3:abort
    expect 3 "balls.0001.npy" "died of signal 6" && one_sentence && all_whole
    faulty fread:8:abort --on-error skip
    expect 0 "skipped" "died of signal 6" && all_whole
    faulty fread:8:abort --on-error hold
    expect 0 "held" "died of signal 6" && [ -z "$(find . -name '*.part')" ]
}

@test "a reader may not be looked into: it sends what it read" {
    local n
    for n in 1 2; do
        faulty process_vm_readv:$n
        expect 0
        for file in out.*; do [[ $file == *timings* ]] || cmp "$file" "$good/$file"; done
    done
}

@test "memory runs out at any time" {
    local n
    for n in 1 3 8 21 55 144 377; do
        faulty "realloc:$n"
        [ "$status" -eq 0 ] && break
        expect 5 "memory" && goes_on || return 1
        rm -f out.*
    done
    [ "$n" -gt 1 ]
}

@test "a frame is missing" {
    rm balls.0002.npy
    mesh
    expect 3 "balls.0002.npy" && all_whole && [ -e out.geometric.0001.ply ]
    cp "$samples/balls.0002.npy" . && goes_on
    rm -f out.* balls.0002.npy
    mesh --on-error skip
    expect 0 "skipped" && all_whole && [ ! -e out.geometric.0002.ply ]
    rm -f out.*
    mesh --on-error hold
    expect 0 "held" && [ -e out.geometric.0002.ply ] && [ -z "$(find . -name '*.part')" ]
}

@test "the folder may not be written" {
    [ "$(id -u)" -ne 0 ] || skip "root may write anywhere"
    chmod a-w .
    mesh
    expect 4 "not permitted" && one_sentence
    chmod u+w .
}

# The whole group gets it, as from a terminal: the readers finish the frame at hand too.
@test "an interrupt keeps the finished frames" {
    mkfifo names
    exec 9<>names
    setsid "$twinmesh" mesh $options - <names 2>err &
    local pid=$! tries=0
    echo balls.0001.npy >&9
    while [ ! -e out.geometric.0001.ply ] && [ $((tries += 1)) -lt 200 ]; do sleep 0.05; done
    kill -INT -- -$pid
    status=0
    wait $pid || status=$?
    exec 9>&-
    [ "$status" -eq 130 ] && grep -q "1 frame is finished" err && all_whole && [ -e out.geometric.glb ]
    [ -z "$(ps -o pid= --ppid $pid)" ]
}
