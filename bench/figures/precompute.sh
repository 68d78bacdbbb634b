#!/usr/bin/env bash
# Compares final gather with and without precomputed irradiance: the time to the same relative MSE against `path`.
# usage: bench/figures/precompute.sh [SCENE...]     default: cornell cornell-caustic cloister; into out/precompute
# RESOLUTION, REFERENCE (samples per pixel of the path-traced image) and SAMPLES (a list) may be set before it; an existing
# reference image is reused. Run nothing else meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/precompute
resolution=${RESOLUTION:-192x128}
reference=${REFERENCE:-4096}
samples=${SAMPLES:-1 4 16 64}
[ $# -gt 0 ] || set -- cornell cornell-caustic cloister
mkdir -p "$out"

for name in "$@"; do
    scene=scenes/$name/$name.pbrt
    if [ "$name" = cloister ] && [ ! -d scenes/cloister/mesh ]; then bash scenes/make.sh cloister; fi
    truth=$out/$name-path-$resolution-$reference.exr
    if [ ! -f "$truth" ]; then
        echo "== $name: path, $reference samples per pixel" >&2
        "$lucerna" render "$scene" -o "$truth" --quiet --integrator path --resolution "$resolution" --spp "$reference"
    fi
    rm -f "$out/$name.csv"
    for precompute in 4 0; do
        for spp in $samples; do
            image=$out/$name-$precompute-$spp
            "$lucerna" render "$scene" -o "$image.exr" --quiet --integrator photonmap --resolution "$resolution" --spp "$spp" \
                --stats "$image.json" --set precompute=$precompute ${SETTINGS:-}
            "$lucerna" compare "$image.exr" "$truth" --json "$image-error.json" >/dev/null || true
            echo "$precompute,$spp,$image" >>"$out/$name.csv"
        done
    done
    echo "== $name"
    /usr/bin/python3 bench/figures/precompute.py "$out/$name.csv"
done
