"""Plots time against error of the ways to direct light and prints how much sooner each reaches an error than `mc`.

usage: direct_methods.py FOLDER picture.png SCENE...     the folder as direct_methods.sh fills it
"""
import glob
import json
import math
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

LABELS = {
    "mc": "mc",
    "map": "map",
    "gated": "gated",
    "guided": "guided",
}
SEEDS = (1, 2)
REFERENCES = (101, 102)


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def mean(values):
    values = list(values)
    return sum(values) / len(values)


class Point:
    """A method at one number of samples, over its seeds; the references' own noise is taken off the error."""

    def __init__(self, stem, samples, noise):
        compared = [load(f"{stem}-{samples}-{seed}-{against}.json") for seed in SEEDS for against in REFERENCES]
        seconds = [load(f"{stem}-{samples}-{seed}.json")["seconds"] for seed in SEEDS]
        self.samples = samples
        self.error = mean(c["relative_mse"] for c in compared) - noise
        self.seconds = mean(s["total"] - s["read"] for s in seconds)
        self.brightness = mean(channel["ratio"] for c in compared for channel in c["channels"].values() if "ratio" in channel)


def read(folder, scene):
    """The noise of the references, and {method: [Point]} by samples."""
    noise = load(f"{folder}/{scene}-references.json")["relative_mse"] / 2
    curves = {}
    for method in LABELS:
        stem = f"{folder}/{scene}-{method}"
        found = (re.fullmatch(r".*-(\d+)-1\.json", path) for path in glob.glob(glob.escape(stem) + "-*-1.json"))
        samples = sorted(int(f[1]) for f in found if f and f[0] == f"{stem}-{f[1]}-1.json")
        points = [Point(stem, n, noise) for n in samples]
        if points:
            curves[method] = [p for p in points if p.error > 0]
    return noise, curves


def seconds_to(curve, error):
    """By straight lines in logarithms between the points measured; beyond them error goes as 1/seconds."""
    for a, b in zip(curve, curve[1:]):
        if a.error >= error >= b.error and a.error > b.error:
            part = math.log(a.error / error) / math.log(a.error / b.error)
            return a.seconds * (b.seconds / a.seconds) ** part
    end = curve[0] if error > curve[0].error else curve[-1]
    return end.seconds * end.error / error


def table(scene, noise, curves):
    mc = curves.get("mc", [])
    print(f"\n**{scene}** (references' noise {noise:.2g}, taken off)\n")
    if not mc:
        print("no curve of mc to compare with")
        return
    counts = [p.samples for p in mc[1:]]
    print("| method | " + " | ".join(f"{n} samples: error, time, mc's time for that error" for n in counts) + " | mean |")
    print("| --- |" + " --- |" * (len(counts) + 1))
    for method, curve in curves.items():
        cells = []
        for n in counts:
            p = next((p for p in curve if p.samples == n), None)
            if p is None:
                cells.append("below the references' noise")
            else:
                cells.append(f"{p.error:.2g}, {p.seconds:.2f} s, × {seconds_to(mc, p.error) / p.seconds:.1f}")
        brightness = f"{curve[-1].brightness:.4f}" if curve else ""
        print(f"| {LABELS[method]} | " + " | ".join(cells) + f" | {brightness} |")


def main(folder, picture, scenes):
    figure, axes = plt.subplots(1, len(scenes), figsize=(3.7 * len(scenes), 3.7), squeeze=False)
    for ax, scene in zip(axes[0], scenes):
        noise, curves = read(folder, scene)
        table(scene, noise, curves)
        for method, curve in curves.items():
            ax.loglog([p.seconds for p in curve], [p.error for p in curve], marker=".", label=LABELS[method])
        ax.set_title(scene)
        ax.set_xlabel("seconds")
        ax.grid(True, which="both", linewidth=0.3)
    axes[0][0].set_ylabel("relative MSE")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


main(sys.argv[1], sys.argv[2], sys.argv[3:])
