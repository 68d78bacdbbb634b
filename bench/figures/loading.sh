#!/usr/bin/env bash
# Measures scene loading, for docs/results/results.md: the cost of reading alone, and a scene loaded as by the command, with its
# peak memory. Times are CPU times of one thread, so that other load on the machine matters little. It takes about two minutes.
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
