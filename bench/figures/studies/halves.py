"""Prints what halves save and lose beside floats, and plots it.

usage: halves.py halves.csv picture.png     as figure_stored_halves writes it
"""
import sys

from common import by, pyplot, rows, save, size


def main(source, picture):
    stored, timed = rows(source)
    lamps = by(stored, "lamp")
    print("| lamp | file: halves, floats | memory: halves, floats, table | coefficients change by | flux by | irradiance by, at most | noise of its rays |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for lamp, these in lamps.items():
        first = these[0]
        worst = max(row["rms"] for row in these)
        noise = f"{100 * first['noise']:.0f} %" if first["noise"] > 0 else "–"
        print(f"| {lamp} | {size(first['half_file'])}, {size(first['float_file'])} | {size(first['half_memory'])}, {size(first['float_memory'])}, {size(first['table'])} | "
              f"{first['coefficient_rms']:.1e} | {first['flux']:.1e} | {worst:.1e} | {noise} |")
    print("\n| lamp | drawing a cell | reading its coefficients: floats | halves |\n| --- | --- | --- | --- |")
    for lamp, these in by(timed, "lamp").items():
        of = {row["storage"]: row for row in these}
        draw = sum(row["draw"] for row in these) / len(these)
        print(f"| {lamp} | {1e9 * draw:.0f} ns | {1e9 * of['floats']['fetch']:.0f} ns | {1e9 * of['halves']['fetch']:.0f} ns |")

    figure, axes = pyplot.subplots(1, 3, figsize=(11.5, 3.6))
    places = range(len(lamps))
    firsts = [these[0] for these in lamps.values()]
    for ax, keys, title, scale, unit in (
        (axes[0], ("half_file", "float_file"), "file", 1e-6, "MB"),
        (axes[1], ("half_memory", "float_memory"), "memory of coefficients", 1e-6, "MB"),
    ):
        for i, key in enumerate(keys):
            ax.bar([p + (i - 0.5) * 0.38 for p in places], [scale * row[key] for row in firsts], 0.38, label=("halves", "floats")[i])
        ax.set_title(title, fontsize=10)
        ax.set_ylabel(unit)
    for i, storage in enumerate(("halves", "floats")):
        axes[2].bar([p + (i - 0.5) * 0.38 for p in places], [1e9 * row["fetch"] for row in timed if row["storage"] == storage], 0.38, label=storage)
    axes[2].set_title("reading a cell's four", fontsize=10)
    axes[2].set_ylabel("ns per particle")
    for ax in axes:
        ax.set_xticks(list(places), list(lamps), fontsize=8)
        ax.grid(True, axis="y", linewidth=0.3)
    axes[0].legend(fontsize=8)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
