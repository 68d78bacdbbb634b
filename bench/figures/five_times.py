"""Plots the errors of far-field lamps over the distance and prints where they fall below 10, 3 and 1 %.

usage: five_times.py five-times.csv picture.png
"""
import csv
import math
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

LIMITS = (0.10, 0.03, 0.01)
MEASURES = (("axis", "in the middle"), ("rms", "over the surface, RMS"), ("worst", "over the surface, worst"))


def read(file):
    lamps = {}
    with open(file, newline="") as rows:
        for row in csv.DictReader(rows):
            lamp = lamps.setdefault(row["lamp"], {"distance": [], "axis": [], "rms": [], "worst": []})
            for key in lamp:
                lamp[key].append(abs(float(row[key])))
    return lamps


def crossing(distances, errors, limit):
    """The distance from which on the error stays below the limit; none if it never does."""
    for i in range(len(errors) - 1, -1, -1):
        if errors[i] > limit:
            if i + 1 == len(errors):
                return None
            # Interpolates linearly in logarithms between the two distances.
            low, high = math.log(errors[i] / limit), math.log(max(errors[i + 1], 1e-9) / limit)
            part = low / (low - high)
            return distances[i] * (distances[i + 1] / distances[i]) ** part
    return 0.0


def text(distance, first, last):
    if distance is None:
        return f"> {last:g}"
    return f"{distance:.2f}" if distance > 0 else f"< {first:g}"


def main(source, picture):
    lamps = read(source)
    print("| lamp | error | 10 % | 3 % | 1 % |\n| --- | --- | --- | --- | --- |")
    for name, lamp in lamps.items():
        for key, label in MEASURES:
            ends = (text(crossing(lamp["distance"], lamp[key], limit), lamp["distance"][0], lamp["distance"][-1]) for limit in LIMITS)
            print(f"| {name} | {label} | {' | '.join(ends)} |")
    figure, axes = plt.subplots(1, len(MEASURES), figsize=(11, 3.8), sharey=True)
    for ax, (key, label) in zip(axes, MEASURES):
        for name, lamp in lamps.items():
            of_opening = name.endswith(" (opening)")
            same = [line for line in ax.get_lines() if line.get_label() == name.removesuffix(" (opening)")]
            ax.loglog(lamp["distance"], [100 * max(e, 1e-6) for e in lamp[key]], "--" if of_opening else "-",
                      color=same[0].get_color() if same else None, label=name)
        for limit in LIMITS:
            ax.axhline(100 * limit, color="grey", linewidth=0.6, linestyle=":")
        ax.axvline(5, color="black", linewidth=0.8, linestyle="--")
        ax.set_title(label, fontsize=10)
        ax.set_xlabel("distance / size of the lamp")
        ax.set_xticks([0.5, 1, 2, 5, 10, 20], ["0.5", "1", "2", "5", "10", "20"])
        ax.minorticks_off()
        ax.set_ylim(0.03, 400)
    axes[0].set_ylabel("error of the far field, %")
    axes[0].set_yticks([0.1, 1, 3, 10, 100], ["0.1", "1", "3", "10", "100"])
    axes[1].legend(fontsize=8, loc="lower left")
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:3])
