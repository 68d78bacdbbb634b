#!/usr/bin/env bash
# Measures the bias that the metric of photon distances causes: docs/images/metric-bias.png, docs/images/metric-corner.png and
# the tables. It takes half a minute.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --build build/release --target figure_metric_bias >/dev/null
build/release/bench/figure_metric_bias >"$work/means.csv"
build/release/bench/figure_metric_bias corner >"$work/corner.csv"
mkdir -p docs/images
/usr/bin/python3 bench/figures/metric_bias.py "$work/means.csv" "$work/corner.csv" docs/images/metric-bias.png docs/images/metric-corner.png
