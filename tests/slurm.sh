#!/usr/bin/env bash
# A sequence farmed by a real Slurm, on this machine: munged, slurmctld and slurmd are started in a folder of their own, take 8 chunks
# and the stitching, and end with the test. Then a chunk that is killed, and one whose frame is damaged.
#   tests/slurm.sh TWINMESH
# Exit 0 passed, 1 not, 77 where there is no Slurm, or nobody may start it.
set -u
here=$(cd "$(dirname "$0")" && pwd)
twinmesh=$(realpath "$1")
scene=$here/../data-samples/scenes/rr6128-figure1.json
chunks=8

for program in munged slurmctld slurmd sbatch; do
    PATH=$PATH:/usr/sbin command -v $program >/dev/null || { echo "$program is not installed (slurm-wlm, munge): NOTHING WAS SENT TO SLURM"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "Slurm's daemons need root here: NOTHING WAS SENT TO SLURM"; exit 77; }
PATH=$PATH:/usr/sbin

dir=$(mktemp -d)
daemons=()
finish() {
    scancel --quiet --full $(squeue --noheader --format=%A 2>/dev/null) 2>/dev/null
    local pid
    for ((i = ${#daemons[@]} - 1; i >= 0; i--)); do
        pid=${daemons[i]}
        kill "$pid" 2>/dev/null
        for _ in $(seq 50); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
        kill -KILL "$pid" 2>/dev/null
        wait "$pid" 2>/dev/null
    done
    rm -rf "$dir"
}
trap finish EXIT
trap 'exit 1' INT TERM

die() {
    echo "FAILED: $*"
    tail -n 20 "$dir"/{farm,slurmctld,slurmd}.log "$dir"/jobs/*/*.farm/*.log 2>/dev/null
    exit 1
}

# until SECONDS COMMAND...: true as soon as the command is
until_true() {
    local end=$((SECONDS + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.1
    done
}

free_port() {
    local port
    while port=$((20000 + RANDOM % 20000)); do
        (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo $port; return; }
    done
}

# --- a cluster of one machine ---------------------------------------------------------------------------------------------

start() { # name, command...
    local log=$dir/$1.log
    shift
    "$@" >"$log" 2>&1 &
    daemons+=($!)
}

chmod 755 "$dir"
head -c 128 /dev/urandom >"$dir/munge.key"
chmod 600 "$dir/munge.key"
start munged munged --foreground --force --num-threads=2 --key-file="$dir/munge.key" --socket="$dir/munge.socket" --pid-file="$dir/munged.pid" \
    --seed-file="$dir/munge.seed"
mkdir "$dir/control" "$dir/spool"
host=$(hostname -s)
cat >"$dir/slurm.conf" <<END
ClusterName=twinmesh
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$dir/munge.socket
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
StateSaveLocation=$dir/control
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,sched_min_interval=0,batch_sched_delay=0
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
END
export SLURM_CONF=$dir/slurm.conf
until_true 10 test -S "$dir/munge.socket" || die "munged does not start"
start slurmctld slurmctld -D
start slurmd slurmd -D
is_idle() { [ "$(sinfo --noheader --format=%T)" = idle ]; }
until_true 30 is_idle || die "no node comes up: $(sinfo 2>&1)"

# --- jobs -----------------------------------------------------------------------------------------------------------------

mkdir "$dir/jobs" "$dir/jobs/it's 100% full"
cd "$dir/jobs/it's 100% full" || exit 1
"$twinmesh" field "$scene" -o phi.####.vdb --quiet >/dev/null || die "no frames"
farm() { "$twinmesh" farm phi.####.vdb --chunks $chunks --format ply,glb "$@" 2>>"$dir/farm.log"; }
state_of() { scontrol --oneliner show job "$1" | grep -o ' JobState=[A-Z]*' | sort -u | cut -d= -f2; }
# A job sent again waits two minutes before it starts, which is lifted here.
is_over() { # ids
    local id
    for id in $(squeue --noheader --array --format='%A %r' --jobs="$1" 2>/dev/null | awk '$2 == "BeginTime" { print $1 }'); do
        scontrol update jobid="$id" starttime=now
    done
    [ -z "$(squeue --noheader --jobs="$1" 2>/dev/null)" ]
}
hashes() { sha256sum "$1".*.ply "$1".*.glb "$1".events.jsonl "$1".report.jsonl | sed "s/ $1\./ /"; }

send() { # prefix
    jobs=($(farm -o "$1" --submit)) || die "not taken"
    [ ${#jobs[@]} -eq 2 ] || die "no two numbers of jobs: ${jobs[*]}"
}

farm -o here --run 2 || die "the same without Slurm"
send sent
until_true 60 is_over "${jobs[0]},${jobs[1]}" || die "not over: $(squeue)"
[ "$(state_of "${jobs[1]}")" = COMPLETED ] || die "the stitching is $(state_of "${jobs[1]}")"
[ "$(hashes here)" = "$(hashes sent)" ] || die "other bytes: $(diff <(hashes here) <(hashes sent))"
frames=$(ls sent.geometric.*.ply | wc -l)
exact=$(grep -c '"wrong_components":0,' sent.report.jsonl)
[ "$frames" -eq 48 ] && [ "$exact" -eq 48 ] || die "of 48 frames $frames are there, $exact exact"
[ -f sent.farm/chunk.0008.log ] || die "no log of a chunk"
echo "$chunks chunks and the stitching done: the same bytes as without Slurm, $exact of 48 frames exact"

# Jobs wait at frame 21, which is a pipe, until they are killed; when they are started again it is a file.
pids_at_work() { # prefix
    local file
    for file in /proc/[0-9]*/cmdline; do
        { tr '\0' ' ' <"$file"; } 2>/dev/null | grep -q " farm --chunk [0-9]* .*$1.farm/plan.json" && basename "$(dirname "$file")"
    done
}
cp phi.0021.vdb whole.vdb
rm phi.0021.vdb
mkfifo phi.0021.vdb
send killed
waits() { [ -f killed.farm/chunk.0003.chunk ] && [ -f killed.farm/chunk.0004.state ] && [ -n "$(pids_at_work killed)" ]; }
until_true 60 waits || die "no chunk came to the pipe: $(squeue)"
victims=$(pids_at_work killed)
mv whole.vdb phi.0021.vdb
kill -KILL $victims
until_true 60 is_over "${jobs[0]},${jobs[1]}" || die "not over after a kill: $(squeue)"
[ "$(state_of "${jobs[1]}")" = COMPLETED ] || die "the stitching is $(state_of "${jobs[1]}") after a chunk was killed"
grep -q "going on after" killed.farm/chunk.*.log || die "no chunk went on where it was killed"
[ "$(hashes here)" = "$(hashes killed)" ] || die "other bytes after a kill: $(diff <(hashes here) <(hashes killed))"
echo "$(wc -w <<<"$victims") jobs killed: sent again, the same bytes"

echo damaged >phi.0021.vdb
send damaged
until_true 60 is_over "${jobs[0]},${jobs[1]}" || die "jobs are left waiting: $(squeue)"
[ "$(state_of "${jobs[1]}")" = CANCELLED ] || die "the stitching is $(state_of "${jobs[1]}") after a damaged frame"
grep -q "frame 0021" damaged.farm/chunk.0004.log || die "the log does not name the frame"
[ -z "$(ls damaged.* -d | grep -v farm)" ] || die "there are outputs: $(ls -d damaged.*)"
echo "a damaged frame: the chunks fail, the stitching is cancelled"
