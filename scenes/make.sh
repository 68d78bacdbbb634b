#!/usr/bin/env bash
# Makes what the scenes need and git does not keep: meshes and pictures by each scene's make.py, lamps by `lucerna light`.
# usage: scenes/make.sh [SCENE...]     default: all that have something to make. What is there is made anew.
# The lamps need build/release/lucerna; without it they are left out, with a word.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

lucerna=../build/release/lucerna
[ $# -gt 0 ] || set -- cathedral cloister office projector room stadium watch

# lamp SCENE ARGUMENT...: scenes/SCENE/lamp.exr
lamp() {
    local scene=$1
    shift
    if [ ! -x "$lucerna" ]; then
        echo "   no lamp for $scene: there is no $lucerna yet"
        return
    fi
    "$lucerna" light acquire "$@" -o "$scene/lamp.exr" --quiet
    echo "   scenes/$scene/lamp.exr"
}

for scene in "$@"; do
    echo "== $scene"
    if [ ! -d "$scene" ]; then
        echo "there is no scene $scene here" >&2
        exit 1
    fi
    if [ -f "$scene/make.py" ]; then python3 "$scene/make.py"; fi
    case $scene in
        cloister) lamp cloister --radius 35mm --exponent 16 --flux 1200 --unit lm --colour 1.17,0.97,0.72 ;;
        room) lamp room --radius 35mm --exponent 20 --flux 1500 --unit lm --colour 1.28,0.96,0.55 ;;
    esac
done
