#!/usr/bin/env python3
"""The lamps that scenes/lamps makes as ray files: the same bytes each time, and their READMEs' expected numbers.

    ray_files_test.py LUCERNA
"""
import array
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

LAMPS = pathlib.Path(__file__).resolve().parents[2] / "scenes" / "lamps"
HEADER = 36288
LUCERNA = ""


class Lamp:
    """A made file: its rows of floats, and what `lucerna light info` says of it."""

    def __init__(self, name, folder, floats):
        self.file = pathlib.Path(folder) / (name + ".tm25ray")
        self.bytes = self.make()
        rows = array.array("f", self.bytes[-4 * floats * self.rays():])
        self.rows = [rows[i:i + floats] for i in range(0, len(rows), floats)]
        self.said = subprocess.run([LUCERNA, "light", "info", str(self.file)], check=True, text=True,
                                   stdout=subprocess.PIPE).stdout

    def make(self):
        subprocess.run([sys.executable, str(LAMPS / self.file.stem / "make.py"), str(self.file)], check=True,
                       stdout=subprocess.DEVNULL)
        return self.file.read_bytes()

    def rays(self):
        return int.from_bytes(self.bytes[20:28], "little")

    def numbers(self, line):
        found = re.search("^" + line + " (.*)$", self.said, re.MULTILINE)
        return [float(n) for n in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", found.group(1))]


class RayFiles(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def lamp(self, name, floats):
        lamp = Lamp(name, self.folder.name, floats)
        self.assertEqual(lamp.make(), lamp.bytes, "other bytes the second time")
        for row in lamp.rows[::97]:
            self.assertAlmostEqual(math.hypot(*row[3:6]), 1, delta=1e-6)
        self.assertEqual(lamp.numbers("skipped"), [0, 0, 0])
        return lamp

    def test_white_led(self):
        lamp = self.lamp("white-led", 8)
        self.assertEqual(len(lamp.rows), 200_000)
        self.assertEqual(lamp.numbers("flux")[0], 1)
        self.assertIn("each ray with its own", lamp.said)
        blue = [row for row in lamp.rows if row[7] == 1]
        self.assertEqual(len(blue), 48_000)
        self.assertTrue(all(max(abs(row[0]), abs(row[1])) <= 0.5 for row in blue))
        self.assertTrue(all(math.hypot(row[0], row[1]) <= 1.75 + 1e-6 for row in lamp.rows))
        # Of the phosphor's light 1 mm^2 at half density in a disc of 3.5 mm: to five standard errors.
        core, ring = 0.5, math.pi * 1.75 ** 2 - 1
        share = core / (core + ring)
        phosphor = [row for row in lamp.rows if row[7] == 2]
        inside = sum(max(abs(row[0]), abs(row[1])) < 0.5 for row in phosphor)
        self.assertAlmostEqual(inside / len(phosphor), share,
                               delta=5 * math.sqrt(share / len(phosphor)))
        mean = sum(row[5] for row in lamp.rows) / len(lamp.rows)
        self.assertAlmostEqual(mean, 0.24 * 3 / 4 + 0.76 * 2 / 3, delta=5 * 0.236 / math.sqrt(200_000))
        # Of the two spectra, summed every nanometre apart from this program: 0.34286, 0.34793, 339.73 lm/W.
        self.assertAlmostEqual(lamp.numbers("chromaticity")[0], 0.34286, delta=1e-4)
        self.assertAlmostEqual(lamp.numbers("chromaticity")[1], 0.34793, delta=1e-4)
        self.assertAlmostEqual(lamp.numbers("luminous efficacy")[0], 339.73, delta=0.05)
        kelvin, duv = lamp.numbers("colour temperature")
        self.assertAlmostEqual(kelvin, 5075, delta=5)
        self.assertAlmostEqual(duv, -0.0009, delta=1e-4)

    def test_bulb(self):
        lamp = self.lamp("bulb", 7)
        self.assertEqual(len(lamp.rows), 100_000)
        self.assertEqual(lamp.numbers("flux")[0], 4)
        self.assertEqual(lamp.numbers("colour temperature"), [2856, 0])
        for row in lamp.rows:
            self.assertAlmostEqual(math.hypot(*row[:3]), 30, delta=1e-4)
            self.assertGreaterEqual(row[2], -30 * math.cos(math.radians(25)) - 1e-4)
            self.assertGreater(sum(row[i] * row[3 + i] for i in range(3)), 0, "a ray into the glass")
        backward = sum(row[5] < 0 for row in lamp.rows) / len(lamp.rows)
        self.assertGreater(backward, 0.45)
        # A mirror sphere preserves a line's distance from its centre, so all lines pass as near to it as the
        # filament does.
        for row in lamp.rows:
            along = sum(row[i] * row[3 + i] for i in range(3))
            self.assertLess(30 ** 2 - along * along, 6.6 ** 2)

    def test_narrow_beam(self):
        lamp = self.lamp("narrow-beam", 7)
        self.assertEqual(len(lamp.rows), 20_000)
        self.assertEqual(lamp.numbers("flux")[0], 0.5)
        self.assertEqual(lamp.numbers("colour temperature"), [3200, 0])

        def within(degrees):
            return sum(row[5] > math.cos(math.radians(degrees)) for row in lamp.rows) / len(lamp.rows)
        error = 0.5 / math.sqrt(20_000)
        self.assertAlmostEqual(within(1.0), 0.5, delta=5 * error)
        self.assertAlmostEqual(within(2.0), 1 - 1 / 16, delta=5 * error)
        self.assertGreater(within(1.1), 0.5 + 5 * error, "a wider beam would be noticed")


if __name__ == "__main__":
    LUCERNA = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
