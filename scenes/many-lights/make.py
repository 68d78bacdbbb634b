"""Writes many-lights.pbrt: a night market of 64 stalls under 384 small lamps. The same bytes on every run."""
import math
import os
import random

STALLS = 8          # each way
SIZE = 3.0          # of a stall, metres
HEIGHT = 1.9        # of its walls
LAMPS = 6           # in each

HEAD = """\
# A night market: 64 stalls of three walls each under 384 small lamps of very different power; each place is lit by the
# few lamps of its own stall and faintly by many others. Written by make.py. Metres, W/(m^2 sr); y is up.

LookAt -2.5 6.5 -4.5  9 0 11  0 1 0
Camera "perspective" "float fov" 52
Film "rgb" "integer xresolution" 384 "integer yresolution" 256 "string filename" "many-lights.exr"
PixelFilter "box"
Sampler "independent" "integer pixelsamples" 16
Integrator "direct"

WorldBegin

Material "diffuse" "rgb reflectance" [ 0.45 0.42 0.40 ]
Shape "trianglemesh" "integer indices" [ 0 1 2  0 2 3 ] "point3 P" [ -3 0 -3  -3 0 27  27 0 27  27 0 -3 ]
"""


def number(x):
    return f"{x:.2f}".rstrip("0").rstrip(".")


def quads(name, reflectance, corners):
    """One mesh of quadrilaterals, four corners each."""
    points = "\n    ".join(" ".join(number(c) for p in quad for c in p) for quad in corners)
    indices = " ".join(f"{4 * i} {4 * i + 1} {4 * i + 2} {4 * i} {4 * i + 2} {4 * i + 3}" for i in range(len(corners)))
    return f"""
# {name}
Material "diffuse" "rgb reflectance" [ {reflectance} ]
Shape "trianglemesh" "integer indices" [ {indices} ]
    "point3 P" [
    {points} ]
"""


def upright(x0, z0, x1, z1):
    return [(x0, 0, z0), (x1, 0, z1), (x1, HEIGHT, z1), (x0, HEIGHT, z0)]


def table(x, z):
    return [(x + 0.6, 0.8, z + 1.1), (x + 0.6, 0.8, z + 1.9), (x + 2.4, 0.8, z + 1.9), (x + 2.4, 0.8, z + 1.1)]


def lamp(random_, x, z):
    """A glass ball of 3 to 6 cm; lamps of one power each would be an easy scene."""
    place = [x + random_.uniform(0.4, 2.6), random_.uniform(1.3, 2.3), z + random_.uniform(0.4, 2.6)]
    radius = random_.uniform(0.015, 0.03)
    watts = 4 * math.exp(random_.gauss(0, 1))
    tint = random_.choice([(1.3, 0.95, 0.5), (1.0, 1.0, 1.0), (0.75, 1.0, 1.4), (1.8, 0.75, 0.55)])
    radiance = watts / (4 * math.pi ** 2 * radius ** 2)
    colour = " ".join(f"{radiance * c:.0f}" for c in tint)
    return (f'AttributeBegin Translate {" ".join(number(c) for c in place)} AreaLightSource "diffuse" "rgb L" [ {colour} ] '
            f'Shape "sphere" "float radius" {radius:.3f} AttributeEnd\n')


def main():
    random_ = random.Random(2003)
    walls, tables, lamps = [], [], []
    for i in range(STALLS):
        for j in range(STALLS):
            x, z = i * SIZE, j * SIZE
            walls.append(upright(x + 0.1, z + 2.9, x + 2.9, z + 2.9))
            walls.append(upright(x + 0.1, z + 0.5, x + 0.1, z + 2.9))
            walls.append(upright(x + 2.9, z + 0.5, x + 2.9, z + 2.9))
            tables.append(table(x, z))
            lamps += [lamp(random_, x, z) for _ in range(LAMPS)]
    text = HEAD + quads("walls", "0.6 0.5 0.4", walls) + quads("tables", "0.3 0.35 0.4", tables)
    text += '\n# lamps\nMaterial "diffuse" "rgb reflectance" [ 0 0 0 ]\n' + "".join(lamps)
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "many-lights.pbrt"), "w", encoding="ascii") as out:
        out.write(text)


main()
