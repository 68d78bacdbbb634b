# Measures what short renders do with their time (docs/howto/budgets.md): the method, samples per pixel (or the
# resolution), after how long each pixel had a sample, the share of the time in the samples of the image and the time of
# the whole command.
#   usage: budgets.py LUCERNA OUT_FOLDER DATA_FOLDER [--busy N] [--sizes 256x256,1280x720] [--times 2,5,10] [SCENE...]
# DATA_FOLDER is that of methods.py, whose scenes are the default; a SCENE may be a file, too. With --busy, N endless
# processes run beside it. Run nothing else meanwhile.
import json
import os
import subprocess
import sys
import time

from methods import SCENES, option


def scene_file(data, name):
    """The file of one of the scenes of methods.py; a name with a suffix is a file."""
    return SCENES[name][0].format(data=data) if name in SCENES else name


def resolution_said(lines):
    """What the program says of an image with less than one sample per pixel."""
    for part in ("half", "a quarter"):
        if f"rendered at {part} of its resolution" in lines:
            return part
    return ""


def cell(lucerna, out, data, name, size, seconds):
    label = os.path.basename(os.path.dirname(name)) if name not in SCENES else name
    stats = f"{out}/{label}.json"
    begin = time.time()
    done = subprocess.run([lucerna, "render", scene_file(data, name), "--resolution", size, "--time", f"{seconds}s", "-o",
                           f"{out}/{label}-{size}-{seconds}.exr", "--png", "--stats", stats, "--quiet"],
                          check=True, capture_output=True, text=True)
    wall = time.time() - begin
    with open(stats) as file:
        numbers = json.load(file)
    took = numbers["seconds"]
    samples = numbers["samples"]["done"] or resolution_said(done.stderr)
    whole = f"{numbers['whole_after']:.1f} s, " if "whole_after" in numbers else ""
    return f"{numbers['integrator']}, {samples}, {whole}{100 * took.get('image', 0) / seconds:.0f} %, {wall:.2f} s"


def main():
    words = sys.argv[1:]
    busy = int(option(words, "--busy", "0"))
    sizes = option(words, "--sizes", "256x256,1280x720,1920x1080").split(",")
    times = [int(t) for t in option(words, "--times", "2,5,10").split(",")]
    lucerna, out, data = words[:3]
    os.makedirs(out, exist_ok=True)
    print(f"| scene | size | {' | '.join(f'{t} s' for t in times)} |\n|{' --- |' * (len(times) + 2)}")
    beside = [subprocess.Popen(["yes"], stdout=subprocess.DEVNULL) for _ in range(busy)]
    try:
        for name in words[3:] or SCENES:
            for size in sizes:
                cells = [cell(lucerna, out, data, name, size, seconds) for seconds in times]
                print(f"| {name} | {size} | {' | '.join(cells)} |", flush=True)
    finally:
        for process in beside:
            process.kill()


if __name__ == "__main__":
    main()
