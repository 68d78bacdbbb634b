#!/usr/bin/env bash
# Renders one LED as its measured near field beside the same LED as its IES far field, docs/images/near-and-far.jpg, from
# scenes/near-and-far. Both sides have the same time and exposure, and the method is chosen for the time. It needs ImageMagick.
# usage: bench/figures/near_and_far.sh [TIME]     default 60s for each side
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

out=out/near-and-far
mkdir -p "$out"
bash scenes/make.sh near-and-far

# side NAME WORDS: renders and labels one half of the picture
side() {
    build/release/lucerna render "scenes/near-and-far/$1.pbrt" -o "$out/$1.exr" --png --resolution 638x640 --exposure -18.4 --time "$time"
    convert "$out/$1.png" -gravity southwest -pointsize 22 -fill '#333' -annotate +16+12 "$2" "$out/$1-labelled.png"
}

time=${1:-60s}
side near 'measured near field'
side far 'IES far field'
convert "$out/near-labelled.png" -size 4x640 xc:white "$out/far-labelled.png" +append -quality 90 docs/images/near-and-far.jpg
