# Measures the time to a requested error with a denoiser: the wall clock time of the whole command, and the error that the image
# then has.
#   usage: time_to_error.py LUCERNA OUT_FOLDER DATA_FOLDER [--error 5%] [--reference SECONDS] [SCENE...]
# Scenes, sizes and references are those of denoising.py. Run nothing else meanwhile.
import sys

from denoising import Denoising
from methods import SCENES, option


def main():
    words = sys.argv[1:]
    asked, seconds = option(words, "--error", "5%"), float(option(words, "--reference", "600"))
    table = Denoising(*words[:3], seconds, False)
    print("| scene | asked for | wall | denoised error | method |\n| --- | --- | --- | --- | --- |")
    for name in words[3:] or SCENES:
        image = f"{table.out}/{name}-{table.size(name)}-to-error"
        said, wall = table.render(name, f"{image}.exr", ["--error", asked])
        error, _ = table.numbers(name, table.denoised(image))
        method = next((line.split()[2] for line in said.splitlines() if line.startswith("method ")), "?")
        print(f"| {name} | {asked} | {wall:.1f} s | {100 * error:.3g} % | {method} |", flush=True)


if __name__ == "__main__":
    main()
