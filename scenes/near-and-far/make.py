"""Two pins, a spoked wheel and a coil spring on a sheet of paper, and the far field of a chip by formula. Metres.

Built in millimetres: x right, y up, z away from the reader.
"""
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from workshop import Mesh, at, cross, here, lathe, loft, unit, wheel, write_all  # noqa: E402

MILLI = 1e-3


def pin(height, head):
    """A pin stuck upright into the paper, and its ceramic head, a ball of radius `head` about the upper end."""
    shaft = lathe([(0.14, 0.0), (0.14, height)], 24)
    ball = [(head * math.sin(math.pi * i / 24), height - head * math.cos(math.pi * i / 24)) for i in range(25)]
    return shaft, lathe(ball, 48)


def coil(radius, height, turns, wire):
    """A coil spring on end: closed turns at both ends, open ones between."""
    rings, low, high, closed = [], wire, height - wire, 2.05 * wire
    for i in range(64 * (turns + 2) + 1):
        turn = i / 64
        if turn < 1:
            y = low + closed * turn
        elif turn < turns + 1:
            y = low + closed + (high - low - 2 * closed) * (turn - 1) / turns
        else:
            y = high - closed * (turns + 2 - turn)
        a = 2 * math.pi * turn
        out = (math.cos(a), 0.0, math.sin(a))
        along = unit((-math.sin(a), (high - low) / (turns * 2 * math.pi * radius), math.cos(a)))
        up = cross(out, along)
        rings.append([tuple(v + wire * (math.cos(t) * o + math.sin(t) * u) for v, o, u in
                            zip((radius * out[0], y, radius * out[2]), out, up))
                      for t in (2 * math.pi * k / 16 for k in range(16))])
    return loft(rings)


def lambertian(file):
    """The far field of a flat chip by formula, 1 lm: cos(gamma) / pi candela, in steps of 5 degrees."""
    angles = range(0, 91, 5)
    with open(file, "w", encoding="ascii") as out:
        out.write("IESNA:LM-63-2002\n[TEST] by formula\n[TESTLAB] none\n[ISSUEDATE] none\n[MANUFAC] none\nTILT=NONE\n"
                  "1 -1 1 %d 1 1 2 0 0 0\n1 1 0\n" % len(angles))
        out.write(" ".join(map(str, angles)) + "\n0\n")
        out.write(" ".join("%.6f" % (math.cos(math.radians(a)) / math.pi) for a in angles) + "\n")


def main():
    parts = {name: Mesh() for name in ("steel", "brass", "ceramic")}
    for x, z, height, head in ((0.7, -3.1, 3.4, 0.55), (2.7, 2.3, 2.8, 0.45)):
        shaft, ball = pin(height, head)
        parts["steel"].join(shaft, at(x, 0, z))
        parts["ceramic"].join(ball, at(x, 0, z))
    gear = wheel(36, 2.3, -0.2, thick=0.4, spokes=5, rim=0.2)
    parts["brass"].join(Mesh().join(gear, at(tilt=-90)), at(-1.0, 2.27, 1.7, turn=40))
    parts["steel"].join(coil(0.95, 2.8, 4, 0.11), at(-3.2, 0, -1.9))
    parts = {name: Mesh().join(mesh, lambda p: (MILLI * p[0], MILLI * p[1], MILLI * p[2])) for name, mesh in parts.items()}
    folder = here(__file__)
    write_all(folder, parts, crease=32.0)
    for chip in ("red", "green", "blue"):
        lambertian(os.path.join(folder, "led-%s.ies" % chip))


main()
