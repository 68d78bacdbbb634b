#!/usr/bin/env bash
# A cluster on this machine: Slurm with one machine posing as several nodes, for as long as a command runs.
# usage: scripts/slurm.sh [--nodes N] [--cpus C] [--logs FOLDER] COMMAND [ARGUMENT...]
#   --nodes N       how many nodes, node1 ... nodeN, 4 unless told; a partition "local" of all of them
#   --cpus C        how many processors each says it has, 2 unless told (what the machine has is not asked)
#   --logs FOLDER   keeps the configuration, the daemons' logs and the list of jobs that ended there
# The command runs with SLURM_CONF set, so that sbatch, srun, squeue and scancel in it speak to this cluster and to no
# other. When it has ended, this waits until no job is queued or running, and stops every daemon; when it failed
# or is interrupted, jobs are cancelled. The exit code is the command's.
# Installs what is missing (scripts/deps.sh slurm). No accounting database, no
# cgroups, no systemd: it runs in a container, as root or as any user.
set -euo pipefail

usage() {
    sed -n '3s/^# //p' "$0" >&2
    exit 2
}

nodes=4 cpus=2 logs=""
while [ $# -gt 0 ]; do
    case $1 in
        --nodes) nodes=${2:?} && shift 2 ;;
        --cpus) cpus=${2:?} && shift 2 ;;
        --logs) logs=${2:?} && shift 2 ;;
        -h | --help) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" && exit ;;
        -*) usage ;;
        *) break ;;
    esac
done
[ $# -gt 0 ] || usage

bash "$(dirname "${BASH_SOURCE[0]}")/deps.sh" slurm
export PATH="$PATH:/usr/sbin"

folder=$(mktemp -d "${TMPDIR:-/tmp}/slurm.XXXXXX")
daemons=()
command=""

running_jobs() { timeout 20 squeue --noheader --format '%i' 2>/dev/null; }

# Stops what this script started, by its process ids, whatever happens before.
stop() {
    local code=$? alive pid left second
    trap '' INT TERM HUP
    trap - EXIT
    set +e
    [ -z "$command" ] || kill -TERM "$command" 2>/dev/null
    local jobs
    mapfile -t jobs < <(running_jobs)
    if [ ${#jobs[@]} -gt 0 ]; then
        echo "slurm.sh: cancelling ${#jobs[@]} jobs" >&2
        timeout 20 scancel "${jobs[@]}"
        for _ in $(seq 100); do
            [ -n "$(running_jobs)" ] || break
            sleep 0.2
        done
    fi
    # The last started is stopped first: nodes, controller, munge.
    for ((i = ${#daemons[@]} - 1; i >= 0; --i)); do kill -TERM "${daemons[i]}" 2>/dev/null; done
    for _ in $(seq 50); do
        alive=0
        for pid in "${daemons[@]}"; do ! kill -0 "$pid" 2>/dev/null || alive=1; done
        [ "$alive" -eq 1 ] || break
        sleep 0.2
    done
    for pid in "${daemons[@]}"; do ! kill -KILL "$pid" 2>/dev/null || echo "slurm.sh: $pid had to be killed" >&2; done
    wait "${daemons[@]}" 2>/dev/null
    # Steps outlive the daemons, as they should on a cluster. All of them, and their processes, have this cluster's configuration.
    export -n SLURM_CONF
    for second in 0 1 2; do
        mapfile -t left < <(grep -lsxz "SLURM_CONF=$folder/slurm.conf" /proc/[0-9]*/environ | cut -d/ -f3)
        [ ${#left[@]} -gt 0 ] || break
        [ "$second" -lt 2 ] || kill -KILL "${left[@]}" 2>/dev/null
        sleep 1
    done
    [ ${#left[@]} -eq 0 ] || echo "slurm.sh: ${#left[@]} processes were left and had to be killed" >&2
    if [ -n "$logs" ]; then
        mkdir -p "$logs"
        cp "$folder"/*.log "$folder"/slurm.conf "$folder"/jobs.txt "$logs/" 2>/dev/null
    fi
    rm -rf "$folder"
    exit "$code"
}
trap stop EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

start() { # NAME COMMAND...: a daemon in the foreground of a process of its own
    local name=$1
    shift
    "$@" >"$folder/$name.out" 2>&1 </dev/null &
    daemons+=($!)
}
wait_for() { # WHAT COMMAND...
    local what=$1
    shift
    for _ in $(seq 150); do
        ! "$@" >/dev/null 2>&1 || return 0
        sleep 0.2
    done
    echo "slurm.sh: $what; the ends of the logs:" >&2
    tail -n 15 "$folder"/*.out >&2
    exit 1
}
# Chooses unused ports below the range from which the kernel takes ports for outgoing connections.
free_ports() {
    local port=$((20000 + RANDOM % 10000)) found=0
    while [ "$found" -lt "$1" ]; do
        if ! (: <"/dev/tcp/127.0.0.1/$port") 2>/dev/null; then
            echo "$port"
            found=$((found + 1))
        fi
        port=$((port + 1))
    done
}

user=$(id -un)
host=$(hostname -s)
mapfile -t ports < <(free_ports $((nodes + 1)))
(umask 077 && head -c 1024 /dev/urandom >"$folder/munge.key")
chmod 755 "$folder"

cat >"$folder/slurm.conf" <<END
ClusterName=local
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports[0]}
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
CryptoType=crypto/munge
# A job that is requeued may start again when its credential has expired: seconds, for 120.
AuthInfo=socket=$folder/munge.socket,cred_expire=5
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool.%n
# PMIx keeps a folder for each step there, which two nodes cannot share.
TmpFS=$folder/tmp.%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/%n.log
# The cluster uses neither control groups nor a database.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$folder/jobs.txt
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
# The nodes report these numbers, not those of the machine.
SlurmdParameters=config_overrides
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=1,sched_interval=2,sched_min_interval=100000
MinJobAge=3600
KillWait=5
ReturnToService=2
JobRequeue=1
END
for ((node = 1; node <= nodes; ++node)); do
    mkdir "$folder/spool.node$node" "$folder/tmp.node$node"
    echo "NodeName=node$node NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[node]} CPUs=$cpus"
done >>"$folder/slurm.conf"
echo "PartitionName=local Nodes=ALL Default=YES State=UP MaxTime=INFINITE" >>"$folder/slurm.conf"
export SLURM_CONF="$folder/slurm.conf"
mkdir "$folder/state"

start munged munged --foreground --socket="$folder/munge.socket" --key-file="$folder/munge.key" --seed-file="$folder/munge.seed" \
    --pid-file="$folder/munge.pid" --num-threads=2 --force
wait_for "munged does not answer" munge --socket="$folder/munge.socket" --no-input
start slurmctld slurmctld -D -c
wait_for "slurmctld does not answer" scontrol ping
for ((node = 1; node <= nodes; ++node)); do start "node$node" slurmd -D -N "node$node"; done
all_idle() { [ "$(sinfo --noheader --Node --format '%T' | grep -cx idle)" -eq "$nodes" ]; }
wait_for "not every node is idle" all_idle

# The command gets this script's standard input, which a shell does not give to background processes by
# default.
"$@" <&0 &
command=$!
code=0
wait "$command" || code=$?
command=""
[ "$code" -eq 0 ] || exit "$code"
while [ -n "$(running_jobs)" ]; do sleep 0.5; done
