#!/usr/bin/env python3
"""Compares representations of lamps at equal bytes, for docs/results/lamps.md. Prints tables in Markdown and draws a figure.

A lamp is given by rays: those of a file, of which one half is fitted and the other half is the truth; or those of a formula, or of a
light field that a rig measured, a million of which are fitted and four million others are the truth. Lucerna's light field, as
`lucerna light import` makes it, sets the number of bytes. The others get as many:

  views / 2, views x 2    Lucerna's basis with half and twice as many views; these have the bytes that they need
  Haar, spline            wavelets [Haar; Cohen-Daubechies-Feauveau 2,2] of the 4D histogram of the rays' places and directions,
                          the largest coefficients, of the best of three shapes of the histogram
  emitters                256 points, each with a histogram of its directions (after [Mas et al. 2008])
  rays                    as many of the rays as fit, at 8 bytes each
  goniometric             intensities on spheres of five radii around the lamp, interpolated in between

The error on a plane is the root mean square difference of the irradiance relative to its own, in 48 x 48 cells that hold about
equally much light. All but the last are drawn from, as a renderer does, and negative values are clamped. With two independent sets
of rays of the representation, A, and of the truth, T, the mean of (A1 - T1)(A2 - T2) is the squared error without the noise of
either; where noise leaves a negative number, the error is "small".

A second table compares the speed of Lucerna's light field with that of the list of all rays, by figure_lamp_rates, which is beside
LUCERNA.

usage: bench/figures/lamp_compression.py [--rays N] LUCERNA SCENES DATA FIGURE.png
SCENES holds lamps/, made by scenes/make.sh; DATA holds the measured rays. It takes half an hour.
"""
import argparse
import math
import pathlib
import subprocess
import tempfile
import time
import zlib

import numpy

CELLS = 48
PLANES = [("contact", 0.001), ("1 width", 1), ("5", 5), ("50", 50), ("far", None)]
random = numpy.random.default_rng(1)


# Rays are arrays of six columns: x, y, z [mm] and a unit direction with z > 0. All rays of a lamp have the same flux.

def read_tm25(file):
    """The rays of a TM-25 file that leave towards +z; rays of different flux are resampled."""
    data = pathlib.Path(file).read_bytes()
    count = int(numpy.frombuffer(data, "<u8", 1, 20)[0])
    flags = numpy.frombuffer(data, "<i4", 8, 256)
    columns = 6 + sum(number for number, flag in zip((1, 1, 1, 6, 2, 1), flags[2:]) if flag)
    rows = numpy.frombuffer(data[len(data) - 4 * columns * count:], "<f4").reshape(count, columns)
    rows = rows[rows[:, 5] > 1e-3]
    power = rows[:, 6].astype(float)
    rays = rows[:, :6].astype(float)
    if power.max() > 1.01 * power.min():
        rays = rays[random.choice(len(rays), len(rays), p=power / power.sum())]
    return rays


def write_tm25(file, rays):
    header = bytearray(36288)
    header[0:4] = b"TM25"
    header[4:8] = numpy.int32(2013).tobytes()
    header[12:28] = numpy.array([math.nan, 1.0], "<f4").tobytes() + numpy.uint64(len(rays)).tobytes()
    header[60:80] = numpy.int32(0).tobytes() + numpy.array([math.nan] * 3, "<f4").tobytes() + numpy.int32(0).tobytes()
    header[256:288] = numpy.array([1, 1, 1, 0, 0, 0, 0, 0], "<i4").tobytes()
    rows = numpy.hstack([rays, numpy.full((len(rays), 1), 1 / len(rays))]).astype("<f4")
    pathlib.Path(file).write_bytes(bytes(header) + rows.tobytes())


def directions(slope):
    """Unit directions of slopes dx/dz, dy/dz."""
    d = numpy.hstack([slope, numpy.ones((len(slope), 1))])
    return d / numpy.linalg.norm(d, axis=1)[:, None]


def lambert(count):
    r, turn = numpy.sqrt(random.random(count)), 2 * math.pi * random.random(count)
    return numpy.stack([r * numpy.cos(turn), r * numpy.sin(turn), numpy.sqrt(1 - r * r)], axis=1)


def square(count):
    """A Lambertian square of 2 mm."""
    at = numpy.hstack([2 * random.random((count, 2)) - 1, numpy.zeros((count, 1))])
    d = lambert(count)
    keep = d[:, 2] > 1e-3
    return numpy.hstack([at, d])[keep]


def slide(count):
    """A lens of 20 mm that throws a slide, rings and stripes of different width, sharply on a plane 200 mm away."""
    goal = numpy.empty((0, 2))
    while len(goal) < count:
        p = 60 * (2 * random.random((count, 2)) - 1)
        r = numpy.hypot(p[:, 0], p[:, 1])
        light = numpy.where(p[:, 0] > 0, (r // 6) % 2, (p[:, 1] // (2 + (r // 20) * 2)) % 2) * 0.95 + 0.05
        goal = numpy.vstack([goal, p[random.random(count) < light]])
    r, turn = 10 * numpy.sqrt(random.random(count)), 2 * math.pi * random.random(count)
    lens = numpy.stack([r * numpy.cos(turn), r * numpy.sin(turn)], axis=1)
    return numpy.hstack([lens, numpy.zeros((count, 1)), directions((goal[:count] - lens) / 200)])


def zoom(count):
    """A disc of 20 mm whose light crosses the axis 100 mm away, in a beam of Gaussian spread, within a dim wide part."""
    r, turn = 10 * numpy.sqrt(random.random(count)), 2 * math.pi * random.random(count)
    at = numpy.stack([r * numpy.cos(turn), r * numpy.sin(turn)], axis=1)
    d = directions(-at / 100 + math.radians(1.5) * random.standard_normal((count, 2)))
    wide = random.random(count) < 0.1
    d[wide] = lambert(count)[wide]
    keep = d[:, 2] > 1e-3
    return numpy.hstack([at, numpy.zeros((count, 1)), d])[keep]


class Planes:
    """The cells of each plane, from the rays of the truth."""

    def __init__(self, halves):
        some = numpy.vstack(halves)[:1_000_000]
        self.front = numpy.quantile(some[:, 2], 0.999)
        at = self.at(some, 0.0)
        self.middle = numpy.median(at, axis=0)
        self.width = 2 * numpy.quantile(numpy.hypot(*(at - self.middle).T), 0.9)
        self.edges = []
        for _, widths in PLANES:
            at = self.on(some, widths)
            self.edges.append([numpy.unique(numpy.quantile(at[:, a], numpy.linspace(0.0025, 0.9975, CELLS + 1))) for a in (0, 1)])
        self.truth = [self.count(half) for half in halves]

    def at(self, rays, distance):
        """Where rays pass a plane in front of the lamp."""
        return rays[:, :2] + ((self.front + distance - rays[:, 2]) / rays[:, 5])[:, None] * rays[:, 3:5]

    def on(self, rays, widths):
        return rays[:, 3:5] / rays[:, 5:6] if widths is None else self.at(rays, widths * self.width)

    def count(self, rays):
        """The share of the flux in the cells of each plane."""
        counts = []
        for (_, widths), edges in zip(PLANES, self.edges):
            at = self.on(rays, widths)
            counts.append(numpy.histogram2d(at[:, 0], at[:, 1], bins=edges)[0] / len(rays))
        return counts

    def errors(self, one, other):
        """The relative errors of two estimates of the shares; None where the noise leaves nothing."""
        found = []
        for p, edges in enumerate(self.edges):
            area = numpy.outer(numpy.diff(edges[0]), numpy.diff(edges[1]))
            t, u = self.truth[0][p], self.truth[1][p]
            square = ((one[p] - t) * (other[p] - u) / area).sum() / (t * u / area).sum()
            found.append(math.sqrt(square) if square > 0 else None)
        return found

    def errors_of(self, draw, rays):
        """The errors of a function that draws a number of rays."""
        return self.errors(self.count(draw(rays)), self.count(draw(rays)))


class Histogram:
    """A 4D histogram of places on the front plane and of directions, in boxes that hold nearly all light."""

    def __init__(self, rays, planes, shape):
        self.front = planes.front
        at, d = planes.at(rays, 0.0), rays[:, 3:5]
        data = numpy.hstack([at, d])
        self.low, self.high = numpy.quantile(data, 0.002, axis=0), numpy.quantile(data, 0.998, axis=0)
        self.shape = shape
        places = ((data - self.low) / (self.high - self.low) * shape).astype(int).clip(0, numpy.array(shape) - 1)
        self.values = numpy.bincount(numpy.ravel_multi_index(places.T, shape), minlength=math.prod(shape)).astype(float)
        self.values = self.values.reshape(shape)

    def draw(self, values, count):
        """Rays in proportion to values, which are clamped, uniform within each cell."""
        sums = numpy.cumsum(values.clip(0).ravel())
        cells = numpy.searchsorted(sums, random.random(count) * sums[-1], side="right").clip(0, sums.size - 1)
        places = numpy.stack(numpy.unravel_index(cells, self.shape), axis=1) + random.random((count, 4))
        data = self.low + places / self.shape * (self.high - self.low)
        sine2 = (data[:, 2:] ** 2).sum(axis=1)
        data, sine2 = data[sine2 < 0.999999], sine2[sine2 < 0.999999]
        z = numpy.sqrt(1 - sine2)
        return numpy.column_stack([data[:, :2], numpy.full(len(data), self.front), data[:, 2:], z])


def haar_step(v, axis, inverse):
    v = numpy.moveaxis(v, axis, 0)
    half = len(v) // 2
    out = numpy.empty_like(v)
    if inverse:
        out[0::2], out[1::2] = (v[:half] + v[half:]) / math.sqrt(2), (v[:half] - v[half:]) / math.sqrt(2)
    else:
        out[:half], out[half:] = (v[0::2] + v[1::2]) / math.sqrt(2), (v[0::2] - v[1::2]) / math.sqrt(2)
    return numpy.moveaxis(out, 0, axis)


def spline_step(v, axis, inverse):
    """Lifting: a sample less the mean of its neighbours, then a quarter of these differences on the others."""
    v = numpy.moveaxis(v, axis, 0)
    half = len(v) // 2
    out = numpy.empty_like(v)
    if inverse:
        even, odd = v[:half] / math.sqrt(2), v[half:] * math.sqrt(2)
        even = even - (odd + numpy.concatenate([odd[:1], odd[:-1]])) / 4
        odd = odd + (even + numpy.concatenate([even[1:], even[-1:]])) / 2
        out[0::2], out[1::2] = even, odd
    else:
        even, odd = v[0::2], v[1::2]
        odd = odd - (even + numpy.concatenate([even[1:], even[-1:]])) / 2
        even = even + (odd + numpy.concatenate([odd[:1], odd[:-1]])) / 4
        out[:half], out[half:] = even * math.sqrt(2), odd / math.sqrt(2)
    return numpy.moveaxis(out, 0, axis)


def transformed(values, step, inverse=False):
    """All levels of a wavelet transform, each along all axes, down to 2 samples along the shortest one."""
    v = values.copy()
    levels = [tuple(n >> i for n in v.shape) for i in range(int(math.log2(min(v.shape))))]
    for shape in reversed(levels) if inverse else levels:
        part = v[tuple(slice(n) for n in shape)]
        for axis in (reversed(range(4)) if inverse else range(4)):
            part = step(part, axis, inverse)
        v[tuple(slice(n) for n in shape)] = part
    return v


def packed(coefficients):
    """The bytes of the coefficients that are not 0: gaps between their places, and halves, both deflated."""
    places = numpy.nonzero(coefficients)[0]
    gaps = numpy.diff(places, prepend=0)
    gaps = numpy.minimum(gaps, 65535).astype("<u2").view("u1").reshape(-1, 2)
    halves = coefficients[places].astype("<f2").view("u1").reshape(-1, 2)
    return sum(len(zlib.compress(numpy.ascontiguousarray(byte).tobytes(), 9)) for byte in (*gaps.T, *halves.T))


def thresholded(values, step, size):
    """The histogram from its largest wavelet coefficients that fit `size` bytes, the bytes, and the clamped share."""
    c = transformed(values, step).ravel()
    order = numpy.argsort(-abs(c))
    low, high = 1, int((c != 0).sum())
    for _ in range(12):
        some = (low + high + 1) // 2
        kept = numpy.zeros_like(c)
        kept[order[:some]] = c[order[:some]]
        if packed(kept) <= size:
            low = some
        else:
            high = some - 1
        if high <= low:
            break
    kept = numpy.zeros_like(c)
    kept[order[:low]] = c[order[:low]].astype("f2")
    made = transformed(kept.reshape(values.shape), step, inverse=True)
    return made, packed(kept), -made[made < 0].sum() / made.sum()


def wavelets(rays, planes, step, size, count):
    """The result with the least error of three shapes of the histogram."""
    found = []
    for shape in ((32, 32, 32, 32), (64, 64, 16, 16), (16, 16, 64, 64)):
        h = Histogram(rays, planes, shape)
        made, used, clamped = thresholded(h.values, step, size)
        errors = planes.errors_of(lambda n: h.draw(made, n), count)
        found.append((total(errors), errors, used, clamped))
    return min(found, key=lambda each: each[0])[1:]


def emitters(rays, planes, size):
    """A function that draws rays of 256 points with a histogram of directions each, and its bytes."""
    at, d = planes.at(rays, 0.0), rays[:, 3:5]
    groups = [numpy.arange(len(rays))]
    for level in range(8):
        halves = []
        for g in groups:
            order = g[numpy.argsort(at[g, level % 2], kind="stable")]
            halves += [order[:len(order) // 2], order[len(order) // 2:]]
        groups = halves
    low, high = numpy.quantile(d, 0.002, axis=0), numpy.quantile(d, 0.998, axis=0)

    def histograms(side):
        places = ((d - low) / (high - low) * side).astype(int).clip(0, side - 1)
        cell = places[:, 0] * side + places[:, 1]
        return numpy.stack([numpy.bincount(cell[g], minlength=side * side) for g in groups])

    def bytes_of(side):
        return len(zlib.compress(histograms(side).astype("<u2").T.tobytes(), 9)) + 8 * len(groups)
    side = 2
    while side < 256 and bytes_of(side + max(1, side // 8)) <= size:
        side += max(1, side // 8)
    h = histograms(side)
    points = numpy.stack([at[g].mean(axis=0) for g in groups])
    sums = numpy.cumsum(h.ravel())

    def draw(count):
        cell = numpy.searchsorted(sums, random.random(count) * sums[-1], side="right").clip(0, sums.size - 1)
        which, place = cell // (side * side), cell % (side * side)
        uv = low + (numpy.stack([place // side, place % side], axis=1) + random.random((count, 2))) / side * (high - low)
        keep = (uv ** 2).sum(axis=1) < 0.999999
        uv, which = uv[keep], which[keep]
        return numpy.column_stack([points[which], numpy.full(len(uv), planes.front), uv, numpy.sqrt(1 - (uv ** 2).sum(axis=1))])
    return draw, bytes_of(side)


def goniometric(rays, planes, size):
    """The shares in the cells of all planes from intensities on five spheres, and their bytes."""
    radii = [planes.width * factor for factor in (1, 4, 16, 64, 256)]
    centre = numpy.append(planes.middle, planes.front)
    o, d = rays[:, :3] - centre, rays[:, 3:]
    b, c = (o * d).sum(axis=1), (o * o).sum(axis=1)

    def maps(side, reach):
        """Mean intensity over pixels of the sine, per flux."""
        found = []
        for radius in radii:
            root = b * b - c + radius * radius
            w = (o + (-b + numpy.sqrt(root.clip(0)))[:, None] * d) / radius
            w = w[(root > 0) & (w[:, 2] > 0)]
            counts = numpy.histogram2d(w[:, 0], w[:, 1], bins=numpy.linspace(-reach, reach, side + 1))[0]
            centres = (numpy.arange(side) + 0.5) / side * 2 * reach - reach
            cosine = numpy.sqrt((1 - centres[:, None] ** 2 - centres ** 2).clip(1e-4))
            found.append(counts / len(rays) * cosine / (2 * reach / side) ** 2)
        return found

    reach = min(1.0, 1.2 * numpy.quantile(numpy.hypot(d[:, 0], d[:, 1]), 0.99))

    def bytes_of(side):
        return sum(len(zlib.compress(m.astype("<f2").tobytes(), 9)) for m in maps(side, reach))
    side = 8
    while side < 512 and bytes_of(side * 5 // 4) <= size:
        side = side * 5 // 4
    tables = maps(side, reach)
    shares = []
    for (_, widths), edges in zip(PLANES, planes.edges):
        parts = [numpy.concatenate([e[:-1] + (e[1:] - e[:-1]) * f for f in (1 / 6, 0.5, 5 / 6)]).reshape(3, -1) for e in edges]
        total_share = numpy.zeros((len(edges[0]) - 1, len(edges[1]) - 1))
        area = numpy.outer(numpy.diff(edges[0]), numpy.diff(edges[1]))
        for x in parts[0]:
            for y in parts[1]:
                gx, gy = numpy.meshgrid(x, y, indexing="ij")
                z = numpy.ones_like(gx) if widths is None else numpy.full_like(gx, max(widths, 1e-3) * planes.width)
                if widths is not None:
                    gx, gy = gx - planes.middle[0], gy - planes.middle[1]
                r = numpy.sqrt(gx * gx + gy * gy + z * z)
                i, j = (((v / r + reach) / (2 * reach) * side).astype(int) for v in (gx, gy))
                inside = (i >= 0) & (i < side) & (j >= 0) & (j < side)
                i, j = i.clip(0, side - 1), j.clip(0, side - 1)
                place = (numpy.log(r / radii[0]) / math.log(4)).clip(0, 4) if widths is not None else numpy.full_like(r, 4.0)
                lower = numpy.minimum(place.astype(int), 3)
                stack = numpy.stack(tables)
                intensity = stack[lower, i, j] * (1 - (place - lower)) + stack[lower + 1, i, j] * (place - lower)
                total_share += numpy.where(inside, intensity * (z / r) / (r * r), 0) * area / 9
        shares.append(total_share)
    return shares, bytes_of(side)


def total(errors):
    """The root mean square over the planes."""
    return math.sqrt(sum((e or 0) ** 2 for e in errors) / len(errors))


def lucerna_field(lucerna, folder, rays, planes, count, resolution=()):
    """Errors, bytes, seconds of the import, clamped share and views of Lucerna's light field."""
    write_tm25(folder / "fit.tm25ray", rays)
    begin = time.time()
    subprocess.run([lucerna, "light", "import", folder / "fit.tm25ray", "-o", folder / "fit.exr", "--slabs", "1", "--quiet", *resolution],
                   check=True, stderr=subprocess.DEVNULL)
    seconds = time.time() - begin
    info = subprocess.run([lucerna, "light", "info", folder / "fit.exr"], capture_output=True, text=True, check=True).stdout
    views = int(info.split("sampling plane S")[1].split()[0])
    clamped = float(info.split("clamping adds ")[1].split()[0]) if "clamping adds " in info else 0.0

    def draw(number):
        draw.seed += 1
        subprocess.run([lucerna, "light", "emit", folder / "fit.exr", "--rays", str(number), "--seed", str(draw.seed), "-o", folder / "drawn.tm25ray",
                        "--quiet"], check=True, stderr=subprocess.DEVNULL)
        return read_tm25(folder / "drawn.tm25ray")
    draw.seed = 0
    errors = planes.errors_of(draw, count)
    return errors, (folder / "fit.exr").stat().st_size, seconds, clamped, views


def rates(lucerna, folder):
    """Table cells: the speeds of the field and of the rays from which it was made."""
    def measured(*files):
        command = [lucerna.parent / "bench" / "figure_lamp_rates", *files]
        return [float(x) for x in subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()]
    field, rays = measured(folder / "fit.exr"), measured(folder / "fit.exr", folder / "fit.tm25ray")
    cells = [f"{field[0] / 1e6:.1f}", f"{rays[0] / 1e6:.1f}"]
    for particles, of_rays, direct in zip(field[1:3], rays[1:3], field[3:5]):
        cells += [f"{particles:.2g}", f"{of_rays:.2g}", f"{direct:.2g}"]
    return cells


def rays_of_field(lucerna, folder, name, arguments, rays):
    """A function that draws rays of a light field that `lucerna light` makes."""
    field = folder / f"{name}.exr"
    subprocess.run([lucerna, "light", *arguments, "-o", field, "--quiet"], check=True, stderr=subprocess.DEVNULL)

    def draw(count):
        draw.seed += 1
        subprocess.run([lucerna, "light", "emit", field, "--rays", str(count), "--seed", str(draw.seed), "-o", folder / "lamp.tm25ray", "--quiet"],
                       check=True, stderr=subprocess.DEVNULL)
        return read_tm25(folder / "lamp.tm25ray")
    draw.seed = 100
    return draw


def lamps(lucerna, scenes, data, folder, count):
    """Yields names, rays to fit, and two halves of the truth."""
    for name, file in (("OSTAR green, measured", data / "osram-ostar-green-100k.tm25ray"), ("OSTAR blue, measured", data / "osram-ostar-blue-100k.tm25ray"),
                       ("white LED", scenes / "lamps/white-led/white-led.tm25ray"), ("narrow beam", scenes / "lamps/narrow-beam/narrow-beam.tm25ray")):
        rays = random.permutation(read_tm25(file))
        yield name, *numpy.array_split(rays, [len(rays) // 2, len(rays) * 3 // 4])
    for name, arguments in (("flashlight", ["acquire", scenes / "lamps/flashlight/rig.toml"]), ("bike light", ["acquire", scenes / "lamps/bike-light/rig.toml"])):
        draw = rays_of_field(lucerna, folder, name.replace(" ", "-"), arguments, count)
        yield name, draw(count), draw(2 * count), draw(2 * count)
    for name, formula in (("Lambertian square", square), ("slide projector", slide), ("zoom flashlight", zoom)):
        yield name, formula(count), formula(2 * count), formula(2 * count)


def draw_figure(rows, file):
    import matplotlib
    matplotlib.use("svg" if str(file).endswith("svg") else "agg")
    from matplotlib import pyplot
    names = list(dict.fromkeys(row[0] for row in rows))
    kinds = [kind for kind in dict.fromkeys(row[1] for row in rows) if not kind.startswith("views")]
    figure, axes = pyplot.subplots(figsize=(9, 4.5), constrained_layout=True)
    for k, kind in enumerate(kinds):
        points = [(100 * total(row[3]), names.index(row[0]) + 0.1 * (k - len(kinds) / 2)) for row in rows if row[1] == kind]
        axes.plot(*zip(*points), "o", ms=9 if kind == "Lucerna" else 5, label=kind, color="black" if kind == "Lucerna" else None)
    axes.set_xscale("log")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel("error of irradiance at equal bytes, root mean square over five planes, %")
    axes.grid(axis="x", alpha=0.3)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1))
    figure.savefig(file, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rays", type=int, default=1_000_000)
    for name in ("lucerna", "scenes", "data", "figure"):
        parser.add_argument(name, type=pathlib.Path)
    o = parser.parse_args()
    rows, speeds = [], []
    print("| lamp | representation | kB | " + " | ".join(name for name, _ in PLANES) + " | clamped | import |")
    print("| --- | --- | --- |" + " --- |" * (len(PLANES) + 2))

    def row(lamp, kind, size, errors, clamped="", seconds=""):
        rows.append((lamp, kind, size, errors))
        cells = ["small" if e is None else f"{100 * e:.1f}" if e < 1 else f"{100 * e:.0f}" for e in errors]
        print(f"| {lamp} | {kind} | {size / 1000:.0f} | " + " | ".join(cells) + f" | {clamped} | {seconds} |", flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for lamp, fit, one, other in lamps(o.lucerna, o.scenes, o.data, folder, o.rays):
            planes = Planes([one, other])
            drawn = max(o.rays, 4 * len(one))
            errors, size, seconds, clamped, views = lucerna_field(o.lucerna, folder, fit, planes, drawn)
            row(lamp, "Lucerna", size, errors, f"{clamped:.2g} %", f"{seconds:.1f} s")
            speeds.append([lamp, *rates(o.lucerna, folder)])
            for factor, kind in ((0.5, "views / 2"), (2, "views x 2")):
                n = max(3, int(views * factor))
                errors, used, seconds, clamped, _ = lucerna_field(o.lucerna, folder, fit, planes, drawn, ["--views", f"{n}x{n}"])
                row(lamp, kind, used, errors, f"{clamped:.2g} %", f"{seconds:.1f} s")
            for kind, step in (("Haar", haar_step), ("spline", spline_step)):
                errors, used, clamped = wavelets(fit, planes, step, size, drawn)
                row(lamp, kind, used, errors, f"{100 * clamped:.2g} %")
            draw, used = emitters(fit, planes, size)
            row(lamp, "emitters", used, planes.errors_of(draw, drawn))
            some = fit[random.permutation(len(fit))[:size // 8]]
            # Rays are drawn in turn, so that there is no other noise than that of the few.
            counts = planes.count(some)
            row(lamp, "rays", 8 * len(some), planes.errors(counts, counts))
            shares, used = goniometric(fit, planes, size)
            row(lamp, "goniometric", used, planes.errors(shares, shares))
    print("\n| lamp | field, M/s | rays, M/s | contact: particles | rays | direct | 1 m: particles | rays | direct |")
    print("| --- |" + " --- |" * 8)
    for cells in speeds:
        print("| " + " | ".join(cells) + " |")
    draw_figure(rows, o.figure)


if __name__ == "__main__":
    main()
