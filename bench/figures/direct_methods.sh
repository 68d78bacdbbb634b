#!/usr/bin/env bash
# Compares four methods for direct light on four scenes, time against error, for docs/images/direct-methods.png and the tables
# of docs/results/results.md. Each method renders direct light alone at increasing numbers of samples, with two seeds; `map`
# gets more photons with them. The error is the relative MSE against two independent references, from which half of their
# difference, their own noise, is subtracted. References are made by `guided`, which has the least noise;
# tests/reference/direct_methods_test.cpp checks it against `path`, and the tables show each method's mean relative to theirs.
# The time is that of everything after reading the scene: photons, index, guide, image.
# usage: bench/figures/direct_methods.sh [SCENE...]     default: flashlight projector many-lights cornell; into out/direct
# RESOLUTION, SPP (a list), REFERENCE (samples of each reference) and METHODS may be set before it. It takes about ten minutes
# on two processors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/direct
resolution=${RESOLUTION:-180x120}
spp=${SPP:-1 4 16 64}
reference=${REFERENCE:-1024}
methods=${METHODS:-mc map gated guided}
[ $# -gt 0 ] || set -- flashlight projector many-lights cornell
mkdir -p "$out" docs/images

# lamp NAME: acquires the lamp on its virtual rig unless it exists
lamp() {
    local folder=scenes/lamps/$1 rig=rig.toml
    [ ! -f "$folder/$1.exr" ] || return 0
    [ "$1" = flashlight ] && rig=rig-screen.toml
    if [ -f "$folder/make.py" ]; then python3 "$folder/make.py"; fi
    "$lucerna" light acquire "$folder/$rig" -o "$folder/$1.exr" --quiet
}

# run METHOD SAMPLES SEED: renders into out/direct/SCENE-METHOD-SAMPLES-SEED
run() {
    local method=$1 n=$2 seed=$3 run=$out/$name-$1-$2-$3
    local set_=(quantity="$quantity" indirect=none)
    case $method in
        map) set_+=(direct=map photons=$((62500 * n)) k=50) ;;
        *) set_+=(direct="$method") ;;
    esac
    "$lucerna" render "${common[@]}" -o "$run.exr" --integrator photonmap --spp "$n" --seed "$seed" --stats "$run.json" \
        --set "${set_[@]}"
    for against in 101 102; do
        "$lucerna" compare "$run.exr" "$out/$name-reference-$against.exr" --json "$run-$against.json" > /dev/null
    done
}

for name in "$@"; do
    quantity=radiance
    case $name in
        flashlight | projector)
            [ -d scenes/cloister/mesh ] || bash scenes/make.sh cloister
            lamp "$name"
            file=scenes/cloister/by-$name.pbrt ;;
        *)  # Visible lamps are small and bright, and at their rims all methods have the same dominating noise.
            quantity=illuminance
            file=scenes/$name/$name.pbrt ;;
    esac
    common=("$file" --quiet --resolution "$resolution")
    for seed in 101 102; do
        image=$out/$name-reference-$seed.exr
        [ -f "$image" ] || "$lucerna" render "${common[@]}" -o "$image" --integrator photonmap --spp "$reference" --seed "$seed" \
            --set quantity="$quantity" indirect=none direct=guided
    done
    "$lucerna" compare "$out/$name-reference-101.exr" "$out/$name-reference-102.exr" --json "$out/$name-references.json" > /dev/null
    for method in $methods; do
        for n in $spp; do
            for seed in 1 2; do run "$method" "$n" "$seed"; done
        done
    done
done
/usr/bin/python3 bench/figures/direct_methods.py "$out" docs/images/direct-methods.png "$@"
