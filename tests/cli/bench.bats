# make bench: what it makes of the lines that its runs leave.

bats_require_minimum_version 1.5.0

setup() {
    bench=$(realpath "$BATS_TEST_DIRNAME/../bench")
    cd "$BATS_TEST_TMPDIR" || exit 1
}

ours() { # case, threads, seconds of 2 frames, mechanical triangles of both
    jq -nc --arg case "$1" '$ARGS.positional as [$threads, $seconds, $mechanical] | {$case, program: "twinmesh", $threads, frames: 2, $seconds, cpu: 1,
        peak: 70e6, triangles: ($mechanical * 2), $mechanical, stages: {read: 9, predict: 0.1, alter: 0.1, relax: ($seconds / 4), audit: 0, mend: 0,
        refine: 0.05, carry: 0, whole: 9}}' --jsonargs "$2" "$3" "$4"
}
peer() { # case, program, seconds, triangles, of its repair, or null
    jq -nc --arg case "$1" --arg program "$2" '$ARGS.positional as [$seconds, $triangles, $repair] | {$case, $program, threads: 2, frames: 2, $seconds, cpu: 1,
        peak: 50e6, $triangles, adaptivity: 0, stages: (if $repair then {$repair} else {} end)}' --jsonargs "$3" "$4" "${5:-null}"
}
error() { # case, program, mean distance
    jq -nc --arg case "$1" --arg program "$2" --argjson mean "$3" '{$case, $program, error: {min_angle_p5: 30, topology_errors: 0,
        to_surface: {$mean, p95: 0.1, p99: 0.2}, from_surface: {mean: 0.01, p95: 0.1, p99: 0.2}}}'
}
figures() { jq -s -L "$bench" --argjson threads 2 -f "$bench/figures.jq" "$@" >figures.json; }
holds() { jq -e "$1" figures.json || { jq -c '.slopes, .cases[]' figures.json; return 1; }; }

lines() {
    for seconds in 4 2 9; do ours splash64 2 $seconds 40000; done
    ours splash64 1 8 40000
    peer splash64 volume_to_mesh 1 100000
    peer splash64 volume_to_mesh_as_many 2 80000
    peer splash64 isotropic 22 40000 2
    peer splash64 floor 0.5 null
    peer splash64 fields 0.5 null | jq -c '.edge = 0.02'
    error splash64 twinmesh 0.02
    error splash64 volume_to_mesh 0.03
    ours splash128 2 16 160000
    peer splash128 volume_to_mesh 4 400000
    peer splash128 fields 0.5 null
    ours still64 2 3 40000
    peer still64 volume_to_mesh 4 400000
    peer still64 floor 1.5 null
    peer still64 fields 0.5 null
}

@test "figures are of medians, and of a frame" {
    lines | figures
    holds '.cases.splash64 | .kind == "splash" and .frames == 2 and .edge == 0.02 and .programs.twinmesh_1.runs == 1'
    holds '.cases.splash64.programs.twinmesh | .runs == 3 and .seconds == 2 and .seconds_least == 1 and .seconds_most == 4.5 and .mechanical == 20000'
    holds '.cases.splash64.figures | .against_volume_to_mesh == 4 and .against_as_many == 2 and .triangles == 0.8'
    holds '.cases.splash64.figures | .against_isotropic == 0.2' # without the repair
    holds '.cases.splash64.figures | .microseconds_a_triangle == 100 and .bytes_a_triangle == 1000'
    holds '.cases.splash64.figures | (.triangles_a_second - 40000 / 2.25 | fabs) < 1e-6 and .speed_up == 2'
}

@test "what was not measured is null, and calm cases have bars of their own" {
    lines | figures
    holds '.cases.splash128.figures | .against_isotropic == null and .is_no_farther == null and .speed_up == null and .against_floor == null'
    holds '.cases.still64 | .kind == "calm" and .figures.against_floor == 2'
    holds '.bars.calm.against_floor.bar == 1.5 and .bars.splash.against_floor == null'
}

@test "a mesh farther from the surface than volumeToMesh's is told of, whichever figure it is" {
    lines | figures
    holds '.cases.splash64.figures.is_no_farther == true'
    { lines; error splash64 twinmesh 0.04; } | figures
    holds '.cases.splash64.figures.is_no_farther == false'
    jq -r --arg case '' -f "$bench/tables.jq" figures.json >tables
    grep -q 'splash64 .*farther than volumeToMesh' tables
}

@test "time against area is a power" {
    lines | figures
    holds '.slopes | (.splash - 1 | fabs) < 1e-9 and .still == null' # 4 times the triangles: 4 times the seconds; of one size nothing is known
}

@test "tables have every program and mark the bars that are met" {
    lines | figures
    jq -r --arg case splash64 -f "$bench/tables.jq" figures.json >tables
    grep -Eq '^twinmesh +2000 +500 +1\.00 +40000 +70 +0\.020 +0\.100 +0\.200' tables
    grep -Eq '^isotropic +11000 ' tables
    jq -r --arg case '' -f "$bench/tables.jq" figures.json >tables
    grep -Eq '^splash64 +0\.200\* +2\.00\* +4\.00\* +0\.800 +100 ' tables
    run ! grep 'time grows.*still' tables
    grep -Eq '^time grows .* 1\.000?\* .*splash$' tables
}
