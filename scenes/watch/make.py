"""A wristwatch movement: plate, bridges, a going train of toothed wheels, jewels, blued screws, a balance. Metres.

Built in millimetres with z up out of the movement and turned over on writing: x right, y up, the face towards the reader.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, at, box, circle, here, lathe, loft, plate, sweep, wheel, write_all  # noqa: E402

MILLI = 1e-3


def screw(radius):
    """A slotted screw: polished head with a chamfer, the slot as a groove across it."""
    mesh, steps, w, d = Mesh(), 40, 0.13 * radius, 0.22 * radius
    c = 0.14 * radius
    mesh.join(lathe([(radius, -0.3 * radius), (radius, 0.42 * radius - c), (radius - c, 0.42 * radius)], steps))
    top, r = 0.42 * radius, radius - c
    for sign in (1, -1):  # the two halves of the top, beside the slot
        a0 = math.asin(w / r)
        points = [(r * math.cos(a0 + (math.pi - 2 * a0) * i / 16), top,
                   sign * r * math.sin(a0 + (math.pi - 2 * a0) * i / 16)) for i in range(17)]
        mesh.fan(points)
    half = math.sqrt(r * r - w * w)
    mesh.quad((-half, top, w), (half, top, w), (half, top - d, w), (-half, top - d, w))
    mesh.quad((-half, top, -w), (half, top, -w), (half, top - d, -w), (-half, top - d, -w))
    mesh.quad((-half, top - d, -w), (half, top - d, -w), (half, top - d, w), (-half, top - d, w))
    return mesh


def jewel(radius):
    """A ruby ring with an oil sink, and the polished gold chaton round it."""
    stone = lathe([(radius, -0.05), (radius, 0.02), (0.92 * radius, 0.05), (0.55 * radius, 0.05), (0.38 * radius, 0.0),
                   (0.22 * radius, -0.06), (0.16 * radius, -0.07), (0.16 * radius, -0.12)], 40)
    chaton = lathe([(1.42 * radius, -0.05), (1.42 * radius, 0.05), (1.34 * radius, 0.08), (1.14 * radius, 0.08),
                    (1.02 * radius, 0.03), (1.0 * radius, -0.05)], 48)
    pivot = lathe([(0.14 * radius, -0.1), (0.14 * radius, 0.02), (0.09 * radius, 0.05), (0.0, 0.055)], 20)
    return stone, chaton, pivot


def striped(mesh, y, pitch, depth):
    """Geneva stripes: the flat top at height y is cut into bands that each rise a little, like roof tiles."""
    out = Mesh()
    for a, b, c, uv in mesh.faces:
        if not all(abs(p[1] - y) < 1e-6 for p in (a, b, c)):
            out.faces.append((a, b, c, uv))
            continue
        along = lambda p: (p[0] * 0.8 + p[2] * 0.6) / pitch
        low, high = min(map(along, (a, b, c))), max(map(along, (a, b, c)))
        for k in range(math.floor(low), math.floor(high) + 1):
            for part in range(4):
                u0, u1 = k + part / 4, k + (part + 1) / 4
                piece = clip(clip([a, b, c], along, u0, 1), along, u1, -1)
                if len(piece) < 3:
                    continue
                arc = lambda p: (p[0], y + depth * (1 - (2 * (along(p) - k) - 1) ** 2), p[2])
                out.fan([arc(p) for p in piece])
    return out


def clip(points, along, limit, sign):
    """The part of a polygon on one side of along(p) = limit."""
    kept = []
    for i, p in enumerate(points):
        q = points[(i + 1) % len(points)]
        dp, dq = sign * (along(p) - limit), sign * (along(q) - limit)
        if dp >= 0:
            kept.append(p)
        if (dp > 1e-12 and dq < -1e-12) or (dp < -1e-12 and dq > 1e-12):
            t = dp / (dp - dq)
            kept.append(tuple(x + t * (w - x) for x, w in zip(p, q)))
    return kept


def blob(cx, cz, parts, steps=120):
    """A star-shaped outline round (cx, cz): the far side of discs (x, z, radius) seen from there, smoothed."""
    radii = []
    for i in range(steps):
        a = 2 * math.pi * i / steps
        c, s, best = math.cos(a), math.sin(a), 0.3
        for x, z, r in parts:
            dx, dz = x - cx, z - cz
            t = dx * c + dz * s
            h2 = r * r - (dx * dx + dz * dz - t * t)
            if h2 > 0:
                best = max(best, t + math.sqrt(h2))
        radii.append(best)
    for _ in range(6):
        radii = [(radii[i - 1] + 2 * radii[i] + radii[(i + 1) % steps]) / 4 for i in range(steps)]
    return [(cx + r * math.cos(2 * math.pi * i / steps), cz + r * math.sin(2 * math.pi * i / steps))
            for i, r in enumerate(radii)]


def balance(z):
    """The balance: a rim with timing screws, two arms, the hairspring above."""
    rim = Mesh()
    profile = [(2.9, z), (3.25, z), (3.25, z + 0.38), (3.2, z + 0.42), (2.95, z + 0.42), (2.9, z + 0.38), (2.9, z)]
    rim.join(lathe(profile, 96))
    for turn in (35, 215):
        rim.join(loft([[(0.0, y, w) for w, y in ((-0.3, z + 0.1), (-0.3, z + 0.3), (0.3, z + 0.3), (0.3, z + 0.1))],
                       [(2.95, y, w) for w, y in ((-0.2, z + 0.1), (-0.2, z + 0.3), (0.2, z + 0.3), (0.2, z + 0.1))]]),
                 at(turn=turn))
    rim.join(lathe([(0.55, z), (0.55, z + 0.5), (0.5, z + 0.55), (0.16, z + 0.55), (0.14, z + 1.1), (0, z + 1.12)], 40))
    head = lathe([(0.0, 0.34), (0.16, 0.34), (0.2, 0.30), (0.2, 0.0)], 20)
    for k in range(16):
        a = 360 * k / 16 + 8
        place = at(turn=a)
        rim.join(Mesh().join(head, lambda p: (3.22 + p[1], z + 0.2 + p[0], p[2])), place)
    spring = []
    for i in range(420):
        a = 2 * math.pi * i / 48
        r = 0.5 + 1.75 * i / 420
        spring.append((r * math.cos(a), z + 0.78, r * math.sin(a)))
    hair = sweep([(-0.022, -0.08), (-0.022, 0.08), (0.022, 0.08), (0.022, -0.08)], spring, (0, 1, 0))
    return rim, hair


def led():
    """The LED in its own frame, light along +z: four chips (one is off) in a ceramic package, on a board with an arm."""
    ceramic, board, chips = Mesh(), Mesh(), {}
    ceramic.join(box(-2.95, 2.95, -2.4, 2.4, -1.2, -0.25, 0.12))
    for x0, x1, y0, y1 in ((-2.6, 2.6, 1.75, 2.1), (-2.6, 2.6, -2.1, -1.75), (-2.6, -2.2, -1.75, 1.75), (2.2, 2.6, -1.75, 1.75)):
        ceramic.join(box(x0, x1, y0, y1, -0.25, -0.06))
    board.join(box(-5, 5, -4, 4, -2.6, -1.2, 0.2))
    for k in range(7):  # the fins behind it
        board.join(box(-4.6 + 1.5 * k, -4.2 + 1.5 * k, -3.8, 3.8, -5.4, -2.6))
    board.join(box(-0.9, 0.9, -40, -3, -4.4, -3.2, 0.2))
    for name, x, y in (("red", 0.69, -0.84), ("green", -0.68, 0.84), ("blue", 0.69, 0.81), ("off", -0.74, -0.83)):
        chips["chip-" + name] = Mesh()
        a, b, c, d = [(x + u, y + v, -0.05) for u, v in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
        chips["chip-" + name].quad(a, b, c, d)
    return {"ceramic": ceramic, "board": board, **chips}


def main():
    parts = {name: Mesh() for name in ("base", "bridges", "wheels", "steel", "screws", "rubies", "gold", "balance", "hair",
                                       "strap", "case")}
    parts["base"].join(plate(circle(14.2, 200), -1.0, 0.0, 0.12))
    # Perlage: rows of shallow dishes, as a spotted plate has them.
    dish = lathe([(0.0, 0.012), (0.2, 0.008), (0.34, 0.0)], 14)
    for i in range(-22, 23):
        for k in range(-26, 27):
            x, z = 0.62 * i + 0.31 * (k % 2), 0.54 * k
            if x * x + z * z < 13.6 ** 2:
                parts["base"].join(dish, at(x, 0.0, z))
    # The going train: (teeth, radius, x, z, height, spokes, pinion)
    train = [(88, 4.7, -5.4, 4.2, 0.5, 0, 0.0), (80, 3.9, 2.1, 1.0, 0.75, 5, 0.62), (72, 3.2, 5.9, 6.4, 1.2, 5, 0.55),
             (60, 2.7, 8.6, 0.4, 0.45, 4, 0.5)]
    for teeth, radius, x, z, y, spokes, pinion in train:
        if spokes:
            parts["wheels"].join(wheel(teeth, radius, y, spokes=spokes, pinion=pinion), at(x, 0, z))
    # The mainspring's ratchet and crown wheels, of steel, lie on the barrel bridge.
    parts["steel"].join(wheel(64, 4.1, 2.32, 0.30, spokes=0, rim=0.72), at(-5.6, 0, 4.6))
    parts["steel"].join(wheel(40, 2.6, 2.32, 0.30, spokes=0, rim=0.66), at(0.75, 0, 7.15, turn=4))
    parts["steel"].join(lathe([(15, -1.2), (15, -1.2)], 3))
    bridges = [blob(-4.5, 5.6, [(-5.6, 4.6, 5.2), (0.6, 7.8, 3.6), (-9.0, 0.6, 2.6), (-2.0, 9.6, 3.6)]),
               blob(6.4, 3.2, [(5.9, 6.4, 1.7), (8.6, 0.6, 1.7), (10.4, 4.2, 2.4), (2.4, 1.0, 1.5)]),
               blob(1.6, -9.0, [(-1.4, -5.6, 1.5), (3.6, -11.0, 2.2), (1.2, -9.2, 1.8)])]
    heights = [(1.1, 2.2), (1.5, 2.4), (1.9, 2.9)]
    for outline, (z0, z1) in zip(bridges, heights):
        parts["bridges"].join(striped(plate(outline, z0, z1, 0.14), z1, 1.5, 0.03))
    stone_at = [(5.9, 6.4, 2.43, 0.52), (8.6, 0.5, 2.43, 0.48), (2.2, 1.0, 2.43, 0.6), (-1.5, -5.7, 2.93, 0.62),
                (-9.2, 0.5, 2.23, 0.42)]
    for x, z, y, r in stone_at:
        for name, mesh in zip(("rubies", "gold", "steel"), jewel(r)):
            parts[name].join(mesh, at(x, y, z))
    dice = random.Random(4)
    for x, z, y, r in [(-9.4, 8.0, 2.2, 0.75), (-1.6, 11.6, 2.2, 0.75), (10.9, 5.4, 2.4, 0.7), (8.4, 3.4, 2.4, 0.5),
                       (3.9, -11.6, 2.9, 0.75), (-5.6, 4.6, 2.75, 0.95), (0.75, 7.15, 2.75, 0.7), (10.9, 2.9, 2.4, 0.42),
                       (-11.2, 1.6, 0.0, 0.6), (-8.6, -8.2, 0.0, 0.6), (10.2, -6.6, 0.0, 0.6), (11.9, -3.6, 0.0, 0.45)]:
        parts["screws"].join(screw(r), at(x, y + 0.05, z, turn=dice.uniform(0, 180)))
    rim, hair = balance(1.05)
    parts["balance"].join(rim, at(-1.5, 0, -5.7))
    parts["hair"].join(hair, at(-1.5, 0, -5.7))
    # The case round it: a polished ring with a step, and the crown at its right.
    parts["case"].join(lathe([(14.3, -2), (14.3, 1.2), (14.9, 1.6), (16.6, 1.9), (17.6, 1.5), (18.2, 0.4), (18.3, -3)], 200))
    knob = []
    for i in range(120):
        a = 2 * math.pi * i / 120
        knob.append((1.0 + 0.07 * math.cos(30 * a), a))
    rings = [[(s * r * math.sin(a), h, s * r * math.cos(a)) for r, a in knob]
             for s, h in ((1.8, 0.0), (2.1, 0.15), (2.1, 2.2), (1.9, 2.5), (0.6, 2.6))]
    crown = loft(rings)
    parts["case"].join(crown, lambda p: (18.6 + p[1], p[0] - 0.9, p[2] + 0.6))
    parts.update(led())
    folder = here(__file__)
    parts = {name: Mesh().join(mesh, lambda p: (MILLI * p[0], MILLI * p[1], MILLI * p[2]))
             for name, mesh in parts.items() if mesh.faces}
    write_all(folder, parts, crease=32.0)


main()
