"""Plots error against time for every scene of a study and prints the points that nothing beats.

usage: trade.py results.json picture.png
"""
import math
import sys

from common import by, front, load, percent, pyplot, save


def draw(ax, scene, points):
    for i, (method, these) in enumerate(by(points, "method").items()):
        ax.loglog([p["seconds"] for p in these], [math.sqrt(p["error2"]) for p in these], ".", color=f"C{i}", label=method)
    best = front(points)
    ax.step([p["seconds"] for p in best], [math.sqrt(p["error2"]) for p in best], where="post", color="grey", linewidth=0.8)
    ax.set_title(scene, fontsize=10)
    ax.set_xlabel("seconds")
    ax.grid(True, which="both", linewidth=0.3)


def parts(point):
    """Bias and noise as shares, where there are seeds to tell them apart."""
    if point["bias2"] is None:
        return "", ""
    return percent(point["bias2"]["value"]), percent(point["noise2"]["value"])


def main(results, picture):
    study = load(results)
    scenes = by(study["points"], "scene")
    figure, axes = pyplot.subplots(1, len(scenes), figsize=(min(4.2 * len(scenes), 26), 3.9), squeeze=False)
    for ax, (scene, points) in zip(axes[0], scenes.items()):
        draw(ax, scene, points)
        print(f"\n**{scene}**: what nothing beats in time and error\n")
        print("| method | settings | seconds | error | bias | noise | mean |\n| --- | --- | --- | --- | --- | --- | --- |")
        for p in front(points):
            bias, noise = parts(p)
            print(f"| {p['method']} | `{p['settings']}` | {p['seconds']:.2f} | {percent(p['error2'])} | {bias} | {noise} | {p['mean_ratio']:.4f} |")
    print()
    for line in study["advice"]:
        print(f"* {line}")
    axes[0][0].set_ylabel("relative error (RMS)")
    axes[0][0].legend(fontsize=7)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:3])
