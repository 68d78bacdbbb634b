# Measures whether static things flicker: a camera moves sideways, by a few pixels per frame, each with its own seed. Pieces of
# surface of a few pixels are tracked by their position in the scene (the layer P), and their luminance is compared between
# frames.
#   usage: flythrough.py LUCERNA OUT_FOLDER DATA_FOLDER [--frames 12] [--spp 16] [--integrator path] [SCENE...]
# It prints, relative to a piece's luminance, the root of the mean variance between frames of the measured and of the denoised
# image, and how many pieces vary more when denoised. It needs oiiotool and numpy.
import os
import shutil
import sys

import numpy

from methods import SCENES, option, run
from pixels import luminance, pixels

FRAMES_APART = 1.3  # pixels at the scene's median distance
PIECE = 4           # pixels


def beside(out, scene):
    """A file in a folder that looks like the scene's, from which all that the scene names is found."""
    folder, tree = os.path.dirname(os.path.abspath(scene)), os.path.join(out, "tree-" + os.path.basename(scene))
    own = os.path.join(tree, os.path.basename(folder))
    shutil.rmtree(tree, ignore_errors=True)
    os.makedirs(own)
    for source, to in ((os.path.dirname(folder), tree), (folder, own)):
        for name in os.listdir(source):
            if not os.path.exists(os.path.join(to, name)):
                os.symlink(os.path.join(source, name), os.path.join(to, name))
    return os.path.join(own, "frame.pbrt")


def frame(program, out, file, scene, step, number, words):
    """Places, and luminances measured and denoised, of one frame."""
    image = f"{out}/frame-{number:02}.exr"
    with open(file, "w") as text:
        text.write(f'Translate {-step * number} 0 0\nInclude "{os.path.basename(scene)}"\n')
    run([program, "render", file, "-o", image, "--layers", "--denoise", "--png", "--seed", str(number + 1), *words])
    seen = [luminance(image, channels) for channels in ("R,G,B", "denoised.R,denoised.G,denoised.B")]
    place, normal = pixels(image, "P.X,P.Y,P.Z"), pixels(image, "Ng.X,Ng.Y,Ng.Z")
    depth = pixels(image, "Z,Z,Z")[..., 0]
    return place, depth, normal, seen


def main():
    words = sys.argv[1:]
    frames, spp = int(option(words, "--frames", "12")), option(words, "--spp", "16")
    integrator = option(words, "--integrator", "path")
    program, out, data = words[:3]
    os.makedirs(out, exist_ok=True)
    print("| scene | pieces | measured, from frame to frame | denoised | pieces that vary more when denoised |")
    print("| --- | --- | --- | --- | --- |")
    for name in words[3:] or ["room", "coffee", "staircase2", "projector"]:
        scene, (width, height), _ = SCENES[name]
        scene = scene.format(data=data)
        file = beside(out, scene)
        asked = ["--resolution", f"{width}x{height}", "--integrator", integrator, "--spp", spp]
        _, depth, _, _ = frame(program, out, file, scene, 0, 0, asked)
        # A pixel's width is that at the median distance, for a field of view of about 50 degrees.
        pixel = numpy.median(depth[depth > 0]) * 0.9 / width
        pieces = {}
        for number in range(frames):
            place, depth, normal, seen = frame(program, out, file, scene, FRAMES_APART * pixel, number, asked)
            valid = (depth > 0) & (numpy.linalg.norm(normal, axis=2) > 0.98)  # whole pixels of one surface
            cell = numpy.floor(place[valid] / (PIECE * pixel)).astype(int)
            # Surfaces in a cell are distinguished by the axis that they face.
            side = numpy.rint(normal[valid]).astype(int)
            keys, inverse, count = numpy.unique(numpy.hstack([cell, side]), axis=0, return_inverse=True, return_counts=True)
            means = [numpy.bincount(inverse.ravel(), light[valid]) / count for light in seen]
            for key, n, raw, clean in zip(map(tuple, keys), count, *means):
                if n >= PIECE * PIECE // 2:
                    pieces.setdefault(key, []).append((raw, clean))
        followed = numpy.array([values for values in pieces.values() if len(values) == frames])  # pieces x frames x 2
        mean = followed.mean(axis=(1, 2))
        variance = followed.var(axis=1, ddof=1) / (mean ** 2 + (0.1 * mean.mean()) ** 2)[:, None]
        raw, clean = numpy.sqrt(variance.mean(axis=0))
        more = (variance[:, 1] > variance[:, 0]).mean()
        print(f"| {name} | {len(followed)} | {100 * raw:.3g} % | {100 * clean:.3g} % | {100 * more:.2g} % |", flush=True)


if __name__ == "__main__":
    main()
