"""Scenes built in memory are those of the same text, bit for bit."""

import unittest

import lucerna
import numpy as np

VERTICES = np.array([[-1, 0, -1], [1, 0, -1.1], [1.3, 0.1, 1], [-1, 0, 1 / 3]])
TRIANGLES = np.array([[0, 2, 1], [0, 3, 2]])
NORMALS = np.array([[0, 1, 0], [0.1, 1, 0], [0, 1, 0.1], [0, 1, 0]])
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)


def numbers(array):
    return " ".join(repr(x) for x in np.asarray(array).ravel().tolist())


TEXT = f"""
Film "rgb" "integer xresolution" 20 "integer yresolution" 12
LookAt 0 2 4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Integrator "path" "integer maxdepth" 3
WorldBegin
LightSource "infinite" "rgb L" [ 0.2 0.2 0.3 ]
LightSource "point" "point3 from" [ 1 3 0.1 ] "blackbody I" 3000 "float power" 100
Texture "checks" "spectrum" "checkerboard" "float uscale" 4 "float vscale" 4 "rgb tex1" [ 0.1 0.2 0.3 ] "rgb tex2" [ 0.9 0.8 0.7 ]
AttributeBegin
  Material "diffuse" "texture reflectance" "checks"
  Translate 0 -0.5 0
  Shape "trianglemesh" "point3 P" [ {numbers(VERTICES)} ] "integer indices" [ {numbers(TRIANGLES)} ]
    "normal3 N" [ {numbers(NORMALS)} ] "point2 uv" [ {numbers(UV)} ]
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 4 4 4 ] "bool twosided" true
  Translate 0 1 0
  Shape "trianglemesh" "point3 P" [ 0 0 0  0.5 0 0  0 0.5 0 ] "integer indices" [ 0 1 2 ]
AttributeEnd
"""


def built():
    b = lucerna.SceneBuilder()
    b.film(xresolution=20, yresolution=12)
    b.look_at((0, 2, 4), (0, 0, 0), (0, 1, 0))
    b.camera("perspective", fov=40)
    b.integrator("path", maxdepth=3)
    b.light_source("infinite", L=(0.2, 0.2, 0.3))
    b.light_source("point", I=lucerna.blackbody(3000), power=100, from_=(1, 3, 0.1))
    b.texture("checks", "checkerboard", uscale=4, vscale=4, tex1=(0.1, 0.2, 0.3), tex2=(0.9, 0.8, 0.7))
    with b.attributes():
        b.material("diffuse", reflectance=lucerna.texture("checks"))
        b.translate(0, -0.5, 0)
        b.mesh(VERTICES, TRIANGLES, normals=NORMALS, uv=UV)
    with b.attributes():
        b.area_light_source("diffuse", L=(4, 4, 4), twosided=True)
        b.translate(0, 1, 0)
        b.mesh([[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0]], [[0, 1, 2]])
    return b


class Builder(unittest.TestCase):
    def test_same_bits_as_text(self):
        ours = lucerna.render(built().scene(strict=True), spp=8)
        theirs = lucerna.render(lucerna.read_text(TEXT, strict=True), spp=8)
        self.assertGreater(ours.image.mean(), 0.01)
        for name in ours.channels:
            self.assertTrue(np.array_equal(ours.channel(name), theirs.channel(name)), name)

    def test_arrays_of_any_layout(self):
        b = lucerna.SceneBuilder()
        b.film(xresolution=8, yresolution=8)
        b.camera(fov=60)
        b.light_source("infinite")
        b.mesh(
            np.asfortranarray(VERTICES.astype(np.float32) + [0, 0, 4], dtype=np.float32),
            TRIANGLES.astype(np.uint8)[:, ::-1],
            uv=UV.tolist(),
        )
        self.assertGreater(lucerna.render(b.scene(strict=True), spp=2).image.mean(), 0)

    def test_one_array_may_change_afterwards(self):
        vertices = VERTICES.copy()
        b = built()
        b.mesh(vertices, TRIANGLES)
        before = lucerna.render(b.scene(), spp=2).image
        vertices[:] = 0
        self.assertTrue(np.array_equal(lucerna.render(b.scene(), spp=2).image, before))

    def test_what_is_no_mesh(self):
        for arguments in (
            (VERTICES[:, :2], TRIANGLES),
            (VERTICES, TRIANGLES + 0.5),
            (VERTICES, TRIANGLES + 2),
            (VERTICES, TRIANGLES - 1),
            (VERTICES, TRIANGLES[:0]),
            (VERTICES, TRIANGLES, NORMALS[:2]),
            (VERTICES, TRIANGLES, None, UV[:3]),
            (VERTICES * np.nan, TRIANGLES),
        ):
            with self.assertRaises(lucerna.InputError, msg=repr(arguments)):
                b = lucerna.SceneBuilder()
                b.mesh(*arguments)
                b.scene()

    def test_text_is_quoted(self):
        b = lucerna.SceneBuilder()
        b.light_source("infinite", filename='a "quoted" \\ name.exr')
        self.assertIn(r'"a \"quoted\" \\ name.exr"', b.text)
        with self.assertRaises(lucerna.InputError):
            b.light_source("infinite", filename="a\nb")

    def test_numbers_are_exact(self):
        for number in (0.1, 1 / 3, 1e-300, -2.5e17, np.float64(np.pi)):
            b = lucerna.SceneBuilder()
            b.shape("sphere", radius=number)
            word = b.text.split("[ ")[1].split(" ]")[0]
            self.assertEqual(float(word), float(number))
        with self.assertRaises(lucerna.InputError):
            lucerna.SceneBuilder().shape("sphere", radius=float("inf"))

    def test_matrix_is_pbrts(self):
        b = lucerna.SceneBuilder()
        m = np.eye(4)
        m[:3, 3] = 1, 2, 3
        b.transform(m)
        self.assertEqual(b.text.strip(), "Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1 ]")

    def test_unknown_parameter_is_said(self):
        b = built()
        b.shape("sphere", radious=1)
        with self.assertRaisesRegex(lucerna.InputError, "radius"):
            b.scene(strict=True)


if __name__ == "__main__":
    unittest.main()
