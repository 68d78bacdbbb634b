"""A scene of so many triangles, to be loaded: half of them as text, half as binary PLY, in wavy sheets of half a million.

usage: loading_scene.py FOLDER TRIANGLES     writes text.pbrt, ply.pbrt, both.pbrt and sheetN.ply
"""
import array
import math
import os
import sys

SHEET = 500_000  # triangles per mesh, at most


def sheet(triangles, level):
    """Positions x y z ... as text would have them (six digits), and indices, of a grid of about so many triangles."""
    columns = max(1, round(math.sqrt(triangles / 2)))
    rows = max(1, round(triangles / 2 / columns))
    points, indices = [], []
    for y in range(rows + 1):
        for x in range(columns + 1):
            u, v = x / columns, y / rows
            points += (round(10 * u, 6), round(level + 0.1 * math.sin(40 * u) * math.cos(30 * v), 6), round(10 * v, 6))
    for y in range(rows):
        for x in range(columns):
            corner = x + y * (columns + 1)
            above = corner + columns + 1
            indices += (corner, corner + 1, above + 1, corner, above + 1, above)
    return points, indices


def write_text(out, points, indices):
    out.write('Shape "trianglemesh"\n  "point3 P" [\n')
    for i in range(0, len(points), 3):
        out.write("%.6g %.6g %.6g\n" % tuple(points[i : i + 3]))
    out.write(']\n  "integer indices" [\n')
    for i in range(0, len(indices), 3):
        out.write("%d %d %d\n" % tuple(indices[i : i + 3]))
    out.write("]\n")


def write_ply(path, points, indices):
    with open(path, "wb") as out:
        faces = len(indices) // 3
        header = ("ply", "format binary_little_endian 1.0", "element vertex %d" % (len(points) // 3), "property float x",
                  "property float y", "property float z", "element face %d" % faces, "property list uchar int vertex_indices",
                  "end_header")
        out.write(("\n".join(header) + "\n").encode())
        for numbers in (points, indices):
            block = array.array("f" if numbers is points else "i", numbers)
            if sys.byteorder == "big":
                block.byteswap()
            raw = block.tobytes()
            if numbers is points:
                out.write(raw)
            else:
                rows = bytearray(13 * faces)
                for byte in range(12):
                    rows[1 + byte :: 13] = raw[byte::12]
                rows[0::13] = b"\x03" * faces
                out.write(rows)


def main():
    folder, triangles = sys.argv[1], int(sys.argv[2])
    head = ('LookAt 5 8 -6  5 0 5  0 1 0\nCamera "perspective"\nFilm "rgb" "integer xresolution" 16 "integer yresolution" 16\n'
            'WorldBegin\nLightSource "infinite"\n')
    names = ("text", "ply", "both")
    files = {name: open(os.path.join(folder, name + ".pbrt"), "w") for name in names}
    for out in files.values():
        out.write(head)
    sheets = max(1, math.ceil(triangles / 2 / SHEET))
    for number in range(sheets):
        points, indices = sheet(triangles / 2 / sheets, 0.3 * number)
        for name in ("text", "both"):
            write_text(files[name], points, indices)
        write_ply(os.path.join(folder, "sheet%d.ply" % number), points, indices)
        for name in ("ply", "both"):
            files[name].write('Shape "plymesh" "string filename" "sheet%d.ply"\n' % number)
    for out in files.values():
        out.close()


if __name__ == "__main__":
    main()
