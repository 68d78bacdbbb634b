"""Plots what the modes of emission cost and lose and prints it.

usage: emission.py emission.csv picture.png     as figure_emission_modes writes it
"""
import math
import sys

from common import bias_text, by, percent, pyplot, rows, save, seen_bias

MODES = ("constant", "exact")


def table(lamps):
    for lamp, of_lamp in lamps.items():
        planes = sorted({row["plane"] for row in of_lamp})
        particles = int(of_lamp[0]["particles"])
        print(f"\n**{lamp}**, {int(of_lamp[0]['coefficients'])} coefficients; bias, and the noise of {particles} particles, on planes at {planes} of M's distance\n")
        print("| mode | M particles/s | " + " | ".join(f"at {plane:g}" for plane in planes) + " |")
        print("| --- | --- |" + " --- |" * len(planes))
        for mode, these in by(of_lamp, "mode").items():
            cells = [f"{bias_text(row)}, {percent(row['noise2'])}" for row in sorted(these, key=lambda row: row["plane"])]
            print(f"| {mode} | {these[0]['rate'] / 1e6:.1f} | " + " | ".join(cells) + " |")
        rates = {mode: these[0]["rate"] for mode, these in by(of_lamp, "mode").items()}
        print(f"\n`exact` takes × {rates['constant'] / rates['exact']:.2f} of `constant`'s time.")


def main(source, picture):
    (measured,) = rows(source)
    lamps = by(measured, "lamp")
    table(lamps)
    figure, axes = pyplot.subplots(1, 3, figsize=(11.5, 3.8))
    width = 0.35
    for i, mode in enumerate(MODES):
        these = [next(row for row in of_lamp if row["mode"] == mode) for of_lamp in lamps.values()]
        places = [j + (i - 0.5) * width for j in range(len(lamps))]
        axes[0].bar(places, [row["rate"] / 1e6 for row in these], width, label=mode)
        nearest = [min((row for row in of_lamp if row["mode"] == mode), key=lambda row: row["plane"]) for of_lamp in lamps.values()]
        axes[1].bar(places, [100 * (seen_bias(row) or 0) for row in nearest], width, label=mode)
        axes[2].bar(places, [100 * math.sqrt(row["noise2"]) for row in nearest], width, label=mode)
    for ax, title, unit in zip(axes, ("speed", "bias near S", "noise near S"), ("million particles per second", "%", "%")):
        ax.set_xticks(range(len(lamps)), list(lamps), fontsize=8)
        ax.set_title(title, fontsize=10)
        ax.set_ylabel(unit)
        ax.grid(True, axis="y", linewidth=0.3)
    axes[0].legend(fontsize=8)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
