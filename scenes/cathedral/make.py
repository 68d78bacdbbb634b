"""A nave with two aisles: compound piers, pointed arcades, a clerestory with mullions, ribbed vaults, an apse wall.

Metres; y up, the nave runs along +z from 0. In the spirit of the cathedral of Sibenik, as light tests know it.
"""
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import (Mesh, arch, at, box, circle, here, holed_wall, lathe, loft, prism,  # noqa: E402
                      stone_picture, sweep, write_all)

BAY, BAYS = 5.0, 7
NAVE, AISLE = 4.2, 4.0        # half the nave's width; the aisles' width
LENGTH = BAY * BAYS
IMPOST = 4.6                  # where the arcade's arches start
SPRING = 9.4                  # where the nave's vault starts
THICK = 1.0                   # of the nave's walls
SHARP = 0.45                  # of its arches: 0 round, 1 equilateral
ARCADE = 1.75                 # half the opening of an arcade's arch


def rise(half):
    return half * math.sqrt((1 + SHARP) ** 2 - SHARP ** 2)


def shaft(radius, y0, y1, count=12):
    """A round shaft with a moulded base and a bell capital with a square abacus."""
    r = radius
    base = [(1.75 * r, y0), (1.75 * r, y0 + 0.10), (1.45 * r, y0 + 0.13)]
    base += [(1.68 * r, y0 + 0.13 + 0.2 * r), (1.62 * r, y0 + 0.13 + 0.45 * r), (1.1 * r, y0 + 0.15 + 0.6 * r),
             (r, y0 + 0.2 + 0.6 * r)]
    bell = [(r, y1 - 0.42), (1.22 * r, y1 - 0.385), (r, y1 - 0.35), (1.12 * r, y1 - 0.21), (1.55 * r, y1 - 0.11)]
    mesh = lathe(base + bell, count)
    h = 1.6 * r
    return mesh.join(loft([[(x, y, z) for x, z in ((-k, -k), (-k, k), (k, k), (k, -k))]
                           for k, y in ((h * 0.94, y1 - 0.11), (h, y1 - 0.07), (h, y1))]))


def pier():
    """An octagonal core with four large and four small shafts."""
    mesh = Mesh()
    plinth = circle(0.98, 8, start=22.5)
    mesh.join(prism(plinth, -0.05, 0.28, 0.05)).join(prism(circle(0.86, 8, start=22.5), 0.28, 0.46, 0.05))
    core = circle(0.56, 8, start=22.5)
    mesh.join(prism(core, 0.4, IMPOST))
    large, small = shaft(0.19, 0.42, IMPOST, 10), shaft(0.11, 0.42, IMPOST, 8)
    for k in range(4):
        a = math.radians(90 * k)
        mesh.join(large, at(0.56 * math.cos(a), 0, 0.56 * math.sin(a)))
        b = a + math.radians(45)
        mesh.join(small, at(0.56 * math.cos(b), 0, 0.56 * math.sin(b)))
    mesh.join(prism(circle(0.86, 8, start=22.5), IMPOST, IMPOST + 0.16, 0.04))
    return mesh


MOULDING = [(0.0, -0.5), (0.0, 0.5), (-0.10, 0.5), (-0.12, 0.34), (-0.34, 0.20), (-0.26, 0.12), (-0.44, 0.0),
            (-0.26, -0.12), (-0.34, -0.20), (-0.12, -0.34), (-0.10, -0.5)]


def arch_band(half, spring, width, depth, count=7):
    """A moulded arch in the plane z = 0 that hangs `depth` into an opening of 2 `half`."""
    path = [(x, y, 0.0) for x, y in arch(half, SHARP, count, spring)]
    profile = [(-u * depth / 0.44, v * width) for u, v in MOULDING]
    return sweep(profile, path, (0, 0, 1))


def vault(half_x, half_z, spring, steps=7):
    """Four webs between pointed ribs over a bay, and the ribs."""
    top = rise(1.0)
    curve = [(x, y) for x, y in arch(1.0, SHARP, steps)]
    web, ribs = Mesh(), Mesh()
    for axis, (a, b) in enumerate(((half_x, half_z), (half_z, half_x))):
        for sign in (1, -1):
            for (s0, h0), (s1, h1) in zip(curve, curve[1:]):
                for k in range(3):
                    t = lambda s, j: sign * b * (abs(s) + (1 - abs(s)) * j / 3)
                    points = [(a * s0, h0, t(s0, k)), (a * s1, h1, t(s1, k)),
                              (a * s1, h1, t(s1, k + 1)), (a * s0, h0, t(s0, k + 1))]
                    place = (lambda p: (p[0], p[1], p[2])) if axis == 0 else (lambda p: (p[2], p[1], p[0]))
                    web.quad(*[(place(p)[0], spring + p[1] * half_x, place(p)[2]) for p in points])
    roll = [(0.0, -0.11), (0.0, 0.11), (0.12, 0.11), (0.17, 0.06), (0.24, 0.075), (0.29, 0.0), (0.24, -0.075),
            (0.17, -0.06), (0.12, -0.11)]
    for sx in (1, -1):
        long = math.hypot(half_x, half_z)
        path = [(sx * half_x * s, spring + h * half_x, half_z * s) for s, h in arch(1.0, SHARP, 7)]
        ribs.join(sweep(roll, path, (sx * -half_z / long, 0, half_x / long)))
    boss = [(0.0, -0.40), (0.12, -0.38), (0.2, -0.30), (0.30, -0.26), (0.34, -0.18), (0.34, 0.0)]
    ribs.join(lathe(boss, 16), at(0, spring + top * half_x, 0))
    return web, ribs


def tracery(half, sill, spring, z):
    """Two lights under pointed heads and an oculus above: bars of stone."""
    mesh = Mesh()
    bar = [(-0.06, -0.08), (0.0, -0.16), (0.06, -0.08), (0.06, 0.08), (0.0, 0.16), (-0.06, 0.08)]
    low = spring - 0.35
    mesh.join(sweep(bar, [(0, sill, z), (0, low, z)], (0, 0, 1)))
    for x in (-half / 2, half / 2):
        path = [(x + u, v, z) for u, v in arch(half / 2, 0.5, 5, low)]
        mesh.join(sweep(bar, path, (0, 0, 1)))
    r = 0.36 * half
    ring = [(x, y, z) for x, y in circle(r, 14, 0, low + half * 0.98)]
    mesh.join(sweep(bar, ring, (0, 0, 1), closed_path=True))
    for k in range(4):  # a quatrefoil in the oculus
        a = math.radians(45 + 90 * k)
        foil = [(0.52 * r * math.cos(a) + u, low + half * 0.98 + 0.52 * r * math.sin(a) + v, z)
                for u, v in circle(0.46 * r, 8)]
        mesh.join(sweep([(0.4 * u, 0.5 * v) for u, v in bar], foil, (0, 0, 1), closed_path=True))
    return mesh


def window(wide, y0, y1, half, sill, spring, depth):
    """A piece of wall `wide` long with a traceried window whose reveal opens inwards."""
    wall = holed_wall(-wide / 2, wide / 2, y0, y1, half + 0.25, half, sill, spring, SHARP, depth, 7)
    return wall, tracery(half, sill, spring, depth - 0.2)


def string_course(y, out):
    """A moulding along the nave's wall."""
    profile = [(0.0, -0.14), (0.0, 0.12), (out, 0.10), (out, 0.03), (out * 0.6, -0.02), (out * 0.45, -0.1)]
    path = [(0.0, y, 0.0), (0.0, y, LENGTH)]
    return loft([[(p[0] + u, p[1] + v, p[2]) for u, v in profile] for p in path])


def side(sign):
    """One side of the nave and its aisle, as if for x > 0, with x turned over for the other."""
    wall, carved, web = Mesh(), Mesh(), Mesh()
    low, high = IMPOST + 0.16, SPRING + rise(NAVE) + 0.3
    post, band = pier(), arch_band(ARCADE, low, THICK * 0.92, 0.32)
    for k in range(BAYS):
        z = BAY * (k + 0.5)
        here_ = at(NAVE, 0, z, turn=90)
        back = at(NAVE + THICK, 0, z, turn=90)
        arcade = holed_wall(-BAY / 2, BAY / 2, low, SPRING - 1.2, ARCADE, ARCADE, 0, low, SHARP, THICK, 9)
        wall.join(arcade, here_).join(arcade, back)
        carved.join(band, at(NAVE + THICK / 2, 0, z, turn=90))
        upper, bars = window(BAY, SPRING - 1.2, high, 1.05, SPRING - 0.1, SPRING + 2.1, THICK)
        wall.join(upper, here_)
        carved.join(bars, here_)
        lower, bars = window(BAY, 0, 7.2, 0.8, 2.0, 3.9, 0.8)
        outer = at(NAVE + THICK + AISLE, 0, z, turn=90)
        wall.join(lower, outer)
        carved.join(bars, outer)
        aisle_web, aisle_ribs = vault(AISLE / 2, BAY / 2, IMPOST - 0.2, 5)
        middle = at(NAVE + THICK + AISLE / 2, 0, z)
        web.join(aisle_web, middle)
        carved.join(aisle_ribs, middle)
    for k in range(BAYS + 1):
        z = BAY * k
        carved.join(post, at(NAVE + THICK / 2, 0, z))
        tall = shaft(0.16, IMPOST + 0.16, SPRING, 10)
        carved.join(tall, at(NAVE + 0.02, 0, z))
        carved.join(shaft(0.09, IMPOST + 0.16, SPRING, 8), at(NAVE + 0.02, 0, z - 0.27), at(NAVE + 0.02, 0, z + 0.27))
        carved.join(shaft(0.2, 0.0, IMPOST - 0.2, 8), at(NAVE + THICK + AISLE, 0, z))
    carved.join(string_course(SPRING - 1.25, -0.16), at(NAVE, 0, 0))
    carved.join(string_course(SPRING - 0.2, -0.10), at(NAVE, 0, 0))
    carved.join(string_course(1.6, -0.10), at(NAVE + THICK + AISLE, 0, 0))
    turn = lambda p: (sign * p[0], p[1], p[2])
    return [Mesh().join(mesh, turn) for mesh in (wall, carved, web)]


def ends():
    """The east wall with three tall windows over the altar; the west wall behind the camera."""
    wall, carved = Mesh(), Mesh()
    high, wide = SPRING + rise(NAVE) + 0.3, 2 * (NAVE + THICK) / 3
    for i in (-1, 0, 1):
        half = 0.95 if i else 1.15
        piece, bars = window(wide, 0, high, half, 3.2, 8.0 if i else 9.4, 0.9)
        wall.join(piece, at(i * wide, 0, LENGTH))
        carved.join(bars, at(i * wide, 0, LENGTH))
    for s in (-1, 1):
        x = s * (NAVE + THICK + AISLE / 2)
        piece, bars = window(AISLE, 0, high, 0.7, 2.0, 4.2, 0.9)
        wall.join(piece, at(x, 0, LENGTH))
        carved.join(bars, at(x, 0, LENGTH))
    x = NAVE + THICK + AISLE
    wall.quad((-x, 0, 0), (x, 0, 0), (x, high, 0), (-x, high, 0))
    return wall, carved


def furniture():
    """Steps, an altar with a cross and candlesticks; benches in the nave."""
    stone, wood = Mesh(), Mesh()
    for i, (half, z) in enumerate(((4.0, 6.6), (3.4, 5.6), (2.8, 4.6))):
        stone.join(box(-half, half, -0.05, 0.16 * (i + 1), LENGTH - z, LENGTH, 0.03))
    stone.join(box(-1.4, 1.4, 0.48, 1.35, LENGTH - 3.4, LENGTH - 2.5, 0.04))
    stone.join(box(-1.6, 1.6, 1.35, 1.5, LENGTH - 3.55, LENGTH - 2.35, 0.04))
    bench = Mesh()
    bench.join(box(-1.35, 1.35, 0.43, 0.48, -0.22, 0.22))
    bench.join(box(-1.35, 1.35, 0.45, 0.95, 0.19, 0.24)).join(box(-1.37, 1.37, 0.93, 0.99, 0.15, 0.27))
    for x in (-1.38, 1.33):
        bench.join(box(x, x + 0.06, 0.0, 0.95, -0.24, 0.26))
    for k in range(13):
        wood.join(bench, at(-1.95, 0, 8.2 + 1.25 * k, turn=180), at(1.95, 0, 8.2 + 1.25 * k, turn=180))
    return stone, wood


def floor():
    """Square tiles light and dark, each with a chamfer."""
    tiles = [Mesh(), Mesh()]
    small = 0.9
    for i in range(-13, 14):
        for k in range(0, int(LENGTH / small) + 1):
            h, cx, cz = small / 2 - 0.004, i * small, (k + 0.5) * small
            tile = prism([(cx - h, cz - h), (cx - h, cz + h), (cx + h, cz + h), (cx + h, cz - h)], -0.02, 0.0, 0.008)
            tile.faces = [f for f in tile.faces if max(p[1] for p in f[:3]) > -0.01]
            tiles[(i + k) % 2].join(tile)
    return tiles


def ground():
    """What shows in the joints of the tiles, and keeps the sky out."""
    x = NAVE + THICK + AISLE + 2
    mesh = Mesh()
    mesh.quad((-x, -0.012, -1), (x, -0.012, -1), (x, -0.012, LENGTH + 2), (-x, -0.012, LENGTH + 2))
    return mesh


def main():
    folder = here(__file__)
    wall, carved = ends()
    web = Mesh()
    for sign in (-1, 1):
        for into, mesh in zip((wall, carved, web), side(sign)):
            into.join(mesh)
    for k in range(BAYS):
        nave_web, nave_ribs = vault(NAVE, BAY / 2, SPRING)
        web.join(nave_web, at(0, 0, BAY * (k + 0.5)))
        carved.join(nave_ribs, at(0, 0, BAY * (k + 0.5)))
    across = arch_band(NAVE, SPRING, 0.55, 0.30, 9)
    for k in range(BAYS + 1):
        carved.join(across, at(0, 0, BAY * k))
        over = arch_band(AISLE / 2, IMPOST - 0.2, 0.45, 0.22, 6)
        for s in (-1, 1):
            carved.join(over, at(s * (NAVE + THICK + AISLE / 2), 0, BAY * k))
    stone, wood = furniture()
    light, dark = floor()
    write_all(folder, {"walls": wall, "carved": carved, "webs": web, "altar": stone, "benches": wood,
                       "tiles-light": light, "tiles-dark": dark, "ground": ground()}, tile=2.4)
    stone_picture(os.path.join(folder, "mesh", "courses.png"), 320, (0.80, 0.76, 0.69), 0.16, courses=6, seed=21)
    stone_picture(os.path.join(folder, "mesh", "grain.png"), 256, (0.82, 0.78, 0.71), 0.20, seed=23)


main()
