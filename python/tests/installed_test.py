"""The module in an installed tree, and in one that was moved, finds its libraries and makes the same bits."""

import glob
import os
import subprocess
import sys
import tempfile
import unittest

WORK = """
import sys
import lucerna
from lucerna import _lucerna
assert _lucerna.__file__.startswith(sys.argv[1]), _lucerna.__file__
b = lucerna.SceneBuilder()
b.film(xresolution=8, yresolution=8)
b.camera(fov=60)
b.light_source("infinite", L=(1, 0.5, 0.25))
b.mesh([[-1, -1, 3], [1, -1, 3], [0, 1, 3]], [[0, 1, 2]])
result = lucerna.render(b.scene(), spp=4)
result.save(sys.argv[2] + ".exr")
result.save(sys.argv[2] + ".png")  # by the library of picture formats
"""


class Installed(unittest.TestCase):
    def test_tree_and_moved_tree(self):
        with tempfile.TemporaryDirectory() as folder:
            first, second = os.path.join(folder, "first"), os.path.join(folder, "second")
            subprocess.run(
                [os.environ["CMAKE"], "--install", os.environ["LUCERNA_BUILD"], "--prefix", first],
                check=True, stdout=subprocess.DEVNULL,
            )
            self.work(first, os.path.join(folder, "a"))
            os.rename(first, second)
            self.work(second, os.path.join(folder, "b"))
            import lucerna

            self.assertEqual(lucerna.compare(os.path.join(folder, "a.exr"), os.path.join(folder, "b.exr"))["mse"], 0)

    def work(self, tree, image):
        (extension,) = glob.glob(tree + "/**/_lucerna*.so", recursive=True)
        needed = subprocess.run(["readelf", "-d", extension], check=True, capture_output=True, text=True).stdout
        self.assertNotIn(os.environ["LUCERNA_BUILD"], needed)
        packages = os.path.dirname(os.path.dirname(extension))
        done = subprocess.run(
            [sys.executable, "-c", WORK, tree, image],
            cwd=os.path.dirname(image), env={**os.environ, "PYTHONPATH": packages}, capture_output=True, text=True, timeout=60,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(os.path.getsize(image + ".png"), 50)


if __name__ == "__main__":
    unittest.main()
