"""Runs the shipped studies in a tiny size: every description and program works, and so do the functions that read results.

usage: studies_test.py BUILD     the folder of the built programs
"""
import glob
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
STUDIES = os.path.join(ROOT, "bench", "figures", "studies")
SCRIPT = os.path.join(ROOT, "bench", "figures", "studies.sh")
sys.path.insert(0, STUDIES)
import common  # noqa: E402
import quick  # noqa: E402

BUILD = ""  # set from the command line


def studies(out, *names):
    environment = {**os.environ, "BUILD": BUILD, "OUT": out}
    return subprocess.run(["bash", SCRIPT, "--quick", *names], env=environment, capture_output=True, text=True, check=False)


def names_in(text):
    return re.findall(r'^\[\[method\]\]\nname = "([^"]*)"', text, flags=re.M)


def point(seconds, error2):
    return {"seconds": seconds, "error2": error2}


class Curves(unittest.TestCase):
    def test_front_leaves_out_what_is_beaten(self):
        points = [point(4, 0.1), point(1, 1), point(2, 2), point(4, 0.05)]
        self.assertEqual(common.front(points), [point(1, 1), point(4, 0.05)])

    def test_time_to_an_error_is_straight_in_logarithms(self):
        points = [point(1, 1), point(100, 0.01)]
        self.assertAlmostEqual(common.seconds_to(points, 0.1), 10)
        self.assertEqual(common.seconds_to(points, 3), 1, "nothing faster was measured")
        self.assertIsNone(common.seconds_to(points, 0.001), "it never gets there")
        self.assertAlmostEqual(common.seconds_to(points, 0.001, unbiased=True), 1000)

    def test_slope_is_that_of_the_power(self):
        self.assertAlmostEqual(common.slope([(n, 7 * n**-0.6) for n in (1, 4, 16, 64)]), -0.6)
        self.assertGreater(abs(common.slope([(n, 7 * n**-0.9) for n in (1, 4, 16, 64)]) + 0.6), 0.2)

    def test_percent_of_a_negative_square_is_none(self):
        self.assertEqual(common.percent(-1e-9), "none")
        self.assertEqual(common.percent(0.0004), "2 %")


class Descriptions(unittest.TestCase):
    def test_quick_descriptions_keep_every_method_and_say_no_more(self):
        for description in glob.glob(os.path.join(STUDIES, "*.toml")):
            with tempfile.TemporaryDirectory() as folder:
                small = os.path.join(folder, "small.toml")
                quick.main(description, small)
                with open(description, encoding="utf-8") as file:
                    asked = file.read()
                with open(small, encoding="utf-8") as file:
                    kept = file.read()
            self.assertEqual([re.sub(r" \d+$", "", name) for name in names_in(kept)],
                             [re.sub(r" \d+$", "", name) for name in names_in(asked)], description)
            for spp in re.findall(r"spp = \[([^\]]*)\]", kept):
                self.assertTrue(all(int(n) <= 3 for n in spp.split(",")), f"{description}: {spp}")


class Studies(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.done = studies(cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_all_run_and_leave_tables_and_pictures(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr + self.done.stdout[-2000:])
        for name in ("cornell", "direct", "photons", "igi", "emission", "table", "halves", "tree", "near-far", "progressive"):
            folder = os.path.join(self.folder.name, name)
            pictures = glob.glob(os.path.join(folder, "*.png"))
            self.assertTrue(pictures, f"{name} drew nothing")
            for picture in pictures:
                self.assertGreater(os.path.getsize(picture), 5000, picture)
            with open(os.path.join(folder, "numbers.md"), encoding="utf-8") as file:
                self.assertIn("| --- |", file.read(), name)
            self.assertNotRegex(self.done.stdout, r"\b(nan|inf)\b")

    def test_every_point_of_every_description_was_measured(self):
        for name in ("cornell", "direct", "photons", "igi", "tree", "progressive"):
            folder = os.path.join(self.folder.name, name)
            with open(os.path.join(folder, "results.json"), encoding="utf-8") as file:
                points = json.load(file)["points"]
            with open(os.path.join(folder, f"{name}.toml"), encoding="utf-8") as file:
                description = file.read()
            self.assertEqual({p["method"] for p in points}, set(names_in(description)))
            self.assertTrue(all(math.isfinite(p["error2"]) and p["seconds"] > 0 for p in points), name)

    def test_both_trees_make_the_same_image(self):
        self.assertNotIn("the two images differ", self.done.stderr)

    def test_an_unknown_study_is_refused(self):
        refused = studies(self.folder.name, "dirct")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("dirct", refused.stderr)


if __name__ == "__main__":
    BUILD = os.path.abspath(sys.argv.pop(1))
    unittest.main()
