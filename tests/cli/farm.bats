# twinmesh farm without Slurm: chunks, the stitching, and what goes wrong with them. tests/slurm.sh is the farm itself.

bats_require_minimum_version 1.5.0

setup() {
    samples=$(realpath "$BATS_TEST_DIRNAME/../../data-samples")
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
}

balls=(--iso 0 --inside below --format ply,glb --rest --surface-velocity)
farm() { run --separate-stderr "$twinmesh" farm "$@"; }

expect() { # status, words on standard error...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr"; return 1; }
    shift
    local word
    for word in "$@"; do [[ $stderr == *"$word"* ]] || { echo "no '$word' in: $stderr"; return 1; }; done
}

hashes() { sha256sum "$1".*.ply "$1".*.glb "$1".events.jsonl "$1".report.jsonl | sed "s/ $1\./ /"; }
same() { diff <(hashes "$1") <(hashes "$2"); }

@test "one chunk: the same bytes as mesh" {
    "$twinmesh" mesh "$samples/balls/balls.####.npy" "${balls[@]}" -o whole --quiet
    farm "$samples/balls/balls.####.npy" "${balls[@]}" -o farmed --chunks 1 --run 1
    expect 0
    same whole farmed
}

@test "eight chunks: exact, numbers and identities go on, the same bytes again" {
    scene=$samples/scenes/rr6128-figure1.json
    farm "$scene" --format ply,glb -o a --chunks 8 --overlap 4 --run 2
    expect 0 "48 frames" "48 of 48 frames"
    [ "$(grep -c '"fate":"tracked".*"wrong_components":0,' a.report.jsonl)" -eq 48 ]
    [ "$(ls a.mechanical.*.ply | wc -l)" -eq 48 ]
    [ "$(head -c 4 a.geometric.glb)" = glTF ]
    # 7 seams: at least 95 % of the vertices go on
    [ "$(grep -c '^twinmesh: seam' <<<"$stderr")" -eq 14 ]
    ! grep '^twinmesh: seam' <<<"$stderr" | grep -vE '\((9[5-9]\.[0-9]|100\.0) %\)'
    # components after a frame are those before the next
    grep '"kind":"components"' a.events.jsonl >components
    diff <(sed 's/.*"after":\(\[[^]]*\]\).*/\1/; $d' components) <(sed 's/.*"before":\(\[[^]]*\]\).*/\1/; 1d' components)
    farm "$scene" --format ply,glb -o b --chunks 8 --overlap 4 --run 1 --threads 3
    expect 0
    same a b
    # before the first seam all is as mesh has it
    "$twinmesh" mesh "$scene" --format ply -o m --frames 1-6 --quiet
    for frame in 0001 0006; do for kind in mechanical geometric; do cmp {a,m}.$kind.$frame.ply; done; done
}

@test "a damaged frame ends it; mended, --resume goes on" {
    cp "$samples"/balls/balls.*.npy .
    farm balls.####.npy "${balls[@]}" -o whole --chunks 3 --overlap 2 --run 1
    expect 0
    mv balls.0005.npy safe
    printf damaged >balls.0005.npy
    farm balls.####.npy "${balls[@]}" -o cut --chunks 3 --overlap 2 --run 1
    expect 3 "frame 0005" "finished and kept"
    [ -z "$(ls -d cut.* | grep -v farm)" ]
    farm --stitch cut.farm/plan.json
    expect 3 "cut.farm/chunk.0003.chunk" "run this chunk first"
    [ -z "$(ls -d cut.* | grep -v farm)" ]
    farm --chunk 3 cut.farm/plan.json
    expect 3 "frame 0005"
    farm --stitch cut.farm/plan.json
    expect 3 "cut.farm/chunk.0002.chunk: ends before its last frame"
    mv safe balls.0005.npy
    farm balls.####.npy "${balls[@]}" -o cut --chunks 3 --overlap 2 --run 2 --resume --edge 2v
    expect 2 "cut.farm/plan.json: was made for other"
    farm balls.####.npy "${balls[@]}" -o cut --chunks 3 --overlap 2 --run 2 --resume
    expect 0 "all frames of this run are done" "going on after"
    same whole cut
}

@test "skipped and held frames, at a seam too" {
    cp "$samples"/balls/balls.*.npy .
    for damaged in 0003 0004 0005; do
        printf damaged >balls.$damaged.npy
        for on_error in skip hold; do
            farm balls.####.npy "${balls[@]}" --on-error $on_error -o $on_error$damaged --chunks 2 --overlap 2 --run 1
            expect 0
            [ "$(grep -c '"fate":"tracked"' $on_error$damaged.report.jsonl)" -eq 5 ]
        done
        grep -q '"frame":"'$damaged'","fate":"skipped"' skip$damaged.report.jsonl
        grep -q '"frame":"'$damaged'","fate":"held"' hold$damaged.report.jsonl
        [ ! -f skip$damaged.geometric.$damaged.ply ] && [ -f hold$damaged.geometric.$damaged.ply ]
        cp "$samples/balls/balls.$damaged.npy" .
    done
    # nothing that both chunks tracked
    printf damaged >balls.0003.npy
    farm balls.####.npy "${balls[@]}" --on-error skip -o apart --chunks 2 --overlap 1 --run 1
    expect 0 "seam before frame 0004" "no vertex goes on"
}

@test "the plan: commands, frames and scripts, which nothing was started by" {
    mkdir "a b"
    farm "$samples/balls/balls.####.npy" "${balls[@]}" -o "a b/it's" --chunks 3 --overlap 1 --threads 2 --tries 5 --sbatch "--partition=cpu --mem=1G"
    expect 0
    [ -z "$output" ] && [ "$(ls "a b")" = "it's.farm" ]
    [ "$(cd "a b/it's.farm" && echo *)" = "array.sh plan.json stitch.sh submit.sh" ]
    plan=$(tr -d ' \n' <"a b/it's.farm/plan.json")
    [[ $plan == *'"own":["0003","0004"],"own_places":[2,3],"run_places":[1,4]'* ]]
    [[ $plan == *'"--chunk","2","--threads","2","ab/it'"'"'s.farm/plan.json"'* ]]
    for script in "a b/it's.farm"/*.sh; do sh -n "$script"; done
    grep -q '^#SBATCH --array=1-3$' "a b/it's.farm/array.sh"
    grep -q '^#SBATCH --partition=cpu --mem=1G$' "a b/it's.farm/stitch.sh"
    grep -q '^#SBATCH --kill-on-invalid-dep=yes$' "a b/it's.farm/stitch.sh"
    for k in 1 2 3; do farm --chunk $k "a b/it's.farm/plan.json"; expect 0; done
    farm --stitch "a b/it's.farm/plan.json"
    expect 0 "6 frames"
}

@test "mistakes are sentences" {
    cp "$samples"/balls/balls.*.npy .
    farm balls.####.npy --chunks 2
    expect 2 "-o PREFIX is missing"
    farm balls.####.npy -o out --iso 0 --chunks 7
    expect 2 "--chunks 7: there are 6 frames"
    farm - -o out </dev/null
    expect 2 "standard input"
    farm balls.####.npy -o out --start-from x.state
    expect 2 "--start-from: goes with one run"
    farm balls.####.npy -o out --submit --run 2
    expect 2 "--submit and --run"
    farm balls.####.npy -o nowhere/out --iso 0 --chunks 2
    expect 4 "nowhere/out.farm: the folder cannot be made"
    farm balls.####.npy -o out --iso 0 --inside above --dims 3,3,x
    expect 2 "--dims"
    farm --stitch nothing.json
    expect 3 "nothing.json"
    echo '{"steps": [{"tasks": [{}]}]}' >wrong.json
    farm --chunk 1 wrong.json
    expect 3 "wrong.json: is no plan"
    farm balls.####.npy -o out --iso 0 --inside below --chunks 2
    expect 0
    farm --chunk 3 out.farm/plan.json
    expect 2 "--chunk 3: the plan has 2"
    farm --stitch out.farm/plan.json
    expect 3 "out.farm/chunk.0001.chunk" "run this chunk first"
    rm balls.0006.npy
    farm --chunk 2 out.farm/plan.json
    expect 3 "there are 5 frames now"
    [ -z "$(ls -d out.* | grep -v farm)" ]
}

@test "--submit sends both jobs or none" {
    mkdir bin
    printf '#!/bin/sh\necho "$@" >>said\n[ "$(wc -l <said)" -le "$(cat taken)" ] && echo "4$(wc -l <said);cluster"\n' >bin/sbatch
    printf '#!/bin/sh\necho "cancel $@" >>said\n' >bin/scancel
    chmod +x bin/*
    PATH=$PWD/bin:$PATH
    echo 2 >taken
    farm "$samples/balls/balls.####.npy" -o out --iso 0 --inside below --chunks 2 --submit
    expect 0
    [ "$output" = $'41\n42' ]
    [ "$(cat said)" = $'--parsable out.farm/array.sh\n--parsable --dependency=afterok:41 out.farm/stitch.sh' ]
    echo 1 >taken
    rm said
    farm "$samples/balls/balls.####.npy" -o out --iso 0 --inside below --chunks 2 --submit
    expect 5 "out.farm/submit.sh"
    [ "$(tail -n 1 said)" = "cancel 41" ]
}

@test "damaged chunks are refused" {
    cp "$samples"/balls/balls.*.npy .
    farm balls.####.npy --format ply --iso 0 --inside below -o out --chunks 2 --run 1
    expect 0
    cp out.farm/chunk.0002.chunk safe
    printf 'x' | dd of=out.farm/chunk.0002.chunk bs=1 seek=5000 conv=notrunc status=none
    farm --stitch out.farm/plan.json
    expect 3 "chunk.0002.chunk: is damaged"
    head -c 20 safe >out.farm/chunk.0002.chunk
    farm --stitch out.farm/plan.json
    expect 3 "is no chunk"
    cp out.farm/chunk.0001.chunk out.farm/chunk.0002.chunk
    farm --stitch out.farm/plan.json
    expect 3 "chunk.0002.chunk"
}
