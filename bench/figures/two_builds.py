#!/usr/bin/env python3
"""Compares the images of two builds: ten scenes by five methods. A change of the program that should change no image but by its noise passes.

usage: bench/figures/two_builds.py LUCERNA_BEFORE LUCERNA_AFTER PBRT_SCENES [FOLDER]

PBRT_SCENES is a folder with pbrt-v4's scenes veach-bidir, staircase2, water-caustic and coffee, in a folder each. The lamp of the room is
made by scenes/make.sh room. Images of 128 x 128 pixels, 16 samples, are compared in cells of 8 x 8 pixels by `lucerna compare`: a pair agrees if
the p-value of its z-test, corrected for all cells and channels, exceeds 1e-4. Methods with photons or virtual lights share their errors among
pixels, which variances of pixels do not tell: they are rendered with the same seed, and path and direct with different ones. The time is the
processor time of one thread, the shorter of two renders. Prints a table for docs/results/results.md.
"""
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

OWN = ["cornell/cornell", "cornell-caustic/cornell-caustic", "cornell-fog/cornell-fog", "many-lights/many-lights", "room/room", "rooms/rooms"]
PBRT = ["veach-bidir", "staircase2", "water-caustic", "coffee"]
METHODS = {
    "path": [],
    "direct": [],
    "photonmap": ["photons=200000"],
    "progressive": ["photons=50000"],
    "igi": ["nsets=16"],
}
SAME_SEED = {"photonmap", "progressive", "igi"}


def render(lucerna, scene, method, seed, image):
    """Renders one image and returns its processor time in seconds."""
    words = [lucerna, "render", scene, "-o", image, "--quiet", "--resolution", "128x128", "--spp", "16", "--threads", "1",
             "--integrator", method, "--seed", str(seed)]
    for setting in METHODS[method]:
        words += ["--set", setting]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime


def compare(lucerna, image, reference):
    text = subprocess.run([lucerna, "compare", image, reference, "--cells", "8", "--json", "-"], check=True, capture_output=True, text=True).stdout
    return json.loads(text)


def mean_ratio(compared):
    ratios = [channel["ratio"] for name, channel in compared["channels"].items() if name in "RGB" and "ratio" in channel]
    return sum(ratios) / len(ratios) if ratios else float("nan")


def main():
    before, after, pbrt = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    folder = Path(sys.argv[4] if len(sys.argv) > 4 else tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    scenes = [(name.split("/")[1], f"scenes/{name}.pbrt") for name in OWN]
    for name in PBRT:
        scenes.append((name, str(next((pbrt / name).glob("*.pbrt")))))
    print("| scene | " + " | ".join(METHODS) + " |")
    print("| --- |" + " --- |" * len(METHODS))
    agree = pairs = 0
    times = {method: [0.0, 0.0] for method in METHODS}
    for name, scene in scenes:
        cells = []
        for method in METHODS:
            images = [str(folder / f"{name}-{method}-{which}.exr") for which in ("before", "after")]
            seeds = (1, 1 if method in SAME_SEED else 2)
            least = [min(render(lucerna, scene, method, seed, image) for _ in range(2))
                     for lucerna, seed, image in zip((before, after), seeds, images)]
            compared = compare(after, images[1], images[0])
            p = compared["z_test"]["p_value"] if compared.get("z_test") else 1.0
            pairs += 1
            agree += p > 1e-4
            for i in range(2):
                times[method][i] += least[i]
            cells.append(f"{100 * (mean_ratio(compared) - 1):+.2f} %{'' if p > 1e-4 else f', p {p:.1g}'}, × {least[1] / max(least[0], 1e-9):.2f}")
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    print("| all, time | " + " | ".join(f"× {b / a:.3f}" for a, b in times.values()) + " |")
    print(f"\n{agree} of {pairs} pairs agree.")


if __name__ == "__main__":
    os.chdir(Path(__file__).resolve().parents[2])
    main()
