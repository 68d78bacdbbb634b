"""A dark room in which a projector throws a rose window on the wall; armchairs before it.

Metres; y up, the wall is z = 6. The slide is a picture for a light of the kind "projection": glass of many colours in leads, drawn
by distance to the lines, so that its edges are as soft as one of its pixels.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, Noise, at, box, here, lathe, loft, stone_picture, write_all, write_png  # noqa: E402

SLIDE = 480                      # pixels of the slide's sides
WALL, BACK = 6.0, -3.2           # the room's ends
LENS = (0.0, 1.45, 1.2)          # where the slide's light starts

RUBY, COBALT, SKY, GOLD, GREEN, VIOLET = ((0.93, 0.05, 0.06), (0.06, 0.14, 0.86), (0.25, 0.58, 0.97), (1.00, 0.72, 0.10),
                                          (0.10, 0.66, 0.24), (0.56, 0.12, 0.72))


def sector(angle, count, shift=0.0):
    """Which of `count` sectors, and the angle from its middle."""
    step = 2 * math.pi / count
    k = math.floor((angle - shift) / step + 0.5)
    return k % count, angle - shift - k * step


def rosette(x, y):
    """A rose window on [-1, 1]²: (piece, colour, distance to the nearest lead). Twelve petals, twelve roundels, 24 lancets."""
    r, a = math.hypot(x, y), math.atan2(y, x)
    if r > 0.96:
        return corner(x, y, r)
    if r < 0.13:
        k, d = sector(a, 6)
        return ("eye", k), GOLD if r > 0.06 else RUBY, min(abs(r - 0.06), 0.13 - r, abs(r * math.sin(math.pi / 6 - abs(d))))
    if r < 0.42:
        k, d = sector(a, 12)
        # A petal: an ellipse along its ray.
        across, along = r * math.sin(d), r * math.cos(d) - 0.285
        petal = math.hypot(along / 0.125, across / 0.062) - 1
        rim = min(r - 0.13, 0.42 - r)
        if petal < 0:
            heart = math.hypot(along - 0.03, across) - 0.028
            colour = GOLD if heart < 0 else (RUBY, COBALT)[k % 2]
            return ("petal", k, heart < 0), colour, min(-petal * 0.062, abs(heart))
        outer = along > 0
        return ("between", k, d > 0, outer), (SKY if outer else GREEN), min(petal * 0.062, rim, r * (math.pi / 12 - abs(d)))
    if r < 0.70:
        k, d = sector(a, 12, math.pi / 12)
        px, py = r * math.cos(d) - 0.56, r * math.sin(d)
        roundel, rim = 0.112 - math.hypot(px, py), min(r - 0.42, 0.70 - r)
        if roundel > 0:
            lobe, turn = sector(math.atan2(py, px), 6)
            q = math.hypot(px, py)
            foil = 0.034 - math.hypot(q * math.cos(turn) - 0.056, q * math.sin(turn))
            if q < 0.024:
                return ("pistil", k), GOLD, 0.024 - q
            if foil > 0:
                return ("foil", k, lobe), (GOLD, SKY, GREEN)[k % 3], min(foil, q - 0.024)
            return ("roundel", k), (RUBY, COBALT, VIOLET)[k % 3], min(-foil, roundel, q - 0.024)
        return ("spandrel", k, d > 0, r > 0.56), (COBALT if r > 0.56 else RUBY), min(-roundel, rim, r * (math.pi / 12 - abs(d)))
    k, d = sector(a, 24)
    half = r * (math.pi / 24 - abs(d))
    px, py = r * math.cos(d) - 0.835, r * math.sin(d)
    head = 0.098 - math.hypot(px, py) if px > 0 else 0.098 - abs(py)
    rim = min(r - 0.70, 0.96 - r)
    if head > 0:
        core = math.hypot(px / 1.5, py) - 0.034
        colour = GOLD if core < 0 else (COBALT, VIOLET, GREEN, RUBY)[k % 4]
        return ("lancet", k, core < 0), colour, min(head, rim, abs(core), half)
    return ("corner", k, d > 0), SKY, min(-head, rim, half)


def corner(x, y, r):
    """Between the rose and the slide's edge: night blue with a roundel in each corner."""
    edge = 0.985 - max(abs(x), abs(y))
    if edge < 0:
        return None
    q = math.hypot(abs(x) - 0.82, abs(y) - 0.82)
    which = (x > 0, y > 0)
    rim = min(edge, r - 0.96, abs(q - 0.115), abs(q - 0.05))
    if q < 0.115:
        return ("roundel", which, q < 0.05), GOLD if q < 0.05 else RUBY, rim
    return ("ground", which, abs(x) > abs(y)), (0.16, 0.22, 0.50), min(rim, abs(abs(x) - abs(y)) if q > 0.115 else rim)


def slide(path):
    glass, dice, tones = Noise(9, 14, 4), random.Random(6), {}
    lead, pixel_size = 0.0062, 2.0 / SLIDE

    def pixel(i, j):
        x, y = (2 * i + 1) / SLIDE - 1, 1 - (2 * j + 1) / SLIDE
        found = rosette(x, y)
        if not found:
            return (0.0, 0.0, 0.0)
        piece, colour, distance = found
        if piece not in tones:
            tones[piece] = dice.uniform(0.78, 1.06)
        light = tones[piece] * (0.72 + 0.5 * glass(0.5 + 0.5 * x, 0.5 + 0.5 * y))
        open_ = max(0.0, min(1.0, (distance - lead) / pixel_size + 0.5))
        return tuple(c * light * (0.02 + 0.98 * open_) for c in colour)
    write_png(path, SLIDE, SLIDE, pixel)


def projector(parts):
    """A case with a lens in a hood, on a stand; slots at its back let out a little light."""
    body, metal = parts["black"], parts["metal"]
    x, y, z = LENS
    body.join(box(-0.20, 0.20, y - 0.13, y + 0.13, 0.52, 1.08, 0.025))
    body.join(lathe([(0.055, 0.0), (0.075, 0.0), (0.075, 0.12), (0.068, 0.12), (0.055, 0.0)], 40),
              lambda p: (x + p[0], y + p[2], z - 0.14 + p[1]))
    metal.join(lathe([(0.075, 0.08), (0.082, 0.085), (0.082, 0.115), (0.075, 0.12)], 40),
               lambda p: (x + p[0], y + p[2], z - 0.14 + p[1]))
    for k in range(2):  # two reels above the case
        reel = lathe([(0.03, -0.02), (0.16, -0.02), (0.16, -0.012), (0.03, -0.012), (0.03, 0.012), (0.16, 0.012), (0.16, 0.02),
                      (0.03, 0.02), (0.03, -0.02)], 48)
        metal.join(reel, lambda p: (x + p[1] + 0.06, y + 0.31 + 0.02 * k + p[0], 0.62 + 0.36 * k + p[2]))
        body.join(box(0.03, 0.09, y + 0.12, y + 0.33, 0.605 + 0.36 * k, 0.635 + 0.36 * k, 0.005))
    for k in range(5):
        h = y - 0.08 + 0.035 * k
        parts["slots"].quad((-0.13, h, 0.5195), (-0.13, h + 0.012, 0.5195), (0.13, h + 0.012, 0.5195), (0.13, h, 0.5195))
    top = y - 0.17
    parts["wood"].join(box(-0.34, 0.34, top - 0.04, top, 0.42, 1.22, 0.01))
    for px in (-0.29, 0.29):
        for pz in (0.48, 1.16):
            parts["wood"].join(box(px - 0.025, px + 0.025, 0.0, top - 0.04, pz - 0.025, pz + 0.025, 0.006))
    parts["wood"].join(box(-0.29, 0.29, 0.35, 0.38, 0.48, 1.16, 0.006))
    for px in (-0.14, 0.14):
        for pz in (0.58, 1.02):
            body.join(lathe([(0.0, 0.0), (0.025, 0.0), (0.025, 0.04), (0.0, 0.04)], 14), at(px, top, pz))


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
    x, z0, high = 3.9, BACK, 3.7
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
    parts["wood"].join(beam, *[at(0, 0, z) for z in (-1.5, 0.2, 1.9, 3.6, 5.3)])
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
    names = ("black", "metal", "slots", "wood", "wall", "side", "ceiling", "floor", "trim", "curtain", "bowl")
    parts = {name: Mesh() for name in names}
    projector(parts)
    room(parts)
    parts["chair"] = armchair()  # one: the scene has instances of it
    table = lathe([(0.0, 0.42), (0.30, 0.42), (0.32, 0.44), (0.30, 0.46), (0.0, 0.46)], 40)
    parts["wood"].join(table, at(0, 0, 3.25)).join(lathe([(0.2, 0.0), (0.19, 0.02), (0.03, 0.04), (0.03, 0.42)], 24), at(0, 0, 3.25))
    bowl = lathe([(0.05, 0.46), (0.10, 0.48), (0.13, 0.54), (0.125, 0.54), (0.09, 0.485), (0.0, 0.475)], 32)
    parts["bowl"].join(bowl, at(0.05, 0, 3.2))
    folder = here(__file__)
    parts["floor"].boxed(0.9)
    write_all(folder, parts, crease=35.0)
    stone_picture(os.path.join(folder, "mesh", "boards.png"), 192, (0.56, 0.40, 0.27), 0.45, seed=77)
    slide(os.path.join(folder, "mesh", "slide.png"))


main()
