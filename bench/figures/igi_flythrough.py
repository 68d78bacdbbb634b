#!/usr/bin/env python3
"""Draws the courses that figure_igi_flythrough writes: pieces of surface over frames, by fresh seeds and by one seed.

usage: igi_flythrough.py picture.svg SERIES.txt
"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def main():
    picture, series = sys.argv[1:]
    with open(series, encoding="utf-8") as file:
        pieces = [[[float(word) for word in line.split()] for line in block.splitlines()]
                  for block in file.read().strip().split("\n\n")]
    figure, axes = plt.subplots(1, len(pieces), figsize=(3.4 * len(pieces), 2.8), sharey=True, squeeze=False)
    for axis, rows in zip(axes[0], pieces):
        frames, fresh, fixed = zip(*rows)
        axis.plot(frames, fresh, color="C1", marker="o", markersize=3, label="fresh seeds")
        axis.plot(frames, fixed, color="C0", marker="o", markersize=3, label="one seed")
        axis.set_xlabel("frame")
        axis.grid(True, alpha=0.3)
    axes[0][0].set_ylabel("illuminance over its mean")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(picture)


main()
