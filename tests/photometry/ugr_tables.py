#!/usr/bin/env python3
"""Prints UGR tables as numbers for tests/photometry/ugr_table_test.cpp, by the method of CIE 190:2010, done independently of the
C++ code.

Usage: ugr_tables.py FOLDER > tests/photometry/ugr_tables.h, where FOLDER has examp1.ies and fluorescent_luminaire.ldt.

It differs from engine/photometry/ugr_table.cpp in these ways:
  * the light on the floor of the room is the sum over points of the floor of the illuminance by every luminaire;
  * a luminaire's downward and upward flux is summed over zones of its own table of intensities;
  * interreflection is followed bounce by bounce, and form factors are computed by quadrature over points;
  * angles are found by spherical coordinates at the luminaire, and files are read by the few lines below.
The position index is CIE 117's table in both; its numbers are read from engine/photometry/position_table.cpp, and
tests/cie171/position_index_test.cpp checks them.
"""
import math
import pathlib
import re
import sys

HEIGHT = 2.0  # m
ROOMS = [(2, 2), (2, 3), (2, 4), (2, 6), (2, 8), (2, 12), (4, 2), (4, 3), (4, 4), (4, 6), (4, 8), (4, 12),
         (8, 4), (8, 6), (8, 8), (8, 12), (12, 4), (12, 6), (12, 8)]
REFLECTANCES = [(0.7, 0.5, 0.2), (0.7, 0.3, 0.2), (0.5, 0.5, 0.2), (0.5, 0.3, 0.2), (0.3, 0.3, 0.2)]


def position_rows():
    """Returns the rows of CIE 117's table of the position index."""
    source = pathlib.Path(__file__).resolve().parents[2] / "engine" / "photometry" / "position_table.cpp"
    body = source.read_text().split("kTable{{")[1].split("}};")[0]
    return [[float(word) for word in row.split(",")] for row in re.findall(r"\{([^{}]*)\}", body)]


POSITIONS = position_rows()


def position_index(beside, ahead):
    """Returns p of a luminaire `beside` and `ahead` of the eye [m], or None where the table has no entry."""
    row, column = abs(beside) / ahead * 10, HEIGHT / ahead * 10
    row, column = round(row, 9), round(column, 9)
    if row > 30 or column > 19:
        return None
    index = 0.0
    for r, down in ((math.floor(row), 1 - row % 1), (math.floor(row) + 1, row % 1)):
        for c, right in ((math.floor(column), 1 - column % 1), (math.floor(column) + 1, column % 1)):
            if down * right == 0:
                continue
            if POSITIONS[r][c] == 0:
                return None
            index += down * right * POSITIONS[r][c]
    return index


class Lambertian:
    """A flat square of 0.6 m that emits 1000 lm downwards."""

    lamp_flux = 1000.0
    polar_end = 90.0
    facing = (0, 90)

    def intensity(self, c, gamma):
        return 1000 / math.pi * max(0.0, math.cos(math.radians(gamma)))

    def area(self, c, gamma):
        return 0.36 * abs(math.cos(math.radians(gamma)))

    def azimuths(self):
        return [0]


class Table:
    """A luminaire whose intensities are in a table over C = 0 ... 90 degrees that holds for all four quadrants."""

    def area(self, c, gamma):
        along, across, up = self.size  # along C0, along C90, height
        c, gamma = math.radians(c), math.radians(gamma)
        return (along * across * abs(math.cos(gamma)) + across * up * abs(math.sin(gamma) * math.cos(c)) +
                along * up * abs(math.sin(gamma) * math.sin(c)))

    def intensity(self, c, gamma):
        c %= 180
        c = min(c, 180 - c)
        if gamma > self.polar[-1]:
            return 0.0
        plane = min(int(c / self.plane_step), len(self.candela) - 2)
        row = min(int(gamma / self.polar_step), len(self.polar) - 2)
        u, v = c / self.plane_step - plane, gamma / self.polar_step - row
        return ((1 - u) * ((1 - v) * self.candela[plane][row] + v * self.candela[plane][row + 1]) +
                u * ((1 - v) * self.candela[plane + 1][row] + v * self.candela[plane + 1][row + 1]))

    def azimuths(self):
        return [self.plane_step * (i + 0.5) for i in range(len(self.candela) - 1)]


class Ies(Table):
    """An IES file of type C with planes from 0 to 90 degrees and lengths in metres or feet."""

    facing = (90, 0)  # LM-63's length lies along C0

    def __init__(self, file):
        text = pathlib.Path(file).read_text(encoding="latin1").split("TILT=NONE")[1].split()
        numbers = [float(word) for word in text]
        lamps, lumens, factor, polars, planes, _, units, width, length, height, ballast, future, _ = numbers[:13]
        polars, planes = int(polars), int(planes)
        metre = 0.3048 if units == 1 else 1.0
        self.size = (length * metre, width * metre, height * metre)
        self.lamp_flux = lamps * lumens
        self.polar = numbers[13:13 + polars]
        azimuth = numbers[13 + polars:13 + polars + planes]
        first = 13 + polars + planes
        self.candela = [[factor * ballast * future * value for value in numbers[first + i * polars:first + (i + 1) * polars]]
                        for i in range(planes)]
        self.polar_step, self.plane_step = self.polar[1], azimuth[1]
        self.polar_end = self.polar[-1]
        assert azimuth[0] == 0 and azimuth[-1] == 90 and self.polar[0] == 0


class Ldt(Table):
    """An EULUMDAT file with symmetry 4 (to both planes), a flat rectangle and one set of lamps."""

    facing = (0, 90)  # EULUMDAT's length lies along C90

    def __init__(self, file):
        lines = pathlib.Path(file).read_text(encoding="latin1").splitlines()
        planes, polars = int(lines[3]), int(lines[5])
        assert int(lines[2]) == 4 and int(lines[25]) == 1
        length, width = float(lines[15]) / 1000, float(lines[16]) / 1000
        assert all(float(lines[line]) == 0 for line in range(17, 21)) and width > 0
        self.size = (width, length, 0.0)
        self.lamp_flux = float(lines[28])
        numbers = [float(line) for line in lines[42:] if line.strip()]
        self.polar = numbers[planes:planes + polars]
        values = numbers[planes + polars:]
        stored = planes // 4 + 1
        factor = float(lines[23]) * self.lamp_flux / 1000
        self.candela = [[factor * value for value in values[i * polars:(i + 1) * polars]] for i in range(stored)]
        self.polar_step, self.plane_step = self.polar[1], numbers[1]
        self.polar_end = self.polar[-1]
        assert len(values) == stored * polars and self.plane_step * (stored - 1) == 90


def mean_intensities(lamp, steps_per_degree):
    """Returns the intensity averaged over azimuth for a lamp flux of 1000 lm, at the middles of steps of γ."""
    azimuths = lamp.azimuths()
    scale = 1000 / lamp.lamp_flux / len(azimuths)
    count = round(lamp.polar_end * steps_per_degree)
    return [scale * sum(lamp.intensity(c, (i + 0.5) / steps_per_degree) for c in azimuths) for i in range(count)]


class MeanLamp:
    """The intensity of a lamp averaged over azimuth, for 1000 lm, and its flux in both half spaces."""

    STEPS = 20  # per degree

    def __init__(self, lamp):
        self.values = mean_intensities(lamp, self.STEPS)
        self.flux = [0.0, 0.0]
        for i, value in enumerate(self.values):
            middle = math.radians((i + 0.5) / self.STEPS)
            flux = value * 2 * math.pi * math.sin(middle) * math.radians(1 / self.STEPS)
            self.flux[0 if middle < math.pi / 2 else 1] += flux

    def intensity(self, gamma):  # degrees
        at = gamma * self.STEPS - 0.5
        i = max(0, min(int(at), len(self.values) - 2))
        return self.values[i] + (at - i) * (self.values[i + 1] - self.values[i])


def floor_flux(mean, width, depth, per_height):
    """Returns the flux that falls on the floor per luminaire [lm], by the illuminance at points of a grid on the floor. All is
    in half steps of the points' grid, so that each distance is computed once."""
    points = 8 if per_height < 8 else per_height  # per H, a multiple of per_height
    cell = 1 / points

    def inside(count, extent, offset):
        """Returns how many pairs of luminaire and point along one side are `offset` half cells apart."""
        step = 2 * points // per_height
        found = 0
        for i in range(count):
            point = (2 * i + 1) * step // 2 + offset
            found += 0 < point < 2 * extent * points and point % 2 == 1
        return found

    columns, rows = width * per_height, depth * per_height
    along_x = {d: inside(columns, width, d) for d in range(-2 * width * points, 2 * width * points + 1)}
    along_y = {d: inside(rows, depth, d) for d in range(-2 * depth * points, 2 * depth * points + 1)}
    flux = 0.0
    for dx, in_x in along_x.items():
        if not in_x:
            continue
        for dy, in_y in along_y.items():
            if not in_y:
                continue
            distance2 = (dx * dx + dy * dy) * cell * cell / 4 + 1
            cosine = 1 / math.sqrt(distance2)
            illuminance = mean.intensity(math.degrees(math.acos(cosine))) * cosine / distance2
            flux += in_x * in_y * illuminance * cell * cell
    return flux / (columns * rows)


def opposed_by_points(width, depth):
    """Returns the form factor between two opposed rectangles at distance 1, by sums over points of both, extrapolated from two
    grids. The number of pairs of points that are (dx, dy) apart is the product of those along both sides."""
    def by_grid(n):
        total, cells_x, cells_y = 0.0, width * n, depth * n
        for dx in range(-cells_x + 1, cells_x):
            for dy in range(-cells_y + 1, cells_y):
                distance2 = (dx * dx + dy * dy) / (n * n) + 1
                total += (cells_x - abs(dx)) * (cells_y - abs(dy)) / (math.pi * distance2 * distance2)
        return total / n**4 / (width * depth)
    coarse, fine = by_grid(4), by_grid(8)
    return fine + (fine - coarse) / 3


def indirect_on_walls(width, depth, opposed, reflectances, first):
    """Returns the flux that falls on the walls after at least one reflection, for the fluxes that fall first on (floor, walls,
    ceiling), bounce by bounce."""
    rho_ceiling, rho_walls, rho_floor = reflectances
    floor_to_walls = 1 - opposed
    walls_to_floor = floor_to_walls * width * depth / (2 * (width + depth))
    floor, walls, ceiling = first
    indirect = 0.0
    for _ in range(200):
        from_floor, from_walls, from_ceiling = floor * rho_floor, walls * rho_walls, ceiling * rho_ceiling
        floor = from_walls * walls_to_floor + from_ceiling * opposed
        ceiling = from_walls * walls_to_floor + from_floor * opposed
        walls = (from_floor + from_ceiling) * floor_to_walls + from_walls * (1 - 2 * walls_to_floor)
        indirect += walls
    return indirect


def table(lamp, per_height):
    """Returns UGR for 1000 lm by room, view (crosswise, endwise) and reflectances."""
    mean = MeanLamp(lamp)
    result = []
    for width, depth in ROOMS:
        luminaires = width * depth * per_height**2
        floor = floor_flux(mean, width, depth, per_height)
        first = (floor, mean.flux[0] - floor, mean.flux[1])
        opposed = opposed_by_points(width, depth)
        wall_area = 2 * HEIGHT * (width + depth) * HEIGHT
        backgrounds = [luminaires * indirect_on_walls(width, depth, opposed, rho, first) / wall_area / math.pi
                       for rho in REFLECTANCES]
        views = []
        for facing in lamp.facing:
            total = 0.0
            for i in range(width * per_height):
                for j in range(depth * per_height):
                    beside = ((i + 0.5) / per_height - width / 2) * HEIGHT
                    ahead = (j + 0.5) / per_height * HEIGHT
                    index = position_index(beside, ahead)
                    if index is None:
                        continue
                    distance2 = beside**2 + ahead**2 + HEIGHT**2
                    gamma = math.degrees(math.acos(HEIGHT / math.sqrt(distance2)))
                    c = facing - math.degrees(math.atan(beside / ahead))
                    intensity, area = lamp.intensity(c, gamma) * 1000 / lamp.lamp_flux, lamp.area(c, gamma)
                    luminance, solid_angle = intensity / area, area / distance2
                    total += luminance**2 * solid_angle / index**2
            views.append([8 * math.log10(0.25 / background * total) for background in backgrounds])
        result.append(views)
    return result


def printed(name, values):
    print(f"inline constexpr Ratings {name} = {{")
    for views in values:
        print("    {" + ", ".join("{" + ", ".join(f"{value:.3f}" for value in view) + "}" for view in views) + "},")
    print("};")


def main():
    folder = pathlib.Path(sys.argv[1])
    print("// UGR for 1000 lm by room, view (crosswise, endwise) and reflectances. Written by ugr_tables.py; do not edit.")
    print("#pragma once\n\nnamespace lucerna::ugr_table_test {\n")
    print("// clang-format off\nusing Ratings = double[19][2][5];\n")
    printed("kLambertian", table(Lambertian(), 4))
    printed("kLambertianAtS1H", table(Lambertian(), 1))
    printed("kExamp1", table(Ies(folder / "examp1.ies"), 4))
    printed("kFluorescent", table(Ldt(folder / "fluorescent_luminaire.ldt"), 4))
    print("// clang-format on\n\n}  // namespace lucerna::ugr_table_test")


if __name__ == "__main__":
    main()
