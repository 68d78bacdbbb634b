#!/usr/bin/env bash
# Measures the five-times rule, for docs/images/five-times.png and the table of docs/explanation/near-and-far.md. It takes a few
# seconds.
# usage: bench/figures/five_times.sh [LED.tm25ray]     default: the measured LED of the shared data, if it is there
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

led=${1:-../shared/data/osram-ostar-green-100k.tm25ray}
[ -e "$led" ] || led=-
csv=$(mktemp)
trap 'rm -f "$csv"' EXIT
cmake --build build/release --target figure_five_times >/dev/null
build/release/bench/figure_five_times "$led" >"$csv"
mkdir -p docs/images
/usr/bin/python3 bench/figures/five_times.py "$csv" docs/images/five-times.png
