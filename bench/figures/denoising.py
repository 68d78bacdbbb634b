# What denoising does to images that people wait for: error and FLIP of what is measured and of what is made of it, and the error
# that the program states, at equal time.
#   usage: denoising.py LUCERNA OUT_FOLDER DATA_FOLDER [--times 10,60] [--reference SECONDS] [--large] [SCENE...]
# Scenes, sizes and references are those of methods.py, but that all references are of our own, whose noise is known. Every image is
# rendered twice by the method that `--time` chooses, without a denoiser and with one. It needs oiiotool. Nothing else should run meanwhile.
import json
import math
import sys

from methods import MASKS, SCENES, Table, option, run

SCENES.update({"staircase2": (*SCENES["staircase2"][:2], "path"), "cornellglass": (*SCENES["cornellglass"][:2], "progressive")})


class Denoising(Table):
    def numbers(self, name, image):
        """Error without the reference's noise, and FLIP."""
        reference, noise = self.reference(name)
        mask = ["--mask", str(MASKS[name])] if name in MASKS else []
        text, _ = run([self.program, "compare", image, reference, *mask, "--json", "-"])
        found = json.loads(text[text.index("{"):])
        return math.sqrt(max(found["error"] ** 2 - noise ** 2, (noise / 2) ** 2)), found["flip"]["ldr"]["mean"]

    def row(self, name, seconds):
        start = f"{self.out}/{name}-{self.size(name)}-{seconds}s"
        time = ["--time", f"{seconds}s"]
        _, wall = self.render(name, f"{start}-raw.exr", [*time, "--no-denoise"])
        raw, raw_flip = self.numbers(name, f"{start}-raw.exr")
        said, wall_denoised = self.render(name, f"{start}.exr", [*time, "--denoise", "--png", "--stats", f"{start}.json"])
        # What else is in the file is not compared.
        run(["oiiotool", f"{start}.exr", "--ch", "R=denoised.R,G=denoised.G,B=denoised.B", "-o", f"{start}-denoised.exr"])
        own, _ = self.numbers(name, f"{start}.exr")
        error, flip = self.numbers(name, f"{start}-denoised.exr")
        with open(f"{start}.json") as file:
            told = json.load(file)["numbers"].get("error.denoised", math.nan)
        method = next((line.split()[2] for line in said.splitlines() if line.startswith("method ")), "?")
        return (f"| {name} | {seconds} s | {100 * raw:.3g} % | {100 * own:.3g} % | {100 * error:.3g} % | {error / raw:.2f} | "
                f"{told / error:.2f} | {raw_flip:.3f} | {flip:.3f} | {method} | {wall:.1f}, {wall_denoised:.1f} s |")


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
