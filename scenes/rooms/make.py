"""Writes rooms.pbrt: sixteen furnished rooms with a lamp each, of which the camera sees one. The same bytes on every run.

usage: make.py [ROOMS]      each way; other than 4: rooms-ROOMS.pbrt
"""
import os
import random
import sys

ROOMS = int(sys.argv[1]) if len(sys.argv) > 1 else 4  # each way
SIZE = 4.0             # of a room, from the middle of a wall to the next, metres
HEIGHT = 2.7
WALL = 0.06            # half of a wall's thickness
DOOR, LINTEL = 0.9, 2.05
LAMP = 0.30            # side of a lamp

HEAD = """\
# Sixteen rooms behind open doors, each with a lamp of its own at the ceiling; the camera sees one of them and through its
# doors a little of two more. What most lamps emit never reaches the picture. Written by make.py. Metres, W/(m^2 sr);
# y is up.

LookAt 4.45 1.55 4.5  6.9 1.15 7.2  0 1 0
Camera "perspective" "float fov" 66
Film "rgb" "integer xresolution" 384 "integer yresolution" 256 "string filename" "rooms.exr"
PixelFilter "box"
Sampler "independent" "integer pixelsamples" 16
Integrator "progressive" "integer photons" 100000

WorldBegin
"""


def number(x):
    return f"{x:.3f}".rstrip("0").rstrip(".")


def box(x0, y0, z0, x1, y1, z1):
    """Six quadrilaterals, normals outwards."""
    return [
        [(x0, y0, z0), (x0, y1, z0), (x1, y1, z0), (x1, y0, z0)],
        [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
        [(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)],
        [(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)],
        [(x0, y1, z0), (x0, y1, z1), (x1, y1, z1), (x1, y1, z0)],
        [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)],
    ]


def mesh(quads):
    points = "\n    ".join(" ".join(number(c) for p in quad for c in p) for quad in quads)
    indices = " ".join(f"{4 * i} {4 * i + 1} {4 * i + 2} {4 * i} {4 * i + 2} {4 * i + 3}" for i in range(len(quads)))
    return f'Shape "trianglemesh" "integer indices" [ {indices} ]\n    "point3 P" [\n    {points} ]\n'


def surface(name, reflectance, quads):
    return f'\n# {name}\nMaterial "diffuse" "rgb reflectance" [ {reflectance} ]\n{mesh(quads)}'


def wall(along_x, at, begin, door):
    """From `begin` for one room's length, across the other axis at `at`; `door`: the middle of its door, or none."""
    def piece(a, b, y0, y1):
        if along_x:
            return box(a, y0, at - WALL, b, y1, at + WALL)
        return box(at - WALL, y0, a, at + WALL, y1, b)
    if door is None:
        return piece(begin, begin + SIZE, 0, HEIGHT)
    left, right = door - DOOR / 2, door + DOOR / 2
    return piece(begin, left, 0, HEIGHT) + piece(right, begin + SIZE, 0, HEIGHT) + piece(left, right, LINTEL, HEIGHT)


def walls():
    quads = []
    for i in range(ROOMS + 1):
        for j in range(ROOMS):
            outer = i in (0, ROOMS)
            middle = SIZE * (j + (0.3 if (i + j) % 2 else 0.7))
            for along_x in (False, True):
                quads += wall(along_x, SIZE * i, SIZE * j, None if outer else middle)
    return quads


def main():
    rng = random.Random(5)
    extent = SIZE * ROOMS
    text = HEAD
    text += surface("floor", "0.42 0.34 0.26", [[(0, 0, 0), (0, 0, extent), (extent, 0, extent), (extent, 0, 0)]])
    text += surface("ceiling", "0.78 0.77 0.74",
                    [[(0, HEIGHT, 0), (extent, HEIGHT, 0), (extent, HEIGHT, extent), (0, HEIGHT, extent)]])
    text += surface("walls", "0.70 0.66 0.58", walls())
    tables, shelves, lamps = [], [], ""
    for i in range(ROOMS):
        for j in range(ROOMS):
            x, z = SIZE * i, SIZE * j
            a, b = x + rng.uniform(1.6, 2.4), z + rng.uniform(1.7, 2.5)
            tables += box(a - 0.5, 0.68, b - 0.4, a + 0.5, 0.72, b + 0.4)
            tables += box(a - 0.05, 0, b - 0.05, a + 0.05, 0.68, b + 0.05)
            shelves += box(x + 3.2, 0, z + 3.6, x + 3.94, 1.4, z + 3.94)
            shelves += box(a - 0.3, 0.7201, b - 0.2, a, 0.95, b)
            radiance = 60 * rng.lognormvariate(0, 0.5)
            lx, lz, top = x + 2 - LAMP / 2, z + 2 - LAMP / 2, HEIGHT - 0.25
            lamp = [[(lx, top, lz), (lx + LAMP, top, lz), (lx + LAMP, top, lz + LAMP), (lx, top, lz + LAMP)]]
            lamps += ('AttributeBegin\nAreaLightSource "diffuse" "rgb L" '
                      f'[ {number(radiance)} {number(0.86 * radiance)} {number(0.68 * radiance)} ]\n'
                      f'Material "diffuse" "rgb reflectance" [ 0 0 0 ]\n{mesh(lamp)}AttributeEnd\n')
    text += surface("tables", "0.36 0.22 0.12", tables)
    text += surface("shelves and boxes", "0.20 0.34 0.45", shelves)
    text += "\n# lamps, shining down\n" + lamps
    name = "rooms.pbrt" if ROOMS == 4 else f"rooms-{ROOMS}.pbrt"
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), name), "w", encoding="utf-8") as file:
        file.write(text)


main()
