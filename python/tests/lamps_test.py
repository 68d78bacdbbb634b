"""Light fields, ray files and photometric webs: round trips, and the numbers of the command."""

import os
import subprocess
import unittest

import lucerna
import numpy as np
from folder import Folder

COMMAND = os.environ["LUCERNA_COMMAND"]


def array_of(views=(3, 4), pixels=(5, 6), channels=()):
    values = np.random.default_rng(2003).uniform(0.1, 1, (*views, *pixels, *channels))
    return np.float32(np.float16(values))  # numbers that a file holds exactly


def field_of(array, unit="W"):
    return lucerna.LightField.from_array(array, (0.01, 0.012), (0.02, 0.02), 0.1, unit)


class LampFiles(Folder):
    def command(self, *words):
        subprocess.run(
            [COMMAND, *words], check=True, timeout=100, stdout=subprocess.DEVNULL, cwd=self.folder
        )


class LightFields(LampFiles):
    def test_array_is_kept(self):
        array = array_of()
        self.assertTrue(np.array_equal(field_of(array).array, array))
        self.assertEqual(field_of(array).array.dtype, np.float32)

    def test_file_is_kept(self):
        for array in (array_of(), array_of(channels=(3,))):
            field = field_of(array)
            field.save(self.path("lamp.exr"))
            read = lucerna.LightField.open(self.path("lamp.exr"))
            self.assertTrue(np.array_equal(read.array, field.array))
            again = read.with_array(read.array)
            self.assertTrue(np.array_equal(again.array, read.array))
            again.save(self.path("again.exr"))
            self.assertTrue(np.array_equal(lucerna.LightField.open(self.path("again.exr")).array, read.array))

    def test_colours_are_kept_to_halves(self):
        array = array_of(channels=(3,))
        self.assertTrue(np.allclose(field_of(array).array, array, rtol=2e-3))
        self.assertTrue(field_of(array).coloured)

    def test_planes(self):
        field = field_of(array_of(), "lm")
        self.assertEqual((field.views, field.pixels, field.unit), ((3, 4), (5, 6), "lm"))
        self.assertEqual((field.spacing, field.pixel), ((0.01, 0.012), (0.02, 0.02)))
        self.assertEqual(field.distance, 0.1)
        self.assertTrue(np.allclose(field.u, [-0.01, 0, 0.01]))
        self.assertTrue(np.allclose(field.v, [-0.018, -0.006, 0.006, 0.018]))
        self.assertEqual(len(field.slabs), 1)

    def test_flux_is_the_sum(self):
        array = array_of()
        volume = 0.01 * 0.012 * 0.02 * 0.02
        self.assertAlmostEqual(field_of(array).flux / (array.sum(dtype=float) * volume), 1, places=6)
        half = field_of(array).with_array(0.5 * array)
        self.assertAlmostEqual(half.flux / field_of(array).flux, 0.5, places=6)

    def test_axes(self):
        """One coefficient, of view (m, n) and pixel (k, l), shines where u, v, s and t say."""
        array = np.zeros((3, 3, 9, 9), dtype=np.float32)
        array[1, 1, 7, 1] = 1  # s > 0, t < 0
        field = lucerna.LightField.from_array(array, (0.001, 0.001), (0.01, 0.01), 0.1)
        screen = field.project(0.1, 0.09, (9, 9))
        row, column = np.unravel_index(screen.argmax(), screen.shape)
        self.assertEqual((row, column), (7, 7))  # rows run from the top, so t < 0 is low
        array[:] = 0
        array[0, 2, 4, 4] = 1  # u < 0, v > 0
        field = lucerna.LightField.from_array(array, (0.03, 0.03), (0.001, 0.001), 0.1)
        screen = field.project(0.0, 0.09, (3, 3))
        self.assertEqual(np.unravel_index(screen.argmax(), screen.shape), (0, 0))

    def test_screen_holds_the_flux(self):
        field = field_of(array_of())
        screen = field.project(0.2, (2, 3), (40, 60))
        self.assertEqual(screen.shape, (60, 40))
        # The tolerance is that of the quadrature over pixels; the C++ tests verify it to 1e-2.
        self.assertAlmostEqual(screen.mean() * 6 / field.flux, 1, delta=1e-3)
        xyz = field_of(array_of(channels=(3,))).project(0.2, 1.0, (20, 10), xyz=True)
        self.assertEqual(xyz.shape, (10, 20, 3))

    def test_screen_is_the_commands(self):
        field_of(array_of()).save(self.path("lamp.exr"))
        self.command(
            "light", "project", "lamp.exr", "--distance", "50mm", "--size", "400mmx300mm", "--pixels", "40x30",
            "-o", "screen.exr", "--quiet",
        )
        theirs = lucerna.read_image(self.path("screen.exr")).channel("G")
        ours = lucerna.LightField.open(self.path("lamp.exr")).project(0.05, (0.4, 0.3), (40, 30))
        self.assertTrue(np.allclose(ours, theirs, rtol=1e-5))

    def test_frame_holds_the_light(self):
        field = field_of(array_of())
        size, centre = field.frame(0.1)
        screen = field.project(0.1, size, (50, 50), centre)
        self.assertGreater(screen.mean() * size[0] * size[1], 0.85 * field.flux)

    def test_what_is_no_field(self):
        array = array_of()
        for bad in (array[0], array[..., :2, np.newaxis], array * np.nan, array[:0]):
            with self.assertRaises(lucerna.InputError):
                field_of(bad)
            with self.assertRaises(lucerna.InputError):
                field_of(array).with_array(bad)
        for call in (
            lambda: lucerna.LightField.open(self.path("none.exr")),
            lambda: field_of(array, "foot"),
            lambda: field_of(array).project(-1, 1),
            lambda: field_of(array).project(1, 0),
            lambda: field_of(array).project(1, 1, (0, 4)),
            lambda: field_of(array).project(1, 1, side="up"),
            lambda: field_of(array).far_field(polar_step=7),
            lambda: field_of(array).save(self.path("lamp.png")),
        ):
            self.assertRaises(lucerna.InputError, call)


class Rays(LampFiles):
    def setUp(self):
        super().setUp()
        field_of(array_of((8, 8), (16, 16)), "lm").save(self.path("lamp.exr"))
        self.command("light", "emit", "lamp.exr", "--rays", "20000", "-o", "lamp.tm25ray", "--quiet")

    def test_import_is_the_commands(self):
        self.command(
            "light", "import", "lamp.tm25ray", "--views", "8x8", "--pixels", "16x16", "-o", "theirs.exr", "--quiet"
        )
        told = []
        ours = lucerna.import_rays(
            self.path("lamp.tm25ray"), views=(8, 8), pixels=(16, 16), progress=lambda *now: told.append(now)
        )
        ours.save(self.path("ours.exr"))
        self.assertEqual(
            lucerna.read_image(self.path("ours.exr")).channels, lucerna.read_image(self.path("theirs.exr")).channels
        )
        ours = lucerna.LightField.open(self.path("ours.exr"))
        theirs = lucerna.LightField.open(self.path("theirs.exr"))
        self.assertTrue(np.array_equal(ours.array, theirs.array))
        self.assertEqual((ours.flux, ours.missed), (theirs.flux, theirs.missed))
        self.assertGreater(ours.flux, 0)
        self.assertGreater(len(told), 1)

    def test_errors(self):
        for arguments in ({"views": (0, 3)}, {"slabs": 3}, {"capture": 2}, {"distance": -1}, {"drive": [1, 2]}):
            with self.assertRaises(lucerna.InputError, msg=str(arguments)):
                lucerna.import_rays(self.path("lamp.tm25ray"), **arguments)
        with self.assertRaises(lucerna.InputError):
            lucerna.import_rays(self.path("none.tm25ray"))


class Webs(LampFiles):
    def test_far_field_has_the_flux(self):
        field = field_of(array_of((8, 8), (16, 16)), "lm")
        web = field.far_field(5, 15)
        self.assertAlmostEqual(web.flux / field.flux, 1, places=4)
        self.assertEqual(web.array.shape, (len(web.azimuth), len(web.polar)))
        self.assertEqual(web.unit, "cd")

    def test_ies_is_kept(self):
        web = field_of(array_of(), "lm").far_field(5, 15)
        web.write_ies(self.path("lamp.ies"), "a lamp")
        read = lucerna.open_ies(self.path("lamp.ies"))
        self.assertTrue(np.allclose(read.array, web.array, rtol=1e-4))
        self.assertAlmostEqual(read.flux / web.flux, 1, places=4)

    def test_far_field_is_the_commands(self):
        field_of(array_of(), "lm").save(self.path("lamp.exr"))
        self.command("light", "farfield", "lamp.exr", "-o", "theirs.ies", "--step", "5", "--plane-step", "15", "--quiet")
        web = lucerna.LightField.open(self.path("lamp.exr")).far_field(5, 15)
        web.write_ies(self.path("ours.ies"), "lamp")
        with open(self.path("ours.ies")) as ours, open(self.path("theirs.ies")) as theirs:
            self.assertEqual(ours.read(), theirs.read())

    def test_array_and_directions(self):
        polar, azimuth = [0, 45, 90], [0, 90, 180, 270, 360]
        candela = np.repeat([[3, 2, 1]], 5, axis=0)
        web = lucerna.PhotometricWeb.from_array(polar, azimuth, candela)
        self.assertTrue(np.array_equal(web.array, candela))
        down, level, up = web.intensity([[0, 0, 2], [1, 0, 0], [0, 0, -1]])
        self.assertAlmostEqual(down, 3)
        self.assertAlmostEqual(level, 1)
        self.assertEqual(up, 0)
        self.assertEqual((web.peak, web.planes), (3, "C"))
        for bad in ([polar, azimuth, candela.T], [polar[::-1], azimuth, candela], [polar, azimuth, -candela]):
            self.assertRaises(lucerna.InputError, lucerna.PhotometricWeb.from_array, *bad)
        self.assertRaises(lucerna.InputError, web.intensity, [[0, 0, 0]])

    def test_watts_are_no_candela(self):
        field = field_of(array_of())
        self.assertEqual(field.far_field(5, 15).unit, "W/sr")
        with self.assertRaisesRegex(lucerna.InputError, "efficacy"):
            field.far_field(5, 15).write_ies(self.path("lamp.ies"))
        field.far_field(5, 15, efficacy=300).write_ies(self.path("lamp.ies"))
        self.assertAlmostEqual(lucerna.open_ies(self.path("lamp.ies")).flux / field.flux, 300, delta=0.1)


class InAScene(LampFiles):
    def test_a_changed_lamp_lights_a_scene(self):
        field = field_of(array_of(), "lm")
        means = []
        for name, factor in (("one.exr", 1), ("two.exr", 2)):
            field.with_array(factor * field.array).save(self.path(name))
            b = lucerna.SceneBuilder(self.folder)
            b.film(xresolution=8, yresolution=8)
            b.look_at((0, 0, 0), (0, 0, 1), (0, 1, 0))
            b.camera(fov=30)
            b.light_source("lightfield", filename=name)
            b.mesh([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], [[0, 2, 1], [0, 3, 2]])
            means.append(lucerna.render(b.scene(), "direct", spp=4).image.mean())
        self.assertGreater(means[0], 0)
        self.assertAlmostEqual(means[1] / means[0], 2, places=4)


if __name__ == "__main__":
    unittest.main()
