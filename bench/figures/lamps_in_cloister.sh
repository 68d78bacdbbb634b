#!/usr/bin/env bash
# Renders the paper's lamps in the cloister: each is acquired on its virtual rig, then rendered by photonmap and by path, and
# the two are compared. The paper's own times ([Goesele 2003, 6]) are in docs/explanation/light-fields.md.
# usage: bench/figures/lamps_in_cloister.sh [LAMP...]     default: flashlight bike-light three-led projector; into out/cloister
# RESOLUTION and SPP (of photonmap; path takes 16 times as many) may be set before it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/cloister
resolution=${RESOLUTION:-360x240}
spp=${SPP:-16}
[ $# -gt 0 ] || set -- flashlight bike-light three-led projector
mkdir -p "$out"
[ -d scenes/cloister/mesh ] || bash scenes/make.sh cloister

seconds() { python3 -c "import json,sys; print('%.1f s' % json.load(open(sys.argv[1]))['seconds']['total'])" "$1"; }

for name in "$@"; do
    lamp=scenes/lamps/$name/$name.exr
    if [ ! -f "$lamp" ]; then
        rig=scenes/lamps/$name/rig.toml
        [ "$name" = flashlight ] && rig=scenes/lamps/$name/rig-screen.toml
        if [ -f "scenes/lamps/$name/make.py" ]; then python3 "scenes/lamps/$name/make.py"; fi
        "$lucerna" light acquire "$rig" -o "$lamp" --quiet
    fi
    case $name in
        projector) exposure=-6 ;;
        flashlight | three-led) exposure=-1 ;;
        *) exposure=-2.5 ;;
    esac
    echo "== $name"
    rm -f "${lamp%.exr}.cells"
    for method in photonmap path; do
        samples=$spp
        [ "$method" = path ] && samples=$((16 * spp))
        "$lucerna" render "scenes/cloister/by-$name.pbrt" -o "$out/$name-$method.exr" --png --quiet --integrator "$method" \
            --resolution "$resolution" --spp "$samples" --exposure "$exposure" --stats "$out/$name-$method.json"
        echo "$method, $samples samples per pixel: $(seconds "$out/$name-$method.json")"
    done
    "$lucerna" compare "$out/$name-photonmap.exr" "$out/$name-path.exr" || true
done
