# twinmesh check: its figures beside an independent judge's, limits, what it reads, exit codes.

bats_require_minimum_version 1.5.0

setup_file() {
    local root
    root=$(realpath "$BATS_TEST_DIRNAME/../..")
    cd "$BATS_FILE_TMPDIR" || exit 1
    "$(realpath "${TWINMESH:-$root/build/release/twinmesh}")" mesh "$root"/data-samples/balls/balls.####.npy --frames 1-3 -o out --quiet --iso 0 --inside below \
        --format ply,glb
}

setup() {
    root=$(realpath "$BATS_TEST_DIRNAME/../..")
    samples=$root/data-samples
    twinmesh=$(realpath "${TWINMESH:-$root/build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
}

check() { run --separate-stderr "$twinmesh" check "$@"; }
expect() { # status, words on standard output or error...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr $output"; return 1; }
    shift
    local word
    for word in "$@"; do [[ "$output $stderr" == *"$word"* ]] || { echo "no '$word' in: $stderr $output"; return 1; }; done
}
balls() { cp "$BATS_FILE_TMPDIR"/out.*.jsonl "$BATS_FILE_TMPDIR"/out.*."$1" .; }

# Lines of `frame figure value` from --json.
figures() { grep '"frame":' | grep -v '"worst":' | tr -d '{}"' | tr ',' '\n' | awk -F: '$1 == "frame" { frame = $2 } frame != "" { print frame, $1, $2 }'; }

@test "the figures are those of an independent judge" {
    cp "$root"/tests/check/*.ply .
    "$twinmesh" check "$samples/splash/fluid.####.vdb" --frames 20-21 -m splash --edge 4v --json --quiet | figures | sed 's/^/splash /' >got
    "$twinmesh" check "$samples/smoke/density.####.vdb" --frames 24 -m smoke --edge 8v --json --quiet | figures | sed 's/^/smoke /' >>got
    awk 'FNR == NR { got[$1, $2, $3] = $4; next }
         /^#/ { next }
         { n++; have = got[$1, $2, $3]; off = have - $4; if (off < 0) off = -off
           if (have == "" || off > $5 * $4) { print $0 ": " have; bad = 1 } }
         END { exit bad || n < 80 }' got "$root/tests/check/judge.txt"
}

@test "PLY and glTF give the same figures, with any number of threads" {
    balls ply
    check "$samples"/balls/balls.####.npy --frames 1-3 -m out --json --threads 1
    expect 0 '"kind":"mechanical"' '"kind":"geometric"' '"passed":true'
    ply=$output
    check "$samples"/balls/balls.####.npy --frames 1-3 -m out --json --threads 3
    [ "$output" = "$ply" ]
    rm out.*.ply
    balls glb
    check "$samples"/balls/balls.####.npy --frames 1-3 -m out --json
    expect 0
    # parents stand in PLY files only; sums of base and difference are rounded
    [ "$(grep -o '"faults":[0-9]*\|"triangles":[0-9]*\|"ids_kept":[0-9.]*\|"topology_errors":[0-9]*' <<<"$output")" = \
        "$(grep -o '"faults":[0-9]*\|"triangles":[0-9]*\|"ids_kept":[0-9.]*\|"topology_errors":[0-9]*' <<<"$ply")" ]
    # frame 3 alone: the report tells which of the glTF's frames it is
    check "$samples"/balls/balls.0003.npy -m out
    expect 0 "topology_errors                 0"
}

@test "limits" {
    balls ply
    frames=("$samples/balls/balls.####.npy" --frames 1-3 -m out --quick)
    check "${frames[@]}" --limit ids_kept=0.01,mechanical.min_angle_p5=10
    expect 0 "within all limits" ">= 10"
    check "${frames[@]}" --limit mechanical.min_angle_p5=59
    expect 1 "FAILED" "past a limit"
    check "${frames[@]}" --limit geometric.min_angle_p5=59,min_angle_p5=1
    expect 0
    check "${frames[@]}" --limit to_surface_p95=1
    expect 1 "to_surface_p95 was not measured"
    check "${frames[@]}" --limit colour=1
    expect 2 "no figure"
    check "${frames[@]}" --limit vertices=1
    expect 2 "no figure that can be limited"
    check "${frames[@]}" --limit faults
    expect 2 "wants a number"
}

@test "meshes of another frame fail" {
    balls ply
    mv out.geometric.0001.ply x && mv out.geometric.0003.ply out.geometric.0001.ply && mv x out.geometric.0003.ply
    check "$samples/balls/balls.####.npy" --frames 1-3 -m out --kind geometric --limit to_surface_max=1
    expect 1 "FAILED"
}

@test "a run's own settings are taken; options overrule them" {
    "$twinmesh" mesh "$samples/smoke/density.0024.vdb" -o out --format ply --quiet --iso 0.3 --edge 3v
    check "$samples/smoke/density.0024.vdb" -m out --quick
    expect 0 "inside is above 0.3"
    check "$samples/smoke/density.0024.vdb" -m out --quick --iso 0.1
    expect 1 "FAILED"
}

@test "an open border is no fault, a scene is measured against itself" {
    local edge
    for edge in 2v 4v; do # the cut leaves triangles that meet in a vertex alone
        "$twinmesh" mesh "$samples/splash/fluid.0022.vdb" -o out --format ply --quiet --border open --edge $edge
        check "$samples/splash/fluid.0022.vdb" -m out --quick
        expect 0 "boundary_edges                  0"
        check "$samples/splash/fluid.0022.vdb" -m out --quick --border close
        expect 1 FAILED
    done
    "$twinmesh" mesh "$samples/scenes/rr6128-figure1.json" --frames 12 -o ring --format ply --quiet
    check "$samples/scenes/rr6128-figure1.json" --frames 12 -m ring --limit to_surface_p95=0.1
    expect 0
}

@test "what is missing or cannot be read" {
    balls ply
    rm out.geometric.0002.ply
    head -c 300 out.mechanical.0003.ply >x && mv x out.mechanical.0003.ply
    check "$samples/balls/balls.####.npy" --frames 1-3 -m out --quick --json
    expect 3 "frame 0002: it has no mesh" "frame 0003" "out.mechanical.0003.ply"
    [ "$(grep -c '"frame":"000' <<<"$output")" -eq 5 ]
    rm out.*.ply && balls glb && truncate -s 3000 out.mechanical.glb
    check "$samples/balls/balls.0001.npy" -m out
    expect 3 "out.mechanical.glb"
    check "$samples/balls/balls.0001.npy" -m nothing
    expect 3 "nothing.geometric"
    check "$samples/balls/balls.0001.npy"
    expect 2 "--meshes"
    check -m out
    expect 2 "no frames"
    check --help
    expect 0 "--limit" "flicker_p95"
}
