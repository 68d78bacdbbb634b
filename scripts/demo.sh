#!/usr/bin/env bash
# From a fresh checkout to a picture: builds Lucerna, measures a lamp on the virtual bench, renders a room with it.
# Five minutes on two cores, packages aside. Run it again to render again; what is there is not made anew.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

echo "== packages"
bash scripts/deps.sh product

echo "== build"
[ -f build/release/CMakeCache.txt ] || cmake --preset release -DLUCERNA_TESTS=OFF --log-level=NOTICE >/dev/null
cmake --build --preset release --target lucerna --parallel "$(nproc)"
lucerna=build/release/lucerna

lamp=scenes/room/lamp.exr
if [ ! -f "$lamp" ]; then
    echo "== lamp: a warm disc with a lobe of cos^20, as a light field"
    "$lucerna" light acquire --radius 35mm --exponent 20 --flux 1500 --unit lm --colour 1.28,0.96,0.55 -o "$lamp"
fi

echo "== room"
mkdir -p out
# Renders for half a minute by the method with the lowest expected error in that time, and denoises.
"$lucerna" render scenes/room/room.pbrt -o out/room.exr --png --stats out/room.json --resolution 960x600 --time 28s

echo
echo "The picture is out/room.png; the radiances are in out/room.exr, times and counts in out/room.json."
