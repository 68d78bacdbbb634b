#!/usr/bin/env bash
# Renders the pictures and accuracy figures of docs/explanation/pictures.md: every integrator on the Cornell box and the room,
# beside the path tracer. Run scripts/demo.sh first (for the room's lamp). It takes about ten minutes on two cores.
# usage: bench/figures/pictures.sh [FOLDER]     default out/pictures
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=${1:-out/pictures}
mkdir -p "$out"

# render NAME SCENE ARGUMENT...: renders one image and prints a line with the whole command's time
render() {
    local name=$1 scene=$2
    shift 2
    echo "== $name: $scene $*"
    "$lucerna" render "$scene" -o "$out/$name.exr" --png --quiet --stats "$out/$name.json" "$@"
    python3 -c "import json,sys; s=json.load(open(sys.argv[1])); print('   %.1f s' % s['seconds']['total'])" "$out/$name.json"
}
against() { "$lucerna" compare "$out/$1.exr" "$out/$2.exr" | grep -iE 'relative|ratio'; }

cornell=scenes/cornell/cornell.pbrt
render cornell-path "$cornell" --integrator path --spp 256 --seed 1
render cornell-direct "$cornell" --integrator direct --spp 16
render cornell-gather "$cornell" --integrator photonmap --spp 16
render cornell-map "$cornell" --integrator photonmap --spp 16 --set indirect=map
render cornell-maps "$cornell" --integrator photonmap --spp 16 --set indirect=map direct=map k=50
render cornell-igi "$cornell" --integrator igi --spp 16
for name in direct gather map maps igi; do echo "-- $name"; against "cornell-$name" cornell-path; done

room=scenes/room/room.pbrt
size="--resolution 320x200"
render room-path "$room" --integrator path --spp 512 --seed 1 $size
render room-direct "$room" --integrator direct --spp 16 $size
render room-gather "$room" --integrator photonmap --spp 16 $size
render room-map "$room" --integrator photonmap --spp 16 $size --set indirect=map
render room-igi "$room" --integrator igi --spp 16 $size
for name in direct gather map igi; do echo "-- $name"; against "room-$name" room-path; done
