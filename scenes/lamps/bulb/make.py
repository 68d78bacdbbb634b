"""A bulb as rays: a coiled filament in a clear glass envelope; it emits to all sides.

    make.py [FILE]      default: bulb.tm25ray beside this file

A helix of tungsten wire about the x axis, 12 mm long, emits by Lambert's law as a black body of 2856 K; turns do not
shade each other. The envelope is a sphere of 30 mm: it sends 8 % of the light back inside, as thin glass does, once,
and bends nothing. Rays start where they leave it. What goes into the cap, a cone of 25 degrees about -z, is lost.
"""
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
import tm25  # noqa: E402

RAYS, WATTS, KELVIN = 100_000, 4.0, 2856          # the watts are those from 360 to 830 nm
LENGTH, COIL, WIRE, TURNS = 12.0, 0.5, 0.075, 24  # mm: length; radius of the coil and of its wire
GLASS, REFLECTED = 30.0, 0.08
CAP = math.cos(math.radians(25))


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def along(p, d, t):
    return (p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2])


def filament_point(dice):
    """A point on the wire's surface, and the normal there."""
    a = 2 * math.pi * TURNS * dice.random()
    x = LENGTH * (a / (2 * math.pi * TURNS) - 0.5)
    out = (0.0, math.cos(a), math.sin(a))  # from the coil's axis
    rate = LENGTH / (2 * math.pi * TURNS)
    length = math.hypot(rate, COIL)
    tangent = (rate / length, -COIL * math.sin(a) / length, COIL * math.cos(a) / length)
    across = (tangent[1] * out[2] - tangent[2] * out[1], tangent[2] * out[0] - tangent[0] * out[2],
              tangent[0] * out[1] - tangent[1] * out[0])
    b = 2 * math.pi * dice.random()
    normal = tuple(math.cos(b) * out[i] + math.sin(b) * across[i] for i in range(3))
    return along((x, COIL * out[1], COIL * out[2]), normal, WIRE), normal


def lambert(normal, dice):
    """Cosine-distributed about the normal: the normal and a point on the unit sphere, added."""
    z = 2 * dice.random() - 1
    r, phi = math.sqrt(max(0.0, 1 - z * z)), 2 * math.pi * dice.random()
    d = (normal[0] + r * math.cos(phi), normal[1] + r * math.sin(phi), normal[2] + z)
    length = math.sqrt(dot(d, d))
    return along((0.0, 0.0, 0.0), d, 1 / length) if length > 1e-9 else normal


def to_glass(p, d):
    """Where the ray from inside meets the sphere."""
    b = dot(p, d)
    return along(p, d, -b + math.sqrt(b * b - dot(p, p) + GLASS * GLASS))


def leaving_ray(dice):
    """Position on the glass and direction, or None: lost in the cap."""
    p, normal = filament_point(dice)
    d = lambert(normal, dice)
    p = to_glass(p, d)
    if dice.random() < REFLECTED and p[2] > -CAP * GLASS:
        d = along(d, p, -2 * dot(d, p) / (GLASS * GLASS))
        p = to_glass(p, d)
    return None if p[2] < -CAP * GLASS else p + d


def main():
    dice = random.Random(2856)
    rays = []
    while len(rays) < RAYS:
        ray = leaving_ray(dice)
        if ray:
            rays.append(ray)
    tm25.write_tm25(tm25.target(__file__, "bulb.tm25ray"), "bulb, coiled filament in clear glass, made by formula",
                    WATTS, rays, [tm25.planck(KELVIN)])


main()
