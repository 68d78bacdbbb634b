#!/usr/bin/env python3
"""Draws slide.png, the slide of the measured projector: a lighthouse, its beams and its name, light on dark.

python3 scenes/lamps/projector/make.py        needs nothing but Python
"""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent))
from workshop import write_png  # noqa: E402

WIDTH, HEIGHT, SUB = 360, 240, 4  # pixels, and samples per pixel and axis
STROKE = 0.145  # of a letter's width, half


def segment(x, y, ax, ay, bx, by):
    """The distance to a line between two points."""
    dx, dy = bx - ax, by - ay
    t = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
    t = min(1.0, max(0.0, t))
    return math.hypot(x - ax - t * dx, y - ay - t * dy)


def arc(x, y, cx, cy, r, start, end):
    """The distance to a circle's part, from the angle start up to end, in degrees."""
    a = math.degrees(math.atan2(y - cy, x - cx))
    while a < start:
        a += 360
    if a <= end:
        return abs(math.hypot(x - cx, y - cy) - r)
    ends = ((cx + r * math.cos(math.radians(t)), cy + r * math.sin(math.radians(t))) for t in (start, end))
    return min(math.hypot(x - ex, y - ey) for ex, ey in ends)


# Letters 1 wide and 1.5 high, as the distance to their strokes' middles.
def strokes(*lines):
    return lambda x, y: min(segment(x, y, *line) for line in lines)


def bowl(*parts):
    return lambda x, y: min(part(x, y) for part in parts)


LETTERS = [
    strokes((0.1, 0, 0.1, 1.5), (0.1, 0, 0.9, 0)),  # L
    bowl(strokes((0.1, 0.4, 0.1, 1.5), (0.9, 0.4, 0.9, 1.5)), lambda x, y: arc(x, y, 0.5, 0.4, 0.4, 180, 360)),  # U
    bowl(strokes((0.1, 0.45, 0.1, 1.05)), lambda x, y: arc(x, y, 0.55, 1.05, 0.45, 35, 180),
         lambda x, y: arc(x, y, 0.55, 0.45, 0.45, 180, 325)),  # C
    strokes((0.1, 0, 0.1, 1.5), (0.1, 0, 0.85, 0), (0.1, 0.78, 0.75, 0.78), (0.1, 1.5, 0.85, 1.5)),  # E
    bowl(strokes((0.1, 0, 0.1, 1.5), (0.1, 1.5, 0.5, 1.5), (0.1, 0.7, 0.5, 0.7), (0.4, 0.7, 0.9, 0)),
         lambda x, y: arc(x, y, 0.5, 1.1, 0.4, 270, 450)),  # R
    strokes((0.1, 0, 0.1, 1.5), (0.1, 1.5, 0.9, 0), (0.9, 0, 0.9, 1.5)),  # N
    strokes((0.02, 0, 0.5, 1.5), (0.5, 1.5, 0.98, 0), (0.22, 0.5, 0.78, 0.5)),  # A
]


def word(x, y):
    """LUCERNA across the slide; y from its foot up."""
    if not 0.05 < y < 0.32:  # above and below all letters
        return False
    pitch = 0.206  # of a letter, in heights of the slide
    at = (x + 3.5 * pitch) / pitch
    index = math.floor(at)
    if not 0 <= index < len(LETTERS):
        return False
    scale = 0.145  # of a letter's width
    return LETTERS[index]((at - index - 0.5) * pitch / scale + 0.5, (y - 0.075) / scale) < STROKE


def lighthouse(x, y):
    """A tower with two bands, a gallery, a lantern and its dome; beams to both sides."""
    if 0.08 < abs(x) < 0.72 and abs(y - 0.81) < 0.022 + 0.11 * (abs(x) - 0.08):
        return True
    if 0.36 < y < 0.70:  # the tower narrows
        return abs(x) < 0.085 - 0.11 * (y - 0.36) and not (0.44 < y < 0.50 or 0.58 < y < 0.64)
    if 0.715 < y < 0.745:
        return abs(x) < 0.085
    if 0.76 < y < 0.86:
        return abs(x) < 0.045
    return y > 0.872 and math.hypot(x / 0.065, (y - 0.872) / 0.07) < 1


def pixel(column, row):
    hits = 0
    for i in range(SUB):
        for j in range(SUB):
            x = (column + (i + 0.5) / SUB - WIDTH / 2) / HEIGHT
            y = 1 - (row + (j + 0.5) / SUB) / HEIGHT
            hits += word(x, y) or lighthouse(x, y)
    value = hits / SUB**2
    grey = 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055
    return grey, grey, grey


if __name__ == "__main__":
    write_png(HERE / "slide.png", WIDTH, HEIGHT, pixel)
