#!/usr/bin/env python3
"""Tests the page of `lucerna study` in a browser: points lie at their values, hovering shows their settings and clicking their
images, the slider moves, images zoom, the table sorts, and the page makes no network requests.
Usage: study_page_test.py LUCERNA"""
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import chromium
from compare_page_test import COLOUR, SCENE

DESCRIPTION = """
title = "Two ways, <twice>"
seeds = 3
[[scene]]
file = "scene.pbrt"
resolution = "48x32"
[[scene]]
name = "wide"
file = "scene.pbrt"
resolution = "64x24"
[reference]
integrator = "path"
spp = [128]
[[method]]
name = "paths"
integrator = "path"
spp = [1, 4, 16]
[[method]]
name = "photons"
integrator = "photonmap"
set = "photons=300|3000 gatherrays=1"
spp = [1, 4]
"""
POINTS = 7  # for each scene

LUCERNA = None

# Returns, for plot number %d of the page, the labelled ticks of either axis as [[value, place], …], and the points as
# [seconds, number, x, y, class].
PLOT = """(() => { const svg = document.querySelectorAll('figure svg')[%d];
const place = (g, i) => Number(g.getAttribute('transform').match(/[-\\d.]+/g)[i]);
const ticks = (axis, i) => [...svg.querySelectorAll('.' + axis + ' .tick.labelled')].map(
    (g) => [g.querySelector('text').textContent, place(g, i)]);
return { x: ticks('x', 0), y: ticks('y', 1), points: [...svg.querySelectorAll('g.point')].map(
    (g) => [g.__data__.point.seconds, g.__data__.y || g.__data__.below, place(g, 0), place(g, 1), g.getAttribute('class')]),
    front: svg.querySelector('.front') ? svg.querySelector('.front').getAttribute('d') : '',
    lines: svg.querySelectorAll('path.line').length }; })()"""


def number(label):
    """What a tick's label says, in seconds or as a share."""
    value, _, unit = label.partition(" ")
    return float(value) * {"": 1, "%": 0.01, "ms": 0.001, "s": 1, "min": 60, "h": 3600}[unit]


def furthest_off(ticks, places):
    """How far, in pixels, [number, place] are from where a logarithmic axis with these ticks has them."""
    (a, at_a), (b, at_b) = [(math.log(number(text)), place) for text, place in (ticks[0], ticks[-1])]
    where = lambda v: at_a + (math.log(v) - a) / (b - a) * (at_b - at_a)
    between = [abs(where(number(text)) - place) for text, place in ticks]
    return max(between + [abs(where(v) - place) for v, place in places])


def make_study(folder, description=DESCRIPTION):
    (folder / "scene.pbrt").write_text(SCENE)
    (folder / "study.toml").write_text(description)
    subprocess.run([LUCERNA, "study", "study.toml", "-o", "out", "--quiet"], cwd=folder, check=True)
    return folder / "out" / "study.html", json.loads((folder / "out" / "results.json").read_text())


class StudyPage(chromium.PageCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        file, cls.results = make_study(pathlib.Path(cls.folder.name))
        cls.page = chromium.Page(file, width=1200, seconds=240).__enter__()
        cls.page.evaluate("study.ready.then(() => true)")

    def setUp(self):
        self.page.evaluate("window.scrollTo(0, 0); study.scenes.forEach((one) => { one.images.strip.whole(); one.images.strip.slide(0.5); })")

    def of_scene(self, name):
        return [p for p in self.results["points"] if p["scene"] == name]

    def box(self, selector, index=0):
        return self.page.evaluate(f"""(() => {{ const e = document.querySelectorAll({selector!r})[{index}];
            e.scrollIntoView({{ block: 'center' }});
            const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; }})()""")

    def click(self, selector, index=0, **more):
        x, y, width, height = self.box(selector, index)
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.page.mouse(kind, x + width / 2, y + height / 2, button="left", clickCount=1, **more)

    def set_slider(self, selector, value):
        self.page.evaluate(f"""(() => {{ const s = document.querySelector({selector!r});
            s.value = {value}; s.dispatchEvent(new Event('input')); }})()""")

    def text(self, selector):
        return self.page.evaluate(f"document.querySelector({selector!r}).textContent")

    def clear_point(self, method):
        """Of the points of a method in the first plot, the one furthest from any other (where points lie is for the machine's
        speed to say, and one that lies below another cannot be pointed at): its number and its settings."""
        return self.page.evaluate(f"""(() => {{
            const at = [...document.querySelectorAll('figure svg')[0].querySelectorAll('g.point')].map((g) => {{
                const b = g.getBoundingClientRect();
                return {{ point: g.__data__.point, x: b.left + b.width / 2, y: b.top + b.height / 2 }}; }});
            const free = (p) => Math.min(...at.filter((q) => q !== p).map((q) => Math.hypot(q.x - p.x, q.y - p.y)));
            const best = at.filter((p) => p.point.method === {method!r}).reduce((a, b) => free(b) > free(a) ? b : a);
            return [at.indexOf(best), best.point.settings]; }})()""")

    # Plots.

    def test_points_lie_where_their_numbers_say(self):
        for scene, plot in (("scene", 0), ("wide", 2)):
            drawn = self.page.evaluate(PLOT % plot)
            self.assertGreaterEqual(len(drawn["x"]), 2)
            self.assertGreaterEqual(len(drawn["y"]), 2)
            expected = sorted((p["seconds"], p["error"]) for p in self.of_scene(scene))
            self.assertEqual(sorted((s, e) for s, e, *_ in drawn["points"]), expected)
            self.assertLess(furthest_off(drawn["x"], [(s, x) for s, _, x, _, _ in drawn["points"]]), 1)
            self.assertLess(furthest_off(drawn["y"], [(e, y) for _, e, _, y, _ in drawn["points"]]), 1)

    def test_bias_and_noise_are_drawn_apart(self):
        drawn = self.page.evaluate(PLOT % 1)
        noise = sorted(math.sqrt(p["noise2"]["value"]) for p in self.of_scene("scene") if p["noise2"]["value"] > 0)
        hollow = sorted(v for _, v, _, _, c in drawn["points"] if "hollow" in c)
        self.assertEqual(len(hollow), len(noise))
        for a, b in zip(hollow, noise):
            self.assertAlmostEqual(a, b, places=9)
        for point in self.of_scene("scene"):
            bias, error = point["bias2"]["value"], point["bias2"]["error"]
            if bias > 2 * error:
                expected = ("point", math.sqrt(bias))
            else:
                expected = ("point below", math.sqrt(max(0, bias) + 2 * error))
            found = [(c, v) for s, v, _, _, c in drawn["points"] if s == point["seconds"] and "hollow" not in c]
            self.assertEqual(len(found), 1)
            self.assertTrue(found[0][0].startswith(expected[0]))
            self.assertEqual("below" in found[0][0], "below" in expected[0])
            self.assertAlmostEqual(found[0][1], expected[1], places=9)
        self.assertLess(furthest_off(drawn["y"], [(v, y) for _, v, _, y, _ in drawn["points"]]), 1)

    def test_front_goes_through_what_nothing_beats(self):
        drawn = self.page.evaluate(PLOT % 0)
        numbers = [float(n) for n in re.findall(r"-?[\d.]+(?:e-?\d+)?", drawn["front"])]
        corners = list(zip(numbers[::2], numbers[1::2]))[1::2]
        best = sorted((p["seconds"], p["error"]) for p in self.of_scene("scene") if p["best"])
        places = sorted((x, y) for s, e, x, y, _ in drawn["points"] if (s, e) in best)
        self.assertEqual(len(corners), len(best))
        for corner, place in zip(corners, places):
            for a, b in zip(corner, place):
                self.assertAlmostEqual(a, b, delta=0.5)
        self.assertGreaterEqual(drawn["lines"], 3)  # path tracing, and photon maps with either number of photons

    def test_other_measures_can_be_plotted(self):
        self.click("input[name=plotted][value=flip]")
        drawn = self.page.evaluate(PLOT % 0)
        self.click("input[name=plotted][value=error]")
        self.assertEqual(sorted(v for _, v, *_ in drawn["points"]), sorted(p["flip"] for p in self.of_scene("scene")))
        self.assertLess(furthest_off(drawn["y"], [(v, y) for _, v, _, y, _ in drawn["points"]]), 1)

    def test_hovering_tells_the_settings(self):
        at, settings = self.clear_point("photons")
        x, y, width, height = self.box("figure:first-child g.point .near", at)
        self.page.mouse("mouseMoved", 1, 1)
        self.assertEqual(self.page.evaluate("getComputedStyle(document.querySelector('.tip')).display"), "none")
        self.page.mouse("mouseMoved", x + width / 2, y + height / 2)
        tip = self.page.evaluate("[...document.querySelectorAll('.tip')].filter((t) => t.style.display !== 'none').map((t) => t.innerText)")
        self.assertEqual(len(tip), 1)
        for part in (settings, "error", "bias", "noise", "FLIP"):
            self.assertIn(part, tip[0])

    def test_wanted_error_moves_line_and_sentence(self):
        points = self.of_scene("scene")
        errors = sorted(p["error"] for p in points)
        for target in (1.02 * errors[2], 1.02 * errors[-1]):
            self.set_slider("input[name=target]", math.log10(target))
            shown = float(self.page.evaluate("study.target"))
            fastest = min((p for p in points if p["error"] <= shown), key=lambda p: p["seconds"])
            sentence = self.text("#sentences li")
            self.assertIn(f"{fastest['method']}, {fastest['settings']}", sentence)
            ringed = self.page.evaluate("document.querySelector('figure:first-child g.point.fastest').__data__.point.seconds")
            self.assertEqual(ringed, fastest["seconds"])
            drawn = self.page.evaluate(PLOT % 0)
            line = self.page.evaluate("Number((document.querySelector('line.target') || document.body).getAttribute('y1'))")
            self.assertLess(furthest_off(drawn["y"], [(shown, line)]), 1)
        self.set_slider("input[name=target]", -3)
        self.assertIn("no point is within 0.1 %", self.text("#sentences li"))

    def test_legend_hides_a_method(self):
        self.click(".legend button", 0)
        self.assertEqual(len(self.page.evaluate(PLOT % 0)["points"]), POINTS - 3)
        self.assertEqual(self.page.evaluate("document.querySelectorAll('.points tr.faint').length"), 6)
        self.click(".legend button", 0)
        self.assertEqual(len(self.page.evaluate(PLOT % 0)["points"]), POINTS)

    # Images.

    def chosen(self):
        return self.page.evaluate("[study.scenes[0].images.left, study.scenes[0].images.right].map((p) => p && p.settings)")

    def test_clicking_a_point_shows_its_image(self):
        self.page.evaluate("study.choose(study.scenes[0].scene.points[0], 'left'); true")
        self.page.evaluate("study.scenes[0].images.update().then(() => true)")
        view = "document.querySelector('.strip-view').toDataURL()"
        before = self.page.evaluate(view)
        at, left = self.clear_point("photons")
        self.click("figure:first-child g.point .near", at)
        self.page.evaluate("study.scenes[0].images.update().then(() => true)")
        self.assertEqual(self.chosen(), [left, None])
        self.assertNotEqual(self.page.evaluate(view), before)
        self.assertIn(left, self.text(".large .hint"))
        self.assertEqual(self.page.evaluate("document.querySelectorAll('.points tr.chosen').length"), 2)  # one for each scene
        self.assertIn(left, self.text(".film"))
        selected = self.page.evaluate("document.querySelector('select[name=left]').selectedOptions[0].textContent")
        self.assertIn(left, selected)
        at, right = self.clear_point("paths")
        self.click("figure:first-child g.point .near", at, modifiers=8)  # shift
        self.assertEqual(self.chosen(), [left, right])
        self.page.evaluate("study.choose(null, 'right', study.scenes[0].scene); true")

    def test_keys_reach_every_point(self):
        self.assertEqual(self.page.evaluate("""[...document.querySelectorAll('figure svg')].map(
            (svg) => svg.querySelectorAll('[tabindex="0"]').length)"""), [1, 1, 1, 1])
        self.page.evaluate("document.querySelector('figure:first-child g.point[tabindex=\"0\"]').focus()")
        seen = set()
        for _ in range(POINTS):
            self.page.key("ArrowRight")
            seen.add(self.page.evaluate("document.activeElement.getAttribute('aria-label')"))
        self.assertEqual(len(seen), POINTS)
        self.page.key("Enter")
        settings = self.page.evaluate("document.activeElement.__data__.point.settings")
        self.assertEqual(self.chosen()[0], settings)

    def test_slider_moves_between_image_and_reference(self):
        self.page.evaluate("study.choose(study.scenes[0].scene.points[0], 'left'); study.scenes[0].images.update().then(() => true)")
        self.set_slider("input[name=split]", 0)
        reference = self.page.evaluate(COLOUR % (0.3, 0.75))
        self.set_slider("input[name=split]", 1)
        self.assertEqual(self.page.evaluate("study.scenes[0].images.strip.split"), 1)
        self.assertNotEqual(self.page.evaluate(COLOUR % (0.3, 0.75)), reference)
        x, y, width, height = self.box(".strip-view")
        for kind, at in (("mousePressed", 1), ("mouseMoved", 0.25), ("mouseReleased", 0.25)):
            self.page.mouse(kind, x + width * at - 1, y + height / 2, button="left", clickCount=1)
        self.assertAlmostEqual(self.page.evaluate("study.scenes[0].images.strip.split"), 0.25, delta=0.01)

    def test_zoom_is_that_of_all_images(self):
        cell = """(() => { const c = document.querySelectorAll('.cell canvas')[0], t = document.createElement('canvas');
            t.width = t.height = 1; const x = t.getContext('2d', { willReadFrequently: true });
            x.drawImage(c, -c.width / 4, -c.height / 4); return [...x.getImageData(0, 0, 1, 1).data]; })()"""
        frame = "new Promise((resolve) => setTimeout(resolve, 100))"
        before = self.page.evaluate(cell)
        self.page.evaluate("document.querySelector('.strip-view').focus()")
        for key in ("+", "+", "+", "ArrowDown", "ArrowLeft"):
            self.page.key(key)
        self.page.evaluate(frame)
        zoom, centre = self.page.evaluate("[study.scenes[0].images.strip.zoom, study.scenes[0].images.strip.centre]")
        self.assertEqual(zoom, 8)
        self.assertGreater(centre[1], 0.5)
        self.assertLess(centre[0], 0.5)
        self.assertNotEqual(self.page.evaluate(cell), before)
        self.page.key("0")
        self.page.evaluate(frame)
        self.assertEqual(self.page.evaluate(cell), before)

    def test_signed_error_is_that_of_the_pixels(self):
        self.click("input[name=shown][value=error]")
        texts = self.page.evaluate("""study.scenes[0].images.update().then(() => {
            const images = study.scenes[0].images, strip = images.strip, point = images.points[0], n = strip.layers[0].width;
            const base = 1 + 3 * images.points.indexOf(point);
            return Promise.all([strip.need(base), strip.need(base + 1)]).then(([image, map]) => {
                const y = (l, p) => { const v = l.radiance(p); return 0.212671 * v[0] + 0.715160 * v[1] + 0.072169 * v[2]; };
                const reference = strip.layers[0], pixels = n * reference.height;
                let mean = 0;
                for (let p = 0; p < pixels; ++p) mean += y(reference, p) / pixels;
                const found = [];
                for (let p = 0; p < pixels; p += 7) {
                    const r = y(reference, p), e = (y(image, p) - r) / (r + 0.1 * mean);
                    found.push([e, studyParts.decodeError(map.source[4 * p], study.study.code), map.text(p % n, Math.floor(p / n))]);
                }
                return found; }); })""")
        self.click("input[name=shown][value=image]")
        self.assertGreater(max(abs(e) for e, *_ in texts), 0.1)
        for exact, coded, text in texts:
            self.assertAlmostEqual(coded, exact, delta=0.06 * abs(exact) + 0.015)
            self.assertTrue(text.endswith(" %"))

    def test_maps_are_coloured_by_the_range(self):
        self.click("input[name=shown][value=error]")
        self.page.evaluate("study.choose(study.scenes[0].scene.points[0], 'left'); study.scenes[0].images.update().then(() => true)")
        self.assertNotEqual(self.page.evaluate("getComputedStyle(document.querySelector('.map-scale')).display"), "none")
        self.set_slider("input[name=split]", 1)
        self.set_slider("input[name=range]", 1)
        pale = self.page.evaluate(COLOUR % (0.3, 0.75))
        self.set_slider("input[name=range]", -2)
        self.assertLess(min(self.page.evaluate(COLOUR % (0.3, 0.75))), min(pale))
        self.click("input[name=shown][value=flip]")
        self.page.evaluate("study.scenes[0].images.update().then(() => true)")
        self.assertIn("FLIP", self.page.evaluate("study.scenes[0].images.strip.layers[study.scenes[0].images.strip.left].name"))
        self.click("input[name=shown][value=image]")

    def test_shrunk_images_lie_where_whole_ones_do(self):
        # Compares a picture of 5 x 4 pixels with one whose pixels each cover 2 x 2 of them, both in two colours.
        found = self.page.evaluate("""(() => {
            const picture = (w, h, right) => { const c = document.createElement('canvas'), t = c.getContext('2d');
                c.width = w; c.height = h; t.fillStyle = '#f00'; t.fillRect(0, 0, w, h);
                t.fillStyle = '#00f'; t.fillRect(right, 0, w - right, h); return c.toDataURL(); };
            const element = document.body.appendChild(document.createElement('div'));
            const small = imageStrip(element, [{ name: 'a', kind: 'picture', src: picture(5, 4, 2) },
                { name: 'b', kind: 'picture', src: picture(3, 2, 1), factor: 2 }], { left: 0, right: 1 });
            return small.ready.then(() => {
                const rows = [0, 1].map((i) => { const c = document.createElement('canvas'); c.width = 500; c.height = 400;
                    small.paint(c, i, 0, 500);
                    const row = c.getContext('2d').getImageData(0, 200, 500, 1).data;
                    return [10, 190, 210, 490].map((x) => [...row.slice(4 * x, 4 * x + 4)]); });
                element.remove();
                return rows; }); })()""")
        red, blue = [255, 0, 0, 255], [0, 0, 255, 255]
        self.assertEqual(found, [[red, red, blue, blue]] * 2)

    def test_exposure_is_equal_on_both_sides(self):
        self.page.evaluate("study.choose(null, 'left', study.scenes[0].scene); study.scenes[0].images.update().then(() => true)")
        self.set_slider("input[name=split]", 0.5)
        for stops in (-1, 2):
            self.page.evaluate(f"study.scenes[0].images.strip.expose({stops})")
            whole = [self.page.evaluate(COLOUR % (u, 0.75)) for u in (0.499, 0.501)]
            self.assertLess(max(abs(a - b) for a, b in zip(*whole)), 40)

    # Numbers.

    def test_table_has_every_point_and_sorts(self):
        rows = lambda: self.page.evaluate("[...document.querySelectorAll('.points tbody tr')].map((r) => [...r.cells].map((c) => c.textContent))")
        heads = self.page.evaluate("[...document.querySelectorAll('.points th')].map((c) => c.textContent)")
        self.assertEqual(heads, ["scene", "★", "method", "photons", "gatherrays", "spp", "seconds", "error", "bias", "noise",
                                 "bias share", "FLIP", "mean / reference"])
        self.assertEqual(len(rows()), 2 * POINTS)
        for name, key in (("seconds", "seconds"), ("error", "error")):
            self.click(f".points th:nth-child({heads.index(name) + 1}) button")
            up = self.page.evaluate(f"study.table.rows.map((r) => r.point.{key})")
            self.click(f".points th:nth-child({heads.index(name) + 1}) button")
            down = self.page.evaluate(f"study.table.rows.map((r) => r.point.{key})")
            self.assertIn(sorted(up), (up, down))
            self.assertEqual(down, up[::-1])
        column = heads.index("photons")
        self.click(f".points th:nth-child({column + 1}) button")
        self.assertEqual([r[column] for r in rows()], ["300"] * 4 + ["3000"] * 4 + [""] * 6)
        self.assertEqual(self.page.evaluate("document.querySelectorAll('th[aria-sort=ascending]').length"), 1)
        self.click(".points tbody tr", 0)
        self.assertIn("photons=300", " ".join(str(s) for s in self.chosen() +
                      self.page.evaluate("[study.scenes[1].images.left.settings]")))

    def test_origin_and_description_are_on_the_page(self):
        text = self.page.evaluate("document.body.textContent")
        for part in ("lucerna study study.toml -o out", "lucerna 0.1.0", "processor", self.results["dates"][0],
                     "path, spp=128", 'set = "photons=300|3000 gatherrays=1"'):
            self.assertIn(part, text)
        self.assertEqual(self.text("h1"), "Two ways, <twice>")

    def test_both_schemes_are_legible(self):
        contrast = """(() => {
            const parse = (c) => c.match(/[\\d.]+/g).slice(0, 3).map((v) => v / 255).map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
            const light = (c) => { const [r, g, b] = parse(c); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
            const ground = light(getComputedStyle(document.body).backgroundColor);
            const ratio = (c) => { const y = light(c); return (Math.max(y, ground) + 0.05) / (Math.min(y, ground) + 0.05); };
            const texts = ['body', '.hint', '.axis .tick text', '.axis-name', 'th', '.level-name, body'];
            const of = (s) => { const e = document.querySelector(s), c = getComputedStyle(e); return e.namespaceURI.endsWith('svg') ? c.fill : c.color; };
            const probe = document.body.appendChild(document.createElement('i'));
            const marks = [...Array(8).keys()].map((i) => { probe.style.color = `var(--method-${i})`; return ratio(getComputedStyle(probe).color); });
            probe.remove();
            return [Math.min(...texts.map((s) => ratio(of(s)))), Math.min(...marks)]; })()"""
        for scheme in ("light", "dark"):
            self.page._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            text, marks = self.page.evaluate(contrast)
            self.assertGreater(text, 4.5, scheme)
            self.assertGreater(marks, 2.8, scheme)
        self.page._call("Emulation.setEmulatedMedia", features=[])


class OneSeed(unittest.TestCase):
    """Nothing is told of bias where nothing is known."""

    def test_page_has_one_plot(self):
        with tempfile.TemporaryDirectory() as folder:
            description = DESCRIPTION.replace("seeds = 3", "seeds = 1").replace("|3000", "")
            file, results = make_study(pathlib.Path(folder), description)
            with chromium.Page(file, seconds=120) as page:
                page.evaluate("study.ready.then(() => true)")
                self.assertEqual(page.evaluate("document.querySelectorAll('figure').length"), 2)  # one for each scene
                self.assertNotIn("bias share", page.evaluate("document.querySelector('.points').textContent"))
                self.assertEqual(page.troubles, [])


class BrokenPages(unittest.TestCase):
    """What the tests above look at does tell a good page from a bad one."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        description = DESCRIPTION.replace("seeds = 3", "seeds = 1").replace("|3000", "")
        file, _ = make_study(pathlib.Path(cls.folder.name), description)
        cls.good = file.read_text()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def broken(self, old, new, count=1):
        self.assertIn(old, self.good)
        file = pathlib.Path(self.folder.name) / "broken.html"
        file.write_text(self.good.replace(old, new, count))
        return chromium.Page(file, seconds=120)

    def test_linear_axes_are_noticed(self):
        with self.broken("d3.scaleLog()", "d3.scaleLinear()", 2) as page:
            page.evaluate("study.ready.then(() => true)")
            drawn = page.evaluate(PLOT % 0)
            self.assertGreater(furthest_off(drawn["x"], [(s, x) for s, _, x, _, _ in drawn["points"]]), 5)

    def test_missing_library_is_noticed(self):
        with self.broken("// https://d3js.org", "throw 0; // ") as page:
            self.assertNotEqual(page.troubles, [])

    def test_damaged_image_is_noticed(self):
        with self.broken("data:image/png;base64,iVBOR", "data:image/png;base64,iVBAR", 100) as page:
            with self.assertRaises(RuntimeError):
                page.evaluate("study.ready.then(() => true)")

    def test_request_is_noticed(self):
        with self.broken("<h1>", "<img src='http://127.0.0.1:9/x.png'><h1>") as page:
            self.assertNotEqual(page.requests + page.troubles, [])


if __name__ == "__main__":
    if not chromium.browser():
        print("skipped: no Chromium here (scripts/deps.sh installs it)")
        sys.exit(chromium.SKIPPED)
    LUCERNA = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
