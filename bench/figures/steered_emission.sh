#!/usr/bin/env bash
# Compares emission by power with emission steered by an importance pre-pass, for docs/images/steered-emission.png and the table
# of docs/results/results.md. It renders a corner of the flashlight's beam in the cloister, sixteen rooms of which one is
# visible, and many small lamps: illuminance by `photonmap` with both kinds of light read from maps, at increasing numbers of
# light paths, and by `progressive`, at increasing numbers of passes. The error is the relative MSE against two independent
# references by `path`, bias included, from which half of their difference, their own noise, is subtracted. The time is that of
# everything after reading the scene, pre-pass included.
# usage: bench/figures/steered_emission.sh [SCENE...]     default: beam rooms many-lights; into out/steered
# RESOLUTION, SPP (camera samples of the references), METHODS, PREPASS, PHOTONS, PASSES (lists) and SEEDS may be set before it.
# METHODS may include igi, at increasing numbers SETS of sets and of samples per pixel, as in igi_pre_pass.sh. PICTURE is the
# file to draw.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/steered
resolution=${RESOLUTION:-96x64}
spp=${SPP:-2048}
photons=${PHOTONS:-62500 250000 1000000}
passes=${PASSES:-4 16 64}
sets=${SETS:-4 16 64}
steering=${PREPASS:-65536}
methods=${METHODS:-photonmap progressive}
seeds=${SEEDS:-1 2 3}
picture=${PICTURE:-docs/images/steered-emission.png}
[ $# -gt 0 ] || set -- beam rooms many-lights
mkdir -p "$out" docs/images

# Makes the lamp and the cloister unless they exist.
beam() {
    [ -d scenes/cloister/mesh ] || bash scenes/make.sh cloister
    local lamp=scenes/lamps/flashlight
    [ -f "$lamp/flashlight.exr" ] || "$lucerna" light acquire "$lamp/rig-screen.toml" -o "$lamp/flashlight.exr" --quiet
}

for name in "$@"; do
    file=scenes/$name/$name.pbrt
    if [ "$name" = beam ]; then
        beam
        file=scenes/cloister/beam.pbrt
    fi
    common=("$file" --quiet --resolution "$resolution" --set quantity=illuminance)
    for seed in 101 102; do
        image=$out/$name-reference-$seed.exr
        [ -f "$image" ] || "$lucerna" render "${common[@]}" -o "$image" --integrator path --spp "$spp" --seed "$seed"
    done
    "$lucerna" compare "$out/$name-reference-101.exr" "$out/$name-reference-102.exr" --json "$out/$name-references.json" > /dev/null

    # shoot METHOD NUMBER ARGUMENT...: renders plainly and steered, with every seed
    shoot() {
        local method=$1 number=$2 prepass seed run reference
        shift 2
        for prepass in 0 "$steering"; do
            for seed in $seeds; do
                run=$out/$name-$method-$number-$prepass-$seed
                "$lucerna" render "${common[@]}" "$@" --set prepass="$prepass" --seed "$seed" -o "$run.exr" --stats "$run.json"
                for reference in 101 102; do
                    "$lucerna" compare "$run.exr" "$out/$name-reference-$reference.exr" --json "$run-$reference.json" > /dev/null
                done
                rm "$run.exr"
            done
        done
    }
    for method in $methods; do
        case $method in
        photonmap)
            for n in $photons; do
                shoot photonmap "$n" --integrator photonmap --spp 8 --set photons="$n" direct=map indirect=map radius=0.3
            done
            ;;
        progressive)
            for n in $passes; do
                shoot progressive "$n" --integrator progressive --passes "$n" --set photons=50000 direct=map
            done
            ;;
        igi)
            for n in $sets; do
                # shellcheck disable=SC2086  # IGI is a list of words
                shoot igi "$n" --integrator igi --spp "$n" --set nsets="$n" ${IGI:-}
            done
            ;;
        *)
            echo "METHODS: $method is none of photonmap progressive igi" >&2
            exit 1
            ;;
        esac
    done
done
/usr/bin/python3 bench/figures/steered_emission.py "$out" "$picture" "$@"
