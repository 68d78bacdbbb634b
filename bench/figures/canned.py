"""Plots errors and pictures of light fields with and without the optical filter.

usage: canned.py canned.csv curves.png pictures.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

KINDS = {"filtered": ("filtered, exact", "o-"), "approximate": ("filtered, approximate", "s--"), "canned": ("canned, linear", "^-")}
PLACES = {0.0: "at S", 0.01: "at 10 mm", 1.0: "at 1 m"}


def read(file):
    errors, pictures = {}, {}
    with open(file, newline="") as rows:
        for row in csv.reader(rows):
            if row[0] == "error":
                _, lamp, distance, views, kind, rms = row
                errors.setdefault(lamp, {}).setdefault(float(distance), {}).setdefault(kind, []).append((int(views), float(rms)))
            else:
                _, lamp, kind, y, x, value = row
                pictures.setdefault(lamp, {}).setdefault(kind, {})[int(y), int(x)] = float(value)
    return errors, pictures


def table(errors):
    for lamp, places in errors.items():
        views = [v for v, _ in next(iter(next(iter(places.values())).values()))]
        print(f"| {lamp}, views | " + " | ".join(f"{v} × {v}" for v in views) + " |")
        print("| --- |" + " --- |" * len(views))
        for distance, kinds in places.items():
            for kind, points in kinds.items():
                print(f"| {PLACES[distance]}, {KINDS[kind][0]} | " + " | ".join(f"{100 * e:.1f} %" for _, e in points) + " |")
        print()


def curves(errors, picture):
    figure, axes = plt.subplots(len(errors), 3, figsize=(11, 3.4 * len(errors)), squeeze=False)
    for row, (lamp, places) in zip(axes, errors.items()):
        for ax, (distance, kinds) in zip(row, places.items()):
            for kind, points in kinds.items():
                views, rms = zip(*points)
                label, style = KINDS[kind]
                ax.loglog(views, [100 * e for e in rms], style, label=label, markersize=4)
            ax.set_title(f"{lamp}, {PLACES[distance]}", fontsize=10)
            ax.set_xlabel("views across")
            ax.set_xticks(views, [str(v) for v in views])
            ax.minorticks_off()
            ax.set_ylim(0.1, 120)
            ax.set_yticks([0.1, 0.3, 1, 3, 10, 30, 100], ["0.1", "0.3", "1", "3", "10", "30", "100"])
            ax.grid(alpha=0.3)
        row[0].set_ylabel("error of irradiance, RMS, %")
        row[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(picture, dpi=100)


def draw(pictures, picture):
    kinds = ("lamp", "filtered", "canned")
    figure, axes = plt.subplots(len(pictures), len(kinds), figsize=(9, 3.2 * len(pictures)), squeeze=False)
    for row, (lamp, images) in zip(axes, pictures.items()):
        shown = {}
        for kind in kinds:
            side = 1 + max(y for y, _ in images[kind])
            shown[kind] = np.array([[images[kind][y, x] for x in range(side)] for y in range(side)])
        white = np.percentile(shown["lamp"], 99.5)
        for ax, kind in zip(row, kinds):
            ax.imshow(np.clip(shown[kind] / white, 0, 1) ** (1 / 2.2), cmap="gray", origin="lower", vmin=0, vmax=1)
            ax.set_title(f"{lamp}: " + ("the lamp itself" if kind == "lamp" else KINDS[kind][0]), fontsize=10)
            ax.axis("off")
    figure.tight_layout()
    figure.savefig(picture, dpi=90)


if __name__ == "__main__":
    errors, pictures = read(sys.argv[1])
    table(errors)
    curves(errors, sys.argv[2])
    draw(pictures, sys.argv[3])
