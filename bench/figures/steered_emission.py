"""Plots the error of plain and of steered emission and prints what steering gains at equal paths and at equal time.

usage: steered_emission.py FOLDER picture.png SCENE...     the folder as steered_emission.sh fills it
"""
import glob
import json
import math
import os
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

METHODS = {"photonmap": "light paths", "progressive": "passes", "igi": "sets"}
NAMES = {False: "plain", True: "steered"}  # by whether there is a pre-pass


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def read(folder, scene):
    """{(method, pre_pass): [(number, seconds, error, notes)]}, means over the seeds, the references' noise taken off."""
    noise = load(f"{folder}/{scene}-references.json")["relative_mse"] / 2
    runs = {}
    for path in glob.glob(f"{folder}/{scene}-*.json"):
        found = re.fullmatch(rf"{re.escape(scene)}-(photonmap|progressive|igi)-(\d+)-(\d+)-(\d+)\.json", os.path.basename(path))
        if not found:
            continue
        stats = load(path)
        errors = [load(path.replace(".json", f"-{reference}.json"))["relative_mse"] for reference in (101, 102)]
        run = (stats["seconds"]["total"] - stats["seconds"]["read"], sum(errors) / 2 - noise, stats["numbers"])
        runs.setdefault((found[1], int(found[3]) > 0), {}).setdefault(int(found[2]), []).append(run)
    curves = {}
    for key, of_number in runs.items():
        for number, these in sorted(of_number.items()):
            mean = [sum(run[i] for run in these) / len(these) for i in (0, 1)]
            curves.setdefault(key, []).append((number, mean[0], mean[1], these[0][2]))
    return noise, curves


def seconds_to(curve, error):
    """By straight lines in logarithms between the points measured; none beyond them."""
    for (_, t0, e0, _), (_, t1, e1, _) in zip(curve, curve[1:]):
        if e0 >= error >= e1 and e0 > e1:
            return t0 * (t1 / t0) ** (math.log(e0 / error) / math.log(e0 / e1))
    return None


def error_after(curve, seconds):
    """The error of as many seconds, likewise."""
    for (_, t0, e0, _), (_, t1, e1, _) in zip(curve, curve[1:]):
        if t0 <= seconds <= t1 and t0 < t1:
            return e0 * (e1 / e0) ** (math.log(seconds / t0) / math.log(t1 / t0))
    return None


def table(scene, noise, curves):
    print(f"{scene}: relative MSE; the references' own noise, {noise:.2e}, is taken off")
    for method, unit in METHODS.items():
        plain, steered = (curves.get((method, pre_pass), []) for pre_pass in NAMES)
        for (n, t, e, _), (_, ts, es, numbers) in zip(plain, steered):
            sooner = seconds_to(plain, es)
            beyond = f"> {plain[-1][1] / ts:.2f}" if es < plain[-1][2] else "-"
            gain = f"{sooner / ts:.2f}" if sooner else beyond
            then = error_after(plain, ts)
            less = f"{then / es:.2f}" if then else "-"
            print(f"  {method:12} {n:8} {unit:11}  plain {e:.5f} in {t:6.2f} s   steered {es:.5f} in {ts:6.2f} s   "
                  f"error / {e / es:.2f}, at equal time / {less}   sooner x {gain}   blocks {numbers['prepass.blocks']:.0f}, "
                  f"useful {100 * numbers['prepass.useful']:.0f} %, other lights {100 * numbers['prepass.share_of_lights']:.0f} %")


def main():
    folder, picture, *scenes = sys.argv[1:]
    figure, axes = plt.subplots(1, len(scenes), figsize=(4.2 * len(scenes), 3.6), squeeze=False)
    for axis, scene in zip(axes[0], scenes):
        noise, curves = read(folder, scene)
        table(scene, noise, curves)
        for (method, pre_pass), curve in sorted(curves.items()):
            axis.loglog([p[1] for p in curve], [p[2] for p in curve], marker="o", markersize=4,
                        linestyle="-" if pre_pass else "--", color=f"C{list(METHODS).index(method)}",
                        label=f"{method}, {NAMES[pre_pass]}")
        axis.set_title(scene)
        axis.set_xlabel("seconds")
        axis.grid(True, which="both", alpha=0.3)
    axes[0][0].set_ylabel("relative MSE")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(picture, dpi=130)


main()
