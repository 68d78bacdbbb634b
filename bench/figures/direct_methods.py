"""Plots time against error of the ways to direct light and prints how much sooner each reaches an error than `mc`.

usage: direct_methods.py FOLDER picture.png SCENE...     the folder as direct_methods.sh fills it
"""
import glob
import json
import math
import os
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

LABELS = {
    "mc": "mc",
    "candidates": "mc, 16 candidates",
    "tree": "mc, light tree",
    "map": "map",
    "gated": "gated",
    "guided": "guided",
    "both": "guided, light tree",
}


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def read(folder, scene):
    """{method: [(spp, seconds, relative MSE)]}, sorted; the references' own noise is taken off."""
    noise = load(f"{folder}/{scene}-references.json")["relative_mse"] / 2
    curves = {}
    for path in glob.glob(f"{folder}/{scene}-*-101.json"):
        found = re.fullmatch(rf"{re.escape(scene)}-(\w+)-(\d+)-101\.json", os.path.basename(path))
        if not found or found[1] not in LABELS:
            continue
        errors = [load(path.replace("-101.json", f"-{seed}.json"))["relative_mse"] for seed in (101, 102)]
        seconds = load(path.replace("-101.json", ".json"))["seconds"]
        error = sum(errors) / 2 - noise
        if error > 0:
            curves.setdefault(found[1], []).append((int(found[2]), seconds["total"] - seconds["read"], error))
    for curve in curves.values():
        curve.sort()
    return noise, curves


def seconds_to(curve, error):
    """By straight lines in logarithms between the points measured; none beyond them."""
    for (_, t0, e0), (_, t1, e1) in zip(curve, curve[1:]):
        if e0 >= error >= e1 and e0 > e1:
            part = math.log(e0 / error) / math.log(e0 / e1)
            return t0 * (t1 / t0) ** part
    return None


def table(scene, noise, curves):
    """At three errors that `mc` reaches: seconds, and mc's over them."""
    mc = curves.get("mc", [])
    print(f"\n{scene} (noise of the references {noise:.2g}, taken off)\n")
    if len(mc) < 2:
        print("no curve of mc to compare with")
        return
    picks = [mc[len(mc) // 3][2], mc[2 * len(mc) // 3][2], mc[-1][2]]
    print("| relative MSE | " + " | ".join(LABELS[m] for m in LABELS if m in curves) + " |")
    print("| --- |" + " --- |" * sum(m in curves for m in LABELS))
    for error in picks:
        base = seconds_to(mc, error) or mc[-1][1]
        cells = []
        for method in LABELS:
            if method in curves:
                t = seconds_to(curves[method], error)
                first = curves[method][0]
                if t is None and first[2] < error:
                    cells.append(f"< {first[1]:.2f} s (> {base / first[1]:.1f} times)")
                else:
                    cells.append("not reached" if t is None else f"{t:.2f} s ({base / t:.1f} times)")
        print(f"| {error:.2g} | " + " | ".join(cells) + " |")
    print("\nsamples, seconds, relative MSE:")
    for method, curve in curves.items():
        print(f"  {LABELS[method]}: " + "; ".join(f"{n} {t:.2f} {e:.3g}" for n, t, e in curve))


def main(folder, picture, scenes):
    figure, axes = plt.subplots(1, len(scenes), figsize=(3.7 * len(scenes), 3.7), squeeze=False)
    for ax, scene in zip(axes[0], scenes):
        noise, curves = read(folder, scene)
        table(scene, noise, curves)
        for method in LABELS:
            if method in curves:
                ax.loglog([t for _, t, _ in curves[method]], [e for _, _, e in curves[method]], marker=".", label=LABELS[method])
        ax.set_title(scene)
        ax.set_xlabel("seconds")
        ax.grid(True, which="both", linewidth=0.3)
    axes[0][0].set_ylabel("relative MSE")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


main(sys.argv[1], sys.argv[2], sys.argv[3:])
