"""Plots noise and bias of progressive passes and prints their slopes beside the theory's.

usage: slopes.py results.json picture.png

Theory, of the part that comes from the maps: noise² as N^-alpha and bias as N^(alpha - 1) [Knaus and Zwicker 2011].
"""
import math
import sys

from common import by, load, pyplot, save, setting, slope


def trusted_bias(point):
    """The bias, squared, where it is above the noise that hides it; else none."""
    if point["bias2"] is None:
        return None
    value, error = point["bias2"]["value"], point["bias2"]["error"] or 0
    return value if value > 2 * error else None


def rows(points):
    return [(int(setting(p, "spp")), p["noise2"]["value"], trusted_bias(p), p["error2"]) for p in points]


def main(results, picture):
    scenes = by(load(results)["points"], "scene")
    figure, axes = pyplot.subplots(len(scenes), 2, figsize=(9, 3.9 * len(scenes)), squeeze=False)
    for pair, (scene, points) in zip(axes, scenes.items()):
        print(f"\n**{scene}**\n")
        print("| method | slope of noise², theory | slope of bias, theory | error after the last pass | bias there |\n| --- | --- | --- | --- | --- |")
        for i, (method, these) in enumerate(by(points, "method").items()):
            alpha = float(setting(these[0], "alpha"))
            table = rows(these)
            late = table[-3:]  # the first passes still have about the first radius
            biased = [(n, math.sqrt(b)) for n, _, b, _ in late if b is not None]
            of_noise = f"{slope([(n, v) for n, v, _, _ in late]):.2f}, {-alpha:.2f}" if len(late) > 1 else "–"
            of_bias = f"{slope(biased):.2f}, {alpha - 1:.2f}" if len(biased) > 1 else f"below the noise, {alpha - 1:.2f}"
            last = table[-1]
            left = f"{100 * math.sqrt(last[2]):.2g} %" if last[2] is not None else "below the noise"
            print(f"| {method} | {of_noise} | {of_bias} | {100 * math.sqrt(last[3]):.2g} % after {last[0]} | {left} |")
            pair[0].loglog([r[0] for r in table], [math.sqrt(r[1]) for r in table], "o-", color=f"C{i}", label=method)
            pair[1].loglog([r[0] for r in table if r[2] is not None], [math.sqrt(r[2]) for r in table if r[2] is not None], "^-", color=f"C{i}", label=method)
        for ax, what in zip(pair, ("noise", "bias")):
            ax.set_title(f"{scene}: {what}", fontsize=10)
            ax.set_xlabel("passes")
            ax.grid(True, which="both", linewidth=0.3)
        pair[0].set_ylabel("relative (RMS)")
        pair[0].legend(fontsize=7)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
