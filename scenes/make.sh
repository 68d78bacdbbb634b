#!/usr/bin/env bash
# Makes what the scenes need and git does not keep: meshes and pictures by each scene's make.py, lamps by `lucerna light`.
# usage: scenes/make.sh [SCENE...]     default: all that have something to make. What is there is made anew.
# The lamps need build/release/lucerna; without it they are left out, with a word.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

lucerna=../build/release/lucerna
[ $# -gt 0 ] || set -- beams cathedral cloister lamps/bike-light lamps/bulb lamps/narrow-beam lamps/white-led lamps/zoom-flashlight near-and-far office projector room shade stadium watch

# lamp FILE HOW ARGUMENT...: a light field, scenes/FILE, by `lucerna light HOW`
lamp() {
    local file=$1
    shift
    if [ ! -x "$lucerna" ]; then
        echo "   no $file: there is no $lucerna yet"
        return
    fi
    "$lucerna" light "$@" -o "$file" --quiet
    echo "   scenes/$file"
}

rays=../../shared/data/osram-ostar

# chips FILE DRIVE COLOUR: an LED's green and blue chips as one lamp from their measured rays, the blue one at DRIVE of its flux; one square
# of both, of that COLOUR, where the rays are not there. A formula's chip lies in the package's middle; a measured one in its quadrant.
chips() {
    if [ -f "$rays-green-100k.tm25ray" ]; then
        lamp "$1" import "$rays-green-100k.tm25ray" "$rays-blue-100k.tm25ray" --drive "1,$2"
    else
        echo "   no measured rays $rays-*: the green and blue chips by formula"
        lamp "$1" acquire --emitter rectangle --size 1mmx1mm --exponent 1 --flux 1 --unit lm --colour "$3"
    fi
}

# red_chip FILE: the same LED's red chip by formula, in the middle
red_chip() {
    lamp "$1" acquire --emitter rectangle --size 1mmx1mm --exponent 1 --flux 1 --unit lm --colour 4.42,0.084,0
}

for scene in "$@"; do
    echo "== $scene"
    if [ ! -d "$scene" ]; then
        echo "there is no scene $scene here" >&2
        exit 1
    fi
    if [ -f "$scene/make.py" ]; then python3 "$scene/make.py"; fi
    case $scene in
        beams)
            for exponent in 1 10 100 1000; do
                lamp "beams/lamp-$exponent.exr" acquire --radius 1m --exponent "$exponent" --views 21x21 --pixels 48x48 --capture 95% --distance 10m
            done
            ;;
        cloister) lamp cloister/lamp.exr acquire --radius 35mm --exponent 16 --flux 1200 --unit lm --colour 1.17,0.97,0.72 ;;
        room) lamp room/lamp.exr acquire --radius 35mm --exponent 20 --flux 1500 --unit lm --colour 1.28,0.96,0.55 ;;
        lamps/zoom-flashlight)
            python3 lamps/white-led/make.py
            lamp lamps/white-led/white-led.exr import lamps/white-led/white-led.tm25ray
            lamp lamps/zoom-flashlight/zoom-flashlight.exr acquire lamps/zoom-flashlight/rig.toml
            ;;
        shade)
            python3 lamps/bulb/make.py
            lamp shade/bulb.exr import lamps/bulb/bulb.tm25ray
            ;;
        near-and-far)
            chips near-and-far/led-green-blue.exr 0.28 0,1.266,1.305
            red_chip near-and-far/led-red.exr
            # Over the formula's far fields, which make.py writes, those of the measured rays; steps as fine as they allow.
            if [ -f "$rays-green-100k.tm25ray" ]; then
                lamp near-and-far/led-green.ies farfield "$rays-green-100k.tm25ray" --step 5 --plane-step 15
                lamp near-and-far/led-blue.ies farfield "$rays-blue-100k.tm25ray" --step 5 --plane-step 15 --efficacy 32.53
            fi
            ;;
        watch)
            chips watch/led-green-blue.exr 0.16 0.03,1.318,0.7
            red_chip watch/led-red.exr
            ;;
    esac
done
