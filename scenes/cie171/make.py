#!/usr/bin/env python3
"""The files that the scenes of this folder read, which git keeps: a Lambertian luminaire of 1000 cd as LM-63, and CIE standard
general skies (ISO 15469:2004 / CIE S 011:2003) as environment maps in the equal-area octahedral mapping, z up, the sun
60 degrees high towards +y: 5.9's measured wall, y = 0, is the northern one and faces it.

Skies have 1 lx on the horizontal plane (of the sky alone, no sun). The lower half mirrors the upper one, so that no pixel
straddles a step at the horizon; scenes cover it with a ground.

usage: make.py
"""
import math
import struct

SIZE = 128
# a, b, c, d, e of gradation and indicatrix; 16 is the traditional overcast sky, (1 + 2 sin)/3.
SKIES = {1: (4, -0.7, 0, -1, 0), 12: (-1, -0.32, 10, -3, 0.45), 16: None}
SUN = math.radians(60)


def luminance(kind, x, y, z):
    """Relative to no particular direction."""
    if kind == 16:
        return (1 + 2 * z) / 3
    a, b, c, d, e = SKIES[kind]
    gradation = 1 + a * math.exp(b / max(z, 1e-6))
    chi = math.acos(max(-1, min(1, y * math.cos(SUN) + z * math.sin(SUN))))
    return gradation * (1 + c * (math.exp(d * chi) - math.exp(d * math.pi / 2)) + e * math.cos(chi) ** 2)


def horizontal(kind):
    """Illuminance of the horizontal plane under the whole sky, by the midpoint rule in angles."""
    n, total = 400, 0
    for i in range(n):
        theta = (i + 0.5) / n * math.pi / 2
        for j in range(n):
            phi = (j + 0.5) / n * 2 * math.pi
            w = (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
            total += luminance(kind, *w) * math.cos(theta) * math.sin(theta)
    return total * (math.pi / 2 / n) * (2 * math.pi / n)


def direction(u, v):
    """Clarberg's equal-area octahedral mapping of the unit square, as pbrt-v4 has it."""
    u, v = 2 * u - 1, 2 * v - 1
    distance = 1 - (abs(u) + abs(v))
    r = 1 - abs(distance)
    phi = (1 if r == 0 else (abs(v) - abs(u)) / r + 1) * math.pi / 4
    z = math.copysign(1 - r * r, distance)
    scale = r * math.sqrt(2 - r * r)
    return math.copysign(math.cos(phi), u) * scale, math.copysign(math.sin(phi), v) * scale, z


for kind in SKIES:
    scale = 1 / horizontal(kind)
    with open(f"sky-{kind}.pfm", "wb") as file:
        file.write(f"Pf\n{SIZE} {SIZE}\n-1.0\n".encode())
        for row in reversed(range(SIZE)):  # from the bottom up
            for column in range(SIZE):
                x, y, z = direction((column + 0.5) / SIZE, (row + 0.5) / SIZE)
                file.write(struct.pack("<f", scale * luminance(kind, x, y, abs(z))))

with open("lambertian.ies", "w") as file:
    file.write("IESNA:LM-63-2002\n[TEST] CIE 171:2006, 5.2: diffuse source, I = 1000 cd cos(gamma)\n[MANUFAC] none\n"
               "[LUMCAT] none\n[LUMINAIRE] Lambertian point\n[LAMPCAT] none\n[LAMP] none\nTILT=NONE\n"
               "1 3141.593 1 91 1 1 2 0 0 0\n1 1 0\n")
    for row in ([f"{g}" for g in range(91)], ["0"], [f"{1000 * math.cos(math.radians(g)):.4f}" for g in range(91)]):
        for start in range(0, len(row), 13):
            file.write(" ".join(row[start:start + 13]) + "\n")
