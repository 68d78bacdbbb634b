#!/usr/bin/env bash
# Measures how the cost of indirect light grows with the number of virtual point lights, 10 to a million, evaluated one by one
# or drawn from a tree: docs/images/igi-scaling.svg, and the slopes. It uses places that the camera sees in the cathedral. It
# takes about three minutes on two processors, two of them for the loop's last points.
# usage: bench/figures/igi_scaling.sh [PLACES]        default: 512; into out/igi-scaling
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

[ -d scenes/cathedral/mesh ] || bash scenes/make.sh cathedral
mkdir -p out/igi-scaling docs/images
cmake --build build/release --target figure_igi_scaling >/dev/null
build/release/bench/figure_igi_scaling scenes/cathedral/cathedral.pbrt "${1:-512}" | tee out/igi-scaling/numbers.txt
/usr/bin/python3 bench/figures/igi_scaling.py out/igi-scaling/numbers.txt docs/images/igi-scaling.svg
