#!/usr/bin/env bash
# Measures the cost of indirect light by virtual point lights: the cathedral at 16 samples per pixel by `direct` (one light
# sample and one BSDF sample per camera sample, mirrors followed) and by `igi` with 16 sets, alternating, and the share that igi
# adds to the time of all phases (scene read, virtual point lights, image). Then measures the error against a path-traced
# reference for igi, final gather and the path tracer, each at its own time; error times seconds gives the error at equal time.
# usage: bench/figures/igi_cost.sh [ROUNDS]          default: 3; into out/igi-cost
# RESOLUTION, SPP, REFERENCE (samples of the reference) may be set before it. It takes about five minutes on two processors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/igi-cost
rounds=${1:-3}
resolution=${RESOLUTION:-240x300}
spp=${SPP:-16}
samples=${REFERENCE:-1024}
scene=scenes/cathedral/cathedral.pbrt
[ -d scenes/cathedral/mesh ] || bash scenes/make.sh cathedral
mkdir -p "$out"

# shoot NAME ROUND ARGUMENT...: renders one image
shoot() {
    local run=$out/$1-$2
    shift 2
    "$lucerna" render "$scene" --quiet --resolution "$resolution" -o "$run.exr" --stats "$run.json" "$@"
}

reference=$out/reference-1.exr
[ -f "$reference" ] || shoot reference 1 --integrator path --spp "$samples" --seed 77 --set maxdepth=0
for round in $(seq "$rounds"); do
    igi=(--spp "$spp" --seed "$round" --integrator igi --set nsets=16)
    shoot direct "$round" --integrator direct --spp "$spp" --seed "$round"
    shoot igi-few "$round" "${igi[@]}" --set nlights=4  # about ten lights per set, as [Pharr 2004]
    shoot igi "$round" "${igi[@]}"                                # the defaults
    shoot igi-one-ray "$round" "${igi[@]}" --set shadowrays=1
    shoot igi-all-rays "$round" "${igi[@]}" --set shadowrays=0
    shoot igi-note "$round" "${igi[@]}" --set rrthreshold=0.0767  # roulette by a threshold [cd/m²], as [Pharr 2004]
    shoot gather "$round" --integrator photonmap --spp "$spp" --seed "$round" --set photons=500000 gatherrays=1
    shoot path "$round" --integrator path --spp "$spp" --seed "$round" --set maxdepth=0
done
for run in direct igi-few igi igi-one-ray igi-all-rays igi-note gather path; do
    "$lucerna" compare "$out/$run-1.exr" "$reference" --json "$out/$run-error.json" >/dev/null
done
/usr/bin/python3 bench/figures/igi_cost.py "$out" "$rounds"
