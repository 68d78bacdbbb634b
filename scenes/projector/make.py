"""A dark room in which a three-tube projector throws a landscape on the wall; rows of seats before it.

Metres; y up, the wall is z = 6. Each tube is a point of one primary behind a slide of its own: a screen of strips, cut so
that each cell of the picture lets through as much as it is bright. The slides are the wall's picture drawn towards the
tubes, so the three fall on each other.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, Noise, at, box, circle, here, lathe, loft, prism, stone_picture, write_all  # noqa: E402

ACROSS, DOWN = 144, 90           # cells of the picture
LEFT, RIGHT, LOW, HIGH, WALL = -1.9, 1.9, 0.85, 3.225, 6.0
TUBES = [(-0.13, 1.02, 1.2), (0.0, 1.02, 1.2), (0.13, 1.02, 1.2)]
THROW = 0.012                    # share of the way to the wall at which the slides stand


def landscape():
    """An evening: sky, sun, four ridges, a lake that mirrors them. A function of (u, v) from 0 to 1, linear colours."""
    noise = [Noise(40 + i, 3, 5) for i in range(5)]

    def ridge(layer, u):
        base = (0.60, 0.53, 0.46, 0.40)[layer]
        rough = (0.30, 0.24, 0.18, 0.10)[layer]
        return base + rough * (noise[layer](u * (0.55 + 0.13 * layer) + 0.1 * layer, 0.3) - 0.5)

    def above(u, v):
        sun = math.hypot((u - 0.64) * 1.6, v - 0.63)
        glow = math.exp(-sun * sun * 22)
        t = max(0.0, min(1.0, (v - 0.4) / 0.6))
        cloud = max(0.0, noise[4](u * 0.9, v * 3.2) - 0.52) * 2.2 * (1 - 0.5 * t)
        sky = [a + (b - a) * t for a, b in zip((1.0, 0.42, 0.16), (0.05, 0.13, 0.42))]
        color = [s + glow * g + cloud * c for s, g, c in zip(sky, (0.6, 0.42, 0.16), (0.75, 0.26, 0.24))]
        if sun < 0.075:
            color = [1.0, 0.93, 0.70]
        for layer in range(4):
            if v < ridge(layer, u):
                haze = (0.62, 0.36, 0.16, 0.0)[layer]
                body = (0.030, 0.038, 0.075)
                color = [b + haze * (s - b) for b, s in zip(body, (0.60, 0.27, 0.26))]
        return color

    def color(u, v):
        shore = 0.30
        if v >= shore:
            return above(u, v)
        depth = (shore - v) / shore
        wave = 0.012 * math.sin(90 * depth ** 0.6 + 9 * noise[4](u * 2, v * 6)) * depth
        mirror = above(u + wave, shore + (shore - v) * 1.55 + wave)
        return [0.62 * m + 0.01 for m in mirror]
    return color


def slides(parts):
    picture = landscape()
    dice = random.Random(6)
    wide, tall = (RIGHT - LEFT) / ACROSS, (HIGH - LOW) / DOWN
    for i in range(ACROSS):
        for k in range(DOWN):
            value = picture((i + 0.5) / ACROSS, (k + 0.5) / DOWN)
            x, y, side = LEFT + wide * i, LOW + tall * k, dice.randrange(4)
            for tube, v in zip(TUBES, value):
                shut = 1 - max(0.004, min(1.0, 0.9 * v))
                # The strip lies at any of the cell's sides: rows all alike would beat with the image's pixels.
                x0, x1 = ((x, x + wide), (x, x + wide), (x, x + wide * shut), (x + wide * (1 - shut), x + wide))[side]
                y0, y1 = ((y, y + tall * shut), (y + tall * (1 - shut), y + tall), (y, y + tall), (y, y + tall))[side]
                strip(parts["slides"], tube, x0, x1, y0, y1)
    for tube in TUBES:  # the frame round the picture
        far = 3.0
        strip(parts["slides"], tube, LEFT - far, LEFT, LOW - far, HIGH + far)
        strip(parts["slides"], tube, RIGHT, RIGHT + far, LOW - far, HIGH + far)
        strip(parts["slides"], tube, LEFT, RIGHT, LOW - far, LOW)
        strip(parts["slides"], tube, LEFT, RIGHT, HIGH, HIGH + far)


def strip(mesh, tube, x0, x1, y0, y1):
    """A rectangle of the wall, drawn towards a tube."""
    if y1 <= y0:
        return
    toward = lambda x, y: tuple(t + THROW * (w - t) for t, w in zip(tube, (x, y, WALL)))
    mesh.quad(toward(x0, y0), toward(x1, y0), toward(x1, y1), toward(x0, y1))


def projector(parts):
    """A case with three hoods, on a table."""
    body, metal = parts["black"], parts["metal"]
    body.join(box(-0.30, 0.30, 0.86, 1.18, 0.62, 1.10, 0.03))
    for x, y, z in TUBES:
        hood = lathe([(0.057, 0.0), (0.063, 0.0), (0.063, 0.15), (0.057, 0.15), (0.057, 0.0)], 28)
        body.join(hood, lambda p: (x + p[0], y + p[2], z - 0.06 + p[1]))
        ring = lathe([(0.063, 0.12), (0.069, 0.125), (0.069, 0.145), (0.063, 0.15)], 28)
        metal.join(ring, lambda p: (x + p[0], y + p[2], z - 0.06 + p[1]))
    parts["wood"].join(box(-0.5, 0.5, 0.80, 0.84, 0.45, 1.35, 0.01))
    for x in (-0.44, 0.44):
        for z in (0.52, 1.28):
            parts["wood"].join(box(x - 0.03, x + 0.03, 0.0, 0.80, z - 0.03, z + 0.03, 0.006))
    body.join(box(-0.2, 0.2, 0.84, 0.87, 0.68, 1.0))


def armchair():
    """A seat with a rounded back and arms."""
    cloth = Mesh()
    cloth.join(box(-0.30, 0.30, 0.18, 0.44, -0.30, 0.34, 0.06))
    for s in (-1, 1):
        cloth.join(box(s * 0.38 - 0.085, s * 0.38 + 0.085, 0.10, 0.60, -0.36, 0.34, 0.06))
    rings = []
    for i in range(9):
        t = i / 8
        y, lean = 0.30 + 0.62 * t, -0.30 - 0.12 * t
        half = 0.36 * math.sqrt(max(0.05, 1 - max(0.0, (t - 0.55) / 0.47) ** 2))
        thick = 0.085 * (1 - 0.55 * t * t)
        front = [(half * math.cos(a), y, lean + thick * math.sin(a) + 0.05 * math.cos(a) ** 2)
                 for a in (2 * math.pi * k / 20 for k in range(20))]
        rings.append(front)
    cloth.join(loft(rings))
    return cloth


def room(parts):
    wall, floor = parts["wall"], parts["floor"]
    x, z0, high = 3.9, -1.6, 3.7
    wall.quad((-x, 0, WALL), (x, 0, WALL), (x, high, WALL), (-x, high, WALL))
    for s in (-1, 1):
        parts["side"].quad((s * x, 0, z0), (s * x, 0, WALL), (s * x, high, WALL), (s * x, high, z0))
    parts["side"].quad((-x, 0, z0), (x, 0, z0), (x, high, z0), (-x, high, z0))
    parts["ceiling"].quad((-x, high, z0), (x, high, z0), (x, high, WALL), (-x, high, WALL))
    for k in range(44):  # boards with chamfered edges
        e = x * 2 / 44
        board = box(-x + e * k + 0.002, -x + e * (k + 1) - 0.002, -0.03, 0.0, z0, WALL, 0.004)
        floor.join(board)
    parts["trim"].join(box(-x, x, 0.0, 0.12, WALL - 0.02, WALL, 0.006))
    for s in (-1, 1):
        parts["trim"].join(box(min(s * x, s * (x - 0.02)), max(s * x, s * (x - 0.02)), 0.0, 0.12, z0, WALL, 0.006))
    beam = box(-x, x, high - 0.22, high, -0.09, 0.09, 0.02)
    parts["wood"].join(beam, *[at(0, 0, z) for z in (0.2, 1.9, 3.6, 5.3)])
    # Long curtains at both sides of the picture.
    for s in (-1, 1):
        fold = []
        for i in range(61):
            u = i / 60
            cx = s * (2.55 + 1.2 * u)
            fold.append((cx, WALL - 0.16 + 0.06 * math.sin(40 * u) + 0.02 * math.sin(91 * u + s)))
        rings = [[(px, y, pz) for px, pz in fold] for y in (0.02, 3.45)]
        parts["curtain"].join(loft(rings, closed=False))
    rod = lathe([(0.018, -3.8), (0.018, 3.8)], 12)
    parts["metal"].join(rod, lambda p: (p[1], 3.47 + p[0], WALL - 0.16 + p[2]))


def main():
    names = ("slides", "black", "metal", "wood", "wall", "side", "ceiling", "floor", "trim", "curtain", "chairs")
    parts = {name: Mesh() for name in names}
    slides(parts)
    projector(parts)
    room(parts)
    chair = armchair()
    for x, z, turn in ((-1.75, 2.35, 8), (-0.78, 3.05, 4), (0.78, 3.05, -4), (1.75, 2.35, -8), (2.7, 1.6, -14), (-2.7, 1.6, 14)):
        parts["chairs"].join(chair, at(x, 0, z, turn=turn))
    table = lathe([(0.0, 0.42), (0.30, 0.42), (0.32, 0.44), (0.30, 0.46), (0.0, 0.46)], 40)
    parts["wood"].join(table, at(0, 0, 3.25)).join(lathe([(0.2, 0.0), (0.19, 0.02), (0.03, 0.04), (0.03, 0.42)], 24), at(0, 0, 3.25))
    bowl = lathe([(0.05, 0.46), (0.10, 0.48), (0.13, 0.54), (0.125, 0.54), (0.09, 0.485), (0.0, 0.475)], 32)
    parts["metal"].join(bowl, at(0.05, 0, 3.2))
    folder = here(__file__)
    parts["floor"].boxed(0.9)
    write_all(folder, parts, crease=35.0)
    stone_picture(os.path.join(folder, "mesh", "boards.png"), 192, (0.56, 0.40, 0.27), 0.45, seed=77)


main()
