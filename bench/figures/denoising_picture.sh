#!/usr/bin/env bash
# Joins measured and denoised images of 10 s side by side in docs/images/denoising.jpg, from the pictures that denoising.py
# left. It needs ImageMagick.
# usage: bench/figures/denoising_picture.sh OUT_FOLDER     that of denoising.py
set -euo pipefail
from=$(realpath "${1:?the folder of denoising.py is missing}")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
pieces=$(mktemp -d)
trap 'rm -rf "$pieces"' EXIT
for scene in coffee-256x320 cathedral-256x320; do
    convert "$from/$scene-10s-raw.png" "$from/$scene-10s.png" +append -crop 512x256+0+40 +repage "$pieces/$scene.png"
done
for scene in office-320x240 room-320x200; do
    convert "$from/$scene-10s-raw.png" "$from/$scene-10s.png" -gravity center -crop 256x200+0+0 +repage +append "$pieces/$scene.png"
done
cd "$pieces"
convert \( coffee-256x320.png cathedral-256x320.png +append \) \( office-320x240.png room-320x200.png +append \) \
    -append -quality 88 "$OLDPWD/docs/images/denoising.jpg"
