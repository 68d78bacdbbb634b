# Run by Blender: blender -b --factory-startup -P blender_test.py -- COMMAND DATA WORK
# The add-on blender/lucerna_render.py renders scenes of known answer through Blender's own render().
import math
import os
import subprocess
import sys
import time
import unittest

import bpy
import numpy as np
import OpenImageIO as oiio
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

COMMAND, DATA, WORK = sys.argv[sys.argv.index("--") + 1 :][:3]


def new_scene(width=64, height=48):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    enable()
    scene = bpy.context.scene
    scene.render.engine = "LUCERNA"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    scene.world = None
    scene.lucerna.spp, scene.lucerna.denoise, scene.lucerna.layers = 64, False, False
    return scene


def enable():
    if "lucerna_render" not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module="lucerna_render")
    chosen = bpy.context.preferences.addons["lucerna_render"].preferences
    chosen.command = COMMAND


def add(data, name, location=(0, 0, 0), rotation=(0, 0, 0)):
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(obj)
    return obj


def camera(location, target=(0, 0, 0), lens=50):
    data = bpy.data.cameras.new("camera")
    data.lens = lens
    obj = add(data, "camera", location)
    obj.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = obj
    bpy.context.view_layer.update()
    return obj


def light(kind, energy, location=(0, 0, 2), rotation=(0, 0, 0), **more):
    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in more.items():
        setattr(data, name, value)
    return add(data, kind, location, rotation)


def diffuse(grey):
    material = bpy.data.materials.new("diffuse")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (grey, grey, grey, 1)
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def plane(size=1.0, location=(0, 0, 0), material=None):
    bpy.ops.mesh.primitive_plane_add(size=size, location=location)
    obj = bpy.context.object
    obj.data.materials.append(material or diffuse(0.5))
    return obj


def render(name):
    """All channels of Blender's render result, by name: arrays, top row first."""
    path = os.path.join(WORK, name + ".exr")
    bpy.context.scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    file = oiio.ImageInput.open(path)
    spec = file.spec()
    values = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
    file.close()
    return {name: values[..., i] for i, name in enumerate(spec.channelnames)}


def combined(channels):
    key = [name for name in channels if name.endswith("Combined.R")][0][:-1]
    return np.stack([channels[key + c] for c in "RGB"], axis=-1)


def middle(image, half=4):
    h, w = image.shape[:2]
    return float(image[h // 2 - half : h // 2 + half, w // 2 - half : w // 2 + half].mean())


# Looks from above through a long lens: the central 8 x 8 pixels cover 1 cm of the plane.
def above(lens=1000):
    return camera((0.0, -0.001, 3.0), (0, 0, 0), lens)


# Returns the radiance of a diffuse plane of reflectance 1/2 under the irradiance E.
def radiance(irradiance):
    return 0.5 / math.pi * irradiance


class ClosedForms(unittest.TestCase):
    """Irradiance in the middle of a plane, by Blender's units; noise is below the tolerance of 1 %."""

    def expect(self, name, value):
        above()
        self.assertAlmostEqual(middle(combined(render(name))) / value, 1, delta=0.01)

    # At (0, 0.8, 1.5), E = I cos / d2 with I = P / (4 pi).
    def point(self, **more):
        new_scene()
        plane()
        light("POINT", 100, (0, 0.8, 1.5), **more)
        d2 = 0.8**2 + 1.5**2
        return radiance(100 / (4 * math.pi) * 1.5 / math.sqrt(d2) / d2)

    def test_point(self):
        self.expect("point", self.point(shadow_soft_size=0))

    # A Lambertian sphere above the horizon acts as a point of its intensity.
    def test_point_with_radius(self):
        self.expect("sphere", self.point(shadow_soft_size=0.1))

    def test_sun(self):
        new_scene()
        plane()
        light("SUN", 3, rotation=(math.radians(40), 0, 0), angle=0)
        self.expect("sun", radiance(3 * math.cos(math.radians(40))))

    # The spot has full brightness where the cosine exceeds edge + (1 - edge) blend, and is dark outside the
    # cone.
    def test_spot(self):
        new_scene()
        plane(20)
        light("SPOT", 100, (0, 0, 2), spot_size=math.radians(60), spot_blend=0.3, shadow_soft_size=0)
        self.expect("spot", radiance(100 / (4 * math.pi) / 4))

    def test_spot_edge(self):
        new_scene()
        plane(20)
        angle = math.radians(25)
        light("SPOT", 100, (2 * math.tan(angle), 0, 2), spot_size=math.radians(60), spot_blend=0.5, shadow_soft_size=0)
        edge = math.cos(math.radians(30))
        t = (math.cos(angle) - edge) / ((1 - edge) * 0.5)
        self.expect("spot-edge", radiance(100 / (4 * math.pi) * t * t * (3 - 2 * t) * math.cos(angle) ** 3 / 4))

    # A parallel disk of radius r at the height h has E = pi L r2 / (r2 + h2) with L = P / (4 A), as in
    # Cycles.
    def test_disk(self):
        new_scene()
        plane()
        light("AREA", 100, (0, 0, 1.0), shape="DISK", size=1.0)
        bpy.context.scene.lucerna.spp = 1024
        self.seen_from_the_side("disk", math.pi * 100 / (4 * math.pi * 0.25) * 0.25 / 1.25)

    # A parallel square of half side a stands at the height h, centred over the point.
    def test_square_scaled(self):
        new_scene()
        plane()
        light("AREA", 100, (0, 0, 1.0), shape="SQUARE", size=0.5).scale = (2, 2, 1)
        bpy.context.scene.lucerna.spp = 1024
        a = 0.5
        q = a / math.sqrt(a * a + 1)
        # E = pi L F; F is four times the factor of a quarter seen below its corner, q atan(q) / pi.
        self.seen_from_the_side("square", 4 * 100 / 4 * q * math.atan(q))

    def seen_from_the_side(self, name, irradiance):
        camera((0.0, -3.0, 0.9), (0, 0, 0), 1000)
        self.assertAlmostEqual(middle(combined(render(name))) / radiance(irradiance), 1, delta=0.01)

    # The upper half of a uniform sky lights the plane.
    def test_world(self):
        scene = new_scene()
        plane()
        world(scene, 0.7)
        scene.lucerna.spp = 1024
        self.expect("world", 0.5 * 0.7)

    # A sheet of emission 2 is seen at normal incidence.
    def test_emission(self):
        new_scene()
        plane(material=emitting(2))
        self.expect("emission", 2)

    # The photometric value is the watts times the lumens per watt.
    def test_photometric(self):
        value = self.point(shadow_soft_size=0)
        bpy.context.scene.lucerna.unit = "PHOTOMETRIC"
        bpy.context.scene.lucerna.efficacy = 200
        self.expect("photometric", 200 * value)


def emitting(strength):
    material = diffuse(0.5)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes.new("ShaderNodeEmission")
    shader.inputs["Strength"].default_value = strength
    links.new(shader.outputs[0], nodes["Material Output"].inputs["Surface"])
    return material


def world(scene, strength):
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = strength
    return background


def candela(path, c, gamma):
    """Of an LM-63 file at the nearest angles of its tables."""
    with open(path, encoding="latin-1") as file:
        words = file.read()
    words = words[words.index("TILT=") :].split()[1:]
    numbers = [float(each) for each in words]
    lamps, lumens, multiplier, gammas, planes = numbers[0], numbers[1], numbers[2], int(numbers[3]), int(numbers[4])
    ballast, ballast_lamp = numbers[10], numbers[11]
    values = numbers[13:]
    table_g, table_c = values[:gammas], values[gammas : gammas + planes]
    i = min(range(planes), key=lambda k: abs(table_c[k] - c))
    j = min(range(gammas), key=lambda k: abs(table_g[k] - gamma))
    assert abs(table_g[j] - gamma) < 1e-6 and abs(table_c[i] - c) < 1e-6, (table_c, table_g)
    return values[gammas + planes + i * gammas + j] * multiplier * ballast


IES = os.path.join(DATA, "photometry", "italo-street.ies")


class Lamps(unittest.TestCase):
    # A street lamp shines to one side: C0 along x, C90 along -y, seen at 45 degrees in the lamp's unit.
    def expect(self, turn, c, unit):
        scene = new_scene()
        plane(20)
        lamp = add(None, "lamp", (0, 0, 2), (0, 0, turn))
        lamp.lucerna_lamp.enabled, lamp.lucerna_lamp.file = True, IES
        scene.lucerna.unit = unit
        gamma = math.radians(45)
        # Computes the point of the plane in the direction (C, 45 degrees); C counts clockwise as seen from
        # the lamp.
        azimuth = turn - math.radians(c)
        x, y = 2 * math.tan(gamma) * math.cos(azimuth), 2 * math.tan(gamma) * math.sin(azimuth)
        camera((x, y - 0.001, 3.0), (x, y, 0), 1000)
        e = candela(IES, c, 45) * math.cos(gamma) ** 3 / 4
        if unit == "RADIOMETRIC":
            e /= 683
        self.assertAlmostEqual(middle(combined(render(f"lamp-{c}-{turn:.0f}")), 1) / radiance(e), 1, delta=0.02)

    def test_planes(self):
        for c in (0, 90, 180, 270):
            with self.subTest(c=c):
                self.expect(0, c, "PHOTOMETRIC")

    def test_turned(self):
        self.expect(math.radians(70), 90, "RADIOMETRIC")


class Camera(unittest.TestCase):
    # A small bright sphere lies where Blender's own projection puts it, for any fit, shift, roll and aspect.
    def test_alignment(self):
        for fit, shift, size, kind in (("AUTO", (0, 0), (96, 64), "PERSP"), ("VERTICAL", (0.1, -0.15), (96, 64), "PERSP"),
                                       ("AUTO", (0.05, 0.1), (64, 96), "PERSP"), ("HORIZONTAL", (0, 0.1), (64, 96), "ORTHO")):
            with self.subTest(fit=fit, shift=shift, size=size, kind=kind):
                scene = new_scene(*size)
                view = camera((3, -4, 2))
                view.rotation_euler.y += 0.2
                view.data.sensor_fit, view.data.type = fit, kind
                view.data.shift_x, view.data.shift_y = shift
                view.data.ortho_scale = 3
                bpy.context.view_layer.update()
                bpy.ops.mesh.primitive_uv_sphere_add(radius=0.03, location=(0.3, 0.25, 0.2))
                bpy.context.object.data.materials.append(emitting(1))
                place = world_to_camera_view(scene, view, Vector((0.3, 0.25, 0.2)))
                image = combined(render("camera"))[..., 0]
                self.assertGreater(image.sum(), 0.5)
                h, w = image.shape
                ys, xs = np.mgrid[0:h, 0:w] + 0.5
                self.assertAlmostEqual((image * xs).sum() / image.sum(), place.x * w, delta=0.15)
                self.assertAlmostEqual((image * ys).sum() / image.sum(), (1 - place.y) * h, delta=0.15)

    def test_panorama_is_refused(self):
        new_scene()
        camera((0, 0, 3)).data.type = "PANO"
        with self.assertRaisesRegex(RuntimeError, "panoramic"):
            render("panorama")

    def test_region(self):
        scene = new_scene()
        plane(20, material=emitting(1))
        camera((0, -0.001, 3))
        scene.render.use_border = scene.render.use_crop_to_border = True
        scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.5
        scene.render.border_min_y, scene.render.border_max_y = 0.0, 0.5
        image = combined(render("region"))
        self.assertEqual(image.shape[:2], (24, 16))
        self.assertAlmostEqual(image.mean(), 1, delta=1e-3)


def everything():
    """A cube on a plane, a light of each kind, a placed lamp, light groups, an instance."""
    scene = new_scene()
    scene.render.resolution_x, scene.render.resolution_y = 96, 64
    plane(8)
    for x, metallic, transmission in ((-1.5, 0, 0), (0, 1, 0), (1.5, 0, 0.5)):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(x, 0, 0.5))
        bpy.ops.object.shade_smooth()
        material = bpy.data.materials.new("principled")
        material.use_nodes = True
        shader = material.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (0.8, 0.4, 0.2, 1)
        shader.inputs["Metallic"].default_value = metallic
        shader.inputs["Transmission"].default_value = transmission
        shader.inputs["Roughness"].default_value = 0.3
        bpy.context.object.data.materials.append(material)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(0, -1.5, 0.3))
    cube = bpy.context.object
    collection = bpy.data.collections.new("twins")
    collection.objects.link(cube)
    for x in (-1.5, 1.5):
        twin = add(None, "twin", (x, 0, 0))
        twin.instance_type, twin.instance_collection = "COLLECTION", collection
    bpy.context.scene.view_layers[0].lightgroups.add(name="key light")
    light("AREA", 60, (-2, -2, 3), (0.6, -0.5, 0), shape="RECTANGLE", size=1, size_y=0.5).lightgroup = "key light"
    light("POINT", 40, (2, -2, 2))
    light("SUN", 0.5, rotation=(0.5, 0.3, 0))
    light("SPOT", 60, (0, -3, 3), (0.8, 0, 0), spot_size=0.6)
    lamp = add(None, "lamp", (0, 1.5, 2.5))
    lamp.lucerna_lamp.enabled, lamp.lucerna_lamp.file, lamp.lucerna_lamp.flux = True, IES, 2000
    world(scene, 0.05)
    camera((0, -7, 3.5), (0, -0.3, 0.4), 45)
    return scene


class WholeScene(unittest.TestCase):
    def test_export_is_strict(self):
        everything()
        path = os.path.join(WORK, "everything.pbrt")
        bpy.ops.export_scene.lucerna(filepath=path)
        subprocess.run([COMMAND, "info", "--strict", path], check=True, stdout=subprocess.DEVNULL)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for word in ('"distant"', '"spot"', '"sphere"', '"ies"', '"infinite"', "ObjectInstance", '"key_light"'):
            self.assertIn(word, text)

    def test_passes(self):
        scene = everything()
        scene.lucerna.layers = scene.lucerna.denoise = True
        scene.lucerna.spp = 16
        channels = render("passes")
        of = lambda name: np.stack([channels[next(k for k in channels if k.endswith(f"{name}.{c}"))] for c in "RGB"], -1)
        measured = of("Measured")
        np.testing.assert_array_equal(of("Denoised"), combined(channels))
        self.assertFalse(np.array_equal(measured, combined(channels)))
        parts = sum(of(name) for name in ("Emission", "Direct", "Indirect", "Caustic", "Media"))
        np.testing.assert_allclose(parts, measured, rtol=1e-3, atol=1e-4)
        groups = of("Combined_key light") + of("Combined_default")
        np.testing.assert_allclose(groups, measured, rtol=1e-3, atol=1e-4)
        self.assertGreater(of("Combined_key light").mean(), 0.001)
        normal = np.stack([channels[next(k for k in channels if k.endswith(f"Normal.{c}"))] for c in "XYZ"], -1)
        np.testing.assert_allclose(normal[-1, 0], (0, 0, 1), atol=1e-3)  # the plane, bottom left
        depth = channels[next(k for k in channels if k.endswith("Depth.Z"))]
        self.assertTrue(3 < depth[-1, 0] < 8)
        self.assertEqual(depth[0, 0], np.float32(1e10))
        self.assertTrue(0.4 < of("Albedo")[-1, 0, 0] < 0.6)


class LooseEnds(unittest.TestCase):
    """Nodes to which nothing is linked, or only a reroute without input, behave as in Blender."""

    # The sky of radiance 1 is seen around the plane, so that a missing picture differs from a black plane.
    def expect(self, name, colour):
        world(bpy.context.scene, 1)
        camera((0, -0.001, 3))
        image = combined(render(name))
        np.testing.assert_allclose(image[0, 0], 1, rtol=1e-3)
        np.testing.assert_allclose([middle(image[..., c]) for c in range(3)], colour, rtol=1e-3)

    # Makes a plane whose material's nodes link(nodes, links, surface) changes; surface is the output's socket.
    def plane_of(self, link):
        new_scene()
        material = diffuse(0.5)
        nodes, links = material.node_tree.nodes, material.node_tree.links
        link(nodes, links, nodes["Material Output"].inputs["Surface"])
        plane(0.5, material=material)

    def emission(self, nodes, strength):
        shader = nodes.new("ShaderNodeEmission")
        shader.inputs["Color"].default_value, shader.inputs["Strength"].default_value = (0.5, 1, 0.25, 1), strength
        return shader

    def test_add_shader(self):
        for emitting_inputs in (0, 1, 2):
            def link(nodes, links, surface):
                adding = nodes.new("ShaderNodeAddShader")
                for i in range(emitting_inputs):
                    links.new(self.emission(nodes, 2).outputs[0], adding.inputs[i])
                links.new(adding.outputs[0], surface)

            with self.subTest(emitting_inputs=emitting_inputs):
                self.plane_of(link)
                self.expect(f"add-{emitting_inputs}", [emitting_inputs * c for c in (1, 2, 0.5)])

    def test_mix_shader(self):
        def link(nodes, links, surface):
            mixing = nodes.new("ShaderNodeMixShader")
            mixing.inputs[0].default_value = 0.25
            links.new(self.emission(nodes, 4).outputs[0], mixing.inputs[2])
            links.new(mixing.outputs[0], surface)

        self.plane_of(link)
        self.expect("mix", (0.5, 1, 0.25))

    def test_reroutes(self):
        def link(nodes, links, surface):
            shader = self.emission(nodes, 2)
            for name in ("Color", "Strength"):
                links.new(nodes.new("NodeReroute").outputs[0], shader.inputs[name])
            links.new(shader.outputs[0], surface)

        self.plane_of(link)
        self.expect("reroute-emission", (1, 2, 0.5))
        self.plane_of(lambda nodes, links, surface: links.new(nodes.new("NodeReroute").outputs[0], surface))
        self.expect("reroute-surface", (0, 0, 0))

    def test_reroute_to_coordinates(self):
        def link(nodes, links, surface):
            texture = nodes.new("ShaderNodeTexImage")
            pixels = np.ones((2, 2, 4), dtype=np.float32)
            pixels[..., :3] = 188 / 255
            texture.image = image_of("even.png", pixels, "PNG")
            links.new(nodes.new("NodeReroute").outputs[0], texture.inputs["Vector"])
            links.new(texture.outputs[0], nodes["Diffuse BSDF"].inputs["Color"])

        self.plane_of(link)
        self.expect("reroute-vector", [((188 / 255 + 0.055) / 1.055) ** 2.4] * 3)  # by the definition of sRGB


class Errors(unittest.TestCase):
    def test_own_words(self):
        new_scene()
        plane()
        above()
        bpy.context.scene.lucerna.more_options = "--set nothing=1"
        with self.assertRaisesRegex(RuntimeError, "nothing") as raised:
            render("error")
        self.assertNotIn("read scene", str(raised.exception))

    def test_missing_command(self):
        new_scene()
        above()
        bpy.context.preferences.addons["lucerna_render"].preferences.command = "/nowhere/lucerna"
        with self.assertRaisesRegex(RuntimeError, "/nowhere/lucerna is not found"):
            render("missing")


class Cancel(unittest.TestCase):
    # Esc turns the image so far into the picture.
    def test_esc(self):
        ClosedForms().point(shadow_soft_size=0)
        above()
        bpy.context.scene.lucerna.spp = 10_000_000
        engine = sys.modules["lucerna_render"].LucernaRenderEngine
        start = time.monotonic()
        cancelled = engine.is_cancelled
        engine.is_cancelled = lambda self: time.monotonic() > start + 3
        try:
            image = combined(render("cancel"))
        finally:
            engine.is_cancelled = cancelled
        self.assertLess(time.monotonic() - start, 60)
        d2 = 0.8**2 + 1.5**2
        self.assertAlmostEqual(middle(image) / radiance(100 / (4 * math.pi) * 1.5 / math.sqrt(d2) / d2), 1, delta=0.01)


class Oracle(unittest.TestCase):
    """The same scene by Cycles: means of the picture and of its quarters agree."""

    def both(self, name, tolerance=0.02):
        scene = bpy.context.scene
        scene.lucerna.spp = 256
        ours = combined(render(name))
        scene.render.engine = "CYCLES"
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 256, False, False
        scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = scene.cycles.transmission_bounces = 32
        scene.cycles.sample_clamp_indirect = 0
        scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = True
        scene.cycles.blur_glossy = 0
        theirs = combined(render(name + "-cycles"))
        h, w = ours.shape[0] // 2, ours.shape[1] // 2
        ratios = [ours[y : y + h, x : x + w].mean() / theirs[y : y + h, x : x + w].mean() for y in (0, h) for x in (0, w)]
        print(name, "ours / Cycles, quarters:", [round(float(each), 4) for each in ratios], "whole:", round(float(ours.mean() / theirs.mean()), 4))
        for ratio in ratios:
            self.assertAlmostEqual(float(ratio), 1, delta=tolerance)
        return ours, theirs

    def box(self):
        scene = new_scene(96, 64)
        plane(6)
        bpy.ops.mesh.primitive_cube_add(size=1, location=(-0.8, 0, 0.5), rotation=(0, 0, 0.5))
        bpy.context.object.data.materials.append(diffuse(0.7))
        camera((1, -6, 4), (0, 0, 0.3))
        return scene

    # The spot is narrow, because within the cone Cycles' spots, up to Blender 3, fall with the cosine, and
    # those of EEVEE do not.
    def test_lights(self):
        self.box()
        light("POINT", 40, (2, -1, 2), shadow_soft_size=0.1)
        light("SUN", 0.4, rotation=(0.5, 0.3, 0), angle=0)
        light("SPOT", 100, (0, -2, 3), (0.6, 0, 0), spot_size=0.35, spot_blend=0.4, shadow_soft_size=0)
        light("AREA", 60, (-2, 1, 3), (-0.3, -0.5, 0), shape="ELLIPSE", size=1, size_y=0.5)
        self.both("lights")

    def test_principled(self):
        self.box()
        world(bpy.context.scene, 0.3)
        light("AREA", 100, (-2, -2, 4), (0.4, -0.4, 0), size=2)
        for x, metallic in ((0.7, 0), (2.0, 1)):
            bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(x, 0, 0.5), segments=64, ring_count=32)
            bpy.ops.object.shade_smooth()
            material = bpy.data.materials.new("principled")
            material.use_nodes = True
            shader = material.node_tree.nodes["Principled BSDF"]
            shader.inputs["Base Color"].default_value = (0.7, 0.3, 0.2, 1)
            shader.inputs["Metallic"].default_value = metallic
            shader.inputs["Roughness"].default_value = 0.4
            bpy.context.object.data.materials.append(material)
        self.both("principled")

    def test_environment_and_texture(self):
        scene = self.box()
        pixels = np.full((32, 64, 4), 0.2, dtype=np.float32)
        pixels[20:26, 8:14, :3] = (20, 10, 5)  # a bright patch to one side, above the horizon
        background = world(scene, 1)
        node = scene.world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = image_of("sky.exr", pixels, "OPEN_EXR")
        scene.world.node_tree.links.new(node.outputs[0], background.inputs["Color"])
        # The texture is fine, because between texels Cycles interpolates in sRGB.
        painted = np.ones((256, 256, 4), dtype=np.float32)
        painted[:128, :128, :3], painted[128:, 128:, :3] = (0.9, 0.2, 0.1), (0.1, 0.5, 0.9)
        floor = bpy.data.objects["Plane"].data.materials[0]
        texture = floor.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = image_of("floor.png", painted, "PNG")
        floor.node_tree.links.new(texture.outputs[0], floor.node_tree.nodes["Diffuse BSDF"].inputs["Color"])
        self.both("environment")


def image_of(name, pixels, file_format):
    h, w = pixels.shape[:2]
    image = bpy.data.images.new(name, w, h, float_buffer=file_format == "OPEN_EXR")
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = os.path.join(WORK, name), file_format
    image.save()
    return bpy.data.images.load(image.filepath_raw)


if __name__ == "__main__":
    chosen = sys.argv[sys.argv.index("--") + 4 :]
    program = unittest.main(argv=["blender_test", *chosen], exit=False, verbosity=2)
    sys.stdout.flush()
    os._exit(0 if program.result.wasSuccessful() and program.result.testsRun else 1)
