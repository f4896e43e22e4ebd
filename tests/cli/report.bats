# twinmesh report: what stands in the page, without a browser (tests/page looks at it in one).

bats_require_minimum_version 1.5.0

setup_file() {
    export twinmesh samples
    samples=$(realpath "$BATS_TEST_DIRNAME/../../data-samples")
    twinmesh=$(realpath "${TWINMESH:-$BATS_TEST_DIRNAME/../../build/release/twinmesh}")
    cd "$BATS_FILE_TMPDIR" || exit 1
    "$twinmesh" mesh "$samples/balls/balls.####.npy" --frames 1-4 --inside below -o run --quiet
}

setup() {
    mkdir "$BATS_TEST_TMPDIR/here" && cd "$BATS_TEST_TMPDIR/here" || exit 1
    cp "$BATS_FILE_TMPDIR"/run.* .
}

report() { run --separate-stderr "$twinmesh" report "$@"; }
expect() { # exit status, words on standard error...
    [ "$status" -eq "$1" ] || { echo "exit $status, not $1: $stderr"; return 1; }
    local word
    for word in "${@:2}"; do [[ $stderr == *"$word"* ]] || { echo "no '$word' in: $stderr"; return 1; }; done
}
# The JSON of a script, a line each, as the file had it.
json() { sed -n "/<script type=\"application\/json\" id=\"$1\">/,/<\/script>/p" "$2" | sed 's/<script[^>]*>//; s/<\/script>.*//' | jq -c '.[]'; }
mesh() { sed -nE "s/<script type=\"text\/plain\" data-mesh=\"$1\">([^<]+)<\/script>/\1/p" "$2" | base64 -d | gunzip; }

@test "all lines and both meshes stand in the page, and the same files give the same bytes" {
    report run
    expect 0
    [ "$output" = run.report.html ]
    for file in report events timings; do cmp <(json $file run.report.html) <(jq -c . run.$file.jsonl); done
    for kind in mechanical geometric; do cmp <(mesh $kind run.report.html) run.$kind.glb; done
    report run -o again.html
    expect 0
    cmp run.report.html again.html
    [ ! -e again.html.part ]
}

@test "the page asks for nothing elsewhere, and bears the licence of three.js" {
    report run
    [ -z "$(grep -oE 'https?://[^"'"'"'` )]*' run.report.html | grep -vE '^http://www\.w3\.org/(1999/xhtml|2000/svg)$')" ]
    run ! grep -qE '<(script|link|img|iframe)[^>]* (src|href)=' run.report.html
    grep -q "Content-Security-Policy\" content=\"default-src 'none'" run.report.html
    if [ -s "$BATS_TEST_DIRNAME/../../build/page/viewer.js" ]; then
        grep -q 'The MIT License' run.report.html
        grep -q 'The above copyright notice and this permission notice shall be included' run.report.html
    fi
}

@test "no text of a file ends a script or opens a tag" {
    local sign='</script><!--<script>alert(1)</script>&'
    jq -c --arg sign "$sign" 'if .surface then .surface = $sign else . end' run.report.jsonl >new && mv new run.report.jsonl
    report run -o plain.html --title plain
    local scripts
    scripts=$(grep -o '</script' plain.html | wc -l)
    report run --title "$sign\""
    expect 0
    [ "$(grep -o '</script' run.report.html | wc -l)" -eq "$scripts" ]
    run ! grep -q '<!--' run.report.html
    [ "$(json report run.report.html | jq -r 'select(.surface) | .surface' | head -n 1)" = "$sign" ]
    grep -qF '<title>&lt;/script&gt;&lt;!--&lt;script&gt;alert(1)&lt;/script&gt;&amp;&quot;</title>' run.report.html
}

@test "a run that was cut off, or has its report alone, makes a page too" {
    sed -i '$d' run.report.jsonl
    rm run.events.jsonl run.timings.jsonl run.*.glb
    report run
    expect 0 "run.events.jsonl" "no mechanical mesh" "no geometric mesh" "--format glb"
    [ "$(json report run.report.html | wc -l)" -eq 5 ]
    [ -z "$(json events run.report.html)" ]
    [ "$(grep -c 'data-missing="There is no' run.report.html)" -eq 2 ]
    report run --quiet
    expect 0
    [ -z "$stderr" ]
}

@test "lines that mesh did not write are refused by file and number, and leave no page" {
    local line
    for line in '{"frame":' '[1]' '{"frame":3,"fate":"tracked"}' '{"frame":"3","fate":"eaten"}' '{"frame":"3","fate":"tracked","events":1}' \
        '{"frame":"3","fate":"tracked","frame":"4"}' "$(printf '{"frame":"\xff","fate":"tracked"}')"; do
        { head -n 2 "$BATS_FILE_TMPDIR/run.report.jsonl"; echo "$line"; } >run.report.jsonl
        report run
        expect 3 "run.report.jsonl: line 3 is no"
        [ ! -e run.report.html ] && [ ! -e run.report.html.part ]
    done
    echo '{"frame":"0001","fate":"tracked"}' >run.report.jsonl
    report run
    expect 3 "line 1 is none of a report"
    : >run.report.jsonl
    report run
    expect 3 "is empty"
    cp "$BATS_FILE_TMPDIR/run.report.jsonl" .
    echo '{"frame":"0001","kind":"blend","place":[1,2],"before":[],"after":[],"places":[]}' >run.events.jsonl
    report run
    expect 3 "run.events.jsonl: line 1 is none of a list of events"
}

@test "large meshes: left out by --max-embed, or linked" {
    report run --max-embed 0
    expect 0 "run.mechanical.glb is left out" "--max-embed is 0" "--link"
    grep -q 'data-mesh="geometric" data-missing="run.geometric.glb is left out' run.report.html
    report run --link
    expect 0
    grep -q 'data-mesh="geometric" data-link="run.geometric.glb"></script>' run.report.html
    [ -z "$(mesh geometric run.report.html 2>/dev/null)" ]
    mkdir there
    report run --link -o there/page.html
    expect 2 "there/page.html does not lie beside"
    report run -o there/page.html
    expect 0
    cmp <(mesh geometric there/page.html) run.geometric.glb
}

@test "what is missing or broken is named" {
    report
    expect 2 "one PREFIX"
    report there/
    expect 2 "is a folder"
    report nothing
    expect 3 "nothing.report.jsonl: there is no such file" "twinmesh mesh -o nothing"
    report run -o nowhere/page.html
    expect 4 "nowhere/page.html" "folder does not exist"
    head -c 500 "$BATS_FILE_TMPDIR/run.geometric.glb" >run.geometric.glb
    report run
    expect 3 "run.geometric.glb"
    [ ! -e run.report.html ]
    rm run.geometric.glb
    touch run.geometric.gltf
    report run
    expect 0 "The geometric mesh is a .gltf"
}
