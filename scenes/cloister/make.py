"""A vaulted crypt: three aisles of six bays, columns, ribbed groin vaults, flagstones. Metres, y up, z down the aisle."""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, at, box, here, holed_wall, lathe, loft, prism, stone_picture, sweep, write_all  # noqa: E402

HALF = 1.5        # half a bay
BAYS = 6          # along z, from 0 to 18
SPRING = 2.0      # height at which the arches start
RISE = 1.5        # of the vaults
WALL = 3 * HALF   # inner face of the side walls


def square(half, round_to, y):
    """A superellipse ring: a circle at round_to = 2, nearly a square at 12."""
    points = []
    for i in range(12):
        a = 2 * math.pi * (i + 0.5) / 12
        c, s = math.cos(a), math.sin(a)
        k = (abs(c) ** round_to + abs(s) ** round_to) ** (-1 / round_to)
        points.append((half * k * s, y, half * k * c))
    return points


def column():
    """Plinth, Attic base, shaft with a little entasis, cushion capital, abacus."""
    mesh = Mesh()
    mesh.join(box(-0.29, 0.29, -0.02, 0.13, -0.29, 0.29, 0.02))
    torus = [(0.27 + 0.035 * math.sin(t), 0.165 - 0.035 * math.cos(t)) for t in (0.0, 1.05, 2.1, 3.14)]
    upper = [(0.21 + 0.022 * math.sin(t), 0.262 - 0.022 * math.cos(t)) for t in (0.0, 1.57, 3.14)]
    shaft = [(0.185, 0.30), (0.176, 0.34), (0.176, 0.8), (0.168, 1.2), (0.158, 1.56)]
    ring = [(0.185, 1.565), (0.19, 1.585), (0.185, 1.605), (0.162, 1.61)]
    mesh.join(lathe([(0.2, 0.13)] + torus + [(0.225, 0.215), (0.215, 0.24)] + upper + shaft + ring, 12))
    rings = [(0.160, 2.0, 1.61), (0.200, 2.3, 1.70), (0.238, 3.6, 1.78), (0.250, 9.0, 1.87)]
    mesh.join(loft([square(*ring) for ring in rings]))
    mesh.join(box(-0.28, 0.28, 1.87, 1.90, -0.28, 0.28))
    mesh.join(loft([square(h, 14.0, y) for h, y in ((0.27, 1.90), (0.31, 1.94), (0.31, SPRING))]))
    return mesh


def vault():
    """One bay's web: in each quarter a piece of barrel, cut along the diagonals."""
    mesh, n = Mesh(), 6
    height = lambda s: SPRING + 0.03 + RISE * math.sqrt(max(0.0, 1 - s * s))
    across = [math.sin(math.pi / 2 * i / n) for i in range(-n, n + 1)]
    for quarter in range(4):
        place = at(turn=90 * quarter)
        for s0, s1 in zip(across, across[1:]):
            a, b = (HALF * s0, height(s0), HALF * abs(s0)), (HALF * s1, height(s1), HALF * abs(s1))
            c, d = (HALF * s1, height(s1), HALF), (HALF * s0, height(s0), HALF)
            mesh.quad(*[place(p) for p in (a, b, c, d)])
    return mesh


def rib(half, width, depth, roll):
    """Along z = 0 from -half to half: a rectangular arch with a roll beneath. Intrados `depth` under the web."""
    path = [(x, y + SPRING, 0.0) for x, y in ellipse(half - 0.05, RISE)]
    w, d = width / 2, depth
    profile = [(0.0, -w), (0.0, w), (-d * 0.7, w)]
    if roll:
        profile += [(-d * 0.75 - 0.045 * math.sin(t), 0.05 * math.cos(t)) for t in (0.4, 1.57, 2.74)]
    else:
        profile += [(-d, w - 0.3 * d), (-d, -w + 0.3 * d)]
    profile += [(-d * 0.7, -w)]
    return sweep([(-u, v) for u, v in profile], path, (0, 0, 1))


def ellipse(half, rise, n=12):
    return [(-half * math.cos(math.pi * i / n), rise * math.sin(math.pi * i / n)) for i in range(n + 1)]


def flagstones(dice):
    """Rows of slabs, each a little different in height and tone: three meshes, one for each tone."""
    meshes = [Mesh(), Mesh(), Mesh()]
    z = -0.4
    while z < 2 * HALF * BAYS:
        depth = dice.uniform(0.6, 0.9)
        x = -WALL + dice.uniform(-0.6, 0.0)
        while x < WALL:
            width = dice.uniform(0.7, 1.3)
            g, y = 0.006, dice.uniform(-0.006, 0.004)
            slab = prism([(x + g, z + g), (x + g, z + depth - g), (x + width - g, z + depth - g),
                          (x + width - g, z + g)], -0.05, 0.0, 0.012)
            slab.faces = [f for f in slab.faces if max(p[1] for p in f[:3]) > -0.04]
            tilt = dice.uniform(-0.25, 0.25)
            cx, cz = x + width / 2, z + depth / 2
            lean = lambda p: (p[0], p[1] + y + math.radians(tilt) * (p[0] - cx) * 0.6, p[2])
            meshes[dice.choice((0, 0, 1, 1, 2))].join(slab, lean)
            x += width
        z += depth
    return meshes


def walls():
    """Side walls with a blind arch in each bay, end walls with a door and an altar niche; the dust under it all."""
    mesh, length = Mesh(), 2 * HALF * BAYS
    mesh.quad((-WALL, 0, 0), (WALL, 0, 0), (WALL, 4, 0), (-WALL, 4, 0))
    for side in (-1, 1):
        x = side * WALL
        for bay in range(BAYS):
            z0 = 2 * HALF * bay
            if side == 1 and bay in (1, 3):  # a window: its reveal slopes in from outside
                mesh.join(holed_wall(-HALF, HALF, 0, 4, 0.42, 0.2, 1.35, 2.25, 0.0, 0.7, 6),
                          at(x, 0, z0 + HALF, turn=90))
            else:
                mesh.quad((x, 0, z0), (x, 0, z0 + 2 * HALF), (x, 4, z0 + 2 * HALF), (x, 4, z0))
    for i, inside in enumerate((0.62, 0.95, 0.62)):
        mesh.join(holed_wall(-HALF, HALF, 0, 4, inside, inside - 0.08, 0.9 if i != 1 else 0.0, 1.7, 0.0, 0.6, 8),
                  at((i - 1) * 2 * HALF, 0, length))
    mesh.quad((-WALL, 0, length + 0.6), (WALL, 0, length + 0.6), (WALL, 4, length + 0.6), (-WALL, 4, length + 0.6))
    return mesh


def altar():
    """A table of stone on two steps in the middle niche."""
    mesh, z = Mesh(), 2 * HALF * BAYS
    mesh.join(box(-1.5, 1.5, -0.02, 0.14, z - 1.6, z + 0.3, 0.02))
    mesh.join(box(-1.15, 1.15, 0.14, 0.28, z - 1.15, z + 0.3, 0.02))
    mesh.join(box(-0.7, 0.7, 0.28, 1.05, z - 0.75, z - 0.2, 0.03))
    mesh.join(box(-0.85, 0.85, 1.05, 1.17, z - 0.88, z - 0.1, 0.03))
    return mesh


def main():
    folder, dice = here(__file__), random.Random(11)
    stone, web, carved = walls(), Mesh(), Mesh()
    post = column()
    for x in (-3 * HALF, -HALF, HALF, 3 * HALF):
        for k in range(BAYS + 1):
            carved.join(post, at(x, 0, 2 * HALF * k))
    bays = [(2 * HALF * (i - 1), 2 * HALF * (k + 0.5)) for i in range(3) for k in range(BAYS)]
    diagonal = rib(HALF * math.sqrt(2), 0.14, 0.10, True)
    band = rib(HALF, 0.40, 0.14, False)
    boss = lathe([(0.0, -0.09), (0.07, -0.085), (0.11, -0.05), (0.16, -0.02), (0.17, 0.04)], 14)
    for x, z in bays:
        web.join(vault(), at(x, 0, z))
        carved.join(diagonal, at(x, 0, z, turn=45), at(x, 0, z, turn=-45))
        carved.join(boss, at(x, SPRING + RISE - 0.06, z))
        carved.join(band, at(x, 0, z - HALF), at(x - HALF, 0, z, turn=90))
    for x in (-2 * HALF, 0, 2 * HALF):
        carved.join(band, at(x, 0, 2 * HALF * BAYS))
    for k in range(BAYS):
        carved.join(band, at(3 * HALF, 0, 2 * HALF * (k + 0.5), turn=90))
    # What stands wholly behind the walls is not seen.
    inside = lambda p: abs(p[0]) < WALL + 0.01 and 0.0 < p[2] < 2 * HALF * BAYS + 0.01
    carved.faces = [face for face in carved.faces if any(inside(p) for p in face[:3])]
    slabs = flagstones(dice)
    ground = Mesh()
    ground.quad((-6, -0.03, -1), (6, -0.03, -1), (6, -0.03, 20), (-6, -0.03, 20))
    meshes = {"walls": stone, "vault": web, "carved": carved, "altar": altar(), "ground": ground}
    meshes.update({"slabs-%d" % i: slab for i, slab in enumerate(slabs)})
    write_all(folder, meshes, tile=1.6)
    stone_picture(os.path.join(folder, "mesh", "courses.png"), 320, (0.78, 0.72, 0.62), 0.30, courses=5, seed=5)
    stone_picture(os.path.join(folder, "mesh", "grain.png"), 256, (0.78, 0.73, 0.64), 0.34, seed=9)


main()
