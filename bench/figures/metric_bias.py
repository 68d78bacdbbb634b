"""Plots the bias of a photon's distance and prints it as tables; shows the error on the floor of a corner.

usage: metric_bias.py means.csv corner.csv bias.png corner.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PANELS = (
    ("corner", "t", "corner, even sky", "distance from the wall / radius"),
    ("corner, 20 degrees", "t", "corner, light 20° from the vertical", "distance from the wall / radius"),
    ("corner, 60 degrees", "t", "corner, light 60° from the vertical", "distance from the wall / radius"),
    ("edge", "t", "convex edge", "distance from the edge / radius"),
    ("inside sphere", "size", "inside a sphere", "sphere's radius / radius"),
    ("outside sphere", "size", "outside a sphere", "sphere's radius / radius"),
    ("cylinder", "size", "thin cylinder", "cylinder's radius / radius"),
    ("shelf", "size", "in the dark under a lit shelf", "shelf's height / radius"),
)


def read(file):
    with open(file, newline="") as rows:
        return list(csv.DictReader(rows))


def bias(row):
    return 100 * (float(row["estimate"]) - float(row["exact"]))


def plot(rows, picture):
    measures = list(dict.fromkeys(row["measure"] for row in rows))
    figure, axes = plt.subplots(2, 4, figsize=(14, 6.4))
    for ax, (shape, key, title, label) in zip(axes.flat, PANELS):
        values = sorted({float(row[key]) for row in rows if row["shape"] == shape})
        print(f"| {title}: {label} | {' | '.join(f'{v:g}' for v in values)} |\n| --- |{' --- |' * len(values)}")
        for measure in measures:
            found = {float(row[key]): bias(row) for row in rows if row["shape"] == shape and row["measure"] == measure}
            ax.plot(values, [found[v] for v in values], marker=".", label=measure)
            print(f"| {measure} | {' | '.join(f'{found[v]:+.1f}' for v in values)} |")
        print()
        if key == "size":
            ax.set_xscale("log")
            ax.set_xticks(values, [f"{v:g}" for v in values])
            ax.minorticks_off()
        ax.axhline(0, color="black", linewidth=0.6)
        ax.set_title(title, fontsize=10)
        ax.set_xlabel(label, fontsize=8)
    for ax in axes[:, 0]:
        ax.set_ylabel("bias, % of the full irradiance", fontsize=8)
    axes[0, 0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)
    behind = [row for row in rows if row["shape"] == "behind"]
    print("lit from behind: " + ", ".join(f"{row['measure']} {float(row['estimate']):g}" for row in behind))


def show(rows, picture):
    measures = list(dict.fromkeys(row["measure"] for row in rows))
    figure, axes = plt.subplots(1, len(measures), figsize=(2.2 * len(measures), 2.7), layout="constrained")
    shown = None
    for ax, measure in zip(axes, measures):
        values = [100 * (float(row["estimate"]) - 1) for row in rows if row["measure"] == measure]
        side = round(len(values) ** 0.5)
        grid = [values[i * side : (i + 1) * side] for i in range(side)]
        shown = ax.imshow(grid, cmap="RdBu_r", vmin=-50, vmax=50, origin="lower", interpolation="nearest")
        ax.set_title(measure, fontsize=8)
        ax.set_xticks([])
        ax.set_yticks([])
    axes[0].set_ylabel("wall at the left", fontsize=8)
    figure.colorbar(shown, ax=axes, label="error, %", shrink=0.8)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    means, corner, bias_png, corner_png = sys.argv[1:5]
    plot(read(means), bias_png)
    show(read(corner), corner_png)
