"""Plots the error of a lamp's far field over the distance and prints from where on it is small.

usage: near_far.py near-far.csv picture.png     as figure_near_far writes it
"""
import math
import sys

from common import by, pyplot, rows, save, size

LIMITS = (0.10, 0.03, 0.01)
KEYS = (("rms", "over the lit square, RMS"), ("worst", "at its worst, of the peak"))


def crossing(points, key, limit):
    """The distance from which on the error stays below the limit, straight in logarithms; none if it never does."""
    for a, b in reversed(list(zip(points, points[1:]))):
        if a[key] > limit:
            if b[key] > limit:
                return None
            part = math.log(a[key] / limit) / math.log(a[key] / max(b[key], 1e-12))
            return a["distance"] * (b["distance"] / a["distance"]) ** part
    return points[0]["distance"]


def text(distance, points):
    if distance is None:
        return f"beyond {points[-1]['distance']:g}"
    return f"{distance:.3g}" if distance > points[0]["distance"] else f"below {distance:g}"


def main(source, picture):
    compared, timed = rows(source)
    lamps = by(compared, "lamp")
    print("Distances in sizes of the lamp from which on the error stays below\n")
    print("| lamp | size | point | error | 10 % | 3 % | 1 % |\n| --- | --- | --- | --- | --- | --- | --- |")
    for lamp, these in lamps.items():
        for point, row in by(these, "point").items():
            where = point if point != "waist" else f"waist, {1e3 * row[0]['waist']:.1f} mm"
            for key, label in KEYS:
                ends = " | ".join(text(crossing(row, key, limit), row) for limit in LIMITS)
                print(f"| {lamp} | {1e3 * row[0]['size']:.0f} mm | {where} | {label} | {ends} |")
    print("\n| lamp | | memory | a particle | a light sample |\n| --- | --- | --- | --- | --- |")
    for row in timed:
        print(f"| {row['lamp']} | {row['model']} | {size(row['bytes'])} | {1e9 * row['sample_Le']:.0f} ns | {1e9 * row['sample_Li']:.0f} ns |")

    figure, axes = pyplot.subplots(1, len(KEYS), figsize=(11, 4), sharey=True)
    for ax, (key, label) in zip(axes, KEYS):
        for i, (lamp, these) in enumerate(lamps.items()):
            for point, style in (("waist", "-"), ("middle of S", ":")):
                row = [r for r in these if r["point"] == point]
                ax.loglog([r["distance"] for r in row], [100 * r[key] for r in row], style, color=f"C{i}", label=lamp if point == "waist" else None)
        for limit in LIMITS:
            ax.axhline(100 * limit, color="grey", linewidth=0.6, linestyle=":")
        ax.axvline(5, color="black", linewidth=0.8, linestyle="--")
        ax.set_title(label, fontsize=10)
        ax.set_xlabel("distance / size of the lamp")
        ax.set_ylim(0.2, 1000)
    axes[0].set_ylabel("error of the far field, %")
    axes[0].legend(fontsize=8, loc="lower left")
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
