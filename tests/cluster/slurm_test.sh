#!/usr/bin/env bash
# The job scripts of docs/howto/cluster under a real Slurm, of three nodes on this machine (scripts/slurm.sh): by hand or nightly.
# usage: tests/cluster/slurm_test.sh LUCERNA [--mpi] [--logs FOLDER]
#   LUCERNA         the built command, as build/release/lucerna
#   --mpi           also one MPI job, started by srun and by mpirun; LUCERNA must be built with MPI
#   --logs FOLDER   keeps the logs of daemons and jobs there
# An array of four parts, of which one is put back into the queue while it renders, one loses its node, and one reaches its time limit,
# and the job that merges them, have the bits of one render that nothing disturbs. Three minutes on two cores.
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

# Under scripts/slurm.sh, which starts this script again.
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
    if [ -n "$logs" ]; then mkdir -p "$logs" && cp "$folder"/*.log "$logs/" 2>/dev/null || true; fi
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

options=(--resolution 64x48 --spp 8192 --seed 5)
echo "== one render, the reference"
lucerna render "$scene" "${options[@]}" --no-adaptive --quiet -o whole.exr

echo "== an array of four parts"
array=$(sbatch --parsable --array=1-4 --cpus-per-task=1 "$jobs/array.sbatch" 4 "$scene" out "${options[@]}" --checkpoint-every 1s)
merge=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --cpus-per-task=1 \
    "$jobs/merge.sbatch" 4 out merged.exr)
until_true 60 "the checkpoint of part 1" test -s out/part1.checkpoint
until_true 60 "the checkpoint of part 2" test -s out/part2.checkpoint
squeue
scontrol requeue "${array}_1"
node=$(squeue --noheader --array --job "${array}_2" --format %N)
scontrol update NodeName="$node" State=DOWN Reason="a node that fails"
squeue
sleep 8
squeue
scontrol update NodeName="$node" State=RESUME
squeue
ended() { [ -z "$(squeue --noheader --job "$1" 2>/dev/null)" ]; }
until_true 240 "the end of the merge" ended "$merge"
scontrol show job "$array"; scontrol show job "$merge"
tail -n 100 *.log
expect_same_pixels merged.exr whole.exr
