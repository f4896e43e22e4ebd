# twinmesh skin: particles, grids and scenes in, level sets out, and on to twinmesh mesh.

bats_require_minimum_version 1.5.0

# Drops of a few hundred particles that fall and meet: parts.0001.ply ... 0004; as text, each place once.
write_particles() {
    local frame
    for frame in 1 2 3 4; do
        awk -v frame="$frame" 'BEGIN {
            n = 0
            for (k = 0; k < 2; k++)
                for (x = -3; x <= 3; x++) for (y = -3; y <= 3; y++) for (z = -3; z <= 3; z++)
                    if (x * x + y * y + z * z <= 10)
                        line[n++] = sprintf("%.3f %.3f %.3f", 0.1 * x, 0.1 * y, 0.1 * z + (k ? 1.25 - 0.15 * frame : 0))
            printf "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\nend_header\n", n
            for (i = 0; i < n; i++) print line[i]
        }' >"parts.000$frame.ply"
    done
}

setup() {
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    scenes=$(realpath "$BATS_TEST_DIRNAME/../../data-samples/scenes")
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
    write_particles
}

skin() { run --separate-stderr "$twinmesh" skin "$@"; }

expect() { # status, words on standard error...
    [ "$status" -eq "$1" ] || { echo "exit $status: $stderr"; return 1; }
    shift
    local word
    for word in "$@"; do [[ $stderr == *"$word"* ]] || { echo "no '$word' in: $stderr"; return 1; }; done
}

@test "particles become level sets, named as they are finished" {
    skin 'parts.####.ply' --radius 0.1 -o skin.####.vdb
    expect 0 "voxel 0.05, alpha 2, beta 0.1"
    [ "$output" = $'skin.0001.vdb\nskin.0002.vdb\nskin.0003.vdb\nskin.0004.vdb' ]
    run "$twinmesh" info skin.0003.vdb
    [[ $output == *"class: level set"* ]]
    [[ $output == *"background: 0.15"* ]]
    [[ $output == *"lowest: -0.15"* ]]
}

@test "a pipe to mesh: frames are meshed as they are made, with exact topology" {
    "$twinmesh" skin 'parts.####.ply' --radius 0.1 --tension 0.1 --keep volume -o skin.####.vdb -q | "$twinmesh" mesh - -o out --format ply -q
    [ -s out.geometric.0004.ply ]
    run grep -c '"wrong_components":0' out.report.jsonl
    [ "$output" -ge 4 ]
    grep -q '"components":2' out.report.jsonl
    grep -q '"components":1' out.report.jsonl
}

@test "the same bytes with any number of threads" {
    skin 'parts.####.ply' --radius 0.1 -o one.####.vdb --threads 1 -q
    expect 0
    skin 'parts.####.ply' --radius 0.1 -o three.####.vdb --threads 3 -q
    expect 0
    for frame in 1 2 3 4; do cmp one.000$frame.vdb three.000$frame.vdb; done
}

@test "a metamorphosis begins on one scene and ends on the other" {
    skin --from "$scenes/gi98-figure6-from.json" --to "$scenes/gi98-figure6-to.json" --frames 8 -v -o morph.#.vdb --voxel 0.1
    expect 0 "time a frame 0.571429"
    [ "$(wc -l <<<"$output")" -eq 8 ]
    "$twinmesh" mesh morph.#.vdb -o out --format ply -q
    components=$(grep -oE '"components":[0-9]+' out.report.jsonl | head -8 | cut -d: -f2 | tr '\n' ' ')
    [[ $components == "1 "*" 2 " ]] || { echo "$components"; return 1; }
}

@test "a scene and its grids are followed alike" {
    scene=$scenes/gi98-figure5.json
    skin "$scene" --frames 1-2 -o a.#.vdb -q
    expect 0
    "$twinmesh" field "$scene" --frames 1-2 -o phi.#.vdb -q
    skin phi.#.vdb -o b.#.vdb -q
    expect 0
    cmp a.1.vdb b.1.vdb && cmp a.2.vdb b.2.vdb
}

@test "a cache of particles and a grid" {
    skin "$BATS_TEST_DIRNAME/../../data-samples/splash/fluid.0020.vdb" --grid phi -o skin.vdb --tension 0
    expect 0 "'phi'"
    skin "$BATS_TEST_DIRNAME/../../data-samples/splash/fluid.0020.vdb" --points particles -o skin2.vdb
    expect 3 "no point grid 'particles'" "twinmesh info"
}

@test "wrong usage is a sentence" {
    skin 'parts.####.ply' --radius 0.1
    expect 2 "-o PATTERN is missing"
    skin -o skin.####.vdb
    expect 2 "no target is named"
    skin 'parts.####.ply' -o skin.####.vdb
    expect 2 "--radius"
    skin 'parts.####.ply' --radius 0.1 -o skin.####.obj
    expect 2 ".vdb, .npy or .exr"
    skin 'parts.####.ply' --radius 0.1 -o skin.vdb
    expect 2 "####"
    skin --to parts.0001.ply --frames 4 --radius 0.1 -o skin.####.vdb
    expect 2 "--from is missing"
    skin --from parts.0001.ply --to parts.0002.ply --radius 0.1 -o skin.####.vdb
    expect 2 "--frames N is missing"
    skin parts.0001.ply --from parts.0001.ply --to parts.0002.ply --frames 3 --radius 0.1 -o skin.####.vdb
    expect 2 "name no others"
    [ -z "$(ls skin* 2>/dev/null)" ]
}

@test "what would not be stable in a thousand substeps is refused" {
    skin 'parts.####.ply' --radius 0.1 --tension 100 -o skin.####.vdb
    expect 2 "--tension 100" "substeps a frame" "give less tension"
    [ ! -e skin.0001.vdb ]
    skin 'parts.####.ply' --radius 0.1 --tension 0.1 --unit 0.1 -o skin.####.vdb -v
    expect 0 "beta 0.1 (0.4 voxels^2 a frame)"
}

@test "an unreadable frame stops the run and leaves what was finished" {
    echo nonsense >parts.0003.ply
    skin 'parts.####.ply' --radius 0.1 -o skin.####.vdb
    expect 3 "parts.0003.ply"
    [ -s skin.0002.vdb ] && [ ! -e skin.0003.vdb ]
}

@test "--mesh makes the meshes that the pipe makes, without grids" {
    "$twinmesh" skin 'parts.####.ply' --radius 0.1 -o skin.####.vdb -q | "$twinmesh" mesh - -o pipe --format ply -q
    rm skin.*
    skin 'parts.####.ply' --radius 0.1 --mesh at-once -q -- --format ply
    expect 0
    for frame in 1 2 3 4; do cmp pipe.geometric.000$frame.ply at-once.geometric.000$frame.ply; done
    [ -z "$(ls skin* 2>/dev/null)" ]
    skin 'parts.####.ply' --radius 0.1 --mesh other -q -- --resume
    expect 2 "--resume"
    skin 'parts.####.ply' --radius 0.1 -o skin.####.vdb -- --format ply
    expect 2 "--mesh, which is missing"
    skin --from "$scenes/gi98-figure6-from.json" --to "$scenes/gi98-figure6-to.json" --frames 3 --voxel 0.2 --mesh morph -q -- --format ply
    expect 0
    [ -s morph.geometric.0003.ply ] || ls
}
