#!/usr/bin/env bash
# Loading scenes, for docs/results/results.md: what reading costs by itself, and a scene loaded as the command does it, with the peak of
# its memory. CPU time of one thread throughout, so that other work on the machine counts little. About two minutes.
# usage: bench/figures/loading.sh [TRIANGLES]     default: 10000000, half as text and half as binary PLY
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

triangles=${1:-10000000}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

build/release/bench/lucerna_bench --benchmark_filter='^load/' --benchmark_repetitions=3 \
    --benchmark_report_aggregates_only=true 2>/dev/null | grep -E '^Benchmark|_median'

python3 bench/figures/loading_scene.py "$folder" "$triangles"
python3 bench/figures/loading_cost.py build/release/lucerna "$folder" "$triangles"
