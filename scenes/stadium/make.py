"""A stadium in a town by night, three kilometres across: bowl, crowd, roof, pitch, masts; streets and lit windows; hills.

Metres; y up. The bowl stands round the origin, the pitch lies along x.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, Noise, at, box, here, loft, sweep, write_all  # noqa: E402

SECTORS = 64


def oval(a, b, y, count=SECTORS):
    """A superellipse: the stands are straight along the pitch and round at its corners."""
    points = []
    for i in range(count):
        t = 2 * math.pi * i / count
        c, s = math.cos(t), math.sin(t)
        k = (abs(c) ** 2.8 + abs(s) ** 2.8) ** (-1 / 2.8)
        points.append((a * k * c, y, b * k * s))
    return points


def stands(parts, dice):
    """Two tiers of stepped rows; people sit on most of the seats that the camera can tell apart."""
    tiers = [(62.0, 44.0, 1.5, 22, 0.42, 0.85), (84.0, 66.0, 13.0, 24, 0.58, 0.85)]
    for number, (a, b, y, rows, step, deep) in enumerate(tiers):
        rings = []
        for k in range(rows):
            rings += [oval(a + deep * k, b + deep * k, y + step * k), oval(a + deep * (k + 1), b + deep * (k + 1), y + step * k)]
            for i in range(SECTORS * 5):
                if i % 20 < 1 or dice.random() < 0.22 + 0.1 * number:
                    continue
                seat(parts, dice, a + deep * (k + 0.45), b + deep * (k + 0.45), y + step * k, i)
        parts["stands"].join(loft(rings, caps=False))
        rim = [oval(a, b, y - 1.2), oval(a, b, y + 0.9), oval(a - 0.2, b - 0.2, y + 0.9), oval(a - 0.2, b - 0.2, y - 1.2)]
        parts["fascia"].join(loft(rim, caps=False))
        if number == 1:
            glow = [oval(a - 0.22, b - 0.22, y - 0.7), oval(a - 0.22, b - 0.22, y + 0.3)]
            parts["banner"].join(loft(glow, caps=False))
    back = [oval(106, 88, 0), oval(106, 88, 29), oval(104.5, 86.5, 29)]
    parts["fascia"].join(loft(back, caps=False))
    inner = [oval(81, 63, 10.5), oval(84, 66, 11.8)]
    parts["fascia"].join(loft(inner, caps=False))


def seat(parts, dice, a, b, y, i):
    """One spectator: a box of 0.5 m by 0.9 m in a shirt."""
    t = 2 * math.pi * (i + dice.uniform(-0.3, 0.3)) / (SECTORS * 5)
    c, s = math.cos(t), math.sin(t)
    k = (abs(c) ** 2.8 + abs(s) ** 2.8) ** (-1 / 2.8)
    x, z = a * k * c, b * k * s
    shirt = dice.choice(("red", "red", "red", "white", "navy") if x > -20 else ("navy", "navy", "navy", "white", "red"))
    h, w = y + dice.uniform(0.7, 1.1), dice.uniform(0.26, 0.4)
    body = [(x - w, y, z - w), (x + w, y, z - w), (x + w, y, z + w), (x - w, y, z + w)]
    top = [(x - w / 2, h, z - w / 2), (x + w / 2, h, z - w / 2), (x + w / 2, h, z + w / 2), (x - w / 2, h, z + w / 2)]
    mesh = parts[shirt]
    for k in range(4):
        mesh.quad(body[k], body[(k + 1) % 4], top[(k + 1) % 4], top[k])
    mesh.quad(*top)


def roof(parts):
    """A ring of roof that leans up and out over the upper tier, on ribs; a line of lamps along its inner edge."""
    inside, outside = oval(80, 62, 37.5), oval(110, 92, 33.0)
    parts["roof"].join(loft([inside, outside, oval(110, 92, 32.2), oval(80, 62, 36.9), inside], caps=False))
    rod = [(0.35 * math.cos(t), 0.35 * math.sin(t)) for t in (0.8, 2.4, 3.9, 5.5)]
    for i in range(0, SECTORS):
        p, q = inside[i], outside[i]
        up = ((q[0] * 0.75 + p[0] * 0.25), 42.5, (q[2] * 0.75 + p[2] * 0.25))
        foot = (q[0] * 1.02, 0.0, q[2] * 1.02)
        for path in ([p, up], [up, q], [q, foot], [up, foot]):
            d = (path[1][0] - path[0][0], 0, path[1][2] - path[0][2])
            n = (-d[2], 0, d[0])
            length = math.hypot(n[0], n[2]) or 1.0
            parts["steel"].join(sweep(rod, path, (n[0] / length, 0, n[2] / length)))
    ring = oval(80.4, 62.4, 36.8, 128)
    for i in range(0, 128):
        p, q = ring[i], ring[(i + 1) % 128]
        along = [(q[k] - p[k]) * 0.35 for k in range(3)]
        drop = (-0.012 * p[0], -0.9, -0.012 * p[2])
        parts["floods"].quad(p, tuple(p[k] + drop[k] for k in range(3)), tuple(p[k] + along[k] + drop[k] for k in range(3)),
                             tuple(p[k] + along[k] for k in range(3)))


def masts(parts):
    """Four lattice masts of 75 m beyond the corners, each with a leaning panel of lamps."""
    for sx in (-1, 1):
        for sz in (-1, 1):
            x, z = 118 * sx, 104 * sz
            for ux in (-1, 1):
                for uz in (-1, 1):
                    rod = [(0.3 * math.cos(t), 0.3 * math.sin(t)) for t in (0.8, 2.4, 3.9, 5.5)]
                    path = [(x + 3.2 * ux, 0, z + 3.2 * uz), (x + 0.8 * ux, 72, z + 0.8 * uz)]
                    parts["steel"].join(sweep(rod, path, (1, 0, 0)))
            for k in range(18):
                h, w = 4 * k, 3.2 - 2.4 * k / 18
                parts["steel"].join(box(x - w, x + w, h, h + 0.25, z - 0.1, z + 0.1))
                parts["steel"].join(box(x - 0.1, x + 0.1, h + 2, h + 2.25, z - w, z + w))
            turn = math.degrees(math.atan2(-x, -z))
            head = at(x, 70, z, turn=turn, tilt=32)
            parts["steel"].join(box(-7, 7, 0, 9, -0.9, -0.3, 0.2), head)
            for i in range(8):
                for k in range(5):
                    u, v = -6.1 + 1.75 * i, 0.9 + 1.75 * k
                    parts["floods"].join(quad_facing(u - 0.6, u + 0.6, v - 0.6, v + 0.6), head)


def quad_facing(x0, x1, y0, y1):
    mesh = Mesh()
    mesh.quad((x0, y0, -0.25), (x1, y0, -0.25), (x1, y1, -0.25), (x0, y1, -0.25))
    return mesh


def pitch(parts):
    """Grass mown in stripes, the lines, the goals, a track of red round it."""
    for i in range(20):
        x = -60 + 6 * i
        parts["grass-a" if i % 2 else "grass-b"].quad((x, 0.0, -42), (x + 6, 0.0, -42), (x + 6, 0.0, 42), (x, 0.0, 42))
    lines, y, w = parts["lines"], 0.03, 0.16

    def line(x0, z0, x1, z1):
        lines.quad((x0 - w, y, z0 - w), (x1 + w, y, z0 - w), (x1 + w, y, z1 + w), (x0 - w, y, z1 + w))

    def arc(cx, cz, r, a0, a1):
        steps = 40
        for i in range(steps):
            s, e = (math.radians(a0 + (a1 - a0) * k / steps) for k in (i, i + 1))
            ring = [(cx + q * math.cos(t), y, cz + q * math.sin(t)) for q, t in
                    ((r - w, s), (r + w, s), (r + w, e), (r - w, e))]
            lines.quad(*ring)
    for s in (-1, 1):
        line(-52.5, 34 * s, 52.5, 34 * s)
        line(52.5 * s, -34, 52.5 * s, 34)
        for depth, half in ((16.5, 20.16), (5.5, 9.16)):
            x = s * (52.5 - depth)
            line(x, -half, x, half)
            for e in (-half, half):
                line(min(x, 52.5 * s), e, max(x, 52.5 * s), e)
        arc(s * (52.5 - 11), 0, 9.15, 127 if s > 0 else -53, 233 if s > 0 else 53)
        post = [(0.12 * math.cos(t), 0.12 * math.sin(t)) for t in (0, 1.57, 3.14, 4.71)]
        g = s * 52.5
        parts["lines"].join(sweep(post, [(g, 0, -3.66), (g, 2.44, -3.66), (g, 2.44, 3.66), (g, 0, 3.66)], (1, 0, 0)))
    line(0, -34, 0, 34)
    arc(0, 0, 9.15, 0, 360)
    dice = random.Random(3)
    for k in range(23):
        x, z = dice.uniform(-40, 40), dice.uniform(-26, 26)
        parts["red" if k % 2 else "navy"].join(box(x - 0.3, x + 0.3, 0.0, 1.8, z - 0.3, z + 0.3, 0.1))


def height(noise, x, z):
    """Hills that rise beyond the town."""
    far = math.hypot(x, z)
    t = max(0.0, (far - 900) / 2000)
    return 420 * t ** 1.4 * (0.25 + noise(x / 5000 + 0.31, z / 5000 + 0.77)) - 0.4


def land(parts, noise):
    steps, reach = 90, 3600.0
    grid = lambda i: reach * math.copysign(abs(2 * i / steps - 1) ** 1.4, 2 * i / steps - 1)
    for i in range(steps):
        for k in range(steps):
            xs, zs = (grid(i), grid(i + 1)), (grid(k), grid(k + 1))
            p = [(x, height(noise, x, z), z) for x, z in ((xs[0], zs[0]), (xs[0], zs[1]), (xs[1], zs[1]), (xs[1], zs[0]))]
            parts["land"].quad(*p)


def town(parts, noise, dice):
    """Blocks of houses along a crooked grid of streets, windows lit here and there, lamps along the streets."""
    for i in range(-17, 18):
        for k in range(-17, 18):
            cx, cz = 86 * i + 12 * math.sin(k * 0.7), 72 * k + 12 * math.sin(i * 0.6)
            far = math.hypot(cx, cz)
            if abs(cx) < 190 and abs(cz) < 165 or far > 1450 or dice.random() < (far / 1600) ** 2:
                continue
            for s in range(2):
                lamp_x, lamp_z = cx - 40 + 43 * s, cz - 33
                y = height(noise, lamp_x, lamp_z) + 8
                parts["street"].join(box(lamp_x - 0.5, lamp_x + 0.5, y, y + 0.25, lamp_z - 0.5, lamp_z + 0.5))
            for _ in range(dice.randint(3, 6)):
                x, z = cx + dice.uniform(-28, 28), cz + dice.uniform(-22, 22)
                w, d = dice.uniform(5, 11), dice.uniform(5, 10)
                high = dice.choice((7, 9, 12, 12, 15, 18)) if far < 1000 else dice.choice((5, 7, 9))
                if dice.random() < 0.02:
                    high = dice.uniform(40, 75)
                house(parts, dice, x, height(noise, x, z), z, w, d, high)


def house(parts, dice, x, y, z, w, d, high):
    parts[dice.choice(("house-a", "house-b"))].join(box(x - w, x + w, y - 4, y + high, z - d, z + d))
    if high < 20:
        ridge = [(x - w * 1.05, y + high, z - d * 1.05), (x + w * 1.05, y + high, z - d * 1.05), (x + w * 1.05, y + high, z + d * 1.05),
                 (x - w * 1.05, y + high, z + d * 1.05)]
        top = [(x - w * 0.9, y + high + 0.5 * d, z), (x + w * 0.9, y + high + 0.5 * d, z)]
        mesh = parts["tiles"]
        mesh.quad(ridge[0], ridge[1], top[1], top[0])
        mesh.quad(ridge[2], ridge[3], top[0], top[1])
        mesh.tri(ridge[1], ridge[2], top[1])
        mesh.tri(ridge[3], ridge[0], top[0])
    for floor_ in range(int(high // 3)):
        for side in (-1, 1):
            for k in range(int(w // 1.6)):
                if dice.random() < 0.15:
                    u, v = x - w + 1.4 + 3.1 * k, y + 1.2 + 3 * floor_
                    parts["windows"].quad((u, v, z + side * (d + 0.06)), (u + 1.2, v, z + side * (d + 0.06)),
                                          (u + 1.2, v + 1.4, z + side * (d + 0.06)), (u, v + 1.4, z + side * (d + 0.06)))
                if dice.random() < 0.12:
                    u, v = z - d + 1.4 + 3.1 * k, y + 1.2 + 3 * floor_
                    if u + 1.2 < z + d:
                        e = x + side * (w + 0.06)
                        parts["windows"].quad((e, v, u), (e, v, u + 1.2), (e, v + 1.4, u + 1.2), (e, v + 1.4, u))


def main():
    dice, noise = random.Random(5), Noise(17, 4, 4)
    names = ("stands", "fascia", "banner", "roof", "steel", "floods", "grass-a", "grass-b", "lines", "red", "navy", "white", "land",
             "house-a", "house-b", "tiles", "windows", "street")
    parts = {name: Mesh() for name in names}
    stands(parts, dice)
    roof(parts)
    masts(parts)
    pitch(parts)
    land(parts, noise)
    town(parts, noise, dice)
    apron = [oval(62, 44, -0.05), oval(180, 160, -0.05)]
    parts["fascia"].join(loft(apron, caps=False))
    write_all(here(__file__), parts, crease=30.0)


main()
