"""Images: arrays and files, comparison, and the package as type checkers see it."""

import os
import py_compile
import subprocess
import sys
import unittest

import lucerna
import numpy as np
from folder import Folder


RNG = np.random.default_rng(7)
COLOURS = RNG.uniform(0, 2, (6, 9, 3)).astype(np.float32)


class Files(Folder):
    def test_colours_are_kept(self):
        lucerna.write_image(self.path("a.exr"), COLOURS, attributes={"lucerna.unit": "lx"})
        read = lucerna.read_image(self.path("a.exr"))
        self.assertTrue(np.array_equal(read.image, COLOURS))
        self.assertEqual(read.attributes["lucerna.unit"], "lx")
        self.assertEqual((read.width, read.height, read.channels), (9, 6, ["R", "G", "B"]))
        self.assertIsNone(read.variance)

    def test_one_channel(self):
        lucerna.write_image(self.path("a.exr"), COLOURS[..., 0])
        read = lucerna.read_image(self.path("a.exr"))
        self.assertTrue(np.array_equal(read.channel("Y"), COLOURS[..., 0]))
        self.assertEqual(read.image.shape, (6, 9, 3))

    def test_names_and_layers(self):
        names = ["R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z", "Z"]
        values = RNG.normal(size=(6, 9, 10)).astype(np.float32)
        lucerna.write_image(self.path("a.exr"), values, channels=names)
        layers = lucerna.read_image(self.path("a.exr")).layers
        self.assertEqual(sorted(layers), ["N", "Z", "albedo"])
        self.assertTrue(np.array_equal(layers["N"], values[..., 6:9]))
        self.assertTrue(np.array_equal(layers["Z"], values[..., 9]))

    def test_other_colour_space(self):
        lucerna.write_image(self.path("a.exr"), np.full((2, 2, 3), 0.5), colour_space="acescg")
        read = lucerna.read_image(self.path("a.exr"))
        self.assertTrue(np.allclose(read.image, 0.5, atol=1e-5))  # grey is grey in every colour space
        with self.assertRaises(lucerna.InputError):
            lucerna.write_image(self.path("a.exr"), COLOURS, colour_space="cmyk")

    def test_picture(self):
        lucerna.write_image(self.path("a.png"), COLOURS, exposure=0, tone="linear", white_balance=3000)
        self.assertGreater(os.path.getsize(self.path("a.png")), 100)

    def test_what_is_no_image(self):
        for image in (np.zeros(3), np.zeros((2, 2, 2)), np.zeros((0, 2, 3)), np.zeros((1, 2, 3, 4))):
            with self.assertRaises(lucerna.InputError, msg=str(image.shape)):
                lucerna.write_image(self.path("a.exr"), image)
        for name in ("a.jpg", "a"):
            self.assertRaises(lucerna.InputError, lucerna.write_image, self.path(name), COLOURS)
        self.assertRaises(lucerna.InputError, lucerna.read_image, self.path("none.exr"))
        self.assertRaises(lucerna.InputError, lucerna.read_image, self.folder)
        self.assertRaises(lucerna.InputError, lucerna.write_image, self.path("no/folder.exr"), COLOURS)
        self.assertRaises(lucerna.InputError, lucerna.write_image, self.path("a.png"), COLOURS, tone="x")
        lucerna.write_image(self.path("a.exr"), COLOURS)
        self.assertRaises(KeyError, lucerna.read_image(self.path("a.exr")).channel, "Z")


class Comparison(Folder):
    def test_numbers(self):
        numbers = lucerna.compare(1.1 * COLOURS, COLOURS)
        self.assertAlmostEqual(numbers["channels"]["R"]["ratio"], 1.1, places=5)
        self.assertAlmostEqual(numbers["mse"] / (0.01 * (COLOURS.astype(float) ** 2).mean()), 1, places=4)
        self.assertEqual(lucerna.compare(COLOURS, COLOURS, flip=False)["mse"], 0)

    def test_files_images_and_seeds(self):
        lucerna.write_image(self.path("a.exr"), COLOURS)
        image = lucerna.read_image(self.path("a.exr"))
        self.assertEqual(lucerna.compare(self.path("a.exr"), image, flip=False)["mse"], 0)
        three = [COLOURS + RNG.normal(scale=0.01, size=COLOURS.shape) for _ in range(3)]
        self.assertGreater(lucerna.compare(three, image, flip=False)["mse"], 0)

    def test_sizes_that_differ(self):
        self.assertRaises(lucerna.InputError, lucerna.compare, COLOURS, COLOURS[1:])


class Hints(Folder):
    def test_all_of_the_package_compiles(self):
        folder = os.path.dirname(lucerna.__file__)
        for name in os.listdir(folder):
            if name.endswith((".py", ".pyi")):
                py_compile.compile(os.path.join(folder, name), cfile=self.path("out"), doraise=True)
        self.assertTrue(os.path.exists(os.path.join(folder, "py.typed")))

    def test_stub_names_what_there_is(self):
        import ast

        from lucerna import _lucerna

        with open(os.path.join(os.path.dirname(lucerna.__file__), "_lucerna.pyi")) as file:
            stub = ast.parse(file.read())
        public = {name for name in dir(_lucerna) if not name.startswith("_")}
        declared = {}
        for node in stub.body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                declared[node.name] = node
        self.assertEqual(public, set(declared))
        for name, node in declared.items():
            if not isinstance(node, ast.ClassDef) or name == "InputError":
                continue
            members = {m.name for m in node.body if isinstance(m, ast.FunctionDef)} - {"__init__"}
            there = {m for m in vars(getattr(_lucerna, name)) if not m.startswith("_")}
            self.assertEqual(there, members, name)

    def test_all_is_there(self):
        for name in lucerna.__all__:
            self.assertTrue(hasattr(lucerna, name), name)

    def test_mypy_finds_nothing(self):
        try:
            import mypy  # noqa: F401
        except ImportError:
            self.skipTest("mypy is not installed")
        folder = os.path.dirname(lucerna.__file__)
        found = subprocess.run(
            [sys.executable, "-m", "mypy", "--strict", "--cache-dir", self.path("cache"), "-p", "lucerna"],
            cwd=os.path.dirname(folder), capture_output=True, text=True, timeout=110,
        )
        self.assertEqual(found.returncode, 0, found.stdout + found.stderr)


if __name__ == "__main__":
    unittest.main()
