#!/usr/bin/env python3
"""Draws what figure_progressive writes: error, noise and bias against passes, with the slopes of the theory.

/usr/bin/python3 bench/figures/progressive.py docs/images/progressive.svg NUMBERS.txt...
"""

import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


def read(path):
    """alpha, and rows of passes, seconds, error², noise², bias²."""
    alpha, rows = 2 / 3, []
    for line in open(path):
        if line.startswith("#"):
            for word in line.split():
                if word.startswith("alpha="):
                    alpha = float(word.split("=")[1])
        else:
            rows.append([float(word) for word in line.split()])
    return alpha, rows


def factors(alpha, n):
    """Of the mean of n passes over the first: variance and bias (photon/radius_schedule.h)."""
    share, shares, inverse = 1.0, 0.0, 0.0
    for i in range(1, n + 1):
        shares += share
        inverse += 1 / share
        share *= (i + alpha) / (i + 1)
    return inverse / n / n, shares / n


def slope(points):
    """The slope of the least-squares line through the logarithms."""
    xs, ys = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def fit_noise(alpha, rows):
    """noise² = a/N + v V(N), both >= 0, by least squares of relative residuals."""
    best = None
    for step in range(201):
        part = step / 200  # the share of a in the noise of one pass
        shape = [part / n + (1 - part) * factors(alpha, int(n))[0] for n, *_ in rows]
        level = math.exp(sum(math.log(row[3] / s) for row, s in zip(rows, shape)) / len(rows))
        residual = sum(math.log(row[3] / (level * s)) ** 2 for row, s in zip(rows, shape))
        if best is None or residual < best[0]:
            best = residual, part * level, (1 - part) * level
    return best[1:]


def draw(axes, path):
    alpha, rows = read(path)
    passes = [row[0] for row in rows]
    name = pathlib.Path(path).stem
    late = [row for row in rows if row[0] >= passes[-1] / 16]
    a, v = fit_noise(alpha, rows)
    print("%s: error² slope %.2f, noise² slope %.2f over the last factor of 16; predicted %.2f" % (
        name, slope([(r[0], r[2]) for r in late]), slope([(r[0], r[3]) for r in late]), -alpha))
    print("%s: noise² = %.3g/N + %.3g V(N)" % (name, a, v))
    last = rows[-1]
    print("%s: after %d passes, %.0f s: error² %.3g, noise² %.3g, bias² %.3g (%s the noise)" % (
        name, last[0], last[1], last[2], last[3], last[4], "below" if last[4] < last[3] else "ABOVE"))
    axes.loglog(passes, [math.sqrt(max(r[2], 1e-12)) for r in rows], "o-", label="error")
    axes.loglog(passes, [math.sqrt(r[3]) for r in rows], "s", label="noise")
    axes.loglog(passes, [math.sqrt(a / n + v * factors(alpha, int(n))[0]) for n in passes], "-", color="C1", lw=0.8,
                label="$\\sqrt{a/N + v\\,V(N)}$")
    biased = [r for r in rows if r[4] > 0]
    axes.loglog([r[0] for r in biased], [math.sqrt(r[4]) for r in biased], "^", color="C2", label="bias")
    first = math.sqrt(biased[0][4]) if biased else 1
    axes.loglog(passes, [first * factors(alpha, int(n))[1] / factors(alpha, int(biased[0][0]) if biased else 1)[1]
                         for n in passes], "--", color="C2", lw=0.8, label="bias as predicted, $N^{%.2f}$" % (alpha - 1))
    axes.set_title(name)
    axes.set_xlabel("passes")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7)


def main(picture, *numbers):
    pyplot.rcParams["svg.hashsalt"] = "lucerna"
    figure, all_axes = pyplot.subplots(1, len(numbers), figsize=(4.6 * len(numbers), 3.8), squeeze=False)
    for axes, path in zip(all_axes[0], numbers):
        draw(axes, path)
    all_axes[0][0].set_ylabel("relative error (RMS)")
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
