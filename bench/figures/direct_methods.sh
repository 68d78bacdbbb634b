#!/usr/bin/env bash
# Direct light four ways on four scenes, time against error: docs/images/direct-methods.png and the tables of docs/results.md.
# Each method renders direct light alone at growing numbers of samples; `map` gets more photons with them. The error is the
# relative MSE against two independent long references by `direct`; half of what those two differ by is their own noise
# and is taken off. The time is everything after the scene was read: photons, index, guide, image.
# usage: bench/figures/direct_methods.sh [SCENE...]     default: flashlight projector many-lights cornell; into out/direct
# RESOLUTION, SPP (a list), REFERENCE (samples of each reference) and METHODS may be set before it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/direct
resolution=${RESOLUTION:-240x160}
spp=${SPP:-1 2 4 8 16 32 64 128}
reference=${REFERENCE:-4096}
methods=${METHODS:-mc candidates map gated guided tree both}
[ $# -gt 0 ] || set -- flashlight projector many-lights cornell
mkdir -p "$out" docs/images

# lamp NAME: measured on its virtual rig if it is not there
lamp() {
    local folder=scenes/lamps/$1 rig=rig.toml
    [ ! -f "$folder/$1.exr" ] || return 0
    [ "$1" = flashlight ] && rig=rig-screen.toml
    if [ -f "$folder/make.py" ]; then python3 "$folder/make.py"; fi
    "$lucerna" light acquire "$folder/$rig" -o "$folder/$1.exr" --quiet
}

for name in "$@"; do
    quantity=radiance
    case $name in
        flashlight | projector)
            [ -d scenes/cloister/mesh ] || bash scenes/make.sh cloister
            lamp "$name"
            file=scenes/cloister/by-$name.pbrt ;;
        *)  # Lamps that are seen are small and bright: at their rims all methods have the same noise, and only that.
            quantity=illuminance
            file=scenes/$name/$name.pbrt ;;
    esac
    common=("$file" --quiet --resolution "$resolution")
    for seed in 101 102; do
        image=$out/$name-reference-$seed.exr
        [ -f "$image" ] || "$lucerna" render "${common[@]}" -o "$image" --integrator direct --set quantity="$quantity" \
            --spp "$reference" --seed "$seed"
    done
    "$lucerna" compare "$out/$name-reference-101.exr" "$out/$name-reference-102.exr" --json "$out/$name-references.json"
    for method in $methods; do
        for n in $spp; do
            run=$out/$name-$method-$n
            set_=(quantity="$quantity" indirect=none)
            case $method in
                # The plain choice with guided's several candidates for one shadow ray: what the guide itself adds to that.
                candidates) set_+=(direct=guided guidefloor=1 lights=power) ;;
                tree) set_+=(direct=mc lights=tree) ;;
                both) set_+=(direct=guided lights=tree) ;;
                map) set_+=(direct=map photons=$((62500 * n)) k=50) ;;
                *) set_+=(direct="$method" lights=power) ;;
            esac
            "$lucerna" render "${common[@]}" -o "$run.exr" --integrator photonmap --spp "$n" --stats "$run.json" --set "${set_[@]}"
            for seed in 101 102; do
                "$lucerna" compare "$run.exr" "$out/$name-reference-$seed.exr" --json "$run-$seed.json"
            done
        done
    done
done
/usr/bin/python3 bench/figures/direct_methods.py "$out" docs/images/direct-methods.png "$@"
