# The raw lines of bench.sh as one object, for tables.jq and for comparing two runs:
#   threads
#   bars      per kind of case and figure: what is to be met, what is wished for, and which side is good
#   cases     per case: its kind, frames and edge; per program the medians of its runs, for one frame; the figures that have bars
#   slopes    per generated kind: of time against triangles, both logarithmic, over its cases of 10^4 to 10^6 mechanical ones
# Seconds, bytes, and distances in voxels. What could not be measured is null.

include "near";
def median: sort | length as $n | (.[($n - 1) / 2 | floor] + .[$n / 2 | floor]) / 2;
def ratio(a; b): a as $a | b as $b | if $a == null or $b == null or $b == 0 then null else $a / $b end;
# Groups with what they have in common as keys.
def keyed_by(name): group_by(name) | map({key: (.[0] | name), value: .}) | from_entries;

def bars:
    def most($bar; $goal): {$bar, $goal, side: "most"};
    def least($bar): {$bar, goal: null, side: "least"};
    {against_isotropic: most(0.3; 0.05), against_as_many: most(2; 0.8), against_volume_to_mesh: most(5; 1),
        bytes_a_triangle: most(300; null), speed_up: least(1.7)} as $all
    | {splash: ($all + {triangles: most(0.7; null), microseconds_a_triangle: most(4; null), triangles_a_second: least(250000)}),
       calm: ($all + {triangles: most(0.35; null), microseconds_a_triangle: most(1.5; null), triangles_a_second: least(500000),
        against_floor: most(1.5; null)}),
       slope: most(1.05; null)};

# --- a case ---------------------------------------------------------------------------------------

# Of the runs of a program, and the distances of its mesh.
def program($error): .[0].frames as $frames
    | {runs: length, threads: .[0].threads,
       seconds: (map(.seconds / $frames) | median),
       seconds_least: (map(.seconds / $frames) | min), seconds_most: (map(.seconds / $frames) | max),
       cpu_seconds: (map(.cpu / $frames) | median),
       stages: (map(.stages // {} | to_entries[]) | keyed_by(.key) | map_values(map(.value / $frames) | median)),
       peak: (map(.peak) | median), triangles: ratio(.[0].triangles; $frames), mechanical: ratio(.[0].mechanical; $frames),
       adaptivity: .[0].adaptivity, $error};

def solve: .stages | .predict + .alter + .relax + .audit + .mend + .refine + .carry;
def figures($is_still): .twinmesh as $ours | (.twinmesh_1 // $ours) as $one | (.twinmesh_as_near // $ours) as $near
    | .volume_to_mesh.error as $theirs | {
    against_isotropic: ratio($ours.seconds; .isotropic | if . then .seconds - .stages.repair else null end),
    against_as_many: ratio($ours.seconds; .volume_to_mesh_as_many.seconds),
    against_volume_to_mesh: ratio($ours.seconds; .volume_to_mesh.seconds),
    is_no_farther: (if $ours.error then $ours.error | is_no_farther($theirs) else null end),
    triangles: ratio($near.triangles; .volume_to_mesh.triangles),
    triangles_are_no_farther: (if $near.error then $near.error | is_no_farther($theirs) else null end),
    microseconds_a_triangle: ratio(1e6 * $ours.seconds; $ours.mechanical),
    triangles_a_second: ratio($one.mechanical; $one | solve),
    speed_up: ratio(.twinmesh_1.seconds; $ours.seconds), # stages of two frames overlap
    bytes_a_triangle: ratio($ours.peak - .fields.peak; $ours.mechanical),
    against_floor: (if $is_still then ratio($ours.seconds; .floor.seconds) else null end)};

def case_of($name): (map(select(.error)) | map({key: .program, value: .error}) | from_entries) as $error
    | map(select(.seconds)) | .[0] as $first
    | {kind: (if $name | test("^(sphere|still)") then "calm" else "splash" end), frames: $first.frames, edge: (map(.edge // empty)[0])}
    + (keyed_by(if .program == "twinmesh" and .threads != $first.threads then "twinmesh_1" else .program end)
        | with_entries(.value |= program($error[.[0].program])) | {programs: ., figures: figures($name | test("^still"))});

# --- all cases ------------------------------------------------------------------------------------

# Of y over x, by least squares.
def slope: if length < 2 then null else (map(.x) | add / length) as $x
    | ratio(map(.y * (.x - $x)) | add; map((.x - $x) * (.x - $x)) | add) end;
def slopes: to_entries | map({kind: (.key | capture("^(?<kind>splash|sphere|still)[0-9]").kind)} + .value.programs.twinmesh)
    | map(select(.mechanical >= 1e4 and .mechanical <= 1e6) | . + {x: (.mechanical | log), y: (.seconds | log)})
    | keyed_by(.kind) | map_values(slope);

keyed_by(.case) | with_entries(.key as $name | .value |= case_of($name)) | {$threads, bars: bars, cases: ., slopes: slopes}
