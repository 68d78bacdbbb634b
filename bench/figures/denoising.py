# Measures what denoising does to images at given times: the error and FLIP of the measured and of the denoised image, and the
# error that the program states.
#   usage: denoising.py LUCERNA OUT_FOLDER DATA_FOLDER [--times 10,60] [--reference SECONDS] [--large] [SCENE...]
# Scenes, sizes and references are those of methods.py, except that all references are our own, whose noise is known. Every
# image is rendered twice by the method that `--time` chooses, without a denoiser and with one. It needs oiiotool and numpy. Run
# nothing else meanwhile.
import json
import math
import sys

from methods import MASKS, REFERENCES, SCENES, Table, option
from pixels import error, luminance

# The methods that make the references here.
BY = {"staircase2": "path", "cornellglass": "progressive", "room": "igi", "cathedral": "igi with a pre-pass"}
REFERENCES["igi with a pre-pass"] = [*REFERENCES["igi"], "--set", "prepass=65536"]
SCENES.update({name: (*SCENES[name][:2], by) for name, by in BY.items()})


class Denoising(Table):
    def numbers(self, name, image):
        """Error without the reference's noise, and FLIP."""
        halves = [luminance(half) for half in self.reference_halves(name)]
        flip = self.compared(name, image, self.reference(name)[0])["flip"]["ldr"]["mean"]
        return error(luminance(image), halves, MASKS.get(name)), flip

    def row(self, name, seconds):
        start = f"{self.out}/{name}-{self.size(name)}-{seconds}s"
        time = ["--time", f"{seconds}s"]
        _, wall = self.render(name, f"{start}-raw.exr", [*time, "--no-denoise"])
        raw, raw_flip = self.numbers(name, f"{start}-raw.exr")
        said, wall_denoised = self.render(name, f"{start}.exr", [*time, "--denoise", "--png", "--stats", f"{start}.json"])
        own, _ = self.numbers(name, f"{start}.exr")
        denoised, flip = self.numbers(name, self.denoised(f"{start}.exr"))
        with open(f"{start}.json") as file:
            told = json.load(file)["image"].get("error", math.nan)
        method = next((line.split()[2] for line in said.splitlines() if line.startswith("method ")), "?")
        return (f"| {name} | {seconds} s | {100 * raw:.3g} % | {100 * own:.3g} % | {100 * denoised:.3g} % | {denoised / raw:.2f} | "
                f"{told / denoised:.2f} | {raw_flip:.3f} | {flip:.3f} | {method} | {wall:.1f}, {wall_denoised:.1f} s |")


def main():
    words = sys.argv[1:]
    times = option(words, "--times", "10,60").split(",")
    seconds = float(option(words, "--reference", "600"))
    large = "--large" in words
    words = [word for word in words if word != "--large"]
    table = Denoising(*words[:3], seconds, large)
    print("| scene | time | measured | with a denoiser, measured | denoised | over measured | said / error | FLIP | FLIP denoised | method | wall |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in words[3:] or SCENES:
        for time in times:
            print(table.row(name, time), flush=True)


if __name__ == "__main__":
    main()
