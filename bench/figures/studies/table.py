"""Plots what the resolution of a lamp's table is worth and prints it.

usage: table.py table.csv picture.png     as figure_table_resolution writes it
"""
import math
import sys

from common import bias_text, by, pyplot, rows, save, seen_bias, size


def main(source, picture):
    (measured,) = rows(source)
    planes = sorted({row["plane"] for row in measured})
    modes = by(measured, "mode")
    print(f"Error of irradiance beside the disc's own, `constant` and `exact`, on planes at {planes} of M's distance\n")
    print("| views, pixels | cells | field, table | built in | M particles/s | " + " | ".join(f"at {plane:g}" for plane in planes) + " |")
    print("| --- | --- | --- | --- | --- |" + " --- |" * len(planes))
    for cells, these in by(measured, "cells").items():
        first = these[0]
        of_mode = {mode: {row["plane"]: row for row in m} for mode, m in by(these, "mode").items()}
        rates = ", ".join(f"{next(iter(of_mode[mode].values()))['rate'] / 1e6:.1f}" for mode in ("constant", "exact"))
        errors = [", ".join(bias_text(of_mode[mode][plane]) for mode in ("constant", "exact")) for plane in planes]
        print(f"| {first['views']:g}², {first['pixels']:g}² | {cells:.3g} | {size(first['field_bytes'])}, {size(first['table_bytes'])} | {first['build_seconds']:.2g} s | {rates} | " + " | ".join(errors) + " |")

    figure, axes = pyplot.subplots(1, 3, figsize=(11.5, 3.8))
    for i, (mode, these) in enumerate(modes.items()):
        of_plane = by(these, "plane")
        nearest = of_plane[planes[0]]
        axes[0].semilogx([row["cells"] for row in nearest], [row["rate"] / 1e6 for row in nearest], "o-", color=f"C{i}", label=mode)
        for plane, style in zip(planes, ("o-", "s--", "^:")):
            biased = [row for row in of_plane[plane] if seen_bias(row) is not None]
            axes[1].loglog([row["cells"] for row in biased], [100 * seen_bias(row) for row in biased], style, color=f"C{i}", label=f"{mode}, plane at {plane:g}")
        axes[2].loglog([row["cells"] for row in nearest], [100 * math.sqrt(row["noise2"]) for row in nearest], "o-", color=f"C{i}", label=mode)
    for ax, title, unit in zip(axes, ("speed", "error without noise", f"noise of {int(measured[0]['particles'])} particles, near S"),
                               ("million particles per second", "%", "%")):
        ax.set_title(title, fontsize=10)
        ax.set_xlabel("cells")
        ax.set_ylabel(unit)
        ax.grid(True, which="both", linewidth=0.3)
        ax.legend(fontsize=6)
    axes[0].set_ylim(bottom=0)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
