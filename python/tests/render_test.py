"""Renders: the same bits as the command's, layers, progress, the interpreter's lock, Ctrl-C, errors."""

import os
import signal
import subprocess
import threading
import time
import unittest
import warnings

import lucerna
import numpy as np
from folder import Folder

COMMAND = os.environ["LUCERNA_COMMAND"]

SCENE = """
Film "rgb" "integer xresolution" [ 24 ] "integer yresolution" [ 16 ]
LookAt 0 1 4  0 1 0  0 1 0
Camera "perspective" "float fov" [ 45 ]
Integrator "path" "integer maxdepth" [ 4 ]
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 8 7 5 ] "string lightgroup" "lamp"
  Translate 0 2.5 0
  Rotate 90 1 0 0
  Shape "disk" "float radius" [ 0.5 ]
AttributeEnd
LightSource "point" "point3 from" [ 1 2 1 ] "rgb I" [ 0.5 0.5 1 ]
Material "diffuse" "rgb reflectance" [ 0.6 0.5 0.4 ]
Shape "trianglemesh" "point3 P" [ -3 0 -3  3 0 -3  3 0 3  -3 0 3 ] "integer indices" [ 0 2 1 0 3 2 ]
Material "conductor" "float roughness" [ 0.1 ]
Shape "sphere" "float radius" [ 0.6 ]
"""


class SceneFile(Folder):
    def setUp(self):
        super().setUp()
        self.file = self.path("scene.pbrt")
        with open(self.file, "w") as out:
            out.write(SCENE)

    def commands(self, *options):
        """The image that the command makes with these options."""
        image = os.path.join(self.folder, "command.exr")
        subprocess.run(
            [COMMAND, "render", self.file, "-o", image, "--quiet", *options], check=True, timeout=100
        )
        return lucerna.read_image(image)

    def require_same(self, ours, theirs):
        self.assertEqual(sorted(ours.channels), sorted(theirs.channels))  # files have their own order
        for name in ours.channels:
            a, b = ours.channel(name), theirs.channel(name)
            self.assertTrue(np.array_equal(a, b, equal_nan=True), name)
        clock = {"lucerna.seconds"}
        self.assertEqual(
            {k: v for k, v in ours.attributes.items() if k not in clock},
            {k: v for k, v in theirs.attributes.items() if k not in clock},
        )


class SameBits(SceneFile):
    def require(self, options, **arguments):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", lucerna.LucernaWarning)
            ours = lucerna.render(lucerna.read_scene(self.file), **arguments)
        self.assertGreater(ours.image.mean(), 0.01)
        theirs = self.commands(*options)
        self.require_same(ours, theirs)

    def test_path(self):
        self.require(["--spp", "8", "--seed", "3", "--no-denoise"], spp=8, seed=3)

    def test_scene_as_it_stands(self):
        self.require(["--no-denoise", "--threads", "1"], threads=1)

    def test_photon_map_with_settings(self):
        self.require(
            "--integrator photonmap --set photons=20000 --set k=30 --set indirect=map --spp 2".split(),
            integrator="photonmap",
            photons=20000,
            k=30,
            indirect="map",
            spp=2,
        )

    def test_igi(self):
        self.require(
            "--integrator igi --set gathersamples=1 --spp 4".split(), integrator="igi", gathersamples=1, spp=4
        )

    def test_progressive_passes(self):
        self.require(
            "--integrator progressive --set photons=2000 --passes 3".split(),
            integrator="progressive",
            photons=2000,
            passes=3,
        )

    def test_layers(self):
        self.require(["--spp", "16", "--layers"], spp=16, layers=True)

    def test_denoised_part_of_the_picture(self):
        self.require(
            ["--spp", "16", "--denoise", "--no-adaptive", "--crop", "4,2,20,14"],
            spp=16,
            denoise=True,
            adaptive=False,
            crop=(4, 2, 20, 14),
        )

    def test_saved_file(self):
        ours = os.path.join(self.folder, "ours.exr")
        lucerna.render(lucerna.read_scene(self.file), spp=2).save(ours)
        self.require_same(lucerna.read_image(ours), self.commands("--spp", "2"))

    def test_another_seed_is_another_image(self):
        scene = lucerna.read_scene(self.file)
        a, b = lucerna.render(scene, spp=2, seed=1), lucerna.render(scene, spp=2, seed=2)
        self.assertFalse(np.array_equal(a.image, b.image))

    def test_a_scene_remembers_nothing_of_a_render(self):
        scene = lucerna.read_scene(self.file)
        before = lucerna.render(scene, spp=2)
        lucerna.render(scene, integrator="photonmap", photons=2000, indirect="map", spp=1, layers=True, crop=(0, 0, 4, 4))
        lucerna.render(scene, maxdepth=1, spp=1)
        self.require_same(lucerna.render(scene, spp=2), before)

    def test_resolution(self):
        scene = lucerna.read_scene(self.file, resolution=(12, 10))
        self.require_same(lucerna.render(scene, spp=2), self.commands("--resolution", "12x10", "--spp", "2"))


class Results(SceneFile):
    def test_shapes_and_names(self):
        result = lucerna.render(lucerna.read_scene(self.file), spp=8, layers=True)
        for array in (result.image, result.variance, result.denoised, result.layers["albedo"]):
            self.assertEqual(array.shape, (16, 24, 3))
            self.assertEqual(array.dtype, np.float32)
        self.assertEqual(result.layers["Z"].shape, (16, 24))
        self.assertEqual(result.report["samples"]["done"], 8)
        self.assertEqual(result.report["settings"]["maxdepth"], 4)
        self.assertTrue(result.complete)
        self.assertEqual(result.attributes["lucerna.unit"], "W/(m^2 sr)")

    def test_without_layers(self):
        result = lucerna.render(lucerna.read_scene(self.file), spp=2)
        self.assertEqual(result.layers, {})
        self.assertIsNone(result.denoised)

    def test_time_chooses_a_method(self):
        began = time.monotonic()
        result = lucerna.render(lucerna.read_scene(self.file), time=3)
        self.assertLess(time.monotonic() - began, 10)
        self.assertIn("choice", result.report)

    def test_picture(self):
        picture = os.path.join(self.folder, "picture.png")
        lucerna.render(lucerna.read_scene(self.file), spp=2, denoise=True).save(picture, exposure=-1)
        with open(picture, "rb") as file:
            self.assertEqual(file.read(4), b"\x89PNG")


LONG = 1 << 20  # samples: hours


class WhileItRenders(SceneFile):
    def test_threads_of_python_go_on(self):
        count, stop = [0], threading.Event()

        def work():
            while not stop.is_set():
                count[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=work)
        thread.start()
        before = count[0]
        lucerna.render(lucerna.read_scene(self.file), "path", time=1.0)
        counted = count[0] - before
        stop.set()
        thread.join()
        # A step takes about a millisecond, or more on a busy machine; with the lock held there would be at
        # most one.
        self.assertGreater(counted, 20)

    def test_progress_is_told(self):
        told = []
        lucerna.render(
            lucerna.read_scene(self.file), spp=64, progress=lambda phase, share: told.append((phase, share))
        )
        self.assertGreater(len(told), 1)
        self.assertTrue(all(isinstance(phase, str) and 0 <= share <= 1 for phase, share in told))
        self.assertEqual(max(share for _, share in told), 1)

    def test_what_progress_raises_ends_it(self):
        def progress(phase, share):
            raise LookupError("enough")

        with self.assertRaisesRegex(LookupError, "enough"):
            lucerna.render(lucerna.read_scene(self.file), spp=LONG, progress=progress)

    def interrupt_soon(self):
        timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        self.addCleanup(timer.join)

    def test_ctrl_c_raises(self):
        scene = lucerna.read_scene(self.file)
        self.interrupt_soon()
        began = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            lucerna.render(scene, spp=LONG)
        self.assertLess(time.monotonic() - began, 20)
        self.assertGreater(lucerna.render(scene, spp=1).image.mean(), 0)

    def test_ctrl_c_keeps_what_there_is(self):
        scene = lucerna.read_scene(self.file)
        self.interrupt_soon()
        result = lucerna.render(scene, spp=LONG, stop="return")
        self.assertFalse(result.complete)
        self.assertLess(result.report["samples"]["done"], LONG)
        self.assertGreater(result.image.mean(), 0)

    def test_a_handler_of_ones_own_counts(self):
        class Own(Exception):
            pass

        def handler(number, frame):
            raise Own

        before = signal.signal(signal.SIGINT, handler)
        self.addCleanup(signal.signal, signal.SIGINT, before)
        self.interrupt_soon()
        with self.assertRaises(Own):
            lucerna.render(lucerna.read_scene(self.file), spp=LONG, stop="return")

    def test_two_threads_render_one_scene(self):
        scene = lucerna.read_scene(self.file)
        alone = [lucerna.render(scene, spp=4, seed=seed).image for seed in (1, 2)]
        both = [None, None]

        def work(i):
            both[i] = lucerna.render(scene, spp=4, seed=i + 1, threads=1).image

        threads = [threading.Thread(target=work, args=(i,)) for i in (0, 1)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for one, other in zip(alone, both):
            self.assertTrue(np.array_equal(one, other))


class Errors(SceneFile):
    def test_is_a_value_error(self):
        self.assertTrue(issubclass(lucerna.InputError, ValueError))
        self.assertTrue(issubclass(lucerna.LucernaWarning, UserWarning))

    def test_missing_file(self):
        with self.assertRaisesRegex(lucerna.InputError, "none.pbrt"):
            lucerna.read_scene(os.path.join(self.folder, "none.pbrt"))

    def test_text_with_a_place(self):
        with self.assertRaisesRegex(lucerna.InputError, r"text\.pbrt:2:\d+: .*Nonsense"):
            lucerna.read_text("WorldBegin\nNonsense 3\n", strict=True)

    def test_unknown_setting(self):
        scene = lucerna.read_scene(self.file)
        with self.assertRaisesRegex(lucerna.InputError, "photon"):
            lucerna.render(scene, integrator="photonmap", photon=10)
        with self.assertRaisesRegex(lucerna.InputError, "photons: .*many"):
            lucerna.render(scene, integrator="photonmap", photons="many")
        with self.assertRaisesRegex(lucerna.InputError, "bdpt"):
            lucerna.render(scene, integrator="bdpt")

    def test_numbers_that_are_none(self):
        scene = lucerna.read_scene(self.file)
        for arguments in ({"spp": 0}, {"time": -1}, {"error": float("nan")}, {"threads": 0}, {"stop": "no"},
                          {"crop": (0, 0, 0, 4)}, {"crop": (0, 0, 99, 4)}, {"passes": 2}):
            with self.assertRaises(lucerna.InputError, msg=str(arguments)):
                lucerna.render(scene, **arguments)

    def test_warnings_are_pythons(self):
        with self.assertWarnsRegex(lucerna.LucernaWarning, "nonsense"):
            lucerna.read_text(SCENE.replace('"float fov"', '"float nonsense" [ 1 ] "float fov"'))


if __name__ == "__main__":
    unittest.main()
