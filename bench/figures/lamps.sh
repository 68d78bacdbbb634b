#!/usr/bin/env bash
# Acquires the paper's lamps on their virtual rigs and draws the pictures of their beams: one light field each, one contact
# sheet of its views, and its irradiance on a wall at several distances. It takes some minutes per lamp on two cores; an
# interrupted run resumes.
# usage: bench/figures/lamps.sh [FOLDER [LAMP...]]     default out/lamps, all: flashlight flashlight-screen bike-light three-led
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=${1:-out/lamps}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- flashlight flashlight-screen bike-light three-led
mkdir -p "$out"

# lamp NAME RIG DISTANCES: acquires and draws one lamp
lamp() {
    echo "== $1"
    if [ ! -f "$out/$1.exr" ] || [ -f "$out/$1.exr.part" ]; then
        "$lucerna" light acquire "scenes/lamps/$2" -o "$out/$1.exr"
    fi
    "$lucerna" light project "$out/$1.exr" --distance "$3" -o "$out/$1-beam.exr" --png
    "$lucerna" light view "$out/$1.exr" -o "$out/$1-views.png"
}

for name in "$@"; do
    case $name in
        flashlight) lamp "$name" flashlight/rig.toml 10mm,55mm,20cm,75cm,3m ;;
        flashlight-screen) lamp "$name" flashlight/rig-screen.toml 2cm,10cm,20cm,30cm,75cm,2m ;;
        bike-light)
            python3 scenes/lamps/bike-light/make.py
            lamp "$name" bike-light/rig.toml 2cm,10cm,187mm,75cm,2m
            ;;
        three-led) lamp "$name" three-led/rig.toml 5mm,2cm,5cm,187mm,75cm,2m ;;
        *)
            echo "there is no lamp $name here" >&2
            exit 1
            ;;
    esac
done
