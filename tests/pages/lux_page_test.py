#!/usr/bin/env python3
"""Tests the report of `lucerna lux` in a browser: its numbers are those of the CSV, its plan shows them at their places, all
text is legible in light and dark, and the page makes no network requests.  Usage: lux_page_test.py LUCERNA"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import chromium

# Under an isotropic point light, E = I h / d³. The surface's name contains characters that a page must escape.
SCENE = """
Option "string unit" "photometric"
LookAt 0 -4 3  0 0 0  0 0 1
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 120 "integer yresolution" 80
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "bilinearmesh" "point3 P" [ -2 -1 0  2 -1 0  -2 1 0  2 1 0 ]
LightSource "point" "rgb I" [ 300 300 300 ] "point3 from" [ 1 0.5 2 ]
CalculationSurface "<b>desk</b> & chair" "point3 P" [ -2 -1 0  2 -1 0  -2 1 0 ] "integer points" [ 8 4 ]
"""

LUCERNA = None

# Computes the least of WCAG's contrast ratios against the background of the nearest ancestor that is not transparent.
CONTRAST = """(() => {
            const linear = v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
            const numbers = c => (c.match(/[\\d.]+/g) || []).map(Number);
            const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
            const behind = e => { for (; e; e = e.parentElement) { const c = numbers(getComputedStyle(e).backgroundColor);
                if (c.length === 3 || c[3] > 0) return c; } return [255, 255, 255]; };
            return Math.min(...[...document.querySelectorAll('h1, h2, td, th, p')].filter(e => e.textContent.trim()).map(e => {
                const a = luminance(numbers(getComputedStyle(e).color)), b = luminance(behind(e));
                return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05); })); })()"""


def expect_contrast(test):
    for scheme in ("light", "dark"):
        test.page.prefer(scheme)
        test.assertGreater(test.page.evaluate(CONTRAST), 4.5, scheme)
    test.page.prefer("light")


class LuxPage(chromium.PageCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        (folder / "scene.pbrt").write_text(SCENE)
        subprocess.run([LUCERNA, "render", "scene.pbrt", "--spp", "2", "-o", "seen.exr", "--quiet"], cwd=folder, check=True)
        subprocess.run([LUCERNA, "lux", "scene.pbrt", "--samples", "4", "-o", "lux.csv", "--html", "lux.html",
                        "--picture", "seen.exr"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        with open(folder / "lux.csv", encoding="utf-8") as file:
            cls.points = list(csv.DictReader(file))
        cls.page = chromium.Page(folder / "lux.html").__enter__()

    def test_the_table_has_the_numbers_of_the_points(self):
        rows = self.page.evaluate("[...document.querySelector('.wide table').rows].map(r => [...r.cells].map(c => c.textContent))")
        self.assertEqual(rows[1][0], "<b>desk</b> & chair")
        values = [float(point["E [lx]"]) for point in self.points]
        self.assertEqual(len(values), 32)
        for point, value in zip(self.points, values):
            x, y = float(point["x"]) - 1, float(point["y"]) - 0.5
            self.assertAlmostEqual(value, 300 * 2 / (x * x + y * y + 4) ** 1.5, delta=1e-3 * value)
        for text, value in zip(rows[1][4:9], (sum(values) / 32, min(values), max(values), min(values) / (sum(values) / 32),
                                              min(values) / max(values))):
            self.assertAlmostEqual(float(text.split()[0]), value, delta=0.01 * value)

    def test_the_plan_has_a_cell_for_each_point_and_its_number_in_it(self):
        # The greatest number is in the upper right of the plan, where the lamp is.
        numbers = self.page.evaluate(
            "(() => { const svg = document.querySelector('figure svg').getBoundingClientRect();"
            "return [...document.querySelectorAll('figure svg text')].map(t => { const b = t.getBoundingClientRect();"
            "return [t.textContent, (b.left + b.right) / 2 - svg.left, (b.top + b.bottom) / 2 - svg.top]; }); })()")
        brightest = max(float(point["E [lx]"]) for point in self.points)
        at = [n for n in numbers if n[0].strip() == f"{brightest:.0f}" or n[0].strip() == f"{brightest:.1f}"]
        self.assertTrue(at, numbers)
        darkest = min(float(point["E [lx]"]) for point in self.points)
        low = [n for n in numbers if n[0].strip() == f"{darkest:.0f}" or n[0].strip() == f"{darkest:.1f}"]
        self.assertTrue(low, numbers)
        self.assertTrue(any(b[1] > d[1] and b[2] < d[2] for b in at for d in low), (at, low))

    def test_the_plan_of_a_level_surface_has_the_lamp_also_where_the_model_has_no_lines(self):
        self.assertEqual(self.page.evaluate("document.querySelectorAll('circle.lamp').length"), 1)
        self.assertEqual(self.page.evaluate("document.querySelectorAll('path.section').length"), 0)

    def test_drawings_and_texts_stay_inside_the_page(self):
        self.assertTrue(self.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"))
        self.assertTrue(self.page.evaluate(
            "[...document.querySelectorAll('figure svg')].every(svg => { const all = svg.getBoundingClientRect();"
            "return [...svg.querySelectorAll('text')].every(t => { const b = t.getBoundingClientRect();"
            "return b.left >= all.left - 1 && b.right <= all.right + 1 && b.top >= all.top - 1 && b.bottom <= all.bottom + 1;"
            "}); })"))

    def test_the_picture_is_there(self):
        self.assertEqual(self.page.evaluate("[...document.images].map(i => [i.complete, i.naturalWidth])"), [[True, 120]])

    def test_all_text_has_contrast_in_light_and_in_dark(self):
        expect_contrast(self)


# A closed room of 4 m x 3 m x 2.5 m with a table, lit by a photometric file.
ROOM = """
Option "string unit" "photometric"
LookAt 0.5 0.5 1.5  3 2 1  0 0 1
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 120 "integer yresolution" 80
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "bilinearmesh" "point3 P" [ 0 0 0  4 0 0  0 3 0  4 3 0 ]
Shape "bilinearmesh" "point3 P" [ 0 0 2.5  4 0 2.5  0 3 2.5  4 3 2.5 ]
Shape "bilinearmesh" "point3 P" [ 0 0 0  4 0 0  0 0 2.5  4 0 2.5 ]
Shape "bilinearmesh" "point3 P" [ 0 3 0  4 3 0  0 3 2.5  4 3 2.5 ]
Shape "bilinearmesh" "point3 P" [ 0 0 0  0 3 0  0 0 2.5  0 3 2.5 ]
Shape "bilinearmesh" "point3 P" [ 4 0 0  4 3 0  4 0 2.5  4 3 2.5 ]
Shape "trianglemesh" "point3 P" [ 1 1 0.6  2 1 0.6  2 2 0.6  1 2 0.6  1 1 0.74  2 1 0.74  2 2 0.74  1 2 0.74 ]
    "integer indices" [ 0 2 1 0 3 2 4 5 6 4 6 7 0 1 5 0 5 4 2 3 7 2 7 6 1 2 6 1 6 5 0 4 7 0 7 3 ]
LightSource "photometric" "string filename" "lamp.ies" "point3 from" [ 2 1.5 2.45 ] "point3 to" [ 2 1.5 0 ]
CalculationSurface "desk" "point3 P" [ 0.5 0.5 0.75  3.5 0.5 0.75  0.5 2.5 0.75 ]
"""
LAMP = """IESNA:LM-63-2002
[LUMCAT] <Panel>
TILT=NONE
1 -1 1 3 1 1 2 0.6 0.6 0
1 1 25
0 45 90
0
900 640 0
"""


class LuxReport(chromium.PageCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        (folder / "room.pbrt").write_text(ROOM)
        (folder / "lamp.ies").write_text(LAMP)
        (folder / "tasks.csv").write_text("reference,task,Em,U0,UGR,walls,ceiling,Ez,modelling\n9.9,<reading>,20,0.1,99,1,1,1,0.1-5\n")
        subprocess.run([LUCERNA, "light", "ugr", "lamp.ies", "-o", "ugr.csv", "--quiet"], cwd=folder, check=True)
        subprocess.run([LUCERNA, "lux", "room.pbrt", "--samples", "4", "--require", "tasks.csv#9.9,UGR=1", "--hours", "2000",
                        "--maintenance-factor", "0.8", "--json", "lux.json", "--about", "Project=<i>Hall</i>", "--html", "report.html", "--pdf", "report.pdf"],
                       cwd=folder, check=True, stdout=subprocess.DEVNULL)
        cls.pdf = (folder / "report.pdf").read_bytes()
        cls.page = chromium.Page(folder / "report.html").__enter__()

    def count(self, selector):
        return self.page.evaluate(f"document.querySelectorAll('{selector}').length")

    def test_the_head_and_the_maintenance_factor_are_there(self):
        self.assertEqual(self.page.evaluate("document.querySelector('.about td').textContent"), "<i>Hall</i>")
        self.assertIn("maintenance factor 0.8", self.page.evaluate("document.body.textContent"))

    def test_each_requirement_has_a_marked_result(self):
        # Em and U0 of the desk, mean and uniformity of 4 walls, the ceiling and the cylinders, modelling, 4 observers.
        self.assertEqual(self.count("td.met") + self.count("td.missed") + self.count("td.undecided"), 2 + 2 * 6 + 1 + 4)
        self.assertEqual(self.count("td.missed"), 4)  # UGR above 1

    def rows(self):
        return self.page.evaluate("[...document.querySelectorAll('tr')].map(r => [...r.cells].map(c => c.textContent))")

    def row_under(self, heading):
        rows = self.rows()
        return rows[[row[-1] for row in rows].index(heading) + 1]

    def test_the_task_of_the_table_is_named(self):
        self.assertIn("Required: 9.9 <reading>.", self.page.evaluate("document.body.textContent"))

    def test_the_luminaire_has_its_article_height_rating_and_aim(self):
        facts = dict(row for row in self.rows() if len(row) == 2)
        self.assertEqual(facts["article"], "<Panel>")
        self.assertEqual(facts["mounting height"], "2.45 m")
        with open(pathlib.Path(self.folder.name) / "ugr.csv", encoding="utf-8") as file:
            stated = {row["view"]: float(row["UGR for the lamp flux"]) for row in csv.DictReader(file)
                      if (row["X [H]"], row["Y [H]"], row["ceiling"], row["walls"]) == ("4", "8", "0.7", "0.5")}
        self.assertEqual(facts["UGR, 4H × 8H, 70/50/20"],
                         f"{stated['crosswise']:.1f} crosswise, {stated['endwise']:.1f} endwise")
        place = next(row for row in self.rows() if len(row) == 8 and row[0] == "L1 lamp.ies" and row[1] == "–")
        self.assertEqual(place[5], "(0, 0, -1)")
        self.assertIn(place[6], ("(2, 1.5, 0)", "(2, 1.5, 0.74)"))  # at the edge of the table

    def test_the_energy_is_that_of_25_watts_in_12_square_metres(self):
        room, luminaires, power, density, mean, of_100_lx, year, leni = self.row_under("LENI [kWh/m²]")
        self.assertEqual((luminaires, power, density, year, leni), ("1", "25", "2.08", "50", "4.2"))
        lux = json.loads((pathlib.Path(self.folder.name) / "lux.json").read_text())["surfaces"][0]["mean"]["value"]
        self.assertAlmostEqual(float(mean), lux, delta=0.06)
        self.assertAlmostEqual(float(of_100_lx), 25 / 12 / lux * 100, delta=0.006)

    def test_the_luminaire_has_a_polar_diagram_its_power_and_its_number(self):
        self.assertEqual(self.count("path.polar"), 2)
        row = self.page.evaluate("[...document.querySelectorAll('tr')].map(r => [...r.cells].map(c => c.textContent))"
                                 ".find(r => r[0] === 'L1 lamp.ies')")
        self.assertEqual(row[1:3], ["photometric", "1"])
        self.assertEqual(row[5], "25")

    def test_the_plan_has_the_table_the_walls_and_the_luminaire(self):
        boxes = self.page.evaluate("[...document.querySelector('figure svg').closest('body').querySelectorAll('path.section')].slice(0, 2)"
                                   ".map(p => { const b = p.getBBox(); return [b.width, b.height]; })")
        self.assertEqual(len(boxes), 2)
        self.assertAlmostEqual(boxes[0][0] / boxes[1][0], 1, delta=0.01)  # both have the walls
        self.assertAlmostEqual(boxes[1][0] / boxes[1][1], 3 / 4, delta=0.02)  # as seen in pbrt's left-handed world: y to the right
        self.assertGreater(self.count("rect.luminaire"), 0)

    def test_drawings_stay_inside_the_page(self):
        self.assertTrue(self.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"))

    def test_all_text_has_contrast_in_light_and_in_dark(self):
        expect_contrast(self)

    def test_the_assumptions_are_there(self):
        self.assertIn("observers before the middle of each wall", self.page.evaluate("document.querySelector('ul').textContent"))

    def test_without_a_browser_there_is_one_line_and_no_file(self):
        folder = pathlib.Path(self.folder.name)
        done = subprocess.run([LUCERNA, "lux", "room.pbrt", "--samples", "1", "--pdf", "none.pdf"], cwd=folder, capture_output=True, text=True,
                              env={"PATH": str(folder)})
        self.assertEqual(done.returncode, 1)
        self.assertIn("--pdf: a PDF is printed by a browser, and none of chromium, ", done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1)
        self.assertFalse((folder / "none.pdf").exists())

    def test_the_pdf_is_one(self):
        self.assertTrue(self.pdf.startswith(b"%PDF"))
        self.assertGreater(len(self.pdf), 20000)


if __name__ == "__main__":
    if not chromium.browser():
        print("skipped: no Chromium here (scripts/deps.sh installs it)")
        sys.exit(chromium.SKIPPED)
    LUCERNA = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
