#!/usr/bin/env bash
# Measures error against passes of `progressive`, on the Cornell box with a caustic and in the cloister, for
# docs/images/progressive.svg and the slopes. Long references by `path` come first; they stay in build/progressive and are
# reused. It takes about two hours on two cores, nearly all of it for the references; smaller numbers are quicker and noisier.
# usage: bench/figures/progressive.sh [PASSES] [SPP] [SIZE]       default: 1024 4096 128 (pixels across)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

passes=${1:-1024}
spp=${2:-4096}
size=${3:-128}
out=build/progressive
mkdir -p "$out" docs/images
cmake --build build/release --target lucerna figure_progressive >/dev/null
[ -e scenes/cloister/mesh ] || scenes/make.sh cloister

# measure NAME SCENE WIDTHxHEIGHT MASK [KEY=VALUE …]: measures one scene
measure() {
    local name=$1 scene=$2 resolution=$3 mask=$4 seed
    shift 4
    for seed in 1 2; do
        local reference=$out/$name-$resolution-$spp-$seed.exr
        [ -e "$reference" ] || build/release/lucerna render "$scene" --integrator path --set maxdepth=0 \
            --resolution "$resolution" --spp "$spp" --seed $((100 + seed)) -o "$reference"
    done
    build/release/bench/figure_progressive "$scene" "$out/$name-$resolution-$spp-1.exr" \
        "$out/$name-$resolution-$spp-2.exr" "$mask" "$passes" "$@" >"$out/$name.txt"
}

measure cornell-caustic scenes/cornell-caustic/cornell-caustic.pbrt "${size}x$size" 4
measure cloister scenes/cloister/cloister.pbrt "${size}x$((size * 2 / 3))" 1e30
/usr/bin/python3 bench/figures/progressive.py docs/images/progressive.svg "$out"/cornell-caustic.txt "$out"/cloister.txt
