#!/usr/bin/env bash
# How the cost of a pixel grows with the number of virtual lights, 10 to a million, looked at one by one and drawn from a tree:
# docs/images/igi-scaling.svg. One set of lights in the cathedral; the same lights, light by light, for both. Time is that of
# the image alone per camera sample (making the lights and their tree is printed beside it). The error that a choice makes is
# the relative MSE between two renders of the same lights that differ in their camera samples alone, halved, less what a
# render of all of them with a shadow ray each would have: so noise of direct light and of the film is in both, and printed.
# usage: bench/figures/igi_scaling.sh               into out/igi-scaling
# RESOLUTION, SPP, LIGHTS (paths, powers of 2) and MOST_LOOP (paths) may be set before it. About ten minutes on two processors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/igi-scaling
resolution=${RESOLUTION:-60x75}
spp=${SPP:-16}
lights=${LIGHTS:-16 64 256 1024 4096 16384 65536 262144 2097152}
most_loop=${MOST_LOOP:-65536}
scene=scenes/cathedral/cathedral.pbrt
[ -d scenes/cathedral/mesh ] || bash scenes/make.sh cathedral
mkdir -p "$out" docs/images
rm -f "$out"/*.json

common=("$scene" --quiet --resolution "$resolution" --seed 1)
reference=$out/reference.exr
[ -f "$reference" ] || "$lucerna" render "${common[@]}" -o "$reference" --integrator igi --spp 256 --set nsets=1 \
    nlights=4194304 choice=tree treesamples=64 shadowrays=16
"$lucerna" render "${common[@]}" -o "$out/direct.exr" --integrator direct --spp "$spp" --stats "$out/direct.json"
for paths in $lights; do
    for choice in loop tree; do
        # Beyond, the loop's line is straight, and its last points would take an hour.
        if [ "$choice" = loop ] && [ "$paths" -gt "$most_loop" ]; then continue; fi
        run=$out/$choice-$paths
        "$lucerna" render "${common[@]}" -o "$run.exr" --integrator igi --spp "$spp" --stats "$run.json" \
            --set nsets=1 nlights="$paths" choice="$choice" treesamples=16 shadowrays=4
        "$lucerna" compare "$run.exr" "$reference" --json "$run-error.json" >/dev/null
    done
done
/usr/bin/python3 bench/figures/igi_scaling.py "$out" docs/images/igi-scaling.svg
