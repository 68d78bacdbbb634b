"""Illuminance on surfaces: closed forms, the command's numbers, light groups, errors."""

import csv
import os
import subprocess
import unittest

import lucerna
import numpy as np
from folder import Folder

COMMAND = os.environ["LUCERNA_COMMAND"]

SCENE = """
Option "string unit" "photometric"
LookAt 0 -4 3  0 0 0  0 0 1
Camera "perspective"
Film "rgb"
WorldBegin
LightSource "point" "rgb I" [ 300 300 300 ] "point3 from" [ 1 0.5 2 ] "string lightgroup" "spot"
LightSource "point" "rgb I" [ 100 100 100 ] "point3 from" [ -1 0 2 ]
Material "diffuse" "rgb reflectance" [ 0.4 0.4 0.4 ]
Shape "bilinearmesh" "point3 P" [ -2 -1 0  2 -1 0  -2 1 0  2 1 0 ]
CalculationSurface "floor" "point3 P" [ -2 -1 0  2 -1 0  -2 1 0 ] "integer points" [ 8 4 ]
"""


def from_point(intensity, place, at):
    away = np.asarray(place) - at
    return intensity * away[..., 2] / np.linalg.norm(away, axis=-1) ** 3


class Illuminance(Folder):
    def setUp(self):
        super().setUp()
        self.scene = lucerna.read_text(SCENE)

    def test_OfPoints_IsTheClosedFormByGroup(self):
        (grid,) = lucerna.illuminance(self.scene, samples=64)
        self.assertEqual((grid.name, grid.kind, grid.unit), ("floor", "planar", "lx"))
        self.assertEqual(grid.values.shape, (4, 8))
        np.testing.assert_allclose(grid.positions[1, 2], (-0.75, -0.25, 0), atol=1e-12)
        spot = from_point(300, (1, 0.5, 2), grid.positions)
        other = from_point(100, (-1, 0, 2), grid.positions)
        # With several lights each sample chooses one, so the tolerance is 4 standard errors.
        self.assertTrue((abs(grid.values - spot - other) <= 2 * grid.half_width + 1e-5 * grid.values).all())
        self.assertLess(grid.half_width.max(), 0.01 * grid.values.min())
        np.testing.assert_allclose(grid.direct, grid.values, rtol=1e-6)
        np.testing.assert_allclose(grid.groups["spot"], spot, rtol=0.02)
        np.testing.assert_allclose(grid.dimmed(spot=0.25), 0.25 * spot + other, rtol=0.02)
        self.assertAlmostEqual(grid.uniformity[0], grid.values.min() / grid.values.mean(), places=5)

    def test_OfASurfaceOfOnesOwn_IsTheCommandsBits(self):
        file = self.path("scene.pbrt")
        with open(file, "w") as out:
            out.write(SCENE)
        surface = lucerna.CalculationSurface("wall", (-1, 1, 0), (2, 0, 0), (0, 0, 1))
        self.assertEqual(surface.points, (10, 5))
        (grid,) = lucerna.illuminance(lucerna.read_scene(file), [surface], samples=16, seed=3)
        table = self.path("lux.csv")
        subprocess.run(
            [COMMAND, "lux", file, "--surface", "wall=-1,1,0:1,1,0:-1,1,1", "--samples", "16", "--seed", "3", "-o", table],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        with open(table) as rows:
            values = [float(row["E [lx]"]) for row in csv.DictReader(rows)]
        self.assertEqual([float(f"{value:.7g}") for value in grid.values.ravel()], values)
        self.assertTrue((grid.values > grid.direct).all())  # the floor reflects light, too

    def test_WhatIsWrong_IsNamed(self):
        with self.assertRaisesRegex(lucerna.InputError, "no CalculationSurface"):
            lucerna.illuminance(lucerna.read_text(SCENE.split("CalculationSurface")[0]))
        with self.assertRaisesRegex(lucerna.InputError, "sphere.*planar"):
            lucerna.CalculationSurface("a", (0, 0, 0), (1, 0, 0), (0, 1, 0), kind="sphere")
        with self.assertRaises(lucerna.InputError):
            lucerna.CalculationSurface("a", (0, 0, 0), (1, 0, 0), (2, 0, 0))
        with self.assertRaisesRegex(lucerna.InputError, "facing"):
            lucerna.CalculationSurface("a", (0, 0, 0), (1, 0, 0), (0, 1, 0), facing=(0, 0, 0))
        with self.assertRaisesRegex(lucerna.InputError, "precision"):
            lucerna.illuminance(self.scene, precision=0)
        (grid,) = lucerna.illuminance(self.scene, samples=1)
        with self.assertRaisesRegex(lucerna.InputError, "ceiling.*spot"):
            grid.dimmed(ceiling=1)


if __name__ == "__main__":
    unittest.main()
