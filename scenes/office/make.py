"""An open-plan office at dusk: desks in islands of four, chairs, screens, desk lamps, plants, a grid of ceiling panels.

Metres; y up. The room is x from 0 to 21.6, z from 0 to 33.6, 3.1 high; windows fill the left wall and the far one.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, at, box, here, lathe, loft, prism, circle, stone_picture, sweep, write_all  # noqa: E402

WIDTH, LENGTH, HIGH = 21.6, 33.6, 3.1


def chair():
    """A swivel chair: five-pointed base on castors, gas spring, shell of seat and back with arms."""
    frame, cloth = Mesh(), Mesh()
    for k in range(5):
        a = 72 * k
        arm = loft([[(0.03, y, w) for w, y in ((-0.03, 0.08), (-0.03, 0.13), (0.03, 0.13), (0.03, 0.08))],
                    [(0.31, y, w) for w, y in ((-0.018, 0.065), (-0.018, 0.085), (0.018, 0.085), (0.018, 0.065))]])
        frame.join(arm, at(turn=a))
        wheel = lathe([(0.0, -0.02), (0.03, -0.02), (0.03, 0.02), (0.0, 0.02)], 10)
        c, s = math.cos(math.radians(a)), math.sin(math.radians(a))
        frame.join(wheel, lambda p: (0.31 * c + p[1] * s + p[0] * c, 0.03 + p[2], -0.31 * s + p[1] * c - p[0] * s))
    frame.join(lathe([(0.04, 0.1), (0.03, 0.12), (0.03, 0.40), (0.12, 0.43), (0.12, 0.45)], 14))
    rings = []
    for z, y, half in ((0.24, 0.47, 0.20), (0.22, 0.49, 0.235), (0.0, 0.47, 0.245), (-0.18, 0.485, 0.235), (-0.235, 0.54, 0.225),
                       (-0.26, 0.66, 0.215), (-0.275, 0.82, 0.22), (-0.29, 0.98, 0.20), (-0.295, 1.03, 0.16)):
        thick = 0.05 if y < 0.6 else 0.035
        front = [(half * u, y + 0.012 * abs(u) ** 2 * 2, z + (0.05 * u * u if y > 0.5 else 0)) for u in (-1, -0.6, 0, 0.6, 1)]
        if y < 0.52:
            back = [(x, yy - thick, zz) for x, yy, zz in reversed(front)]
        else:
            back = [(x, yy - 0.01, zz - thick) for x, yy, zz in reversed(front)]
        rings.append(front + back)
    cloth.join(loft(rings))
    for s in (-1, 1):
        frame.join(box(s * 0.29 - 0.025, s * 0.29 + 0.025, 0.66, 0.69, -0.16, 0.12, 0.01))
        frame.join(box(s * 0.29 - 0.015, s * 0.29 + 0.015, 0.45, 0.66, -0.05, 0.0))
        frame.join(box(min(s * 0.2, s * 0.29), max(s * 0.2, s * 0.29), 0.43, 0.455, -0.05, 0.0))
    return frame, cloth


def screen():
    """A flat screen on a foot: (case, its shining face)."""
    case, glow = Mesh(), Mesh()
    case.join(box(-0.30, 0.30, 0.13, 0.49, -0.012, 0.012, 0.004))
    case.join(box(-0.025, 0.025, 0.0, 0.3, -0.03, -0.012)).join(box(-0.11, 0.11, 0.0, 0.012, -0.10, 0.08, 0.004))
    glow.quad((-0.29, 0.14, 0.0125), (0.29, 0.14, 0.0125), (0.29, 0.48, 0.0125), (-0.29, 0.48, 0.0125))
    return case, glow


def lamp():
    """A desk lamp: foot, two arms, a bell with a disc of light in it."""
    body, glow = Mesh(), Mesh()
    body.join(lathe([(0.0, 0.0), (0.08, 0.0), (0.08, 0.018), (0.02, 0.025), (0.0, 0.025)], 18))
    rod = [(0.007 * math.cos(t), 0.007 * math.sin(t)) for t in (0, 1.26, 2.51, 3.77, 5.03)]
    body.join(sweep(rod, [(0, 0.02, 0), (-0.12, 0.26, 0), (0.14, 0.46, 0)], (0, 0, 1)))
    bell = lathe([(0.02, 0.05), (0.03, 0.03), (0.055, -0.02), (0.075, -0.06), (0.071, -0.06), (0.05, -0.02), (0.0, 0.0)], 18)
    tip = at(0.17, 0.45, 0)
    body.join(bell, tip)
    glow.join(prism(circle(0.05, 12), -0.022, -0.0219), tip)
    glow.faces = [f for f in glow.faces if max(p[1] for p in f[:3]) - min(p[1] for p in f[:3]) < 1e-5][:10]
    return body, glow


def desk():
    top, legs = Mesh(), Mesh()
    top.join(box(-0.8, 0.8, 0.715, 0.74, -0.4, 0.4, 0.005))
    for x in (-0.74, 0.74):
        legs.join(box(x - 0.03, x + 0.03, 0.0, 0.03, -0.36, 0.36, 0.008))
        legs.join(box(x - 0.025, x + 0.025, 0.03, 0.715, -0.04, 0.04))
    legs.join(box(-0.74, 0.74, 0.64, 0.69, -0.02, 0.02))
    return top, legs


def plant(dice):
    """A pot with long leaves that bend outwards."""
    pot, leaves = Mesh(), Mesh()
    pot.join(lathe([(0.0, 0.0), (0.17, 0.0), (0.24, 0.5), (0.24, 0.53), (0.215, 0.53), (0.2, 0.45), (0.0, 0.45)], 24))
    for _ in range(34):
        a, length, lean = dice.uniform(0, 360), dice.uniform(0.7, 1.25), dice.uniform(0.15, 0.95)
        rows = []
        for i in range(7):
            t = i / 6
            w = 0.05 * math.sin(math.pi * min(1, 0.08 + t * 0.92)) * (1.2 - 0.3 * t)
            r, y = length * lean * t ** 1.4, 0.45 + length * (t - 0.55 * lean * t ** 2.4)
            rows.append([(r, y + 0.25 * w, -w), (r, y, 0.0), (r, y + 0.25 * w, w)])
        leaves.join(loft(rows, closed=False), at(turn=a))
    return pot, leaves


def shell(parts):
    """Floor, ceiling with a grid of tiles, walls, window frames, columns."""
    white, frame = parts["white"], parts["frame"]
    parts["floor"].quad((0, 0, 0), (WIDTH, 0, 0), (WIDTH, 0, LENGTH), (0, 0, LENGTH))
    white.quad((0, 0, 0), (WIDTH, 0, 0), (WIDTH, HIGH, 0), (0, HIGH, 0))
    white.quad((WIDTH, 0, 0), (WIDTH, 0, LENGTH), (WIDTH, HIGH, LENGTH), (WIDTH, HIGH, 0))
    for i in range(18):  # ceiling tiles with a dark joint
        for k in range(28):
            x, z, g = 1.2 * i, 1.2 * k, 0.008
            white.join(box(x + g, x + 1.2 - g, HIGH, HIGH + 0.02, z + g, z + 1.2 - g, 0.005))
    parts["dark"].quad((0, HIGH + 0.015, 0), (WIDTH, HIGH + 0.015, 0), (WIDTH, HIGH + 0.015, LENGTH), (0, HIGH + 0.015, LENGTH))
    white.join(box(-0.3, 0.0, 0, 0.55, 0, LENGTH, 0.02)).join(box(-0.3, 0, 2.75, HIGH, 0, LENGTH))
    white.join(box(0, WIDTH, 0, 0.55, LENGTH, LENGTH + 0.3, 0.02)).join(box(0, WIDTH, 2.75, HIGH, LENGTH, LENGTH + 0.3))
    for k in range(29):
        frame.join(box(-0.14, -0.04, 0.55, 2.75, 1.2 * k - 0.03, 1.2 * k + 0.03, 0.01))
    for i in range(19):
        frame.join(box(1.2 * i - 0.03, 1.2 * i + 0.03, 0.55, 2.75, LENGTH + 0.04, LENGTH + 0.14, 0.01))
    frame.join(box(-0.14, -0.04, 1.98, 2.03, 0, LENGTH)).join(box(0, WIDTH, 1.98, 2.03, LENGTH + 0.04, LENGTH + 0.14))
    for k in range(5):
        for x in (7.2, 14.4):
            parts["column"].join(lathe([(0.26, 0.0), (0.26, HIGH)], 28), at(x, 0, 4.2 + 7.2 * k))


def luminaires(parts, dice):
    """Panels of 0.3 m by 1.2 m in rows across the room, each in a frame; a few are off."""
    count = 0
    for i in range(9):
        for k in range(27):
            x, z = 1.2 + 2.4 * i, 1.2 + 1.2 * k
            lit = dice.random() > 0.06
            parts["frame"].join(box(x - 0.17, x + 0.17, HIGH - 0.035, HIGH, z - 0.55, z + 0.55, 0.008))
            panel = parts["panels"] if lit else parts["white"]
            y = HIGH - 0.0355
            panel.quad((x - 0.15, y, z - 0.53), (x + 0.15, y, z - 0.53), (x + 0.15, y, z + 0.53), (x - 0.15, y, z + 0.53))
            count += lit
    return count


def islands(parts, dice):
    """Four desks to an island, back to back, with a low felt screen between them."""
    seats, lamps = 0, 0
    top, legs = desk()
    frame, cloth = chair()
    case, glow = screen()
    body, shine = lamp()
    for i in range(4):
        for k in range(9):
            cx, cz = 3.0 + 5.2 * i, 3.3 + 3.4 * k
            parts["felt" if (i + k) % 3 else "felt-warm"].join(box(cx - 1.62, cx + 1.62, 0.55, 1.12, cz - 0.02, cz + 0.02, 0.012))
            for sx in (-1, 1):
                for sz in (-1, 1):
                    x, z, turn = cx + 0.81 * sx, cz + 0.43 * sz, 0 if sz > 0 else 180
                    seat = at(x, 0, z, turn=turn)
                    parts["wood"].join(top, seat)
                    parts["frame"].join(legs, seat)
                    put = lambda px, py, pz, pt=0.0: (lambda p: seat(at(px, py, pz, turn=pt)(p)))
                    where = put(dice.uniform(-0.2, 0.2), 0, dice.uniform(0.62, 0.9), 180 + dice.uniform(-35, 35))
                    parts["black"].join(frame, where)
                    parts[dice.choice(("cloth", "cloth", "cloth-warm"))].join(cloth, where)
                    for s in (-0.32, 0.32):
                        where = put(s, 0.74, -0.2, -12 * (1 if s > 0 else -1))
                        parts["black"].join(case, where)
                        on = dice.random()
                        parts["screens" if on < 0.55 else "black"].join(glow, where)
                    parts["white"].join(box(-0.2, 0.2, 0.74, 0.755, 0.1, 0.24, 0.004), seat)
                    if dice.random() < 0.7:
                        parts["paper"].join(box(-0.1, 0.1, 0.74, 0.742 + dice.uniform(0, 0.05), -0.14, 0.14), put(
                            dice.uniform(-0.6, -0.5), 0, dice.uniform(0.0, 0.15), dice.uniform(-30, 30)))
                    if dice.random() < 0.5:
                        mug = lathe([(0.0, 0.0), (0.038, 0.0), (0.042, 0.09), (0.037, 0.09), (0.034, 0.01), (0.0, 0.01)], 14)
                        parts["felt-warm" if dice.random() < 0.5 else "white"].join(mug, put(dice.uniform(0.3, 0.6), 0.74, 0.12))
                    if dice.random() < 0.6:
                        where = put(0.68, 0.74, -0.1, dice.uniform(120, 200))
                        parts["yellow" if dice.random() < 0.4 else "black"].join(body, where)
                        parts["lamps"].join(shine, where)
                        lamps += 1
                    seats += 1
    return seats, lamps


def main():
    dice = random.Random(8)
    names = ("floor", "white", "dark", "frame", "column", "panels", "wood", "felt", "felt-warm", "black", "cloth", "cloth-warm",
             "screens", "paper", "yellow", "lamps", "pots", "leaves")
    parts = {name: Mesh() for name in names}
    shell(parts)
    panels = luminaires(parts, dice)
    seats, lamps = islands(parts, dice)
    for x, z in ((0.6, 1.4), (0.7, 5.1), (5.6, 1.7), (10.8, 8.2), (5.6, 11.7), (0.6, 11.8), (16.0, 15), (5.6, 22), (10.8, 25.3)):
        pot, leaves = plant(dice)
        parts["pots"].join(pot, at(x, 0, z))
        parts["leaves"].join(leaves, at(x, 0, z))
    print("   %d seats, %d ceiling panels, %d desk lamps" % (seats, panels, lamps))
    folder = here(__file__)
    parts["floor"].boxed(1.0)
    write_all(folder, parts, crease=35.0)
    stone_picture(os.path.join(folder, "mesh", "carpet.png"), 192, (0.40, 0.42, 0.45), 0.5, seed=31)


main()
