#!/usr/bin/env bash
# Instant global illumination as its note shows it: the cathedral by 1, 16 and 256 sets of virtual point lights at 16 samples per pixel,
# without the least distance (bright spots), with what the least distance takes put back, and by `path`: docs/images/igi-sets.jpg
# and the table. Of 512 paths a set few enter the nave and leave a virtual point light where it is seen. A few minutes on two cores, nearly all
# of them the references, which are kept.
# usage: bench/figures/igi_pictures.sh [ROOM]     ROOM: pbrt-v2's room-igi.pbrt, to be rendered as it stands beside `path`
# RESOLUTION and REFERENCE (samples per pixel of the path-traced images) may be set before it.
set -euo pipefail
room=${1:+$(realpath "$1")}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/igi
resolution=${RESOLUTION:-180x225}
reference=${REFERENCE:-512}
mkdir -p "$out" docs/images
[ -e scenes/cathedral/mesh ] || scenes/make.sh cathedral
cathedral=scenes/cathedral/cathedral.pbrt

# render NAME SCENE ARGUMENT...
render() {
    local name=$1 scene=$2
    shift 2
    local exposure=-10.4  # of cd/m²
    [ "$scene" = "$cathedral" ] || exposure=-0.8
    "$lucerna" render "$scene" -o "$out/$name.exr" --png --exposure "$exposure" --quiet --stats "$out/$name.json" "$@"
}
# row NAME REFERENCE: time, relative MSE, mean over the reference's
row() {
    "$lucerna" compare "$out/$1.exr" "$out/$2.exr" --json "$out/$1-error.json" >/dev/null || true
    python3 - "$out/$1" "$1" <<'ROW'
import json, sys

file, name = sys.argv[1:]
with open(file + ".json") as stats, open(file + "-error.json") as text:
    seconds, error = json.load(stats)["seconds"], json.load(text)
ratios = " ".join(f"{error['channels'][c]['ratio']:.3f}" for c in "RGB")
print(f"| {name} | {seconds['total'] - seconds['read']:.1f} | {error['relative_mse']:.2e} | {ratios} |")
ROW
}

echo "| picture | seconds | relative MSE | mean R, G, B over the reference's |"
echo "| --- | --- | --- | --- |"
size="--resolution $resolution"
truth=cathedral-path-$resolution-$reference
[ -f "$out/$truth.exr" ] || render "$truth" "$cathedral" --integrator path --set maxdepth=0 --spp "$reference" --seed 101 $size
render direct "$cathedral" --integrator direct --spp 16 $size
for sets in 1 16 256; do
    render "sets-$sets" "$cathedral" --integrator igi --spp 16 --set nlights=512 nsets=$sets $size
done
render no-mindist "$cathedral" --integrator igi --spp 16 --set nlights=512 nsets=16 mindist=0 $size
render compensated "$cathedral" --integrator igi --spp 16 --set nlights=512 nsets=16 compensate=true $size
for name in direct sets-1 sets-16 sets-256 no-mindist compensated; do row "$name" "$truth"; done

pictures=()
for name in direct sets-1 sets-16 sets-256 no-mindist compensated "$truth"; do pictures+=("$out/$name.png"); done
/usr/bin/python3 bench/figures/igi_pictures.py docs/images/igi-sets.jpg "${pictures[@]}"

if [ -n "$room" ]; then
    truth=room-path-$reference
    [ -f "$out/$truth.exr" ] || render "$truth" "$room" --integrator path --set maxdepth=0 --spp "$reference" --seed 101
    render room-igi "$room"
    render room-path "$room" --integrator path --set maxdepth=0 --spp 32
    render room-compensated "$room" --set compensate=true
    for name in room-igi room-path room-compensated; do row "$name" "$truth"; done
fi
