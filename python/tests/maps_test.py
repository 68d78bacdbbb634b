"""Saved photon maps as arrays."""

import os
import subprocess
import unittest

import lucerna
import numpy as np
from folder import Folder

COMMAND = os.environ["LUCERNA_COMMAND"]

# A lamp lights a floor away from the origin; a glass ball casts a caustic.
SCENE = """
LookAt 10 3 -4  10 0 0  0 1 0
Camera "perspective"
Film "rgb" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
Translate 10 0 0
LightSource "point" "rgb I" [ 1 2 3 ] "point3 from" [ 0 2 0 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -1 0 -1  -1 0 1  1 0 1  1 0 -1 ]
Material "dielectric"
Translate 0 0.6 0
Shape "sphere" "float radius" 0.3
"""


class SavedMaps(Folder):
    def test_arrays_are_the_photons(self):
        with open(self.path("room.pbrt"), "w") as file:
            file.write(SCENE)
        words = ["render", "room.pbrt", "-o", "room.exr", "--spp", "1", "--integrator", "photonmap"]
        words += ["--set", "direct=map", "--set", "photons=20000", "--seed", "3", "--save-maps"]
        for file in ("room.photons", "room.ply"):
            subprocess.run(
                [COMMAND, *words, file], check=True, timeout=100, stdout=subprocess.DEVNULL, cwd=self.folder
            )
        read = lucerna.read_photon_maps(self.path("room.photons"))
        self.assertEqual((read.scene, read.unit, read.light_paths), ("room.pbrt", "W", 20000))
        self.assertEqual(read.made_for["seed"], "3")
        self.assertIn("caustic", read.maps)
        self.assertNotIn("volume", read.maps)
        # These are the same photons as in the file for other programs, map after map.
        with open(self.path("room.ply"), "rb") as file:
            head, _, data = file.read().partition(b"end_header\n")
        kinds = [("xyz", "<f4", 3), ("n", "<f4", 3), ("d", "<f4", 3), ("power", "<f4", 3)]
        kinds += [("light", "<i4"), ("map", "u1"), ("bounces", "u1")]
        points = np.frombuffer(data, dtype=kinds)
        for index, name in enumerate(("direct", "global", "caustic", "volume")):
            of_map = points[points["map"] == index]
            if name not in read.maps:
                self.assertEqual(len(of_map), 0)
                continue
            photons = read.maps[name]
            self.assertEqual(len(photons), len(of_map))
            self.assertEqual(photons.positions.dtype, np.float64)
            self.assertTrue(np.array_equal(np.float32(photons.positions), of_map["xyz"]))
            self.assertTrue(np.array_equal(photons.normals, of_map["n"]))
            self.assertTrue(np.array_equal(photons.directions, of_map["d"]))
            self.assertTrue(np.array_equal(photons.powers, of_map["power"]))
            self.assertTrue(np.array_equal(photons.lights, of_map["light"]))
            self.assertTrue(np.array_equal(photons.bounces, of_map["bounces"]))
        # The photons lie on the floor, at x = 10. Half of the lamp's light goes down, and some of it meets
        # the floor.
        self.assertTrue(np.allclose(read.maps["direct"].positions.mean(axis=0), (10, 0, 0), atol=0.05))
        share = read.maps["direct"].powers.sum(axis=0) / (4 * np.pi * np.array([1, 2, 3]))
        self.assertTrue(np.all((share > 0.02) & (share < 0.2)))

    def test_other_files_are_refused(self):
        with open(self.path("room.photons"), "w") as file:
            file.write("no maps")
        with self.assertRaisesRegex(lucerna.InputError, "not a file of photon maps"):
            lucerna.read_photon_maps(self.path("room.photons"))
        with self.assertRaisesRegex(lucerna.InputError, "no such file"):
            lucerna.read_photon_maps(self.path("none.photons"))


if __name__ == "__main__":
    unittest.main()
