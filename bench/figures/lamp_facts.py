#!/usr/bin/env python3
"""Compares what `lucerna light info` says of lamps with a direct count, for docs/results/lamps.md. Prints a table in Markdown.

The count is independent of the C++ code. Photometric files are read by the few lines below; their flux is the sum over zones of half
a degree, and angles are found in the file's own planes. Rays are counted in cones and sectors around the peak that
`light info` found.

usage: bench/figures/lamp_facts.py LUCERNA LAMP.(ies|ldt|tm25ray)...
"""
import math
import pathlib
import re
import subprocess
import sys

import numpy

SECTOR = 15.0  # degrees, width of the C planes in which rays are counted


class Table:
    """Intensities [cd] over C planes from 0 to 360 degrees and gamma angles: `candela` has a row for each plane."""

    def __init__(self, planes, polar, candela):
        # Planes up to 90 or 180 degrees are completed by their mirror images.
        while planes[-1] < 359:
            end = planes[-1]
            if end == 0:
                planes, candela = [0.0, 360.0], [candela[0], candela[0]]
                break
            planes = planes + [2 * end - c for c in reversed(planes[:-1])]
            candela = candela + list(reversed(candela[:-1]))
        self.planes, self.polar, self.candela = numpy.array(planes), numpy.array(polar), numpy.array(candela)

    def intensity(self, c, gamma):
        """Bilinear; 0 beyond the last gamma."""
        j = min(max(numpy.searchsorted(self.planes, c, side="right") - 1, 0), len(self.planes) - 2)
        s = (c - self.planes[j]) / (self.planes[j + 1] - self.planes[j])
        rows = [numpy.interp(gamma, self.polar, self.candela[j + k], left=0, right=0) for k in (0, 1)]
        return (1 - s) * rows[0] + s * rows[1]

    def flux(self):
        gamma = numpy.arange(0.25, 180, 0.5)
        zones = 2 * numpy.sin(numpy.radians(gamma)) * math.sin(math.radians(0.25))
        return sum(math.radians(1) * (zones * self.intensity(c + 0.5, gamma)).sum() for c in range(360))

    def peak(self):
        return self.candela.max()

    def angle(self, plane, share):
        """Full angle of the beam in the planes C and C + 180, or None."""
        row, column = numpy.unravel_index(self.candela.argmax(), self.candela.shape)
        up = self.polar[column] > 90
        angles = numpy.arange(0, 180.001, 0.01)
        sides = [self.intensity((plane + turn) % 360, 180 - angles if up else angles) for turn in (0, 180)]
        limit = share * self.peak()
        ends = []
        for near, far in (sides, sides[::-1]):
            if near[9000] >= limit:
                dark = numpy.nonzero(near[9000:] < limit)[0]
                ends.append(90 + dark[0] * 0.01 if len(dark) else 180)
                continue
            lit = numpy.nonzero(near[:9001] >= limit)[0]
            if len(lit):
                ends.append(lit[-1] * 0.01)
                continue
            lit = numpy.nonzero(far[:9001] >= limit)[0]
            if not len(lit):
                return None
            ends.append(-lit[0] * 0.01)
        return sum(ends)


def read_ies(file):
    text = pathlib.Path(file).read_text(encoding="latin1").split("TILT=NONE")[1]
    numbers = [float(word) for word in re.split(r"[\s,]+", text.strip())]
    factor = numbers[2] * numbers[10] * numbers[11]
    polars, planes = int(numbers[3]), int(numbers[4])
    polar, azimuth = numbers[13:13 + polars], numbers[13 + polars:13 + polars + planes]
    values = numbers[13 + polars + planes:]
    return Table(azimuth, polar, [[factor * v for v in values[i * polars:(i + 1) * polars]] for i in range(planes)])


def read_ldt(file):
    lines = pathlib.Path(file).read_text(encoding="latin1").splitlines()
    symmetry, planes, polars, sets = int(lines[2]), int(lines[3]), int(lines[5]), int(lines[25])
    lumens = sum(float(lines[28 + 6 * i]) for i in range(sets))
    numbers = [float(line.replace(",", ".")) for line in lines[26 + 6 * sets + 10:] if line.strip()]
    azimuth, polar = numbers[:planes], numbers[planes:planes + polars]
    factor = float(lines[23]) * lumens / 1000
    values = [factor * v for v in numbers[planes + polars:]]
    rows = [values[i:i + polars] for i in range(0, len(values), polars)]
    if symmetry == 0:
        return Table(azimuth + [360.0], polar, rows + rows[:1])
    if symmetry == 1:
        return Table([0.0], polar, rows[:1])
    if symmetry == 3:  # the planes from 90 to 270 degrees are stored
        stored = [c for c in azimuth if 90 <= c <= 270]
        azimuth = azimuth + [360.0]
        mirrored = [c if 90 <= c <= 270 else (180 - c) % 360 for c in azimuth]
        return Table(azimuth, polar, [rows[min(range(len(stored)), key=lambda i: abs(stored[i] - c))] for c in mirrored])
    return Table(azimuth[:len(rows)], polar, rows)


class Rays:
    """The directions and the power of a TM-25 file's rays: version 2013, 7 or 8 numbers a ray."""

    def __init__(self, file):
        data = pathlib.Path(file).read_bytes()
        count = int(numpy.frombuffer(data, "<u8", 1, 20)[0])
        flags = numpy.frombuffer(data, "<i4", 8, 256)
        # Position and direction, then power in W or lm, wavelength, Stokes parameters, tristimulus values, index of a spectrum.
        columns = 6 + sum(number for number, flag in zip((1, 1, 1, 6, 2, 1), flags[2:]) if flag)
        rays = numpy.frombuffer(data[len(data) - 4 * columns * count:], "<f4").reshape(count, columns)
        self.direction, self.power = rays[:, 3:6].astype(float), rays[:, 6].astype(float)


def said(lucerna, file):
    """Flux, peak and its direction, beam and field angles, and the smoothing in degrees, as `light info` prints them."""
    text = subprocess.run([lucerna, "light", "info", file], capture_output=True, text=True, check=True).stdout
    lines = {line[:21].strip(): line[21:] for line in text.splitlines()}
    angles = [[None if word == "none" else float(word.split()[0]) for word in
               re.findall(r"(none|[\d.]+ degrees) in C", lines[name])] for name in ("beam angle", "field angle")]
    towards = [float(n) for n in re.search(r"\((.*)\)", lines["peak intensity"]).group(1).split(",")]
    smooth = re.search(r"([\d.]+) degrees", lines.get("smoothed over", ""))
    return (float(lines["flux"].split()[0]), float(lines["peak intensity"].split()[0]), towards, angles,
            float(smooth.group(1)) if smooth else None)


def counted(file, flux, towards, width):
    """Of rays: flux, peak and angles, counted in cones and in sectors of the C planes."""
    rays = Rays(file)
    scale = flux / rays.power.sum()
    d = rays.direction / numpy.linalg.norm(rays.direction, axis=1)[:, None]
    cone = rays.power[d @ numpy.array(towards) / numpy.linalg.norm(towards) > math.cos(math.radians(width))].sum() * scale
    peak = cone / (2 * math.pi * (1 - math.cos(math.radians(width))))
    gamma, c = numpy.degrees(numpy.arccos(d[:, 2].clip(-1, 1))), numpy.degrees(numpy.arctan2(-d[:, 1], d[:, 0])) % 360
    edges = numpy.arange(0, 180.01, max(2.0, width / 2))
    solid = 2 * math.radians(SECTOR) * -numpy.diff(numpy.cos(numpy.radians(edges)))
    angles = []
    for share in (0.5, 0.1):
        pair = []
        for plane in (0, 90):
            ends = []
            for turn in (0, 180):
                apart = numpy.abs((c - plane - turn + 180) % 360 - 180)
                near = apart < SECTOR
                intensity = numpy.histogram(gamma[near], edges, weights=rays.power[near])[0] * scale / solid
                inside = intensity >= share * peak
                last = numpy.nonzero(inside)[0].max() if inside.any() else -1
                ends.append(None if last < 0 else edges[last + 1])
            pair.append(None if None in ends else sum(ends))
        angles.append(pair)
    return flux, peak, angles


def text(value, digits):
    return "none" if value is None else f"{value:.{digits}f}"


def main():
    lucerna = sys.argv[1]
    print("| lamp | flux: `light info`, count | peak | beam angle in C0, C90 | field angle in C0, C90 |")
    print("| --- | --- | --- | --- | --- |")
    for file in sys.argv[2:]:
        flux, peak, towards, angles, width = said(lucerna, file)
        if width is None:
            table = read_ies(file) if file.endswith(".ies") else read_ldt(file)
            count = (table.flux(), table.peak(), [[table.angle(plane, share) for plane in (0, 90)] for share in (0.5, 0.1)])
        else:
            count = counted(file, flux, towards, width)
        pairs = [", ".join(f"{text(a, 1)} / {text(b, 1)}" for a, b in zip(angles[i], count[2][i])) for i in (0, 1)]
        print(f"| {pathlib.Path(file).name} | {flux:.6g}, {count[0]:.6g} | {peak:.4g}, {count[1]:.4g} | {pairs[0]} | {pairs[1]} |")


if __name__ == "__main__":
    main()
