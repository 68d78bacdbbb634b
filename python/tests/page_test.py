"""The page docs/howto/python.md: its snippets run as they stand, one after the other."""

import contextlib
import io
import os
import re
import subprocess
import tempfile
import unittest
import warnings

COMMAND = os.environ["LUCERNA_COMMAND"]
PAGE = os.path.join(os.path.dirname(__file__), "../../docs/howto/python.md")

ROOM = """
Film "rgb" "integer xresolution" 200 "integer yresolution" 150 "string filename" "room.exr"
LookAt 0 1 3  0 1 0  0 1 0
Camera "perspective" "float fov" 60
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 9 9 9 ]
  Translate 0 1.9 0
  Rotate 90 1 0 0
  Shape "disk" "float radius" 0.4
AttributeEnd
Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
Shape "trianglemesh" "point3 P" [ -2 0 -2  2 0 -2  2 0 2  -2 0 2 ] "integer indices" [ 0 2 1 0 3 2 ]
"""


def snippets(text):
    """Each as the line it begins on, and its text."""
    return [
        (text[: m.start(1)].count("\n"), m.group(1)) for m in re.finditer(r"^```python\n(.*?)^```$", text, re.M | re.S)
    ]


class Page(unittest.TestCase):
    def test_snippets_run(self):
        import lucerna
        import numpy as np

        with open(PAGE) as file:
            found = snippets(file.read())
        self.assertGreater(len(found), 4)
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            self.addCleanup(os.chdir, before)
            with open("room.pbrt", "w") as file:
                file.write(ROOM)
            lucerna.LightField.from_array(
                np.full((8, 8, 16, 16), 1.0), (1e-3, 1e-3), (2e-3, 2e-3), 0.02, "lm"
            ).save("led.exr")
            subprocess.run(
                [COMMAND, "light", "emit", "led.exr", "--rays", "20000", "-o", "my-led.tm25ray", "--quiet"],
                check=True, timeout=60,
            )
            words = "room.pbrt --resolution 8x6 --integrator photonmap --set photons=20000 --spp 1 --quiet".split()
            subprocess.run(
                [COMMAND, "render", *words, "-o", "maps.exr", "--save-maps", "room.photons"], check=True, timeout=60
            )
            names = {}
            for line, text in found:
                # Line numbers of an error are those of the page.
                code = compile("\n" * line + text, PAGE, "exec")
                with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
                    warnings.simplefilter("error", lucerna.LucernaWarning)
                    exec(code, names)
            self.assertEqual(names["image"].shape, (48, 64, 3))
            self.assertAlmostEqual(names["dimmed"].flux / names["lamp"].flux, 0.5, places=4)
            self.assertGreater(names["flux"], 0.85 * names["lamp"].flux)
            os.chdir(before)


if __name__ == "__main__":
    unittest.main()
