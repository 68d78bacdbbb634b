#!/usr/bin/env python3
"""Tests the SVG of `lucerna falsecolour` in a browser: it is well-formed, makes no network requests, its picture loads, and
its labels stay inside.  Usage: falsecolour_test.py LUCERNA"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import chromium

SCENE = """
LookAt 0 3 0  0 0 0  0 0 1
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 300 "integer yresolution" 200
Sampler "independent" "integer pixelsamples" 1
Integrator "direct"
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.8 0.5 0.2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -4 0 -4  -4 0 4  4 0 4  4 0 -4 ]
LightSource "point" "rgb I" [ 300 300 300 ] "point3 from" [ 0 2 0 ]
"""

LUCERNA = None


class FalseColour(chromium.PageCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        (folder / "scene.pbrt").write_text(SCENE)
        subprocess.run([LUCERNA, "render", "scene.pbrt", "--set", "quantity=illuminance", "-o", "e.exr", "--quiet"],
                       cwd=folder, check=True)
        subprocess.run([LUCERNA, "falsecolour", "e.exr", "-o", "e.svg", "--levels", "40,60", "--size", "600"],
                       cwd=folder, check=True, stdout=subprocess.DEVNULL)
        cls.page = chromium.Page(folder / "e.svg").__enter__()

    def test_it_is_a_drawing(self):
        self.assertEqual(self.page.evaluate("document.documentElement.tagName"), "svg")
        self.assertEqual(self.page.evaluate("document.querySelectorAll('parsererror').length"), 0)

    def test_isolux_lines_are_circles_of_the_right_size(self):
        # E = I h / (h^2 + r^2)^1.5 with I = 300, h = 2. The camera is 3 above the floor; its field of view over the
        # shorter side is 60 degrees: 2 * 3 * tan 30 degrees over 400 pixels.
        pixels = 400 / (6 * 3 ** -0.5)
        for level in (40, 60):
            radius = ((300 * 2 / level) ** (2 / 3) - 4) ** 0.5 * pixels
            boxes = self.page.evaluate(
                f"[...document.querySelectorAll('.isoline[data-level=\"{level}\"]')]"
                ".map(e => { const b = e.getBBox(); return [b.width, b.height]; })")
            self.assertEqual(len(boxes), 1)
            for size in boxes[0]:
                self.assertLess(abs(size - 2 * radius), 4)  # two pixels of the image

    def test_the_picture_loads_and_texts_stay_inside(self):
        self.assertTrue(self.page.evaluate(
            "(async () => { const i = new Image(); i.src = document.querySelector('image').getAttribute('href');"
            "await i.decode(); return i.width === 300 && i.height === 200; })()"))
        self.assertTrue(self.page.evaluate(
            "(() => { const all = document.documentElement.getBoundingClientRect();"
            "return [...document.querySelectorAll('text')].every(t => { const b = t.getBoundingClientRect();"
            "return b.left >= all.left && b.right <= all.right && b.top >= all.top && b.bottom <= all.bottom; }); })()"))
        self.assertGreater(self.page.evaluate("document.querySelectorAll('.tick').length"), 2)


if __name__ == "__main__":
    if not chromium.browser():
        print("skipped: no Chromium here (scripts/deps.sh installs it)")
        sys.exit(chromium.SKIPPED)
    LUCERNA = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
