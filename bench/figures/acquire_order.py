#!/usr/bin/env python3
"""Draws docs/images/acquire-order.svg from what figure_acquire_order writes.

build/release/bench/figure_acquire_order > order.txt
/usr/bin/python3 bench/figures/acquire_order.py order.txt docs/images/acquire-order.svg
"""

import math
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


def order(points):
    """The slope of the least-squares line through the logarithms."""
    xs, ys = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def main(numbers, picture):
    series = {}
    for line in open(numbers):
        if not line.startswith("#"):
            spacing, distance, error = map(float, line.split())
            series.setdefault(distance, []).append((spacing, error))
    pyplot.rcParams["svg.hashsalt"] = "lucerna"
    figure, axes = pyplot.subplots(figsize=(5.2, 3.6))
    for distance, points in sorted(series.items()):
        # Away from S no straight line fits, because the errors of neighbouring filters cancel once Δ is small enough.
        where = "on S: order %.1f" % order(points) if distance == 0 else "%g mm from S" % (1e3 * distance)
        axes.loglog([1e3 * p[0] for p in points], [100 * p[1] for p in points], "o-", label=where)
        print("%g mm: order %.2f" % (1e3 * distance, order(points)))
    axes.set_xlabel("filter spacing Δ [mm]; the lamp is 20 mm wide")
    axes.set_ylabel("error of irradiance [% of the middle's]")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
