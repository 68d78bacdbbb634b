#!/usr/bin/env bash
# Renders the pictures of docs/results/gallery.md: makes what the scenes need and renders each in the time beside its name, with
# the chosen method, denoiser and automatic exposure unless stated otherwise. It takes fifteen minutes on two cores.
# usage: bench/figures/gallery.sh [NAME...]     default: all; into out/gallery
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/gallery
mkdir -p "$out"

# picture NAME SIZE TIME ARGUMENT...: renders out/gallery/NAME.png
picture() {
    local name=$1 size=$2 time=$3
    shift 3
    [[ " $wanted " == *" $name "* ]] || return 0
    local scene=scenes/$name/$name.pbrt
    [ "$name" = zoom-flashlight ] && scene=scenes/cloister/by-zoom-flashlight.pbrt
    echo "== $name: --resolution $size --time $time $*"
    "$lucerna" render "$scene" -o "$out/$name.exr" --png --resolution "$size" --time "$time" "$@" | grep -E '^(method|image|picture) '
}

wanted="${*:-cloister zoom-flashlight watch shade stadium projector office cathedral cornell cornell-caustic}"
for name in $wanted; do
    case $name in
        zoom-flashlight) bash scenes/make.sh cloister lamps/zoom-flashlight ;;
        shade) bash scenes/make.sh shade ;;
        *) if [ -f "scenes/$name/make.py" ]; then bash scenes/make.sh "$name"; fi ;;
    esac
done

picture watch 1280x960 120s --colour-space acescg
picture cloister 1280x854 60s
picture zoom-flashlight 1280x854 60s --exposure 0
picture shade 1000x1000 120s --integrator igi --set gathersamples=1 nsets=256
picture stadium 1280x800 120s
picture projector 1280x840 120s
picture office 1280x800 120s
picture cathedral 1024x1280 120s
picture cornell 1024x1024 60s
picture cornell-caustic 1024x1024 60s
