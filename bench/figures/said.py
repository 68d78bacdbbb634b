# Prints the ratio of an image's stated error to its actual error for several numbers of samples, for the measured image (noise) and
# for the denoised one. Numbers of samples are fixed, so that other work on the machine does not matter.
#   usage: said.py LUCERNA OUT_FOLDER DATA_FOLDER [--spp 2,4,8,16,64] [--seeds 1] [--reference SECONDS] [SCENE...]
# Scenes and references are those of denoising.py at half the width and height; references are rendered once and kept in OUT_FOLDER.
import json
import math
import sys

from methods import MASKS, METHODS, REFERENCES, SCENES, Table, option
from pixels import error, luminance

REFERENCES["igi with a pre-pass"] = [*REFERENCES["igi"], "--set", "prepass=65536"]
BY = {"staircase2": "path", "cornellglass": "progressive", "room": "progressive", "cathedral": "igi with a pre-pass"}
SCENES.update({name: (*SCENES[name][:2], by) for name, by in BY.items()})


class Said(Table):
    def size(self, name):
        width, height = SCENES[name][1]
        return f"{width // 2}x{height // 2}"

    def measured(self, name, image, channels):
        """The error that an image has, without the noise of the references' halves."""
        both = [luminance(half) for half in self.reference_halves(name)]
        return error(luminance(image, channels), both, MASKS.get(name))

    def ratios(self, name, spp, seed):
        """Of the measured image and of the denoised one: what was said, None if nothing was, and the error."""
        start = f"{self.out}/{name}-{self.size(name)}-{spp}-{seed}"
        self.render(name, f"{start}.exr", [*METHODS["path"], "--denoise", "--spp", str(spp), "--seed", str(seed), "--stats",
                                           f"{start}.json"])
        with open(f"{start}.json") as file:
            numbers = json.load(file)["numbers"]
        return [(numbers.get(key), self.measured(name, f"{start}.exr", channels)) for key, channels in
                (("error.relative", "R,G,B"), ("error.denoised", "denoised.R,denoised.G,denoised.B"))]


def cell(pairs):
    """Means over seeds: said, measured, and their ratio."""
    measured = math.sqrt(sum(error ** 2 for _, error in pairs) / len(pairs))
    said = [told for told, _ in pairs if told is not None]
    if len(said) < len(pairs):
        return f"— / {100 * measured:.3g} %"
    told = math.sqrt(sum(s ** 2 for s in said) / len(said))
    return f"{100 * told:.3g} / {100 * measured:.3g} %, {told / measured:.2f}"


def main():
    words = sys.argv[1:]
    counts = option(words, "--spp", "2,4,8,16,64").split(",")
    seeds = int(option(words, "--seeds", "1"))
    table = Said(*words[:3], float(option(words, "--reference", "600")), False) if len(words) >= 3 else sys.exit("usage: said.py LUCERNA OUT_FOLDER DATA_FOLDER [--spp 2,4,8,16,64] [--seeds 1] [--reference SECONDS] [SCENE...]")
    columns = [f"{spp}" for spp in counts]
    print(f"| scene | image | {' | '.join(columns)} |\n|{' --- |' * (len(columns) + 2)}")
    for name in words[3:] or SCENES:
        by_spp = [[table.ratios(name, spp, seed) for seed in range(seeds)] for spp in counts]
        for i, image in enumerate(("measured", "denoised")):
            print(f"| {name} | {image} | {' | '.join(cell([pairs[i] for pairs in row]) for row in by_spp)} |", flush=True)


if __name__ == "__main__":
    main()
