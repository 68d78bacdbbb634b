# Run by Blender: blender -b --factory-startup -P blender_test.py -- COMMAND DATA WORK
# The add-on blender/lucerna_render.py renders scenes of known answer through Blender's own render().
import math
import os
import shutil
import subprocess
import sys
import unittest

import bpy
import numpy as np
import OpenImageIO as oiio
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

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


# Seen from above through a long lens: 8 x 8 pixels in the middle are 1 cm of the plane.
def above(lens=1000):
    return camera((0.0, -0.001, 3.0), (0, 0, 0), lens)


class ClosedForms(unittest.TestCase):
    def test_point(self):
        new_scene()
        plane()
        light("POINT", 100, (0, 0.8, 1.5), shadow_soft_size=0)
        above()
        d2 = 0.8**2 + 1.5**2
        cos = 1.5 / math.sqrt(d2)
        self.assertAlmostEqual(middle(combined(render("point"))) / (0.5 / math.pi * 100 / (4 * math.pi) * cos / d2), 1, delta=0.01)


if __name__ == "__main__":
    result = unittest.main(argv=["blender_test"], exit=False, verbosity=2).result
    sys.stdout.flush()
    os._exit(0 if result.wasSuccessful() else 1)
