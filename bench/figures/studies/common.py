"""What the studies' plots share: reading results, and the time that a curve takes to an error."""
import csv
import json
import math
import os

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "lucerna"
from matplotlib import pyplot  # noqa: E402,F401


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def by(things, key):
    """{key of a thing: [things]} in the order in which keys first come."""
    groups = {}
    for thing in things:
        groups.setdefault(thing[key], []).append(thing)
    return groups


def setting(point, name):
    """The value of a setting written down for a point, as text; none if it was not."""
    for word in point["settings"].split():
        key, value = word.split("=", 1)
        if key == name:
            return value
    return None


def front(points):
    """The points that nothing beats in both time and error, fastest first."""
    best, kept = math.inf, []
    for point in sorted(points, key=lambda p: (p["seconds"], p["error2"])):
        if point["error2"] < best:
            best = point["error2"]
            kept.append(point)
    return kept


def seconds_to(points, error2, unbiased=False):
    """The time to an error along the front, straight in logarithms; none if it is not reached.

    Of an error that the fastest point undercuts the time is that point's: nothing faster was measured. What is unbiased
    gets everywhere: beyond its best point squared errors fall as one over the time."""
    curve = front(points)
    if not curve:
        return None
    if error2 < curve[-1]["error2"]:
        return curve[-1]["seconds"] * curve[-1]["error2"] / error2 if unbiased else None
    if error2 >= curve[0]["error2"]:
        return curve[0]["seconds"]
    for a, b in zip(curve, curve[1:]):
        if a["error2"] >= error2 >= b["error2"]:
            part = math.log(a["error2"] / error2) / math.log(a["error2"] / b["error2"])
            return a["seconds"] * (b["seconds"] / a["seconds"]) ** part
    return None


def slope(pairs):
    """Of the least-squares line through the logarithms of (x, y)."""
    xs, ys = [math.log(x) for x, _ in pairs], [math.log(y) for _, y in pairs]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def save(figure, picture):
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


def without_reading(points, folder):
    """The points with the reading of the scene taken off their times, as the notes of their renders have it.

    It is the same for every method, and at the sizes of a study as long as an image."""
    runs = os.path.join(folder, "runs")
    shortened = []
    for point in points:
        notes = load(os.path.join(runs, os.path.splitext(point["image"])[0] + ".json"))
        # A millisecond remains of a time that was all reading: the note is that of one seed, the time the mean of all.
        shortened.append({**point, "seconds": max(point["seconds"] - notes["seconds"]["read"], 1e-3)})
    return shortened


def rows(path):
    """The tables of a file of comma-separated values: parts are parted by a line "#", numbers are numbers."""

    def value(word):
        try:
            return float(word)
        except ValueError:
            return word

    with open(path, newline="", encoding="utf-8") as file:
        parts = file.read().split("#\n")
    return [[{key: value(word) for key, word in row.items()} for row in csv.DictReader(part.splitlines())] for part in parts]


def percent(square):
    """The root of a relative square, as text; what is below 0 is none."""
    return "none" if square <= 0 else f"{100 * math.sqrt(square):.2g} %"


def seen_bias(row):
    """The bias of a row as a share, where it stands out of its noise; else none."""
    return math.sqrt(row["bias2"]) if row["bias2"] > 3 * row["bias2_error"] else None


def bias_text(row):
    bias = seen_bias(row)
    return f"< {100 * math.sqrt(3 * row['bias2_error']):.1g} %" if bias is None else f"{100 * bias:.2g} %"


def size(count):
    """Bytes as text."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"
