"""The bike light's front glass: flat outside, ribbed inside. Python's standard library only.

Each rib is a cylinder lens along y, bulging towards the lamp, cut into facets so narrow that the coil's width hides
them. Millimetres, as in bike-light.pbrt.
"""
import math
import os

WIDTH, HEIGHT = 52.0, 27.0  # a little more than the housing, whose walls pass through the glass's edges
RIBS, FACETS = 20, 48       # ribs across, facets per rib
BULGE = 0.35                # of a rib, beyond the valleys between ribs
VALLEY, OUTSIDE = -3.0, -0.5  # z of the valleys and of the flat face


def rib_profile():
    """(x, z) of the inner face, from left to right."""
    pitch = WIDTH / RIBS
    radius = ((pitch / 2) ** 2 + BULGE ** 2) / (2 * BULGE)
    for rib in range(RIBS):
        middle = -WIDTH / 2 + (rib + 0.5) * pitch
        last = rib == RIBS - 1
        for i in range(FACETS + (1 if last else 0)):
            x = (i / FACETS - 0.5) * pitch
            yield middle + x, VALLEY - (math.sqrt(radius * radius - x * x) - (radius - BULGE))


def strip(profile, outwards):
    """Points and triangles of a profile drawn along y; normals to +z if outwards."""
    points, faces = [], []
    for x, z in profile:
        points += [(x, -HEIGHT / 2, z), (x, HEIGHT / 2, z)]
    for i in range(0, len(points) - 2, 2):
        a, b, c, d = i, i + 2, i + 3, i + 1
        faces += [(a, b, c), (a, c, d)] if outwards else [(a, c, b), (a, d, c)]
    return points, faces


def write_ply(name, points, faces):
    folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "mesh")
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, name), "w", encoding="ascii") as out:
        out.write("ply\nformat ascii 1.0\nelement vertex %d\n" % len(points))
        out.write("property float x\nproperty float y\nproperty float z\n")
        out.write("element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces))
        for p in points:
            out.write("%.7g %.7g %.7g\n" % p)
        for f in faces:
            out.write("3 %d %d %d\n" % f)


write_ply("ribs.ply", *strip(rib_profile(), False))
write_ply("flat.ply", *strip([(-WIDTH / 2, OUTSIDE), (WIDTH / 2, OUTSIDE)], True))
