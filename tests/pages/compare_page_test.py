#!/usr/bin/env python3
"""Tests the page of `lucerna compare --html` in a browser: the slider moves, images flip and zoom, the exposure works, and
the page makes no network requests.  Usage: compare_page_test.py LUCERNA"""
import base64
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import chromium

SCENE = """
LookAt 0 1 -3  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 96 "integer yresolution" 64
Sampler "independent" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 4
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.8 0.5 0.2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -2  -2 0 2  2 0 2  2 0 -2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 1.5 0 ]
"""

LUCERNA = None

# Returns the colour of the canvas at a share of its width and height, as [r, g, b]; it is read from a copy, so that the
# browser logs no performance warning about reading.
COLOUR = """(() => { const v = document.querySelector('.strip-view'), c = document.createElement('canvas');
c.width = c.height = 1;
const t = c.getContext('2d', { willReadFrequently: true });
t.drawImage(v, -Math.floor(%g * v.width), -Math.floor(%g * v.height));
return [...t.getImageData(0, 0, 1, 1).data].slice(0, 3); })()"""


class ComparePage(chromium.PageCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        (folder / "scene.pbrt").write_text(SCENE)
        for name, more in (("a", []), ("b", ["--seed", "1"]), ("r", ["--seed", "2", "--spp", "64"])):
            subprocess.run([LUCERNA, "render", "scene.pbrt", "-o", name + ".exr", "--quiet", *more], cwd=folder, check=True)
        subprocess.run([LUCERNA, "compare", "a.exr", "b.exr", "r.exr", "--html", "page.html"], cwd=folder, check=True,
                       stdout=subprocess.DEVNULL)
        cls.page = chromium.Page(folder / "page.html").__enter__()
        cls.page.evaluate("strip.ready.then(() => true)")

    def tearDown(self):
        self.page.evaluate("strip.whole(); strip.slide(0.5); strip.left = 0; strip.right = 1; strip.draw()")
        super().tearDown()

    def choose(self, side, name):
        found = self.page.evaluate(f"""(() => {{ const s = document.querySelector('select[name={side}]');
            const o = [...s.options].find((o) => o.textContent.startsWith('{name}'));
            s.value = o.value; s.dispatchEvent(new Event('change')); return o.textContent; }})()""")
        self.assertTrue(found.startswith(name))

    def box(self):
        return self.page.evaluate("""(() => { const b = document.querySelector('.strip-view').getBoundingClientRect();
            return [b.left, b.top, b.width, b.height]; })()""")

    def test_images_are_drawn(self):
        self.assertEqual(self.page.evaluate("[strip.layers.length, strip.layers[0].width, strip.layers[0].height]"),
                         [7, 96, 64])
        left, right = self.page.evaluate(COLOUR % (0.3, 0.7)), self.page.evaluate(COLOUR % (0.7, 0.7))
        self.assertGreater(sum(left), 60)
        self.assertGreater(sum(right), 60)

    def test_slider_moves_the_border_between_images(self):
        self.choose("left", "HDR-FLIP")
        self.choose("right", "reference")
        self.page.evaluate("""(() => { const s = document.querySelector('input[name=split]');
            s.value = 0; s.dispatchEvent(new Event('input')); })()""")
        reference = self.page.evaluate(COLOUR % (0.3, 0.7))
        self.page.evaluate("""(() => { const s = document.querySelector('input[name=split]');
            s.value = 1; s.dispatchEvent(new Event('input')); })()""")
        self.assertNotEqual(self.page.evaluate(COLOUR % (0.3, 0.7)), reference)
        self.assertEqual(self.page.evaluate("strip.split"), 1)

    def test_border_is_dragged_with_the_mouse(self):
        x, y, width, height = self.box()
        self.page.mouse("mousePressed", x + width / 2, y + height / 2, button="left", clickCount=1)
        self.page.mouse("mouseMoved", x + width / 4, y + height / 2, button="left")
        self.page.mouse("mouseReleased", x + width / 4, y + height / 2, button="left", clickCount=1)
        self.assertAlmostEqual(self.page.evaluate("strip.split"), 0.25, delta=0.01)
        self.assertIn("reference", self.page.evaluate("document.querySelector('.strip-status').textContent"))

    def test_flip_shows_one_image_then_the_other(self):
        self.choose("right", "signed error")
        self.page.evaluate("document.querySelector('.strip-view').focus()")
        self.page.key("f")
        self.assertEqual(self.page.evaluate("strip.split"), 0)
        one = self.page.evaluate(COLOUR % (0.5, 0.7))
        self.page.key("f")
        self.assertEqual(self.page.evaluate("strip.split"), 1)
        self.assertNotEqual(self.page.evaluate(COLOUR % (0.5, 0.7)), one)

    def test_wheel_zooms_and_drag_moves(self):
        x, y, width, height = self.box()
        self.page.mouse("mouseWheel", x + width / 4, y + height / 4, deltaX=0, deltaY=-100)
        self.page.evaluate("new Promise((resolve) => setTimeout(resolve, 100))")
        zoom, centre = self.page.evaluate("[strip.zoom, strip.centre]")
        self.assertGreater(zoom, 1)
        self.assertLess(centre[0], 0.5)  # the point under the pointer stays there
        self.page.mouse("mousePressed", x + width / 8, y + height / 2, button="left", clickCount=1)
        self.page.mouse("mouseMoved", x + width / 8 - 40, y + height / 2, button="left")
        self.page.mouse("mouseReleased", x + width / 8 - 40, y + height / 2, button="left", clickCount=1)
        self.assertGreater(self.page.evaluate("strip.centre[0]"), centre[0])

    def test_exposure_brightens_radiance(self):
        before = self.page.evaluate(COLOUR % (0.3, 0.8))
        stops = self.page.evaluate("strip.stops")
        self.page.evaluate("""(() => { const s = document.querySelector('input[name=exposure]');
            s.value = Number(s.value) - 2; s.dispatchEvent(new Event('input')); })()""")
        self.assertLess(sum(self.page.evaluate(COLOUR % (0.3, 0.8))), sum(before))
        self.page.evaluate(f"strip.expose({stops})")

    def difference_from_picture(self, stops, *options):
        """The mean and the largest difference in bytes between the page's reference and the picture that render makes of it."""
        folder = pathlib.Path(self.folder.name)
        subprocess.run([LUCERNA, "render", "scene.pbrt", "-o", "shown.exr", "--seed", "2", "--spp", "64", "--png",
                        "--no-denoise", "--exposure", str(stops), "--quiet", *options], cwd=folder, check=True)
        source = "data:image/png;base64," + base64.b64encode((folder / "shown.png").read_bytes()).decode()
        return self.page.evaluate("""(async () => {
            const image = new Image();
            image.src = '%s';
            await image.decode();
            const bytes = (what) => {
                const c = document.createElement('canvas'), t = c.getContext('2d', { willReadFrequently: true });
                c.width = %d, c.height = %d;
                t.drawImage(what, 0, 0);
                return t.getImageData(0, 0, c.width, c.height).data;
            };
            const layer = strip.layers.find((one) => one.name.startsWith('reference'));
            layer.develop(%g);
            const page = bytes(layer.canvas), picture = bytes(image);
            const apart = Array.from(page, (v, i) => Math.abs(v - picture[i]));
            return [apart.reduce((a, b) => a + b) / (0.75 * apart.length), Math.max(...apart)];
        })()""" % (source, 96, 64, stops))

    def test_radiance_is_shown_as_render_shows_it(self):
        for stops in (0, 2, 4):  # with more and more values beyond the knee of the tone curve
            mean, largest = self.difference_from_picture(stops)
            self.assertLess(mean, 0.5)
            self.assertLessEqual(largest, 3)  # the page stores radiance with 8 bits relative to the largest channel
        self.assertGreater(self.difference_from_picture(4, "--tone", "linear")[1], 30)

    def test_numbers_are_on_the_page(self):
        numbers = self.page.evaluate("document.getElementById('numbers').textContent")
        for part in ("MSE", "bias^2", "noise^2", "FLIP", "HDR-FLIP", "z-test"):
            self.assertIn(part, numbers)


class Driver(unittest.TestCase):
    """The driver sees what it must: a test of the test."""

    def test_errors_and_requests_are_noticed(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "bad.html"
            page.write_text("<img src='http://127.0.0.1:9/x.png'><script>console.error('no'); missing();</script>")
            with chromium.Page(page) as opened:
                opened.evaluate("1")
                self.assertIn("http://127.0.0.1:9/x.png", opened.requests)
                self.assertGreaterEqual(len(opened.troubles), 2)


if __name__ == "__main__":
    if not chromium.browser():
        print("skipped: no Chromium here (scripts/deps.sh installs it)")
        sys.exit(chromium.SKIPPED)
    LUCERNA = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
