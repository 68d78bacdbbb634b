"""Provides Lucerna as a render engine of Blender: docs/howto/from-blender.md.

The add-on writes the open scene as pbrt scene text with its meshes as binary PLY files, runs `lucerna render`, and loads the
OpenEXR image as the render result with its passes. Blender's lengths are taken as metres.

Units. Blender's lights are radiant: a point light of P watts has the intensity P / (4 pi) W/sr, an area light of the
area A the radiance P / (4 A), a sun's strength is the irradiance in W/m2 on a plane that faces it, emission strength and
world are radiances in W/(m2 sr). In a photometric picture each is multiplied by the scene's lumens per watt; in a radiometric
one a measured lamp's lumens are divided by it. Both pictures are the same up to this factor.
"""

from __future__ import annotations

import math
import os
import queue
import re
import shlex
import shutil
import signal
import subprocess
import tempfile
import threading

import bpy
import numpy as np

try:
    import OpenImageIO as oiio  # part of Blender since 3.5; Debian's Blender uses python3-openimageio
except ImportError:
    oiio = None
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from bpy_extras.io_utils import ExportHelper
from mathutils import Matrix

bl_info = {
    "name": "Lucerna",
    "author": "The Lucerna authors",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "Render properties > Render Engine",
    "description": "Global illumination with measured lamps",
    "category": "Render",
}

ENGINE = "LUCERNA"
NO_OIIO = "This Blender has no OpenImageIO for Python, which reads the image; on Debian, install python3-openimageio"
LAMP_KINDS = {".ies": "ies", ".ldt": "ldt", ".gldf": "photometric", ".xml": "photometric", ".exr": "lightfield", ".tm25ray": "rayfile", ".dat": "rayfile", ".sdf": "rayfile", ".ray": "rayfile", ".dis": "rayfile", ".gz": "rayfile", ".zip": "rayfile"}
# Image files that the command reads without conversion.
IMAGE_SUFFIXES = {".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tga", ".tif", ".tiff"}
PARTS = ("emission", "direct", "indirect", "caustic", "media")
FAR = 1e10  # Blender's depth where a ray hits nothing


class RenderError(Exception):
    """The scene cannot be exported or rendered; the text says why."""


# ---------------------------------------------------------------- scene text


def number(value):
    return f"{value:.9g}"


def rgb(colour):
    return "[" + " ".join(number(max(0.0, c)) for c in colour[:3]) + "]"


def quoted(text):
    return '"' + str(text).replace("\\", "\\\\").replace('"', '\\"') + '"'


def matrix_text(directive, matrix):
    """Returns the directive with the matrix column by column, as in pbrt."""
    return directive + " [" + " ".join(number(matrix[r][c]) for c in range(4) for r in range(4)) + "]"


def group_name(name):
    """Returns a valid name of a light group: letters, digits, _ and -, at most 64."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)[:64]


def rigid(matrix):
    """Returns the matrix with its translation and rotation, without scale."""
    location, rotation, _ = matrix.decompose()
    return Matrix.Translation(location) @ rotation.to_matrix().to_4x4()


def unseen(obj):
    """Returns parameters that hide the shape of a light that is not visible to the camera."""
    return "" if obj.visible_camera else ' "float alpha" 0'


def light_groups_of(view_layer):
    return [group.name for group in getattr(view_layer, "lightgroups", [])]


def write_ply(path, points, triangles, normals=None, uv=None):
    """Writes a mesh: points (n, 3), triangles (m, 3) of indices, normals (n, 3), uv (n, 2)."""
    columns = [("x", points[:, 0]), ("y", points[:, 1]), ("z", points[:, 2])]
    if normals is not None:
        columns += [("nx", normals[:, 0]), ("ny", normals[:, 1]), ("nz", normals[:, 2])]
    if uv is not None:
        columns += [("u", uv[:, 0]), ("v", uv[:, 1])]
    vertices = np.empty(len(points), dtype=[(name, "<f4") for name, _ in columns])
    for name, values in columns:
        vertices[name] = values
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("indices", "<i4", 3)])
    faces["count"], faces["indices"] = 3, triangles
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name, _ in columns]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    with open(path, "wb") as file:
        file.write("\n".join(header).encode("ascii"))
        file.write(vertices.tobytes())
        file.write(faces.tobytes())


def corner_normals(mesh):
    normals = np.empty(3 * len(mesh.loops), dtype=np.float32)
    if hasattr(mesh, "corner_normals"):  # Blender 4.1 and later
        mesh.corner_normals.foreach_get("vector", normals)
    else:
        mesh.calc_normals_split()
        mesh.loops.foreach_get("normal", normals)
    return normals.reshape(-1, 3)


class Exporter:
    """Writes one view of a scene into a folder. `warnings` lists what is exported differently from Blender, or not at all."""

    def __init__(self, depsgraph, folder):
        self.depsgraph = depsgraph
        self.scene = depsgraph.scene
        self.settings = self.scene.lucerna
        self.folder = folder
        self.groups = set(light_groups_of(depsgraph.view_layer))
        self.photometric = self.settings.unit == "PHOTOMETRIC"
        self.lines = []
        self.warnings = []
        self.materials = {}  # name in Blender -> the result of material()
        self.images = {}
        self.meshes = {}  # names of an object and its data -> its parts, see mesh_parts
        self.shared = {}  # id of a mesh's parts -> name of their object in the text

    def warn(self, text):
        if text not in self.warnings:
            self.warnings.append(text)

    def add(self, line):
        self.lines.append(line)

    def radiant(self, value):
        """Converts a radiometric value of Blender into the unit of the scene text."""
        return value * self.settings.efficacy if self.photometric else value

    def write(self, name):
        """Writes NAME.pbrt with its files, and returns its path."""
        self.stem = name
        self.add(f"# {os.path.basename(bpy.data.filepath) or 'unnamed scene'}, exported from Blender")
        self.add(f'Option "string unit" "{"photometric" if self.photometric else "radiometric"}"')
        self.camera()
        self.add("WorldBegin")
        self.world()
        self.objects()
        path = os.path.join(self.folder, name + ".pbrt")
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join(self.lines) + "\n")
        return path

    # ------------------------------------------------------------ camera

    def camera(self):
        render = self.scene.render
        camera = self.scene.camera
        if camera is None:
            raise RenderError("the scene has no camera")
        camera = camera.evaluated_get(self.depsgraph)
        data = camera.data
        if data.type not in ("PERSP", "ORTHO"):
            raise RenderError(f"camera {camera.name}: panoramic cameras are not exported; perspective and orthographic are")
        share = render.resolution_percentage / 100
        width, height = max(1, int(render.resolution_x * share)), max(1, int(render.resolution_y * share))
        self.add(f'Film "rgb" "integer xresolution" {width} "integer yresolution" {height} "string filename" "{self.stem}.exr"')
        # pbrt's camera looks along +z with y up and x to the right.
        to_camera = Matrix.Diagonal((1, 1, -1, 1)) @ rigid(camera.matrix_world).inverted()
        self.add(matrix_text("Transform", to_camera))
        # The frame includes sensor fit, pixel aspect and shift.
        corners = data.view_frame(scene=self.scene)
        depth = -corners[0].z if data.type == "PERSP" else 1
        xs, ys = [c.x / depth for c in corners], [c.y / depth for c in corners]
        window = f'"float screenwindow" [{" ".join(number(v) for v in (min(xs), max(xs), min(ys), max(ys)))}]'
        lens = ""
        if data.dof.use_dof:
            focus = data.dof.focus_distance
            if data.dof.focus_object:
                place = data.dof.focus_object.evaluated_get(self.depsgraph).matrix_world.translation
                focus = (to_camera @ place).z
            if data.type == "PERSP":
                radius = data.lens * 1e-3 / (2 * data.dof.aperture_fstop)
            else:
                radius = 1 / (2 * data.dof.aperture_fstop)
            lens = f' "float lensradius" {number(radius)} "float focaldistance" {number(max(focus, 1e-5))}'
            if data.dof.aperture_blades or data.dof.aperture_ratio != 1:
                self.warn(f"camera {camera.name}: the aperture is exported as a circle")
        # With a field of view of 90 degrees, the window is given by the tangents of the angles from the axis.
        kind = '"perspective" "float fov" 90' if data.type == "PERSP" else '"orthographic"'
        self.add(f"Camera {kind} {window}{lens}")

    # ------------------------------------------------------------ lights

    def group(self, holder):
        name = getattr(holder, "lightgroup", "")
        return f' "string lightgroup" {quoted(group_name(name))}' if name and name in self.groups else ""

    def world(self):
        world = self.scene.world
        if world is None:
            return
        colour, strength, image = world.color, 1.0, None
        if world.use_nodes:
            output = world.node_tree.get_output_node("ALL")
            node = source_node(output.inputs["Surface"]) if output else None
            if node is None:
                return
            if node.type != "BACKGROUND":
                self.warn(f"world: node {node.name} is not exported; Background is")
                return
            strength = self.value(node.inputs["Strength"], 1.0, "world")
            colour = node.inputs["Color"].default_value
            source = source_node(node.inputs["Color"])
            if source is not None and source.type == "TEX_ENVIRONMENT" and source.image:
                if source.projection != "EQUIRECTANGULAR":
                    self.warn("world: a mirror ball is taken for latitude and longitude")
                if source_node(source.inputs["Vector"]) is not None:
                    self.warn("world: the texture's coordinates are not exported")
                image = self.image_file(source.image)
            elif source is not None:
                self.warn(f"world: node {source.name} is not exported; Environment Texture is")
        if strength <= 0:
            return
        scale = f' "float scale" {number(self.radiant(strength))}'
        if image:
            # Blender's longitude decreases from left to right, pbrt's increases.
            self.add("AttributeBegin\n    Scale -1 1 1")
            self.add(f'    LightSource "infinite" "string mapname" {quoted(image)}{scale}{self.group(world)}')
            self.add("AttributeEnd")
        elif max(colour[:3]) > 0:
            self.add(f'LightSource "infinite" "rgb L" {rgb(colour)}{scale}{self.group(world)}')

    def light(self, obj, matrix):
        light = obj.data
        group = self.group(obj)
        if light.energy <= 0 or max(light.color) <= 0:
            return
        if light.use_nodes and self.settings_of_nodes(light):
            self.warn(f"light {obj.name}: its nodes are not exported; its colour and power are")
        self.add(f"AttributeBegin  # {plain(obj.name)}")
        if light.type == "SUN":
            self.add("    " + matrix_text("ConcatTransform", rigid(matrix)))
            self.add(f'    LightSource "distant" "rgb L" {rgb(light.color)} "float scale" {number(self.radiant(light.energy))}'
                     f' "point from" [0 0 0] "point to" [0 0 -1]{group}')
            if light.angle > math.radians(1):
                self.warn(f"light {obj.name}: a sun is exported without its angle")
        elif light.type == "AREA":
            self.area_light(obj, light, matrix, group)
        else:
            self.point_or_spot(obj, light, matrix, group)
        self.add("AttributeEnd")

    def settings_of_nodes(self, light):
        """Tells whether the light's first Emission node is linked, not white, or of a strength other than 1."""
        for node in light.node_tree.nodes:
            if node.type == "EMISSION":
                strength, colour = node.inputs["Strength"], node.inputs["Color"]
                return strength.is_linked or colour.is_linked or strength.default_value != 1 or min(colour.default_value[:3]) != 1
        return False

    def point_or_spot(self, obj, light, matrix, group):
        intensity = self.radiant(light.energy) / (4 * math.pi)
        radius = light.shadow_soft_size
        self.add("    " + matrix_text("ConcatTransform", rigid(matrix)))
        if light.type == "POINT" and radius > 0:
            radiance = intensity / (math.pi * radius**2)
            self.add('    Material "diffuse" "rgb reflectance" [0 0 0]')
            self.add(f'    AreaLightSource "diffuse" "rgb L" {rgb(light.color)} "float scale" {number(radiance)}{group}')
            self.add(f'    Shape "sphere" "float radius" {number(radius)}{unseen(obj)}')
        elif light.type == "POINT":
            self.add(f'    LightSource "point" "rgb I" {rgb(light.color)} "float scale" {number(intensity)}{group}')
        else:
            # In both programs the intensity falls smoothly between two cosines.
            edge = math.cos(light.spot_size / 2)
            start = math.acos(min(1, edge + (1 - edge) * light.spot_blend))
            cone = math.degrees(light.spot_size / 2)
            delta = min(cone, cone - math.degrees(start))
            self.add(f'    LightSource "spot" "rgb I" {rgb(light.color)} "float scale" {number(intensity)}'
                     f' "float coneangle" {number(cone)} "float conedeltaangle" {number(max(0, delta))}'
                     f' "point from" [0 0 0] "point to" [0 0 -1]{group}')
            if radius > 0:
                self.warn(f"light {obj.name}: a spot is exported without its radius")

    def area_light(self, obj, light, matrix, group):
        scale = matrix.to_scale()
        width = light.size * abs(scale.x)
        height = (light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size) * abs(scale.y)
        area = width * height * (math.pi / 4 if light.shape in ("DISK", "ELLIPSE") else 1)
        if not area > 0:
            self.warn(f"light {obj.name}: its area is 0, it is left out")
            return
        if light.spread < math.pi - 1e-3:
            self.warn(f"light {obj.name}: an area light is exported without its spread")
        # The radiance is not P / (pi A): Blender emits only pi / 4 of an area light's watts.
        radiance = self.radiant(light.energy) / (4 * area)
        self.add("    " + matrix_text("ConcatTransform", rigid(matrix)))
        self.add('    Material "diffuse" "rgb reflectance" [0 0 0]')
        self.add(f'    AreaLightSource "diffuse" "rgb L" {rgb(light.color)} "float scale" {number(radiance)}{group}')
        x, y = number(width / 2), number(height / 2)
        if light.shape in ("DISK", "ELLIPSE"):
            # A disk emits along +z.
            self.add(f'    Rotate 180 1 0 0\n    Scale {x} {y} {x}\n    Shape "disk" "float radius" 1{unseen(obj)}')
        else:
            self.add(f'    Shape "trianglemesh" "point3 P" [-{x} -{y} 0  -{x} {y} 0  {x} {y} 0  {x} -{y} 0]'
                     f' "integer indices" [0 1 2 0 2 3]{unseen(obj)}')

    def lamp(self, obj, matrix):
        """Writes a measured or photometric lamp: it emits along -z of the object, +z of the lamp's frame."""
        lamp = obj.lucerna_lamp
        path = bpy.path.abspath(lamp.file)
        kind = LAMP_KINDS.get(os.path.splitext(path)[1].lower())
        if kind is None:
            raise RenderError(f"lamp {obj.name}: {lamp.file!r} is none of {', '.join(sorted(LAMP_KINDS))}")
        strength = f' "float efficacy" {number(self.settings.efficacy)}'
        if lamp.flux > 0:
            flux = lamp.flux if self.photometric else lamp.flux / self.settings.efficacy
            strength = f' "float power" {number(flux)}'
        self.add(f"AttributeBegin  # {plain(obj.name)}")
        self.add("    " + matrix_text("ConcatTransform", rigid(matrix) @ Matrix.Rotation(math.pi, 4, "X")))
        self.add(f'    LightSource "{kind}" "string filename" {quoted(os.path.abspath(path))}{strength}{self.group(obj)}')
        self.add("AttributeEnd")

    # ------------------------------------------------------------ shapes

    def objects(self):
        for instance in self.depsgraph.object_instances:
            obj = instance.object
            matrix = instance.matrix_world.copy()
            if obj.type in ("EMPTY", "LIGHT") and obj.original.lucerna_lamp.enabled:
                self.lamp(obj, matrix)
            elif not instance.show_self:
                continue
            elif obj.type == "LIGHT":
                self.light(obj, matrix)
            elif obj.type in ("MESH", "CURVE", "SURFACE", "META", "FONT"):
                self.shape(obj, matrix, instance.is_instance)
            elif obj.type in ("VOLUME", "POINTCLOUD", "CURVES", "HAIR", "GPENCIL"):
                self.warn(f"object {obj.name}: {obj.type.lower()} objects are not exported")

    def shape(self, obj, matrix, is_instance):
        parts = self.mesh_parts(obj)
        if not parts:
            return
        # Area lights inside an object emit nothing; therefore emissive meshes are written out for each instance.
        shared = is_instance and not any(self.material(part["material"])[1] for part in parts)
        if shared and id(parts) not in self.shared:
            self.shared[id(parts)] = f"object {len(self.shared)}"
            self.add(f"ObjectBegin {quoted(self.shared[id(parts)])}  # {plain(obj.name)}")
            for part in parts:
                self.part(part, "")
            self.add("ObjectEnd")
        self.add(f"AttributeBegin  # {plain(obj.name)}")
        self.add("    " + matrix_text("ConcatTransform", matrix))
        if shared:
            self.add(f"    ObjectInstance {quoted(self.shared[id(parts)])}")
        else:
            for part in parts:
                self.part(part, self.group(obj))
        self.add("AttributeEnd")

    def part(self, part, group):
        material, emission, alpha = self.material(part["material"])
        self.add("    AttributeBegin")
        self.add(f"        {material}")
        if emission:
            self.add(f"        {emission}{group}")
        self.add(f'        Shape "plymesh" "string filename" {quoted(part["file"])}{alpha}')
        self.add("    AttributeEnd")

    def mesh_parts(self, obj):
        """Writes the evaluated mesh as one PLY file per material, in the object's own axes, and returns these parts."""
        key = obj.original.name_full, obj.data.name_full if obj.data else ""
        if key in self.meshes:
            return self.meshes[key]
        parts = self.meshes[key] = []
        mesh = obj.to_mesh()
        if mesh is None:
            return parts
        try:
            mesh.calc_loop_triangles()
            count = len(mesh.loop_triangles)
            if not count:
                return parts
            points = np.empty(3 * len(mesh.vertices), dtype=np.float32)
            mesh.vertices.foreach_get("co", points)
            points = points.reshape(-1, 3)
            vertex_of_loop = np.empty(len(mesh.loops), dtype=np.int32)
            mesh.loops.foreach_get("vertex_index", vertex_of_loop)
            loops, slots = np.empty(3 * count, dtype=np.int32), np.empty(count, dtype=np.int32)
            mesh.loop_triangles.foreach_get("loops", loops)
            mesh.loop_triangles.foreach_get("material_index", slots)
            loops = loops.reshape(-1, 3)
            smooth = np.empty(len(mesh.polygons), dtype=bool)
            mesh.polygons.foreach_get("use_smooth", smooth)
            normals = corner_normals(mesh) if smooth.any() else None
            uv = None
            layer = next((each for each in mesh.uv_layers if each.active_render), None)
            if layer is not None:
                uv = np.empty(2 * len(mesh.loops), dtype=np.float32)
                layer.data.foreach_get("uv", uv)
                uv = uv.reshape(-1, 2)
            for slot in np.unique(slots):
                corners = loops[slots == slot]
                material = obj.material_slots[slot].material if slot < len(obj.material_slots) else None
                file = f"{self.stem}-{len(self.meshes)}-{slot}.ply"
                # Each corner gets its own vertex, because normals and texture coordinates belong to corners.
                used, triangles = np.unique(corners, return_inverse=True)
                write_ply(os.path.join(self.folder, file), points[vertex_of_loop[used]], triangles.reshape(-1, 3),
                          None if normals is None else normals[used], None if uv is None else uv[used])
                parts.append({"file": file, "material": material})
        finally:
            obj.to_mesh_clear()
        return parts

    # ------------------------------------------------------------ materials

    def material(self, material):
        """Returns the directive that selects the material, its AreaLightSource or "", and the shape's alpha parameter."""
        name = material.name_full if material else None
        if name not in self.materials:
            text, emission, alpha = 'Material "diffuse" "rgb reflectance" [0.8 0.8 0.8]', "", ""
            if material is not None:
                text, emission, alpha = MaterialText(self, material).result()
            self.materials[name] = text, emission, alpha
        return self.materials[name]

    def value(self, socket, fallback, owner):
        """Returns a socket's number. Of linked nodes only Value is exported; for others there is a warning."""
        if socket is None:
            return fallback
        source = source_node(socket)
        if source is not None:
            if source.type == "VALUE":
                return source.outputs[0].default_value
            self.warn(f"{owner}: what is linked to {socket.name} is not exported")
        return socket.default_value

    def image_file(self, image):
        """Returns a file that the command can read; None, with a warning, if there is none."""
        if image.name_full in self.images:
            return self.images[image.name_full]
        path = os.path.abspath(bpy.path.abspath(image.filepath, library=image.library)) if image.filepath else ""
        suffix = os.path.splitext(path)[1].lower()
        found = None
        if image.packed_file is not None and suffix in IMAGE_SUFFIXES:
            found = f"{self.stem}-image-{len(self.images)}{suffix}"
            with open(os.path.join(self.folder, found), "wb") as file:
                file.write(image.packed_file.data)
        elif image.source == "FILE" and suffix in IMAGE_SUFFIXES and os.path.isfile(path):
            found = path
        else:
            self.warn(f"image {image.name}: only images in or from files ({' '.join(sorted(IMAGE_SUFFIXES))}) are exported")
        self.images[image.name_full] = found
        return found


def plain(name):
    """Returns the name on one line, for a comment."""
    return name.replace("\n", " ").replace("\r", " ")


def source_node(socket):
    """Returns the node that is linked to a socket, through reroutes; None if there is none, as behind a reroute without input."""
    while socket is not None and socket.is_linked:
        node = socket.links[0].from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None


class MaterialText:
    """Exports a material of Blender as the most similar material of the command."""

    def __init__(self, exporter, material):
        self.out = exporter
        self.material = material
        self.owner = f"material {material.name}"
        self.count = 0

    def result(self):
        material = self.material
        if not material.use_nodes or material.node_tree is None:
            return f'Material "diffuse" "rgb reflectance" {rgb(material.diffuse_color)}', "", ""
        output = material.node_tree.get_output_node("ALL")
        surface = source_node(output.inputs["Surface"]) if output else None
        if surface is None:
            return 'Material "diffuse" "rgb reflectance" [0 0 0]', "", ""
        for name in ("Volume", "Displacement"):
            if output.inputs[name].is_linked:
                self.out.warn(f"{self.owner}: {name.lower()} is not exported")
        name, emission, alpha = self.shader(surface)
        light = ""
        if emission and max(emission) > 0:
            light = f'AreaLightSource "diffuse" "rgb L" {rgb([self.out.radiant(c) for c in emission])} "bool twosided" true'
        return f"NamedMaterial {quoted(name)}", light, f' "float alpha" {number(alpha)}' if alpha < 1 else ""

    def named(self, kind, parameters):
        name = self.material.name_full + (f" part {self.count}" if self.count else "")
        self.count += 1
        self.out.add(f"MakeNamedMaterial {quoted(name)} \"string type\" {quoted(kind)} {parameters}")
        return name

    def number(self, node, name, fallback=0.0):
        return self.out.value(node.inputs.get(name), fallback, self.owner)

    def colour(self, socket, parameter):
        """Returns a colour parameter: the socket's colour, or the image that is linked to it."""
        source = source_node(socket)
        if source is not None and source.type == "TEX_IMAGE" and source.image:
            file = self.out.image_file(source.image)
            vector = source_node(source.inputs["Vector"])
            if vector is not None and vector.type not in ("UVMAP", "TEX_COORD"):
                self.out.warn(f"{self.owner}: the coordinates of image {source.image.name} are the active UV map's")
            if file:
                self.count += 1
                name = f"{self.material.name_full} image {self.count}"
                space = source.image.colorspace_settings.name
                encoding = "linear" if space in ("Non-Color", "Raw", "Linear") else "sRGB"
                wrap = ' "string wrap" "clamp"' if source.extension == "EXTEND" else ' "string wrap" "black"' if source.extension == "CLIP" else ""
                self.out.add(f'Texture {quoted(name)} "spectrum" "imagemap" "string filename" {quoted(file)} "string encoding" "{encoding}"{wrap}')
                return f'"texture {parameter}" {quoted(name)}'
        elif source is not None and source.type == "RGB":
            return f'"rgb {parameter}" {rgb(source.outputs[0].default_value)}'
        elif source is not None:
            self.out.warn(f"{self.owner}: node {source.name} is not exported; Image Texture and RGB are")
        return f'"rgb {parameter}" {rgb([min(1, c) for c in socket.default_value[:3]])}'

    def roughness(self, node):
        value = self.number(node, "Roughness")
        return f'"float roughness" {number(value * value)} "bool remaproughness" false'

    def emitted(self, node, colour, strength):
        socket = node.inputs.get(colour)
        if socket is None:
            return None
        factor = self.number(node, strength, 1.0)
        source = source_node(socket)
        if source is not None and source.type == "RGB":
            return [factor * c for c in source.outputs[0].default_value[:3]]
        if source is not None and factor > 0:
            self.out.warn(f"{self.owner}: what is linked to {socket.name} is not exported")
        return [factor * c for c in socket.default_value[:3]]

    def shader(self, node):
        """Returns the material's name, its emitted radiance in Blender's unit or None, and alpha. Without a node it is black."""
        if node is None:
            return self.named("diffuse", '"rgb reflectance" [0 0 0]'), None, 1
        kind = node.type
        if kind == "BSDF_PRINCIPLED":
            return self.principled(node)
        if kind == "EMISSION":
            return self.named("diffuse", '"rgb reflectance" [0 0 0]'), self.emitted(node, "Color", "Strength"), 1
        if kind == "BSDF_DIFFUSE":
            if self.number(node, "Roughness") > 0:
                self.out.warn(f"{self.owner}: a diffuse shader is exported without its roughness")
            return self.named("diffuse", self.colour(node.inputs["Color"], "reflectance")), None, 1
        if kind == "BSDF_GLOSSY":
            rough = self.roughness(node) if node.distribution != "SHARP" else '"float roughness" 0'
            return self.named("conductor", self.colour(node.inputs["Color"], "reflectance") + " " + rough), None, 1
        if kind in ("BSDF_GLASS", "BSDF_REFRACTION"):
            return self.glass(node, self.number(node, "IOR", 1.45)), None, 1
        if kind == "BSDF_TRANSPARENT":
            return self.named("interface", ""), None, 1
        if kind == "BSDF_TRANSLUCENT":
            return self.named("diffusetransmission", '"rgb reflectance" [0 0 0] ' + self.colour(node.inputs["Color"], "transmittance")), None, 1
        if kind == "MIX_SHADER":
            return self.mix(node)
        if kind == "ADD_SHADER":
            return self.sum(node)
        self.out.warn(f"{self.owner}: shader {node.name} is not exported; its viewport colour is taken")
        return self.named("diffuse", f'"rgb reflectance" {rgb(self.material.diffuse_color)}'), None, 1

    def glass(self, node, ior):
        colour = node.inputs.get("Color") or node.inputs.get("Base Color")
        if colour.is_linked or min(colour.default_value[:3]) < 0.99:
            self.out.warn(f"{self.owner}: glass is exported without its colour")
        return self.named("dielectric", f'"float eta" {number(max(ior, 1.0001))} ' + self.roughness(node))

    def mix(self, node):
        amount = self.out.value(node.inputs[0], 0.5, self.owner)
        (a, light_a, alpha_a), (b, light_b, alpha_b) = self.shader(source_node(node.inputs[1])), self.shader(source_node(node.inputs[2]))
        light = [(1 - amount) * x + amount * y for x, y in zip(light_a or [0] * 3, light_b or [0] * 3)]
        name = self.named("mix", f'"string materials" [{quoted(a)} {quoted(b)}] "float amount" {number(amount)}')
        return name, light, (1 - amount) * alpha_a + amount * alpha_b

    def sum(self, node):
        """Exports the sum of emission and another shader."""
        sources = [source_node(node.inputs[0]), source_node(node.inputs[1])]
        emitting = [each for each in sources if each is not None and each.type == "EMISSION"]
        others = [each for each in sources if each is not None and each.type != "EMISSION"]
        if len(others) > 1:
            self.out.warn(f"{self.owner}: of the sum of two surface shaders the first is exported")
        name, light, alpha = self.shader([*others, *emitting, None][0])
        for each in emitting if others else emitting[1:]:
            light = [x + y for x, y in zip(light or [0] * 3, self.emitted(each, "Color", "Strength"))]
        return name, light, alpha

    def principled(self, node):
        for name in ("Subsurface", "Clearcoat", "Sheen", "Anisotropic", "Subsurface Weight", "Coat Weight", "Sheen Weight"):
            if name in node.inputs and (node.inputs[name].is_linked or node.inputs[name].default_value > 0):
                self.out.warn(f"{self.owner}: {name} is not exported")
        if node.inputs["Normal"].is_linked:
            self.out.warn(f"{self.owner}: Normal is not exported")
        metallic = min(1, max(0, self.number(node, "Metallic")))
        transmission = min(1, max(0, self.number(node, "Transmission" if "Transmission" in node.inputs else "Transmission Weight")))
        base = node.inputs["Base Color"]
        rough = self.roughness(node)
        # Lists the parts with their shares: gloss over a diffuse base, glass, and metal.
        parts = []
        if metallic < 1 and transmission < 1:
            specular = self.number(node, "Specular" if "Specular" in node.inputs else "Specular IOR Level", 0.5)
            f0 = math.sqrt(min(0.99, 0.08 * max(0, specular)))
            if f0 > 0:
                eta = (1 + f0) / (1 - f0)
                text = self.named("uber", f'{self.colour(base, "Kd")} "rgb Ks" [1 1 1] "float eta" {number(eta)} {rough}')
            else:
                text = self.named("diffuse", self.colour(base, "reflectance"))
            parts.append((text, (1 - metallic) * (1 - transmission)))
        if metallic < 1 and transmission > 0:
            parts.append((self.glass(node, self.number(node, "IOR", 1.45)), (1 - metallic) * transmission))
        if metallic > 0:
            parts.append((self.named("conductor", f'{self.colour(base, "reflectance")} {rough}'), metallic))
        name, share = parts[0]
        for other, more in parts[1:]:
            share += more
            name = self.named("mix", f'"string materials" [{quoted(name)} {quoted(other)}] "float amount" {number(more / share)}')
        emission = self.emitted(node, "Emission" if "Emission" in node.inputs else "Emission Color", "Emission Strength")
        return name, emission, self.number(node, "Alpha", 1.0)


# ---------------------------------------------------------------- the command


def preferences():
    addon = bpy.context.preferences.addons.get(__name__)
    return addon.preferences if addon else None


def command_path():
    chosen = preferences()
    path = bpy.path.abspath(chosen.command) if chosen and chosen.command else "lucerna"
    found = shutil.which(path)
    if found is None:
        raise RenderError(f"{path} is not found; the add-on's preferences say where the command lucerna is")
    return found


class Image:
    """Reads an image that the command wrote, layer by layer with OpenImageIO."""

    def __init__(self, path):
        self.file = oiio.ImageInput.open(path)
        if self.file is None:
            raise OSError(f"{path}: {oiio.geterror()}")
        spec = self.file.spec()
        self.width, self.height = spec.width, spec.height
        self.indices = {name: i for i, name in enumerate(spec.channelnames)}

    def layer(self, *names):
        """Returns (height, width, channels) float32, top row first; None if there is no such layer."""
        if not set(names) <= set(self.indices):
            return None
        indices = [self.indices[name] for name in names]
        first, last = min(indices), max(indices)
        values = self.file.read_image(0, 0, first, last + 1, oiio.FLOAT)
        if values is None:
            raise OSError(self.file.geterror())
        return values.reshape(self.height, self.width, -1)[..., [i - first for i in indices]]

    def colours(self, layer=""):
        return self.layer(*(f"{layer}.{letter}" if layer else letter for letter in "RGB"))

    def close(self):
        self.file.close()


def render_arguments(settings, scene_file, image_file):
    arguments = ["render", scene_file, "-o", image_file]
    if settings.integrator != "AUTO":
        arguments += ["--integrator", settings.integrator]
    if settings.stop_by == "TIME":
        arguments += ["--time", f"{settings.time:g}s"]
    else:
        arguments += ["--spp", str(settings.spp)]
    if settings.layers:
        arguments.append("--layers")
    elif not settings.denoise:
        arguments.append("--no-denoise")
    if settings.denoise:
        arguments.append("--denoise")
    if settings.seed:
        arguments += ["--seed", str(settings.seed)]
    return arguments + shlex.split(settings.more_options)


class Run:
    """The running command. `poll` returns its lines; `interrupt` makes it end early with the image rendered so far."""

    PROGRESS = re.compile(r"^(.*): (\d+) %")
    PHASE = re.compile(r"^[a-z ]+(: <?[\d.]+ (s|min|h|%).*| …)$")  # begins, continues, ends

    def __init__(self, arguments):
        self.process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                                        text=True, encoding="utf-8", errors="replace")
        self.lines = queue.Queue()
        self.text = []
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))

    def poll(self):
        """Returns the lines since the last call; waits up to a tenth of a second for the first."""
        lines = []
        try:
            lines.append(self.lines.get(timeout=0.1))
            while True:
                lines.append(self.lines.get_nowait())
        except queue.Empty:
            pass
        self.text += lines
        return lines

    @property
    def running(self):
        return self.process.poll() is None or self.reader.is_alive() or not self.lines.empty()

    def interrupt(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)

    def end(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.reader.join()
        self.process.stdout.close()


# ---------------------------------------------------------------- the engine


def pass_list(settings, view_layer):
    """Returns the passes besides Combined: name, letters of the channels, type of socket."""
    passes = []
    if settings.denoise or settings.layers:
        passes += [("Measured", "RGBA", "COLOR"), ("Denoised", "RGBA", "COLOR")]
    if settings.layers:
        passes += [("Depth", "Z", "VALUE"), ("Normal", "XYZ", "VECTOR"), ("Albedo", "RGB", "COLOR")]
        passes += [(part.capitalize(), "RGB", "COLOR") for part in PARTS]
        # The names are those of Cycles.
        groups = light_groups_of(view_layer)
        passes += [(f"Combined_{name}", "RGB", "COLOR") for name in groups + (["default"] if groups else [])]
    return passes


def pass_values(image, settings, name):
    """Returns the values of a pass, (height, width, channels), top row first; None if the image has none."""
    if name == "Combined":
        denoised = image.colours("denoised") if settings.denoise else None
        return image.colours() if denoised is None else denoised
    if name == "Measured":
        return image.colours()
    if name == "Depth":
        depth = image.layer("Z")
        return None if depth is None else np.where(depth > 0, depth, FAR)
    if name == "Normal":
        return image.layer("N.X", "N.Y", "N.Z")
    if name.startswith("Combined_"):
        return image.colours("lightgroup." + group_name(name[len("Combined_"):]))
    return image.colours(name.lower())


def put(render_pass, values):
    """Sets the values of a pass. Blender's rows start at the bottom; a colour without alpha is opaque."""
    values = np.flipud(values)
    channels = render_pass.channels
    whole = np.ones(values.shape[:2] + (channels,), dtype=np.float32)
    whole[..., : min(channels, values.shape[2])] = values[..., :channels]
    render_pass.rect = whole.reshape(-1, channels)


class LucernaRenderEngine(bpy.types.RenderEngine):
    bl_idname = ENGINE
    bl_label = "Lucerna"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False

    def update_render_passes(self, scene=None, renderlayer=None):
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for name, letters, kind in pass_list(scene.lucerna, renderlayer):
            self.register_pass(scene, renderlayer, name, len(letters), letters, kind)

    def render(self, depsgraph):
        scene = depsgraph.scene
        settings = scene.lucerna
        kept = bpy.path.abspath(settings.keep_in) if settings.keep_in else ""
        folder = kept or tempfile.mkdtemp(prefix="lucerna-")
        try:
            os.makedirs(folder, exist_ok=True)
            self.render_in(folder, depsgraph, settings)
        except (RenderError, OSError) as error:
            self.fail(str(error))
        finally:
            if not kept:
                shutil.rmtree(folder, ignore_errors=True)

    def fail(self, text):
        self.report({"ERROR"}, text)
        self.error_set(text)

    def render_in(self, folder, depsgraph, settings):
        if oiio is None:
            raise RenderError(NO_OIIO)
        self.update_stats("", "Lucerna: exporting")
        stem = f"frame-{depsgraph.scene.frame_current:04d}"
        exporter = Exporter(depsgraph, folder)
        scene_file = exporter.write(stem)
        for warning in exporter.warnings:
            self.report({"WARNING"}, warning)
        image_file = os.path.join(folder, stem + ".exr")
        if os.path.exists(image_file):
            os.remove(image_file)  # the image of an earlier render must not be loaded
        arguments = [command_path()] + render_arguments(settings, scene_file, image_file)
        run = Run(arguments + self.border(depsgraph.scene.render))
        try:
            self.watch(run)
        finally:
            run.end()
        code = run.process.returncode
        interrupted = code in (130, -signal.SIGINT)
        if code and not interrupted:
            said = [line for line in run.text if not run.PHASE.match(line)]
            self.fail("\n".join(said[-12:]) or f"lucerna ended with code {code}")
        elif os.path.exists(image_file):
            self.load(image_file, depsgraph, settings)
        elif interrupted:
            self.report({"INFO"}, "interrupted before there was a picture")

    def border(self, render):
        if not render.use_border:
            return []
        width, height = self.full_size(render)
        x0, x1 = int(render.border_min_x * width), int(render.border_max_x * width)
        y0, y1 = int((1 - render.border_max_y) * height), int((1 - render.border_min_y) * height)
        return ["--crop", f"{x0},{y0},{x1},{y1}"]

    def full_size(self, render):
        share = render.resolution_percentage / 100
        return max(1, int(render.resolution_x * share)), max(1, int(render.resolution_y * share))

    def is_cancelled(self):
        return self.test_break()

    def watch(self, run):
        stopping = False
        while run.running:
            for line in run.poll():
                progress = run.PROGRESS.match(line)
                self.update_stats("", "Lucerna: " + line)
                if progress:
                    self.update_progress(int(progress[2]) / 100)
                elif line.startswith("lucerna: warning: "):
                    self.report({"WARNING"}, line[len("lucerna: warning: "):])
            if not stopping and self.is_cancelled():
                stopping = True
                self.update_stats("", "Lucerna: stopping")
                run.interrupt()

    def load(self, image_file, depsgraph, settings):
        layer_name = depsgraph.view_layer.name
        image = Image(image_file)
        try:
            for name, letters, _ in pass_list(settings, depsgraph.view_layer):
                self.add_pass(name, len(letters), letters, layer=layer_name)
            result = self.begin_result(0, 0, image.width, image.height, layer=layer_name)
            for each in result.layers[0].passes:
                values = pass_values(image, settings, each.name)
                if values is not None:
                    put(each, values)
            self.end_result(result)
        finally:
            image.close()


# ---------------------------------------------------------------- settings and panels


class LucernaPreferences(bpy.types.AddonPreferences):
    bl_idname = __name__
    command: StringProperty(name="Command", subtype="FILE_PATH", description="Where the command lucerna is; empty: found by PATH")

    def draw(self, _context):
        self.layout.prop(self, "command")
        if oiio is None:
            self.layout.label(text=NO_OIIO)


class LucernaSettings(bpy.types.PropertyGroup):
    integrator: EnumProperty(name="Integrator", default="path", items=[
        ("AUTO", "By the scene", "Given a time, the method of least error is chosen; given samples, the default"),
        ("path", "Path", "Path tracing"), ("direct", "Direct", "Direct light alone"),
        ("photonmap", "Photon map", "Two passes, with final gathering"), ("igi", "Virtual lights", "Instant global illumination"),
        ("progressive", "Progressive", "Progressive photon mapping")])
    stop_by: EnumProperty(name="End by", default="SPP", items=[
        ("SPP", "Samples", "Samples per pixel"), ("TIME", "Time", "Time of the whole command")])
    spp: IntProperty(name="Samples", default=64, min=1, description="Samples per pixel")
    time: FloatProperty(name="Seconds", default=30, min=0.1)
    seed: IntProperty(name="Seed", default=0, min=0)
    denoise: BoolProperty(name="Denoise", default=True, description="Combined is the denoised image; what was measured is the pass Measured")
    layers: BoolProperty(name="Passes", default=True, description="Parts of the light, light groups, depth, normal and albedo as passes")
    unit: EnumProperty(name="Unit of the picture", default="RADIOMETRIC", items=[
        ("RADIOMETRIC", "W/(m² sr)", "As Blender counts; lumens of measured lamps are divided by the lumens per watt"),
        ("PHOTOMETRIC", "cd/m²", "Luminance; watts of Blender's lights are multiplied by the lumens per watt")])
    efficacy: FloatProperty(name="Lumens per watt", default=683, min=1, max=683,
                            description="Between Blender's watts and lumens; 683 is what Blender's glTF exporter takes")
    more_options: StringProperty(name="More options", description="Further options of lucerna render, as --set photons=1000000")
    keep_in: StringProperty(name="Keep files in", subtype="DIR_PATH", description="Folder for the exported scene and the image; empty: a temporary one")


class LucernaLamp(bpy.types.PropertyGroup):
    enabled: BoolProperty(name="Lucerna lamp", default=False, description="This object is a lamp from a file; light leaves along its -Z")
    file: StringProperty(name="File", subtype="FILE_PATH", description="IES, EULUMDAT, light field (.exr) or ray file (.tm25ray, .dat, .ray, .dis, packed or not)")
    flux: FloatProperty(name="Flux (lm)", default=0, min=0, description="0: as the file says")


class LUCERNA_PT_render(bpy.types.Panel):
    bl_label = "Lucerna"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context):
        return context.engine == ENGINE

    def draw(self, context):
        settings, layout = context.scene.lucerna, self.layout
        layout.use_property_split = True
        layout.prop(settings, "integrator")
        layout.prop(settings, "stop_by")
        layout.prop(settings, "spp" if settings.stop_by == "SPP" else "time")
        for name in ("seed", "denoise", "layers", "unit", "efficacy", "more_options", "keep_in"):
            layout.prop(settings, name)


class LUCERNA_PT_lamp(bpy.types.Panel):
    bl_label = "Lucerna lamp"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"

    @classmethod
    def poll(cls, context):
        return context.engine == ENGINE and context.object is not None and context.object.type in ("EMPTY", "LIGHT")

    def draw_header(self, context):
        self.layout.prop(context.object.lucerna_lamp, "enabled", text="")

    def draw(self, context):
        lamp, layout = context.object.lucerna_lamp, self.layout
        layout.use_property_split = True
        layout.active = lamp.enabled
        layout.prop(lamp, "file")
        layout.prop(lamp, "flux")


class LUCERNA_OT_export(bpy.types.Operator, ExportHelper):
    """Write the scene as text for the command, with its meshes beside it"""

    bl_idname = "export_scene.lucerna"
    bl_label = "Export for Lucerna"
    filename_ext = ".pbrt"
    filter_glob: StringProperty(default="*.pbrt", options={"HIDDEN"})

    def execute(self, context):
        folder, name = os.path.split(self.filepath)
        exporter = Exporter(context.evaluated_depsgraph_get(), folder)
        try:
            exporter.write(os.path.splitext(name)[0])
        except (RenderError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in exporter.warnings:
            self.report({"WARNING"}, warning)
        return {"FINISHED"}


def export_entry(self, _context):
    self.layout.operator(LUCERNA_OT_export.bl_idname, text="Lucerna (.pbrt)")


# Blender's own panels that apply here; those for EEVEE's materials, lights and world show the nodes.
MORE_PANELS = ("EEVEE_MATERIAL_PT_surface", "EEVEE_MATERIAL_PT_context_material", "EEVEE_WORLD_PT_surface", "DATA_PT_EEVEE_light")


def shared_panels():
    def below(kind):
        for each in kind.__subclasses__():
            yield each
            yield from below(each)

    for panel in below(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is not None and ("BLENDER_RENDER" in engines or panel.__name__ in MORE_PANELS):
            yield panel


CLASSES = (LucernaPreferences, LucernaSettings, LucernaLamp, LucernaRenderEngine, LUCERNA_PT_render, LUCERNA_PT_lamp, LUCERNA_OT_export)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.lucerna = PointerProperty(type=LucernaSettings)
    bpy.types.Object.lucerna_lamp = PointerProperty(type=LucernaLamp)
    bpy.types.TOPBAR_MT_file_export.append(export_entry)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister():
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    bpy.types.TOPBAR_MT_file_export.remove(export_entry)
    del bpy.types.Object.lucerna_lamp
    del bpy.types.Scene.lucerna
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
