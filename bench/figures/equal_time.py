# Compares builds of lucerna at equal times: of the denoised pictures that `--time` alone makes the error, the error that is stated
# over the actual one, FLIP, and the seconds of the whole command; at last the error of the last build over that of the first.
#   usage: equal_time.py BUILD[,BUILD...] OUT_FOLDER DATA_FOLDER [--times 5] [--size 1280x720] [--reference SECONDS] [--seeds 1] [SCENE...]
# Scenes and references are those of methods.py, except that all references are our own, in two halves, whose noise the error is
# free of (pixels.py). FLIP includes that noise. It needs oiiotool and numpy. Run nothing else meanwhile.
import json
import math
import sys

from methods import MASKS, SCENES, Table, option
from pixels import error, luminance

SCENES.update({name: (*SCENES[name][:2], by) for name, by in {"staircase2": "path", "cornellglass": "progressive"}.items()})


class EqualTime(Table):
    def __init__(self, programs, out, data, seconds, size):
        super().__init__(programs[-1], out, data, seconds, False)
        self.programs, self.fixed_size = programs, size

    def size(self, name):
        return self.fixed_size or super().size(name)

    def numbers(self, name, image):
        halves = [luminance(half) for half in self.reference_halves(name)]
        denoised = self.denoised(image)
        flip = self.compared(name, denoised, self.reference(name)[0])["flip"]["ldr"]["mean"]
        return error(luminance(denoised), halves, MASKS.get(name), noisy=True), flip

    def cell(self, name, program, seconds, seeds):
        """The error, and the cell's text; means over seeds."""
        squares, told, flips, walls = [], [], [], []
        for seed in range(seeds):
            image = f"{self.out}/{name}-{self.size(name)}-{seconds}s.exr"
            self.program = program
            walls.append(self.render(name, image, ["--denoise", "--time", f"{seconds}s", "--seed", str(seed), "--stats",
                                                   f"{self.out}/stats.json"])[1])
            with open(f"{self.out}/stats.json") as file:
                told.append(json.load(file)["image"].get("error"))
            self.program = self.programs[-1]
            this, flip = self.numbers(name, image)
            squares.append(this * abs(this))
            flips.append(flip)
        actual = math.sqrt(max(1e-8, sum(squares) / seeds))
        said = "—" if None in told else f"{math.sqrt(sum(t * t for t in told) / seeds) / actual:.2f}"
        return actual, f"{100 * actual:.3g} %, {said}, {sum(flips) / seeds:.3f}, {sum(walls) / seeds:.1f} s"

    def row(self, name, seconds, seeds):
        self.program = self.programs[-1]
        self.reference(name)
        cells = [self.cell(name, program, seconds, seeds) for program in self.programs]
        ratio = f"{cells[-1][0] / cells[0][0]:.2f}" if len(cells) > 1 else ""
        return f"| {name} | {seconds} s | {' | '.join(text for _, text in cells)} | {ratio} |"


def main():
    words = sys.argv[1:]
    times = option(words, "--times", "5").split(",")
    size = option(words, "--size", "")
    seconds = float(option(words, "--reference", "600"))
    seeds = int(option(words, "--seeds", "1"))
    if len(words) < 3:
        sys.exit("usage: equal_time.py BUILD[,BUILD...] OUT_FOLDER DATA_FOLDER [--times 5] [--size 1280x720] [--reference SECONDS] "
                 "[--seeds 1] [SCENE...]")
    builds = words[0].split(",")
    table = EqualTime(builds, words[1], words[2], seconds, size)
    print(f"| scene | time |{' error, said / error, FLIP, command |' * len(builds)} last / first |\n|{' --- |' * (3 + len(builds))}")
    for name in words[3:] or SCENES:
        for time in times:
            print(table.row(name, time, seeds), flush=True)


if __name__ == "__main__":
    main()
