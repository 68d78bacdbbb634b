# Measures what the denoiser leaves of the noise: the error of the measured and of the denoised image, for fixed numbers of samples
# by path tracing and by virtual lights. What `--time` expects of methods goes by this (engine/render/method_choice.cpp).
#   usage: noise_left.py LUCERNA OUT_FOLDER DATA_FOLDER [--spp 4,16] [--reference SECONDS] [SCENE...]
# Scenes, sizes and references are those of equal_time.py. The worst thousandth of the pixels is left out. It needs oiiotool and numpy.
import sys

from equal_time import EqualTime
from methods import MASKS, METHODS, SCENES, option
from pixels import error, luminance

METHODS["igi"] += ["--set", "causticpaths=400000", "--set", "nsets=256"]
DENOISED = "denoised.R,denoised.G,denoised.B"


def main():
    words = sys.argv[1:]
    counts = option(words, "--spp", "4,16").split(",")
    seconds = float(option(words, "--reference", "600"))
    table = EqualTime(words[:1], words[1], words[2], seconds, "")
    methods = [(method, spp) for method in ("path", "igi") for spp in counts]
    print(f"| scene | {' | '.join(f'{method}, {spp}' for method, spp in methods)} |\n|{' --- |' * (1 + len(methods))}")
    for name in words[3:] or SCENES:
        halves = [luminance(half) for half in table.reference_halves(name)]
        cells = []
        for method, spp in methods:
            image = f"{table.out}/{name}-{method}-{spp}.exr"
            table.render(name, image, [*METHODS[method], "--denoise", "--no-adaptive", "--spp", spp])
            both = [error(luminance(image, channels), halves, MASKS.get(name), noisy=True, worst=0.001)
                    for channels in ("R,G,B", DENOISED)]
            cells.append(" to ".join(f"{100 * value:.3g}" for value in both) + " %")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
