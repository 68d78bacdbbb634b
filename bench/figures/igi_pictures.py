#!/usr/bin/env python3
"""Instant global illumination as its page shows it: the cathedral by 1, 16 and 256 sets of virtual point lights at 16 samples
per pixel, without the least distance (bright spots), with what the least distance takes put back, and by `path`:
docs/images/igi-sets.jpg and the table. Of 512 paths a set few enter the nave and leave a virtual point light where it is seen.
A few minutes on two cores, nearly all of them the reference, which is kept in out/igi.

usage: bench/figures/igi_pictures.py [--room FILE] [--size WxH] [--reference SAMPLES]
--room: pbrt-v2's room-igi.pbrt, to be rendered as it stands beside `path`.
"""
import argparse
import math
import subprocess

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from module import REPOSITORY, lucerna

OUT = REPOSITORY / "out/igi"
IGI = {"integrator": "igi", "spp": 16, "nlights": 512}
PICTURES = {
    "direct": {"integrator": "direct", "spp": 16},
    "sets-1": {**IGI, "nsets": 1},
    "sets-16": {**IGI, "nsets": 16},
    "sets-256": {**IGI, "nsets": 256},
    "no-mindist": {**IGI, "nsets": 16, "mindist": 1e-6},
    "compensated": {**IGI, "nsets": 16, "gathersamples": 1},
}
ROOM = {
    "room-igi": {},
    "room-path": {"integrator": "path", "maxdepth": 0, "spp": 32},
    "room-compensated": {"integrator": "igi", "gathersamples": 1},
}


def reference(name, scene, samples):
    file = OUT / f"{name}-path-{samples}.exr"
    if not file.exists():
        lucerna.render(scene, "path", maxdepth=0, spp=samples, seed=101).save(file)
    return lucerna.read_image(file)


def compared(scene, pictures, truth, exposure):
    """Prints a row for each picture; their files, with the reference's at the end."""
    files = []
    for name, settings in pictures.items():
        result = lucerna.render(scene, **settings)
        result.save(OUT / f"{name}.png", exposure=exposure)
        error = lucerna.compare(result, truth)
        seconds = result.report["seconds"]
        ratios = " ".join(f"{error['channels'][c]['ratio']:.3f}" for c in "RGB")
        print(f"| {name} | {seconds['total'] - seconds.get('read', 0):.1f} | {100 * error['error']:.3g} % | {ratios} |", flush=True)
        files.append(OUT / f"{name}.png")
    truth.save(OUT / "path.png", exposure=exposure)
    return [*files, OUT / "path.png"]


def sheet(files, target):
    """Side by side, in two rows, named after their files."""
    pictures = [plt.imread(file) for file in files]
    height, width = pictures[0].shape[:2]
    columns = math.ceil(len(files) / 2)
    figure, axes = plt.subplots(2, columns, figsize=(2.4 * columns, 2 * (2.4 * height / width + 0.3)))
    for axis in axes.flat:
        axis.axis("off")
    for axis, picture, file in zip(axes.flat, pictures, files):
        axis.imshow(picture, interpolation="nearest")
        axis.set_title(file.stem, fontsize=8)
    figure.tight_layout(pad=0.4)
    figure.savefig(target, dpi=100)


def main():
    words = argparse.ArgumentParser(usage=__doc__)
    words.add_argument("--room")
    words.add_argument("--size", default="180x225")
    words.add_argument("--reference", type=int, default=512)
    words = words.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    if not (REPOSITORY / "scenes/cathedral/mesh").exists():
        subprocess.run([REPOSITORY / "scenes/make.sh", "cathedral"], check=True)
    size = tuple(int(n) for n in words.size.split("x"))
    cathedral = lucerna.read_scene(REPOSITORY / "scenes/cathedral/cathedral.pbrt", resolution=size)
    print("| picture | seconds | relative error | mean R, G, B over the reference's |\n| --- | --- | --- | --- |")
    files = compared(cathedral, PICTURES, reference(f"cathedral-{words.size}", cathedral, words.reference), -10.4)  # in cd/m²
    sheet(files, REPOSITORY / "docs/images/igi-sets.jpg")
    if words.room:
        room = lucerna.read_scene(words.room)
        compared(room, ROOM, reference("room", room, words.reference), -0.8)


if __name__ == "__main__":
    main()
