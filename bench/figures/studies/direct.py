"""Plots how much sooner than `mc` each way to direct light reaches an error, over the width of the beam.

usage: direct.py FOLDER picture.png     the folder of the study direct.toml

Times are without the reading of the scene. A ratio above 1 says that a method gets to the error sooner, no mark that it never does
with what was measured; `mc` and `guided`, which are unbiased, get everywhere in time.
"""
import math
import os
import sys

from common import by, load, pyplot, save, seconds_to, setting, without_reading

# Half of the intensity lies at this angle in degrees from the axis: cos^N is one half at acos(2^(-1/N)).
WIDTHS = {f"cos^{n}": math.degrees(math.acos(0.5 ** (1 / n))) for n in (1, 10, 100, 1000)}
ERRORS = (0.3, 0.1, 0.05)
UNBIASED = ("mc", "guided")


def times(points):
    """{error: {method: seconds to it, or none}}"""
    methods = by(points, "method")
    return {e: {m: seconds_to(these, e * e, m in UNBIASED) for m, these in methods.items()} for e in ERRORS}


def gain(of_methods, method):
    """mc's time over the method's."""
    seconds = of_methods.get(method)  # none in a study that was stopped
    return None if seconds is None else of_methods["mc"] / seconds


def text(ratio):
    return "never" if ratio is None else f"× {ratio:.2g}"


def table(scenes, all_times, methods):
    print("\n| scene | `mc` to 30, 10, 5 % | " + " | ".join(f"{method}: to 30, 10, 5 %" for method in methods) + " |")
    print("| --- | --- |" + " --- |" * len(methods))
    for scene in scenes:
        of = all_times[scene]
        mc = ", ".join(f"{of[e]['mc']:.2g}" for e in ERRORS)
        cells = " | ".join(", ".join(text(gain(of[e], method)) for e in ERRORS) for method in methods)
        print(f"| {scene} | {mc} s | {cells} |")
    print("\nmc's time over the method's, to that error.\n")
    for scene, points in scenes.items():
        last = next((p for p in reversed(points) if p["method"] == "map"), None)
        if last and last["bias2"]:
            share = max(last["bias2"]["value"], 0) / last["error2"]
            print(f"* {scene}: with {setting(last, 'photons')} photons the map's error is {100 * math.sqrt(last['error2']):.2g} %, {100 * share:.0f} % of its square bias; mean {last['mean_ratio']:.4f}")


def main(folder, picture):
    scenes = by(load(os.path.join(folder, "results.json"))["points"], "scene")
    scenes = {scene: without_reading(points, folder) for scene, points in scenes.items()}
    all_times = {scene: times(points) for scene, points in scenes.items()}
    methods = [m for m in by(next(iter(scenes.values())), "method") if m != "mc"]
    table(scenes, all_times, methods)

    beams = [scene for scene in scenes if scene in WIDTHS]
    others = [scene for scene in scenes if scene not in WIDTHS]
    figure, axes = pyplot.subplots(1, len(ERRORS), figsize=(4.2 * len(ERRORS), 4), sharey=True)
    for ax, error in zip(axes, ERRORS):
        for i, method in enumerate(methods):
            row = [(WIDTHS[s], gain(all_times[s][error], method)) for s in beams]
            row = [(x, y) for x, y in row if y is not None]
            ax.loglog([x for x, _ in row], [y for _, y in row], "o-", color=f"C{i}", label=method)
            for j, scene in enumerate(others):  # beside the row, from left to right
                y = gain(all_times[scene][error], method)
                if y is not None:
                    ax.loglog([0.9 / 1.35**j], [y], "D", color=f"C{i}", markersize=4)
        for j, scene in enumerate(others):
            ax.text(0.9 / 1.35**j, 0.011, scene, rotation=90, fontsize=7, ha="center", va="bottom", color="grey")
        ax.axhline(1, color="black", linewidth=0.8)
        ax.invert_xaxis()
        ax.set_xticks([60, 20, 7, 2], ["60°", "20°", "7°", "2°"])
        ax.minorticks_off()
        ax.set_xlabel("half-width of the beam")
        ax.set_title(f"to an error of {100 * error:g} %", fontsize=10)
        ax.grid(True, linewidth=0.3)
    axes[0].set_ylim(0.01, 100)
    axes[0].set_ylabel("mc's time over the method's")
    axes[0].legend(fontsize=7, loc="upper left")
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
