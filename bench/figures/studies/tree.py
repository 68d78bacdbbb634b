"""Prints our tree beside FLANN's, in whole renders and in searches alone, and plots the ratios.

usage: tree.py FOLDER picture.png     the folder of the study tree.toml, and searches.json in it
"""
import os
import re
import sys

from common import load, pyplot, save, setting, without_reading


def renders(folder):
    """[(what, ours, FLANN's seconds, the largest difference of their errors)]"""
    points = without_reading(load(os.path.join(folder, "results.json"))["points"], folder)
    found = []
    for ours in (p for p in points if setting(p, "index") == "tree"):
        other = ours["settings"].replace("index=tree", "index=flann")
        flann = next(p for p in points if p["settings"] == other and p["scene"] == ours["scene"])
        what = " ".join(w for w in ours["settings"].split() if not w.startswith(("index=", "boundary=")))
        found.append((what, ours["seconds"], flann["seconds"], abs(ours["error2"] - flann["error2"])))
    return found


def searches(folder):
    """[(k or "build", photons, ours, ratio, unit)]"""
    found = []
    for run in load(os.path.join(folder, "searches.json"))["benchmarks"]:
        name = re.match(r"tree/(k_nearest|build)/(\d+)/(\d+)", run["name"])
        unit = "us" if name[1] == "k_nearest" else "ms"
        kind = f"k = {name[3]}" if name[1] == "k_nearest" else f"building, {name[3]} threads"
        found.append((kind, int(name[2]), run[f"tree_{unit}"], run["flann/tree"], unit))
    return found


def main(folder, picture):
    of_renders, of_searches = renders(folder), searches(folder)
    print("| whole render | ours | FLANN | FLANN's over ours |\n| --- | --- | --- | --- |")
    for what, ours, flann, difference in of_renders:
        if difference != 0:
            print(f"tree.py: {what}: the two images differ", file=sys.stderr)
        print(f"| `{what}` | {ours:.2f} s | {flann:.2f} s | × {flann / ours:.2f} |")
    print("\n| search alone | photons | ours | FLANN's over ours |\n| --- | --- | --- | --- |")
    for kind, photons, ours, ratio, unit in of_searches:
        print(f"| {kind} | {photons} | {ours:.3g} {unit} | × {ratio:.1f} |")

    figure, axes = pyplot.subplots(1, 2, figsize=(12, 4.4))
    for ax, names, ratios, title in (
        (axes[0], [f"{kind}, {photons:,}" for kind, photons, *_ in of_searches], [s[3] for s in of_searches], "searches alone"),
        (axes[1], [r[0] for r in of_renders], [r[2] / r[1] for r in of_renders], "whole renders"),
    ):
        ax.barh(range(len(names)), ratios)
        ax.set_yticks(range(len(names)), names, fontsize=7)
        ax.invert_yaxis()
        ax.axvline(1, color="black", linewidth=0.8)
        ax.set_xlabel("FLANN's time over ours")
        ax.set_title(title, fontsize=10)
        ax.grid(True, axis="x", linewidth=0.3)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
