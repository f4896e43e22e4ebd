# bench.json as tables: of $case, or where that is "", of the figures that have bars.

# A number, none of which is negative here, with so many digits behind the point; "-": null.
def digits($n): if . == null then "-" elif $n == 0 then round | tostring
    else pow(10; $n) as $p | (. * $p | round) as $i | ($i % $p | tostring) as $f
        | ($i / $p | floor | tostring) + "." + ("0" * ($n - ($f | length)) // "") + $f end;
# Three digits that count, or all before the point.
def short: if . == null then "-" elif . >= 100 then digits(0) elif . >= 10 then digits(1) elif . >= 1 then digits(2) else digits(3) end;
def left($n): . + (" " * ($n - length) // "");
def right($n): (" " * ($n - length) // "") + .;
def row($name; $n): ($name | left(26)) + (map(tostring | right($n)) | join(""));

# --- the programs of a case -----------------------------------------------------------------------

def order: ["twinmesh", "twinmesh_1", "twinmesh_as_near", "floor", "volume_to_mesh", "volume_to_mesh_as_many", "volume_to_mesh_as_near",
    "flying_edges", "isotropic"];
def title($key): if $key == "twinmesh_1" then "twinmesh, 1 thread"
    elif $key == "twinmesh_as_near" then "  as near as volumeToMesh"
    elif $key == "volume_to_mesh_as_many" then "  as many: adapt. \(.adaptivity)"
    elif $key == "volume_to_mesh_as_near" then "  as near: adapt. \(.adaptivity)"
    else $key end;
def distances: [("to_surface", "from_surface") as $way | ("mean", "p95", "p99") as $f | .error[$way][$f] | digits(3)];
def stages: .stages | to_entries | map(select(.key != "whole" and .key != "carry") | "\(.key) \(.value * 1000 | short)") | join(", ");

def program($key; $ours): title($key) as $title
    | ([(.seconds, .cpu_seconds | . * 1000 | short), (.seconds / $ours.seconds | short), (.triangles | digits(0)), (.peak / 1e6 | digits(0))]
        + distances + [.error | .min_angle_p5, .topology_errors | digits(0)] | row($title; 10)), (stages | select(. != "") | "      " + .);

def a_case: .programs as $programs | $programs.twinmesh as $ours
    | "\($case): \(.frames) frames, \($ours.threads) threads; medians of \($ours.runs) runs, a frame; "
        + "edge \(.edge * 1e6 | round / 1e6); stages in ms",
    (["ms", "cpu ms", "x ours", "triangles", "MB", "to mean", "p95", "p99", "from mean", "p95", "p99", "angle p5", "topology"] | row(""; 10)),
    (order[] as $key | $programs[$key] // empty | program($key; $ours)), "";

# --- the bars -------------------------------------------------------------------------------------

def columns: [["against_isotropic", "isotropic"], ["against_as_many", "as many"], ["against_volume_to_mesh", "adapt. 0"],
    ["triangles", "triangles"], ["microseconds_a_triangle", "us/tri."], ["triangles_a_second", "tri./s/core"],
    ["speed_up", "speed-up"], ["bytes_a_triangle", "bytes/tri."], ["against_floor", "x floor"]];
def limit: if . == null then "-" else (if .side == "most" then "<= " else ">= " end) + (.bar | tostring) end;
def is_met($bar): if $bar.side == "most" then . <= $bar.bar else . >= $bar.bar end;
def figure($bar): if . == null or $bar == null then "-" else short + if is_met($bar) then "*" else " " end end;

def bars_of($kind; $title): .bars[$kind] as $bars | (.cases | to_entries | map(select(.value.kind == $kind))) as $cases
    | select($cases | length > 0)
    | (columns | map(.[1]) | row($title; 12)), (columns | map($bars[.[0]] | limit) | row("bar"; 12)),
    (columns | map($bars[.[0]].goal // "-") | row("goal"; 12)),
    ($cases[] | .key as $name | .value.figures as $f
        | (columns | map(. as [$key] | $f[$key]
            | if $key == "triangles" and $f.triangles_are_no_farther == false then short + " " else figure($bars[$key]) end) | row($name; 12))
        + if $f.is_no_farther == false then "   farther than volumeToMesh at adaptivity 0" else "" end), "";

def all_bars:
    "The bars; *: met. Whole processes against volumeToMesh with CGAL's isotropic remeshing (but for its repair), against volumeToMesh of as",
    "many triangles, and at adaptivity 0; geometric triangles against that one's, of refinement as coarse as still comes as near. The rest",
    "by mechanical triangles: microseconds of the whole process; tracked a second on one core by the stages of the solve; how much faster",
    "the whole is on all threads; bytes of memory beyond the fields'. Of the still surface the whole process against the floor", "",
    bars_of("splash"; "splashes"), bars_of("calm"; "calm"),
    (.bars.slope as $bar | .slopes | to_entries[] | select(.value)
        | "time grows as the area to the power of \(.value | figure($bar)) (\($bar | limit)): \(.key)");

if $case == "" then all_bars else .cases[$case] | a_case end
