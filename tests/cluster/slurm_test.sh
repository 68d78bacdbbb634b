#!/usr/bin/env bash
# Tests the job scripts of docs/howto/cluster under a real Slurm with three nodes on this machine (scripts/slurm.sh), by hand or nightly.
# usage: tests/cluster/slurm_test.sh LUCERNA [--mpi] [--logs FOLDER]
#   LUCERNA         the built command, such as build/release/lucerna
#   --mpi           also one MPI job on all nodes; LUCERNA must be built with MPI
#   --logs FOLDER   keeps the logs of daemons and jobs there
# An array of four parts gives the same bits as one undisturbed render, although one part is requeued while it renders, one loses its
# node, and one gets the signal that precedes a time limit; a job that waits for all of them merges them. It takes a minute on two cores.
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

mpi=0 logs="" lucerna=""
while [ $# -gt 0 ]; do
    case $1 in
        --mpi) mpi=1 && shift ;;
        --logs) logs=$(realpath -m "${2:?}") && shift 2 ;;
        -*) sed -n '3s/^# //p' "$0" >&2 && exit 2 ;;
        *) lucerna=$(realpath "$1") && shift ;;
    esac
done
[ -x "$lucerna" ] || { sed -n '3s/^# //p' "$0" >&2 && exit 2; }

# Starts this script again under scripts/slurm.sh.
if [ -z "${LUCERNA_SLURM_TEST:-}" ]; then
    words=("$lucerna")
    [ "$mpi" -eq 0 ] || words+=(--mpi)
    [ -z "$logs" ] || words+=(--logs "$logs")
    export LUCERNA_SLURM_TEST=1
    exec bash "$repository/scripts/slurm.sh" --nodes 3 --cpus 1 ${logs:+--logs "$logs"} bash "$0" "${words[@]}"
fi

jobs=$repository/docs/howto/cluster scene=$repository/scenes/cornell/cornell.pbrt
folder=$(mktemp -d)
leave() {
    local code=$?
    set +e
    [ -z "$logs" ] || { mkdir -p "$logs" && cp "$folder"/*.log "$logs/"; }
    rm -rf "$folder"
    exit "$code"
}
trap leave EXIT
cd "$folder"
PATH=$(dirname "$lucerna"):$PATH
export PATH

fail() {
    echo "failed: $*" >&2
    tail -n 20 ./*.log >&2
    exit 1
}
expect_same_pixels() { # IMAGE IMAGE
    PYTHONPATH=$repository/bench/figures python3 - "$@" <<'END' || fail "$1 and $2 differ"
import sys
from pathlib import Path
from image_hashes import pixels_of
sys.exit(pixels_of(Path(sys.argv[1])) != pixels_of(Path(sys.argv[2])))
END
}
waits() { [ "$(squeue --noheader --array --job "$1" --format %T)" = PENDING ]; }
ended() { [ -z "$(squeue --noheader --job "$1" 2>/dev/null)" ]; }
state() { scontrol show job "$1" --oneliner | grep -o 'JobState=[A-Z_]*' | cut -d= -f2; } # JOB
until_true() { # SECONDS WHAT COMMAND...
    local seconds=$1 what=$2
    shift 2
    for ((tenth = 0; tenth < 10 * seconds; ++tenth)); do
        ! "$@" || return 0
        sleep 0.1
    done
    fail "$what: not within $seconds s"
}

options=(--resolution 64x48 --spp 4096 --seed 5 --no-adaptive)
echo "== one render"
lucerna render "$scene" "${options[@]}" --quiet -o whole.exr

echo "== an array of four parts, and their merge"
array=$(sbatch --parsable --array=1-4 --cpus-per-task=1 "$jobs/array.sbatch" 4 "$scene" out "${options[@]}" --checkpoint-every 1s)
merge=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --cpus-per-task=1 "$jobs/merge.sbatch" 4 out merged.exr)
for part in 1 2 3; do until_true 60 "the checkpoint of part $part" test -s "out/part$part.checkpoint"; done
squeue
echo "-- part 1 is put back into the queue; the node of part 2 fails; part 3 gets the signal that goes before a time limit"
node=$(squeue --noheader --array --job "${array}_2" --format %N)
scontrol requeue "${array}_1"
scontrol update NodeName="$node" State=DOWN Reason="a node that fails"
scancel --signal=TERM "${array}_3"
for part in 1 2 3; do until_true 60 "part $part waiting again" waits "${array}_$part"; done
squeue
# The node may have returned by itself.
scontrol update NodeName="$node" State=RESUME 2>/dev/null || true
until_true 300 "the end of the merge" ended "$merge"
[ "$(state "$merge")" = COMPLETED ] || fail "the merge: $(state "$merge")"
for part in 1 2 3; do
    grep -q '^resumed: ' "lucerna-$array-$part.log" || fail "part $part did not go on from its checkpoint"
done
expect_same_pixels merged.exr whole.exr

if [ "$mpi" -eq 1 ]; then
    echo "== one MPI job on three nodes, which gets the signal, too"
    job=$(sbatch --parsable --nodes=3 --cpus-per-task=1 "$jobs/mpi.sbatch" "$scene" mpi.exr "${options[@]}" --checkpoint-every 1s)
    until_true 60 "the checkpoint" test -s mpi.exr.checkpoint
    squeue
    scancel --signal=TERM "$job"
    until_true 60 "the job waiting again" waits "$job"
    squeue
    until_true 300 "the end of the MPI job" ended "$job"
    [ "$(state "$job")" = COMPLETED ] || fail "the MPI job: $(state "$job")"
    # Only rank 0 prints, both before and after the requeue.
    log=lucerna-mpi-$job.log
    [ "$(grep -c '^image  ' "$log")" -eq 2 ] || fail "not one process in each of two turns wrote the image"
    [ "$(grep -c '^resumed: ' "$log")" -eq 1 ] || fail "the job did not go on from its checkpoint"
    expect_same_pixels mpi.exr whole.exr
else
    echo "== the MPI job is left out: --mpi was not given"
fi
echo "== all have the same bits"
