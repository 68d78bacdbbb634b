"""Draws how time and error of a place's indirect light go with the number of virtual point lights, and prints slopes.

usage: igi_scaling.py numbers.txt picture.svg     the numbers as figure_igi_scaling writes them
"""
import math
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

COLOURS = {"loop": "C0", "tree": "C1"}


def read(path):
    rows = {"loop": [], "tree": []}
    with open(path, encoding="utf-8") as file:
        for line in file:
            choice, *numbers = line.split()
            rows[choice].append([float(x) for x in numbers])
    return rows


def slope(points):
    """Of the straight line through the logarithms, least squares."""
    x = [math.log(a) for a, _ in points]
    y = [math.log(b) for _, b in points]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def main(numbers, picture):
    pyplot.rcParams["svg.hashsalt"] = "lucerna"
    rows = read(numbers)
    figure, (time, noise, error) = pyplot.subplots(1, 3, figsize=(13, 3.9))
    measures = {
        "seconds": lambda r: r[1],
        "seconds x noise": lambda r: r[1] * r[2],
        "seconds x error": lambda r: r[1] * r[3],
    }
    for choice, some in rows.items():
        lights = [r[0] for r in some]
        colour = COLOURS[choice]
        time.loglog(lights, [1e6 * r[1] for r in some], "o-", color=colour, ms=4, label=choice)
        noise.loglog(lights, [1e6 * r[1] * r[2] for r in some], "o-", color=colour, ms=4, label=choice)
        error.loglog(lights, [r[3] for r in some], "o-", color=colour, ms=4, label=f"{choice}: one estimate")
        error.loglog(lights, [max(r[3] - r[2], 1e-6) for r in some], "x--", color=colour, ms=4, lw=0.8,
                     label=f"{choice}: without noise")
        for name, measure in measures.items():
            points = [(r[0], measure(r)) for r in some if measure(r) > 0]
            last = [p for p in points if p[0] >= 1000]
            print(f"{choice}: {name} goes as lights^{slope(points):.2f}; from 1000 lights on ^{slope(last):.2f}")
    first = rows["tree"][0]
    top = [r[0] for r in rows["tree"]]
    time.loglog(top, [1e6 * first[1] * math.sqrt(n / first[0]) for n in top], ":", color="0.5", label="square root")
    time.set_title("time of a place's indirect light")
    time.set_ylabel("microseconds")
    noise.set_title("time to a given noise")
    noise.set_ylabel("microseconds x relative variance")
    error.set_title("error of the estimate")
    error.set_ylabel("relative squared error")
    for axes in (time, noise, error):
        axes.set_xlabel("virtual point lights")
        axes.grid(True, which="major", alpha=0.3)
        axes.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
