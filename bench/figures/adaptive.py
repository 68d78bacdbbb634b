# Measures the benefit of adaptive sampling: the error of the denoised image of `path` with equally many samples in all pixels,
# and with as many on average, against converged references, and the saving in time to the same error.
#   usage: adaptive.py LUCERNA OUT_FOLDER DATA_FOLDER [--spp 32] [--seeds 3] [--reference SECONDS] [SCENE...]
# Scenes, sizes and references are those of denoising.py. Run nothing else meanwhile.
import json
import math
import sys

from denoising import Denoising
from methods import SCENES, option


class Adaptive(Denoising):
    def measured(self, name, spp, seed, words):
        """Squared error of the denoised image, and of the measured one, and the seconds that the image took."""
        image = f"{self.out}/{name}-{self.size(name)}-adaptive"
        self.render(name, f"{image}.exr", ["--integrator", "path", "--spp", spp, "--seed", str(seed), "--denoise", "--stats",
                                           f"{image}.json", *words])
        with open(f"{image}.json") as file:
            seconds = json.load(file)["seconds"]["image"]
        return [self.numbers(name, self.denoised(image))[0] ** 2, self.numbers(name, f"{image}.exr")[0] ** 2, seconds]

    def row(self, name, spp, seeds):
        def mean(words):
            rows = [self.measured(name, spp, seed, words) for seed in range(1, seeds + 1)]
            return [sum(column) / seeds for column in zip(*rows)]
        even, even_raw, even_seconds = mean(["--no-adaptive"])
        by_need, by_need_raw, by_need_seconds = mean([])
        # The squared error of noise is inversely proportional to time.
        gain = even / by_need * even_seconds / by_need_seconds
        percent = [f"{100 * math.sqrt(e):.3g} %" for e in (even, by_need, even_raw, by_need_raw)]
        return f"| {name} | {' | '.join(percent)} | {even_seconds:.1f}, {by_need_seconds:.1f} s | {gain:.2f} |"


def main():
    words = sys.argv[1:]
    spp, seeds = option(words, "--spp", "32"), int(option(words, "--seeds", "3"))
    table = Adaptive(*words[:3], float(option(words, "--reference", "600")), False)
    print("| scene | denoised, even | by need | measured, even | by need | image: even, by need | less time |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in words[3:] or SCENES:
        print(table.row(name, spp, seeds), flush=True)


if __name__ == "__main__":
    main()
