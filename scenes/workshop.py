"""What the scenes' generators share: meshes from profiles, binary PLY, small tileable pictures.

Python's standard library only; the same bytes on every run. Points are tuples (x, y, z), y is up, lengths are the
scene's. Every builder returns a Mesh; `join` puts meshes together. Normals are found when a mesh is written: faces
that meet at less than the crease angle are smooth.
"""
import array
import math
import os
import random
import struct
import sys
import zlib


# --- vectors and places ---

def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(a):
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length > 0 else (0.0, 0.0, 0.0)


def at(x=0.0, y=0.0, z=0.0, turn=0.0, size=1.0, tilt=0.0):
    """A place: scaled by `size` (a number, or one for each axis), tilted about x, turned about y, moved. Degrees."""
    sx, sy, sz = size if isinstance(size, tuple) else (size, size, size)
    ct, st = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    cp, sp = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))

    def place(p):
        a, b, c = p[0] * sx, p[1] * sy, p[2] * sz
        b, c = cp * b - sp * c, sp * b + cp * c
        return (ct * a + st * c + x, b + y, -st * a + ct * c + z)
    return place


# --- meshes ---

class Mesh:
    """Triangles, each three points, with three texture points or none."""

    def __init__(self):
        self.faces = []

    def tri(self, a, b, c, uv=None):
        ab, ac = sub(b, a), sub(c, a)
        n = cross(ab, ac)
        # Slivers have no direction that could be trusted, and nothing is seen of them.
        if dot(n, n) > 1e-14 * max(dot(ab, ab), dot(ac, ac)) ** 2:
            self.faces.append((a, b, c, uv))

    def quad(self, a, b, c, d, uv=None):
        self.tri(a, b, c, uv and (uv[0], uv[1], uv[2]))
        self.tri(a, c, d, uv and (uv[0], uv[2], uv[3]))

    def fan(self, points):
        for i in range(1, len(points) - 1):
            self.tri(points[0], points[i], points[i + 1])

    def join(self, other, *places):
        """Adds a copy of `other` at each place; as it stands if there is none. Returns self."""
        if not places:
            self.faces += other.faces
        for place in places:
            for a, b, c, uv in other.faces:
                self.faces.append((place(a), place(b), place(c), uv))
        return self

    def boxed(self, tile):
        """Texture points for the faces that have none: the plane that a face faces most, `tile` long per repeat."""
        faces = []
        for a, b, c, uv in self.faces:
            if uv is None:
                n = [abs(v) for v in cross(sub(b, a), sub(c, a))]
                axis = n.index(max(n))
                u, v = ((2, 1), (0, 2), (0, 1))[axis]
                uv = tuple((p[u] / tile, p[v] / tile) for p in (a, b, c))
            faces.append((a, b, c, uv))
        self.faces = faces
        return self

    def write(self, path, crease=40.0):
        """A binary PLY with normals, and texture points if all faces have them. Says how many triangles."""
        scale = max((abs(v) for face in self.faces for p in face[:3] for v in p), default=1.0)
        # Of millimetres written in metres: six digits of the largest.
        digits = 6 if scale >= 1 else 6 - math.floor(math.log10(scale))
        known = {}  # keys of points: most belong to several faces

        def key(p):
            found = known.get(p)
            if found is None:
                found = known[p] = (round(p[0], digits), round(p[1], digits), round(p[2], digits))
            return found
        around, normals, keys = {}, [], []
        for index, (a, b, c, _) in enumerate(self.faces):
            n = cross(sub(b, a), sub(c, a))
            normals.append(n + unit(n))
            corner = (key(a), key(b), key(c))
            keys.append(corner)
            for k in corner:
                around.setdefault(k, []).append(index)
        textured = all(face[3] is not None for face in self.faces)
        cosine = math.cos(math.radians(crease))
        slots, vertices, corners = {}, [], array.array("i")
        for index, face in enumerate(self.faces):
            _, _, _, ox, oy, oz = normals[index]
            for k in range(3):
                own = keys[index][k]
                x = y = z = 0.0
                for other in around[own]:
                    wx, wy, wz, dx, dy, dz = normals[other]
                    if other == index or dx * ox + dy * oy + dz * oz > cosine:
                        x += wx
                        y += wy
                        z += wz
                n = unit((x, y, z))
                vertex = face[k] + n + (face[3][k] if textured else ())
                slot = own + tuple([round(v, 4) for v in vertex[3:]])
                if slot not in slots:
                    slots[slot] = len(vertices)
                    vertices.append(vertex)
                corners.append(slots[slot])
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as out:
            names = ["x", "y", "z", "nx", "ny", "nz"] + (["u", "v"] if textured else [])
            out.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(vertices)
                       + "".join("property float %s\n" % name for name in names)
                       + "element face %d\nproperty list uchar int vertex_indices\nend_header\n"
                       % len(self.faces)).encode())
            row = struct.Struct("<%df" % len(names))
            out.write(b"".join([row.pack(*vertex) for vertex in vertices]))
            triangle = struct.Struct("<Biii").pack
            out.write(b"".join([triangle(3, *corners[i:i + 3]) for i in range(0, len(corners), 3)]))
        print("   %-44s %7d triangles" % (os.path.relpath(path), len(self.faces)))


def write_all(folder, meshes, tile=None, crease=40.0):
    """Every mesh of the dictionary as folder/mesh/NAME.ply; the total is printed."""
    for name, mesh in meshes.items():
        if tile:
            mesh.boxed(tile)
        mesh.write(os.path.join(folder, "mesh", name + ".ply"), crease)
    print("   %d triangles in all" % sum(len(mesh.faces) for mesh in meshes.values()))


# --- builders ---

def loft(rings, closed=True, caps=True):
    """A skin over rings of equally many points; `closed` rings return to their first point."""
    mesh = Mesh()
    count = len(rings[0])
    for low, high in zip(rings, rings[1:]):
        for i in range(count if closed else count - 1):
            j = (i + 1) % count
            mesh.quad(low[i], low[j], high[j], high[i])
    if closed and caps:
        mesh.fan(rings[0][::-1])
        mesh.fan(rings[-1])
    return mesh


def lathe(profile, count, arc=360.0, caps=False):
    """Turns (radius, y) about the y axis."""
    steps = count if arc >= 360 else count + 1
    angles = [math.radians(arc) * i / count for i in range(steps)]
    rings = [[(r * math.sin(a), y, r * math.cos(a)) for a in angles] for r, y in profile]
    return loft(rings, arc >= 360, caps)


def prism(outline, y0, y1, chamfer=0.0):
    """Raises a convex outline of (x, z), counter-clockwise seen from above or not, from y0 to y1; chamfers the top."""
    def ring(points, y):
        return [(x, y, z) for x, z in points]
    rings = [ring(outline, y0)]
    if chamfer > 0:
        rings += [ring(outline, y1 - chamfer), ring(inset(outline, chamfer), y1)]
    else:
        rings.append(ring(outline, y1))
    return loft(rings)


def inset(outline, by):
    """A convex outline drawn in by a distance."""
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(outline, outline[1:] + outline[:1]))
    side = 1.0 if area > 0 else -1.0
    points = []
    for i, p in enumerate(outline):
        a, b = outline[i - 1], outline[(i + 1) % len(outline)]
        d0 = unit((p[0] - a[0], p[1] - a[1], 0))
        d1 = unit((b[0] - p[0], b[1] - p[1], 0))
        n0, n1 = (-d0[1] * side, d0[0] * side), (-d1[1] * side, d1[0] * side)
        k = by / max(1e-9, 1 + n0[0] * n1[0] + n0[1] * n1[1])
        points.append((p[0] + k * (n0[0] + n1[0]), p[1] + k * (n0[1] + n1[1])))
    return points


def box(x0, x1, y0, y1, z0, z1, chamfer=0.0):
    """A box; all its edges chamfered if asked."""
    c = min(chamfer, (x1 - x0) / 2.01, (y1 - y0) / 2.01, (z1 - z0) / 2.01)
    if c <= 0:
        return prism([(x0, z0), (x0, z1), (x1, z1), (x1, z0)], y0, y1)

    def ring(d, y):
        a, b, e, f = x0 + d, x1 - d, z0 + d, z1 - d
        return [(a, y, e + c), (a, y, f - c), (a + c, y, f), (b - c, y, f),
                (b, y, f - c), (b, y, e + c), (b - c, y, e), (a + c, y, e)]
    k = c * 0.999
    return loft([ring(k, y0), ring(0, y0 + c), ring(0, y1 - c), ring(k, y1)])


def sweep(profile, path, normal, closed_path=False, closed_profile=True):
    """Draws a profile of (u, v) along a path that lies in a plane: v along the plane's normal, u to its left."""
    rings, count = [], len(path)
    for i, p in enumerate(path):
        before = path[i - 1] if i > 0 or closed_path else p
        after = path[(i + 1) % count] if i + 1 < count or closed_path else p
        d0, d1 = unit(sub(p, before)), unit(sub(after, p))
        tangent = unit(tuple(x + y for x, y in zip(d0, d1)))
        side = unit(cross(normal, tangent))
        # A mitre: the profile is wider where the path turns.
        turn = max(0.3, abs(dot(tangent, d1 if dot(d1, d1) > 0 else d0)))
        rings.append([tuple(p[k] + u / turn * side[k] + v * normal[k] for k in range(3)) for u, v in profile])
    if closed_path:
        rings.append(rings[0])
    return loft(rings, closed_profile, not closed_path and closed_profile)


def circle(radius, count, cx=0.0, cy=0.0, start=0.0, end=360.0):
    """Points (x, y) on a circle, the end left out if it is the start."""
    whole = abs(end - start) >= 360
    steps = count if whole else count + 1
    return [(cx + radius * math.cos(math.radians(start + (end - start) * i / count)),
             cy + radius * math.sin(math.radians(start + (end - start) * i / count))) for i in range(steps)]


def plate(outline, z0, z1, chamfer=0.08, hole=None):
    """A flat part of any star-shaped outline of (x, z) round its middle, its upper edge chamfered; `hole`: a radius."""
    cx = sum(p[0] for p in outline) / len(outline)
    cz = sum(p[1] for p in outline) / len(outline)

    def ring(by, y):
        points = []
        for x, z in outline:
            r = math.hypot(x - cx, z - cz)
            k = max(0.0, r - by) / r
            points.append((cx + (x - cx) * k, y, cz + (z - cz) * k))
        return points
    rings = [ring(0, z0), ring(0, z1 - chamfer), ring(chamfer, z1)]
    mesh = loft(rings, caps=False)
    top = rings[-1]
    if hole:
        inner = []
        for x, _, z in top:
            a = math.atan2(z - cz, x - cx)
            inner.append((cx + hole * math.cos(a), z1, cz + hole * math.sin(a)))
        low = [(x, z0, z) for x, _, z in inner]
        return mesh.join(loft([top, inner, low], caps=False))
    for i in range(len(top)):
        mesh.tri(top[i], top[(i + 1) % len(top)], (cx, z1, cz))
    return mesh


def wheel(teeth, radius, z, thick=0.16, spokes=5, rim=0.16, pinion=0.0):
    """A toothed wheel: rim with rounded teeth, spokes, hub, an arbor; perhaps a pinion above."""
    mesh = Mesh()
    pitch = 2 * math.pi / teeth
    outer, depth = [], min(0.34, 0.9 * pitch * radius / 2)
    for i in range(teeth):
        a = i * pitch
        for share, r in ((-0.30, radius - depth), (-0.24, radius - 0.35 * depth), (-0.12, radius - 0.06 * depth), (0.0, radius),
                         (0.12, radius - 0.06 * depth), (0.24, radius - 0.35 * depth), (0.30, radius - depth)):
            outer.append((r, a + share * pitch))
    inside = (radius - depth) * (1 - rim)
    c = 0.02

    def ring(points, dr, y):
        return [((r + dr) * math.cos(a), y, (r + dr) * math.sin(a)) for r, a in points]
    inner = [(inside, a) for _, a in outer]
    rings = [ring(inner, 0, z), ring(outer, 0, z), ring(outer, 0, z + thick - c), ring(outer, -c, z + thick),
             ring(inner, c, z + thick), ring(inner, 0, z + thick - c), ring(inner, 0, z)]
    mesh.join(loft(rings, caps=False))
    hub = max(0.34, 0.16 * radius)
    mesh.join(lathe([(hub, z), (hub, z + thick + 0.03 - c), (hub - c, z + thick + 0.03), (0.14, z + thick + 0.03),
                     (0.12, z + thick + 0.6), (0.07, z + thick + 0.66), (0.0, z + thick + 0.66)], 32))
    for k in range(spokes):
        a = 360 * k / spokes
        w0, w1 = 0.17 * hub + 0.13, 0.10 + 0.012 * radius
        arm = loft([[(hub * 0.9, y, -w) for w, y in ((w0, z), (w0, z + thick - c), (w0 - c, z + thick), (-w0 + c, z + thick),
                                                   (-w0, z + thick - c), (-w0, z))],
                    [(inside * 1.01, y, -w) for w, y in ((w1, z), (w1, z + thick - c), (w1 - c, z + thick),
                                                        (-w1 + c, z + thick), (-w1, z + thick - c), (-w1, z))]])
        mesh.join(arm, at(turn=a))
    if pinion:
        leaves = 8
        outline = []
        for i in range(leaves * 6):
            a = 2 * math.pi * i / (leaves * 6)
            outline.append((pinion * (1 + 0.22 * math.cos(leaves * a)) * math.cos(a),
                            pinion * (1 + 0.22 * math.cos(leaves * a)) * math.sin(a)))
        mesh.join(plate(outline, z + thick, z + thick + 0.45, 0.03))
    return mesh


def arch(half, sharp, count, base=0.0):
    """A pointed arch from (-half, base) over its apex to (half, base): two arcs of radius half (1 + sharp).

    sharp 0 is a semicircle, 1 is equilateral. 2 count + 1 points.
    """
    c = sharp * half
    r = half + c
    top = math.acos(-c / r)  # the left arc runs from angle pi to this
    left = [(c + r * math.cos(math.pi + (top - math.pi) * i / count),
             r * math.sin(math.pi + (top - math.pi) * i / count) + base) for i in range(count + 1)]
    return left + [(-x, y) for x, y in reversed(left[:-1])]


def holed_wall(x0, x1, y0, y1, inside, outside, sill, spring, sharp, depth, count=8):
    """A wall with an arched opening, in the plane z = 0 with its back at z = depth.

    The opening is 2 `inside` wide in front and 2 `outside` wide behind; from `sill` it rises to `spring`, then
    arches. sill <= y0 opens it down to the ground.
    """
    mesh = Mesh()
    outlines = []
    for half, z in ((inside, 0.0), (outside, depth)):
        curve = arch(half, sharp, count, spring)
        bottom = max(sill, y0)
        outline = [(-half, bottom)] + curve + [(half, bottom)]
        outlines.append([(x, y, z) for x, y in outline])
        flat = lambda *points: mesh.fan([(x, y, z) for x, y in points])
        flat((x0, y0), (-half, y0), (-half, y1), (x0, y1))
        flat((half, y0), (x1, y0), (x1, y1), (half, y1))
        for (ax, ay), (bx, by) in zip(curve, curve[1:]):
            flat((ax, ay), (bx, by), (bx, y1), (ax, y1))
        if sill > y0:
            flat((-half, y0), (half, y0), (half, sill), (-half, sill))
    front, back = outlines
    for i in range(len(front) - 1):
        mesh.quad(front[i], front[i + 1], back[i + 1], back[i])
    if sill > y0:
        mesh.quad(front[-1], front[0], back[0], back[-1])
    return mesh


# --- pictures ---

def write_png(path, width, height, pixel):
    """An 8-bit RGB picture; pixel(x, y) gives three numbers from 0 to 1, in sRGB, row 0 on top."""
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        for x in range(width):
            rows += bytes(max(0, min(255, int(v * 255 + 0.5))) for v in pixel(x, y))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                  + chunk(b"IDAT", zlib.compress(bytes(rows), 9)) + chunk(b"IEND", b""))
    print("   %-44s %d x %d" % (os.path.relpath(path), width, height))


class Noise:
    """Smooth value noise from 0 to 1 that repeats with period 1 in both directions."""

    def __init__(self, seed, cells=8, octaves=4):
        dice = random.Random(seed)
        self.grids = []
        for octave in range(octaves):
            n = cells << octave
            self.grids.append((n, [dice.random() for _ in range(n * n)]))

    def __call__(self, u, v):
        total, weight, amplitude = 0.0, 0.0, 1.0
        for n, grid in self.grids:
            x, y = (u % 1.0) * n, (v % 1.0) * n
            i, j = int(x) % n, int(y) % n
            fx, fy = x - int(x), y - int(y)
            fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
            i1, j1 = (i + 1) % n, (j + 1) % n
            low = grid[j * n + i] * (1 - fx) + grid[j * n + i1] * fx
            high = grid[j1 * n + i] * (1 - fx) + grid[j1 * n + i1] * fx
            total += amplitude * (low * (1 - fy) + high * fy)
            weight += amplitude
            amplitude *= 0.55
        return total / weight


def stone_picture(path, size, colour, spread, courses=0, seed=1):
    """Tileable stone: grain, and with `courses` rows of ashlar with joints."""
    grain, spots = Noise(seed, 6, 5), Noise(seed + 1, 3, 3)
    dice = random.Random(seed + 2)
    tones = {}

    def pixel(x, y):
        u, v = x / size, y / size
        value = (grain(u, v) - 0.5) * spread + (spots(u, v) - 0.5) * spread * 0.8
        joint = 1.0
        if courses:
            row = int(v * courses)
            per = 2
            shift = 0.25 if row % 2 else 0.0
            column = int((u + shift) % 1.0 * per)
            if (row, column) not in tones:
                tones[row, column] = dice.uniform(-0.5, 0.5) * spread
            value += tones[row, column]
            wobble = (grain(v, u) - 0.5) * 0.02
            fu = ((u + shift) * per + wobble) % 1.0
            fv = (v * courses + wobble) % 1.0
            edge = min(min(fu, 1 - fu) / per, min(fv, 1 - fv) / courses) * size
            joint = 0.62 + 0.38 * min(1.0, max(0.0, (edge - 0.8) / 1.6))
        return tuple(c * (1 + value) * joint for c in colour)
    write_png(path, size, size, pixel)


def here(file):
    """The generator's own folder."""
    return os.path.dirname(os.path.abspath(file))


sys.dont_write_bytecode = True
