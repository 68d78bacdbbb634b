"""Plots how much sooner than `mc` each way to direct light reaches an error, over the width of the beam.

usage: direct.py FOLDER picture.png     the folder of the study direct.toml

Times are without the reading of the scene. Errors are those that `mc` has with its first three numbers of samples per pixel: a ratio
above 1 says that a method gets there sooner, no mark that it never does.
"""
import math
import os
import sys

from common import by, load, pyplot, save, seconds_to, setting, without_reading

# Half of the intensity within so many degrees of the axis: cos^N is a half at acos(2^(-1/N)).
WIDTHS = {f"cos^{n}": math.degrees(math.acos(0.5 ** (1 / n))) for n in (1, 10, 100, 1000)}


def sample_counts(points):
    """Of mc, ascending, without the last: beyond it there is no curve."""
    counts = sorted({int(setting(p, "spp")) for p in points if p["method"] == "mc"})
    return [str(n) for n in (counts[:-1] or counts)[:3]]


def gains(points):
    """{samples of mc: {method: mc's time over the method's to mc's error, or none}}"""
    methods = by(points, "method")
    found = {}
    for samples in sample_counts(points):
        mc = next((p for p in methods["mc"] if setting(p, "spp") == samples), None)
        if mc is None:
            continue
        times = {method: seconds_to(these, mc["error2"]) for method, these in methods.items()}
        found[samples] = {method: None if t is None else mc["seconds"] / t for method, t in times.items()}
    return found


def text(gain):
    return "never" if gain is None else f"× {gain:.2g}"


def table(scenes, all_gains):
    methods = [m for m in by(next(iter(scenes.values())), "method") if m != "mc"]
    print("\n| scene | error of `mc` | " + " | ".join(methods) + " |")
    print("| --- | --- |" + " --- |" * len(methods))
    for scene, points in scenes.items():
        for samples, gain in all_gains[scene].items():
            mc = next(p for p in points if p["method"] == "mc" and setting(p, "spp") == samples)
            cells = " | ".join(text(gain.get(method)) for method in methods)
            print(f"| {scene}, {samples} samples | {100 * math.sqrt(mc['error2']):.2g} %, {mc['seconds']:.2f} s | {cells} |")
    print("\nmc's time over the method's, to that error.\n")
    for scene, points in scenes.items():
        last = [p for p in points if p["method"] == "map"][-1]
        if last["bias2"]:
            share = last["bias2"]["value"] / last["error2"]
            print(f"* {scene}: with {setting(last, 'photons')} photons {100 * share:.0f} % of the map's squared error is bias, mean {last['mean_ratio']:.4f}")


def main(folder, picture):
    scenes = by(load(os.path.join(folder, "results.json"))["points"], "scene")
    scenes = {scene: without_reading(points, folder) for scene, points in scenes.items()}
    counts = sample_counts(next(iter(scenes.values())))
    all_gains = {scene: gains(points) for scene, points in scenes.items()}
    table(scenes, all_gains)

    beams = [scene for scene in scenes if scene in WIDTHS]
    others = [scene for scene in scenes if scene not in WIDTHS]
    methods = [m for m in by(next(iter(scenes.values())), "method") if m != "mc"]
    figure, axes = pyplot.subplots(1, len(counts), figsize=(4.2 * len(counts), 4), sharey=True, squeeze=False)
    for ax, samples in zip(axes[0], counts):
        for i, method in enumerate(methods):
            row = [(WIDTHS[s], all_gains[s].get(samples, {}).get(method)) for s in beams]
            row = [(x, y) for x, y in row if y is not None]
            ax.loglog([x for x, _ in row], [y for _, y in row], "o-", color=f"C{i}", label=method)
            for j, scene in enumerate(others):  # beside the row, from left to right
                y = all_gains[scene].get(samples, {}).get(method)
                if y is not None:
                    ax.loglog([0.9 / 1.35**j], [y], "D", color=f"C{i}", markersize=4)
        for j, scene in enumerate(others):
            ax.text(0.9 / 1.35**j, 0.011, scene, rotation=90, fontsize=7, ha="center", va="bottom", color="grey")
        ax.axhline(1, color="black", linewidth=0.8)
        ax.invert_xaxis()
        ax.set_xticks([60, 20, 7, 2], ["60°", "20°", "7°", "2°"])
        ax.minorticks_off()
        ax.set_xlabel("half-width of the beam")
        ax.set_title(f"to the error of mc with {samples} samples", fontsize=10)
        ax.grid(True, linewidth=0.3)
    axes[0][0].set_ylim(0.01, 100)
    axes[0][0].set_ylabel("mc's time over the method's")
    axes[0][0].legend(fontsize=7, loc="upper left")
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
