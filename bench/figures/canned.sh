#!/usr/bin/env bash
# Draws docs/images/canned-error.png and docs/images/canned-aliasing.png and the tables of docs/results/optical-filter.md, of
# light fields with and without the optical filter. It takes a few minutes.
# usage: bench/figures/canned.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

csv=$(mktemp)
trap 'rm -f "$csv"' EXIT
cmake --build build/release --target figure_canned >/dev/null
build/release/bench/figure_canned >"$csv"
mkdir -p docs/images
/usr/bin/python3 bench/figures/canned.py "$csv" docs/images/canned-error.png docs/images/canned-aliasing.png
