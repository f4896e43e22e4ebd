#!/usr/bin/env bash
# Runs every libFuzzer target for some seconds, two at a time, and tells how many inputs each has seen; fails where one broke.
#   fuzz.sh SEEDS BUILD SECONDS   SEEDS: the program that writes them
# What is found is kept in BUILD/found, and the corpus beside it, which the next run starts from.
cd "$(dirname "$0")/../.." || exit 1
seeds=$1 build=$2 seconds=$3
work=$(realpath "$build")
mkdir -p "$work/found" "$work/scratch"
"$seeds" "$work/seeds" || exit 1
mkdir -p "$work/seeds/scene"
cp data-samples/scenes/*.json "$work/seeds/scene"

# Kept low: a reader may take no more than the length of its file warrants. What OpenVDB and OpenEXR lose when they fail is not ours.
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1
export LSAN_OPTIONS=suppressions=$PWD/tests/fuzz/leaks.txt:print_suppressions=0

fuzz() { # target
    mkdir -p "$work/corpus/$1"
    TMPDIR=$work/scratch "$work/tests/fuzz_$1" -seed=1 -max_total_time="$seconds" -max_len=65536 -timeout=10 -rss_limit_mb=3000 -print_final_stats=1 \
        -artifact_prefix="$work/found/$1-" "$work/corpus/$1" "$work/seeds/$1" >"$work/$1.log" 2>&1
}

status=0
tell() { # target, status
    local count
    count=$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$1.log")
    printf '%-12s %10s inputs%s\n' "$1" "${count:-?}" "$([ "$2" -eq 0 ] || echo ', FAILED')"
    [ "$2" -eq 0 ] && return
    status=1
    grep -E 'ERROR|SUMMARY|runtime error|Test unit written' "$work/$1.log" | sed 's/^/    /'
}

pair() { # one or two targets
    local pids=() i=0 target
    for target; do fuzz "$target" & pids+=($!); done
    for target; do
        wait "${pids[i]}"
        tell "$target" $?
        i=$((i + 1))
    done
}

targets=(vdb volume mesh_file scene state edits)
for ((k = 0; k < ${#targets[@]}; k += 2)); do pair "${targets[@]:k:2}"; done
exit $status
