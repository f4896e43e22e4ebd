#!/usr/bin/env bash
# Runs everything `make check` promises on the build folder named, shows what failed, and ends with one line of counts.
#   tests/check.sh build/release [NAME...]   only the suites whose name contains one of the NAMEs
cd "$(dirname "$0")/.." || exit 1
build=$1
shift
only=("$@")
TWINMESH=$(realpath "$build")/twinmesh
export TWINMESH
logs=$build/logs
mkdir -p "$logs"
passed=0 failed=0 skipped=0

wanted() {
    [ ${#only[@]} -eq 0 ] && return 0
    local name
    for name in "${only[@]}"; do [[ $1 == *"$name"* ]] && return 0; done
    return 1
}

tell() { # name, passed, failed, skipped, seconds
    printf '%-34s %3d passed' "$1" "$2"
    [ "$3" -gt 0 ] && printf ', %d FAILED' "$3"
    [ "$4" -gt 0 ] && printf ', %d skipped' "$4"
    printf '   %d s\n' "$5"
    passed=$((passed + $2)) failed=$((failed + $3)) skipped=$((skipped + $4))
}

# A suite that speaks TAP: cmocka's or bats'. One that dies early counts as failed even if all it said was ok.
tap() {
    local name=$1 log=$logs/$1.log start=$SECONDS status p f s
    wanted "$name" || return 0
    shift
    CMOCKA_MESSAGE_OUTPUT=TAP "$@" >"$log" 2>&1
    status=$?
    s=$(grep -cE '^(not )?ok .*# ?(SKIP|skip)' "$log")
    p=$(grep -E '^ok ' "$log" | grep -cvE '# ?(SKIP|skip)')
    f=$(grep -E '^not ok ' "$log" | grep -cvE '# ?(SKIP|skip)')
    [ $status -ne 0 ] && [ "$f" -eq 0 ] && f=1
    [ $((p + f + s)) -eq 0 ] && f=1
    tell "$name" "$p" "$f" "$s" $((SECONDS - start))
    if [ "$f" -gt 0 ]; then sed 's/^/    /' "$log"; fi
    if [ "$s" -gt 0 ]; then grep -E '# ?(SKIP|skip)' "$log" | sed 's/^/    /'; fi
    return 0
}

# A check that is one thing: exit status 0 passed, 77 skipped (it says why), else failed.
one() {
    local name=$1 log=$logs/$1.log start=$SECONDS status
    wanted "$name" || return 0
    shift
    "$@" >"$log" 2>&1
    status=$?
    case $status in
        0) tell "$name" 1 0 0 $((SECONDS - start)) ;;
        77) tell "$name" 0 0 1 $((SECONDS - start)); sed 's/^/    SKIPPED: /' "$log" ;;
        *) tell "$name" 0 1 0 $((SECONDS - start)); tail -n 60 "$log" | sed 's/^/    /' ;;
    esac
}

one layers tests/layers.sh
one headers tests/headers.sh
one manual tests/manual.sh
for test in "$build"/tests/test_*; do
    [ -x "$test" ] && [ -f "$test" ] && tap "$(basename "$test")" "$test"
done
for file in tests/cli/*.bats; do tap "cli-$(basename "$file" .bats)" bats --formatter tap "$file"; done
one hostile "$build/tests/hostile" 600
one golden tests/golden/golden.sh "$build/twinmesh"
if [ "$(basename "$build")" = release ]; then # the Makefile built these too, where it could
    one golden-without-optimisation tests/golden/golden.sh --quick build/debug/twinmesh
    one golden-clang tests/golden/golden.sh --quick build/clang/twinmesh
fi
one slurm tests/slurm.sh "$build/twinmesh"
[ -x tests/gltf/validate.sh ] && one gltf-validator tests/gltf/validate.sh "$build/twinmesh"
one page-in-chromium tests/page/page.sh "$build/twinmesh"

echo
line="$passed passed, $failed failed"
[ $skipped -gt 0 ] && line+=", $skipped skipped"
echo "$line"
[ $failed -eq 0 ]
