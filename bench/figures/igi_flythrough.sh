#!/usr/bin/env bash
# Renders a flythrough of 24 frames by `igi`, with one seed and with a new seed per frame, and measures how much static pieces
# of surface change between frames, large ones (0.5) and small ones (0.1), with figure_igi_flythrough: the flicker of
# docs/results/results.md and docs/images/igi-flythrough.svg, the course of three large pieces. It takes about five minutes on
# two cores.
# usage: bench/figures/igi_flythrough.sh [SCENE] [TRAVEL]
#     default: the rooms, "0.3 0 0.3" (scene units from the first frame to the last); into out/flythrough
# RESOLUTION, SPP, FRAMES, IGI (settings) may be set before it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

scene=${1:-scenes/rooms/rooms.pbrt}
travel=${2:-0.3 0 0.3}
out=out/flythrough
mkdir -p "$out" docs/images
cmake --build build/release --target figure_igi_flythrough >/dev/null
[ "$scene" != scenes/cathedral/cathedral.pbrt ] || [ -e scenes/cathedral/mesh ] || bash scenes/make.sh cathedral

# shellcheck disable=SC2086  # IGI is a list of words
build/release/bench/figure_igi_flythrough "$scene" "${RESOLUTION:-192x128}" "${SPP:-16}" "${FRAMES:-24}" "$travel" 0.5,0.1 \
    "$out/series.txt" ${IGI:-nsets=16 nlights=16}
/usr/bin/python3 bench/figures/igi_flythrough.py docs/images/igi-flythrough.svg "$out/series.txt"
