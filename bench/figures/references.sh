#!/usr/bin/env bash
# Compares `progressive` with another renderer's images of the Cornell box, with and without a glass ball: seconds of the whole
# command and relative MSE without the visible lamp, for the table of docs/results/results.md. It takes a minute on a quiet
# machine.
# usage: bench/figures/references.sh FOLDER      that holds cornell.pbrt, cornell-seed1.exr, cornellglass.pbrt, cornellglass-4096.exr
# SHORT and LONG ("PHOTONS K PASSES") may be set before it.
set -euo pipefail
folder=$(cd "$1" && pwd)
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

lucerna=build/release/lucerna
out=out/references
short=${SHORT:-50000 40 6}
long=${LONG:-100000 60 40}
mkdir -p "$out"

echo "| scene | photons, k, passes | seconds | relative MSE | mean R, G, B over the reference's |"
echo "| --- | --- | --- | --- | --- |"
for scene in cornell cornellglass; do
    reference=$folder/$scene-4096.exr
    [ -f "$reference" ] || reference=$folder/$scene-seed1.exr
    for run in "$short" "$long"; do
        read -r photons k passes <<<"$run"
        image=$out/$scene-$passes
        before=$EPOCHREALTIME
        "$lucerna" render "$folder/$scene.pbrt" -o "$image.exr" --png --quiet --integrator progressive --set "photons=$photons" "k=$k" \
            --passes "$passes" --stats "$image.json"
        after=$EPOCHREALTIME
        "$lucerna" compare "$image.exr" "$reference" --mask 4 --json "$image-error.json" >/dev/null
        python3 - "$scene" "$run" "$before" "$after" "$image-error.json" <<'ROW'
import json, sys

scene, run, before, after, file = sys.argv[1:]
with open(file) as text:
    error = json.load(text)
ratios = " ".join(f"{error['channels'][c]['ratio']:.4f}" for c in "RGB")
print(f"| {scene} | {run} | {float(after) - float(before):.2f} | {error['relative_mse']:.2e} | {ratios} |")
ROW
    done
done
