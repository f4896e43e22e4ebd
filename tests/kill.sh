#!/usr/bin/env bash
# Kills runs at random instants, goes on with --resume, and holds all outputs but the timings to those of an undisturbed run.
#   tests/kill.sh PROGRAM TIMES ARGUMENTS OF MESH...
program=$1 times=$2
shift 2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir "$scratch/whole"
hashes() { (cd "$1" && sha256sum -- $(ls | grep -v timings)); }

begin=$(date +%s%N)
"$program" mesh "$@" -o "$scratch/whole/m" --quiet 2>/dev/null || { echo "the undisturbed run: exit $?"; exit 1; }
took_us=$((($(date +%s%N) - begin) / 1000))
expected=$(hashes "$scratch/whole")
RANDOM=1
kills=0
for ((i = 1; i <= times; i++)); do
    mkdir "$scratch/cut"
    for ((attempt = 1; ; attempt++)); do
        "$program" mesh "$@" -o "$scratch/cut/m" --quiet --resume 2>"$scratch/said" &
        if ((attempt < 4)); then # a few kills, then it may end
            at=$(((RANDOM * 32768 + RANDOM) % (took_us + took_us / 20)))
            sleep "$((at / 1000000)).$(printf %06d $((at % 1000000)))"
            kill -KILL $! 2>/dev/null
        fi
        wait $! 2>/dev/null
        status=$?
        [ $status -eq 0 ] && break
        [ $status -eq 137 ] || { echo "run $i: exit $status: $(cat "$scratch/said")"; exit 1; }
        kills=$((kills + 1))
    done
    if [ "$(hashes "$scratch/cut")" != "$expected" ]; then
        echo "run $i: other bytes after $((attempt - 1)) kills"
        diff <(echo "$expected") <(hashes "$scratch/cut")
        exit 1
    fi
    rm -r "$scratch/cut"
done
echo "$times runs, $kills kills: all the same bytes"
