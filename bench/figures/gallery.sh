#!/usr/bin/env bash
# The pictures of docs/gallery.md: makes what the scenes need, renders each, scales none. About fifteen minutes on two cores.
# The settings beside each name are all there is to say about a picture.
# usage: bench/figures/gallery.sh [NAME...]     default: all; into out/gallery
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/gallery
mkdir -p "$out"

# picture NAME SIZE EXPOSURE ARGUMENT...: out/gallery/NAME.png
picture() {
    local name=$1 size=$2 exposure=$3
    shift 3
    [[ " $wanted " == *" $name "* ]] || return 0
    local scene=scenes/$name/$name.pbrt
    [ "$name" = zoom-flashlight ] && scene=scenes/cloister/by-zoom-flashlight.pbrt
    echo "== $name: --resolution $size --exposure $exposure $*"
    "$lucerna" render "$scene" -o "$out/$name.exr" --png --quiet --stats "$out/$name.json" \
        --resolution "$size" --exposure "$exposure" "$@"
    python3 -c "import json,sys; s=json.load(open(sys.argv[1])); print('   %.0f s' % s['seconds']['total'])" "$out/$name.json"
}

wanted="${*:-cloister zoom-flashlight watch shade stadium projector office cathedral cornell cornell-caustic}"
for name in $wanted; do
    case $name in
        zoom-flashlight) bash scenes/make.sh cloister lamps/zoom-flashlight ;;
        shade) bash scenes/make.sh shade ;;
        *) if [ -f "scenes/$name/make.py" ]; then bash scenes/make.sh "$name"; fi ;;
    esac
done

picture watch 640x480 -0.7 --integrator path --spp 96 --colour-space acescg
picture zoom-flashlight 640x427 -1.5 --integrator igi --spp 16 --set nlights=256 nsets=16
picture shade 480x480 -0.5 --integrator igi --spp 32 --set nlights=256 nsets=16
picture cloister 640x427 -3 --integrator photonmap --spp 16 --set photons=1000000 gatherrays=4 radius=0.35
picture stadium 640x400 0 --integrator path --spp 64
picture projector 640x420 0.3 --integrator path --spp 144
picture office 400x225 -7.6 --integrator igi --spp 16 --set nlights=256 nsets=16
picture cathedral 400x500 -0.8 --integrator photonmap --spp 24 --set photons=2000000 gatherrays=2 radius=1
picture cornell 400x400 0 --integrator path --spp 128
picture cornell-caustic 400x400 0 --integrator photonmap --spp 16 --set photons=1000000 gatherrays=4
