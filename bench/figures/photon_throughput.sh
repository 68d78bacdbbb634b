#!/usr/bin/env bash
# Measures photon paths, rays and deposits per second and core in the cloister, beside Embree alone on the same rays, and the
# benefit of a second thread, for the table of docs/results/results.md. It takes about two minutes on a quiet machine.
# usage: bench/figures/photon_throughput.sh [PATHS] [ROUNDS]       default: 1000000 9
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

cmake --build build/release --target lucerna figure_photon_throughput >/dev/null
[ -e scenes/cloister/mesh ] || scenes/make.sh cloister
scenes=(scenes/cloister/cloister.pbrt)
for lamp in flashlight projector; do
    # Lamps of scenes/lamps take longer to make than this measurement; bench/figures/lamps.sh makes them.
    if [ -e "scenes/lamps/$lamp/$lamp.exr" ]; then scenes+=("scenes/cloister/by-$lamp.pbrt"); fi
done
build/release/bench/figure_photon_throughput "${1:-1000000}" "${2:-9}" "${scenes[@]}"
