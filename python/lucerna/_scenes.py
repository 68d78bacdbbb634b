"""Scenes: from files, from text, and built in memory by pbrt's directives."""

from __future__ import annotations

import contextlib
import math
import os
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _lucerna
from ._images import Path

Progress = Callable[[str, float], object]


class Scene:
    """A scene that was read and can be rendered, as often as wanted and by any method.

    The first render by another integrator than the one before reads the scene's text again.
    """

    def __init__(self, held: _lucerna.Scene) -> None:
        self._held = held

    def __repr__(self) -> str:
        return f"<lucerna.Scene {os.fspath(self._held.file)!r}>"


def _read(
    file: Path,
    text: Optional[str],
    meshes: Dict[str, _lucerna.Mesh],
    integrator: Optional[str] = None,
    resolution: Optional[Tuple[int, int]] = None,
    colour_space: Optional[str] = None,
    skip_missing: bool = False,
    strict: bool = False,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Scene:
    return Scene(
        _lucerna.read_scene(
            file,
            text,
            integrator or "",
            resolution,
            colour_space,
            skip_missing,
            strict,
            meshes,
            threads,
            progress,
        )
    )


def read_scene(path: Path, **overrides: Any) -> Scene:
    """A scene file in pbrt's text format; of several frames the first.

    `overrides` replace the scene's own: `integrator`, `resolution` (width, height),
    `colour_space` ("srgb", "rec2020", "acescg"); `skip_missing` leaves out meshes and textures without a file,
    `strict` refuses what would be a LucernaWarning; `threads`, `progress(phase, share)`.
    """
    return _read(path, None, {}, **overrides)


def read_text(text: str, folder: Path = ".", **overrides: Any) -> Scene:
    """A scene's text; names of files within it start from `folder`. `overrides`: read_scene()."""
    return _read(os.path.join(os.fspath(folder), "text.pbrt"), text, {}, **overrides)


class _Typed:
    """A parameter's value whose type Python's own types do not tell."""

    def __init__(self, kind: str, values: Sequence[Union[str, float]]) -> None:
        self.kind = kind
        self.values = list(values)


def texture(name: str) -> _Typed:
    """A texture that texture() of the builder has named, as a value: reflectance=texture("wood")."""
    return _Typed("texture", [name])


def blackbody(kelvin: float) -> _Typed:
    """The colour of a blackbody, luminance 1: L=blackbody(3000), scale=50."""
    return _Typed("blackbody", [kelvin])


def spectrum(values: Union[str, Sequence[float], npt.ArrayLike]) -> _Typed:
    """A spectrum: a name of pbrt's, a file, or wavelengths in nm and values, one after the other, as an
    array (n, 2) has them."""
    if isinstance(values, str):
        return _Typed("spectrum", [values])
    return _Typed("spectrum", np.asarray(values, dtype=float).ravel().tolist())


# Names parameters that pbrt declares as integers, points and so on. All other numbers are "float", and three
# of them "rgb".
_INTEGERS = frozenset(
    "degree dimension gathersamples indices iterations levels maxdepth nlevels numiterations nu nv nx ny nz "
    "octaves photonsperiteration pixelsamples splitdepth uorder vorder xresolution xsamples yresolution "
    "ysamples".split()
)
_KINDS = {
    "P": "point3",
    "N": "normal3",
    "S": "vector3",
    "center": "point3",
    "from": "point3",
    "to": "point3",
    "p0": "point3",
    "p1": "point3",
    "p2": "point3",
    "uv": "point2",
    "st": "point2",
    "v1": "vector3",
    "v2": "vector3",
    "updir": "vector3",
}
_FLOATS = frozenset("Pw Pz density pixelbounds cropwindow screenwindow uknots vknots".split())


def _quoted(text: str) -> str:
    if any(ord(c) < 32 for c in text):
        raise _lucerna.InputError(f"{text!r}: control characters are not accepted in a scene's text")
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _number(value: Any, what: str) -> str:
    number = float(value)
    if not math.isfinite(number):
        raise _lucerna.InputError(f"{what}: {number} is not accepted; expected finite numbers")
    return str(int(number)) if number.is_integer() and abs(number) < 2**53 else repr(number)


def _parameter(name: str, value: Any) -> str:
    """ "float fov" [ 40 ] of fov=40. A name that says its type, as "point3 from", is taken as it stands."""
    kind, _, plain = name.removesuffix("_").rpartition(" ")
    values: List[Any]
    if isinstance(value, _Typed):
        kind, values = value.kind, value.values
    else:
        is_list = isinstance(value, (list, tuple, np.ndarray))
        flat = np.asarray(value).ravel().tolist() if is_list else [value]
        values = [v.item() if isinstance(v, np.generic) else v for v in flat]
    if not values:
        raise _lucerna.InputError(f"{name}: an empty list is not accepted")
    first = values[0]
    if not kind:
        if isinstance(first, bool):
            kind = "bool"
        elif isinstance(first, str):
            kind = "string"
        elif plain in _INTEGERS:
            kind = "integer"
        elif plain in _KINDS:
            kind = _KINDS[plain]
        else:
            kind = "rgb" if len(values) == 3 and plain not in _FLOATS else "float"
    words = []
    for one in values:
        if isinstance(one, bool):
            words.append("true" if one else "false")
        elif isinstance(one, str):
            words.append(_quoted(one))
        else:
            words.append(_number(one, name))
    return f'"{kind} {plain}" [ {" ".join(words)} ]'


class SceneBuilder:
    """A scene in memory: pbrt's directives as methods, in pbrt's order, with pbrt's parameters.

    Types of parameters follow from their names and values: numbers are "float" (or "integer", where pbrt has
    one), three of them "rgb" (or a point), words "string"; texture(), spectrum() and blackbody() say others,
    and so does a name that tells its type: **{"float width0": 0.1}. Python's own words take an underscore
    behind: from_=(0, 0, 1). The world begins with the first directive that stands in it. Names of files start
    from `folder`.
    """

    def __init__(self, folder: Path = ".") -> None:
        self._folder = folder
        self._lines: List[str] = []
        self._meshes: Dict[str, _lucerna.Mesh] = {}
        self._in_world = False
        self._depth = 0

    def _write(self, line: str) -> None:
        self._lines.append("  " * self._depth + line)

    def directive(self, name: str, /, *words: str, **parameters: Any) -> None:
        """Any directive, its quoted words and its parameters."""
        parts = [name, *map(_quoted, words), *(_parameter(n, v) for n, v in parameters.items())]
        self._write(" ".join(parts))

    def _world_directive(self, name: str, /, *words: str, **parameters: Any) -> None:
        self.world_begin()
        self.directive(name, *words, **parameters)

    def _numbers(self, name: str, numbers: Sequence[float], brackets: bool = False) -> None:
        text = " ".join(_number(number, name) for number in numbers)
        self._write(f"{name} [ {text} ]" if brackets else f"{name} {text}")

    def raw(self, text: str) -> None:
        """Text as a scene file holds it."""
        self._write(text)

    # Directives before WorldBegin.

    def film(self, kind: str = "rgb", /, **parameters: Any) -> None:
        self.directive("Film", kind, **parameters)

    def camera(self, kind: str = "perspective", /, **parameters: Any) -> None:
        self.directive("Camera", kind, **parameters)

    def sampler(self, kind: str = "zsobol", /, **parameters: Any) -> None:
        self.directive("Sampler", kind, **parameters)

    def pixel_filter(self, kind: str, /, **parameters: Any) -> None:
        self.directive("PixelFilter", kind, **parameters)

    def integrator(self, kind: str, /, **parameters: Any) -> None:
        self.directive("Integrator", kind, **parameters)

    def color_space(self, name: str) -> None:
        self.directive("ColorSpace", name)

    def world_begin(self) -> None:
        if not self._in_world:
            self._write("WorldBegin")
            self._in_world = True


    def look_at(self, eye: Sequence[float], look: Sequence[float], up: Sequence[float]) -> None:
        self._numbers("LookAt", [*eye, *look, *up])

    def translate(self, x: float, y: float, z: float) -> None:
        self._numbers("Translate", [x, y, z])

    def scale(self, x: float, y: float, z: float) -> None:
        self._numbers("Scale", [x, y, z])

    def rotate(self, degrees: float, x: float, y: float, z: float) -> None:
        self._numbers("Rotate", [degrees, x, y, z])

    def transform(self, matrix: npt.ArrayLike) -> None:
        """4 x 4, for column vectors: the translation is the last column."""
        self._numbers("Transform", np.asarray(matrix, dtype=float).reshape(4, 4).T.ravel().tolist(), True)

    def concat_transform(self, matrix: npt.ArrayLike) -> None:
        self._numbers("ConcatTransform", np.asarray(matrix, dtype=float).reshape(4, 4).T.ravel().tolist(), True)

    @contextlib.contextmanager
    def attributes(self) -> Iterator[None]:
        """AttributeBegin and AttributeEnd: with builder.attributes(): ..."""
        self._world_directive("AttributeBegin")
        self._depth += 1
        yield
        self._depth -= 1
        self.directive("AttributeEnd")

    @contextlib.contextmanager
    def object(self, name: str) -> Iterator[None]:
        """ObjectBegin and ObjectEnd."""
        self._world_directive("ObjectBegin", name)
        self._depth += 1
        yield
        self._depth -= 1
        self.directive("ObjectEnd")

    def object_instance(self, name: str) -> None:
        self._world_directive("ObjectInstance", name)

    # Directives after WorldBegin.

    def reverse_orientation(self) -> None:
        self._world_directive("ReverseOrientation")

    def material(self, kind: str, /, **parameters: Any) -> None:
        self._world_directive("Material", kind, **parameters)

    def make_named_material(self, name: str, kind: str, /, **parameters: Any) -> None:
        self._world_directive("MakeNamedMaterial", name, type=kind, **parameters)

    def named_material(self, name: str) -> None:
        self._world_directive("NamedMaterial", name)

    def texture(self, name: str, kind: str, of: str = "spectrum", /, **parameters: Any) -> None:
        """`kind` as "imagemap" or "checkerboard"; `of`: "spectrum" or "float"."""
        self._world_directive("Texture", name, of, kind, **parameters)

    def make_named_medium(self, name: str, kind: str, /, **parameters: Any) -> None:
        self.directive("MakeNamedMedium", name, type=kind, **parameters)

    def medium_interface(self, inside: str, outside: str) -> None:
        self.directive("MediumInterface", inside, outside)

    def light_source(self, kind: str, /, **parameters: Any) -> None:
        """ "point", "spot", "distant", "infinite", "sky", "goniometric", "projection"; and, of a measured
        lamp's `filename`, "lightfield", "rayfile", "photometric"."""
        self._world_directive("LightSource", kind, **parameters)

    def area_light_source(self, kind: str = "diffuse", /, **parameters: Any) -> None:
        """Of the shapes that follow, up to the end of the block."""
        self._world_directive("AreaLightSource", kind, **parameters)

    def shape(self, kind: str, /, **parameters: Any) -> None:
        self._world_directive("Shape", kind, **parameters)

    def mesh(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        normals: Optional[npt.ArrayLike] = None,
        uv: Optional[npt.ArrayLike] = None,
        **parameters: Any,
    ) -> None:
        """A mesh of arrays: vertices (n, 3), triangles (m, 3) of their indices, normals (n, 3), uv (n, 2).

        They are copied, in double precision. `parameters` as of any shape, alpha for one.
        """
        indices = np.asarray(triangles)
        if indices.dtype.kind not in "iu":
            raise _lucerna.InputError(f"triangles: {indices.dtype} is not accepted; expected whole numbers")
        if indices.size and not (0 <= indices.min() and indices.max() < 2**31):
            raise _lucerna.InputError(f"triangles: indices are from {indices.min()} to {indices.max()}")
        name = f"mesh {len(self._meshes)}"
        self._meshes[name] = _lucerna.Mesh(
            np.asarray(vertices, dtype=np.float64),
            indices.astype(np.int32),
            None if normals is None else np.asarray(normals, dtype=np.float64),
            None if uv is None else np.asarray(uv, dtype=np.float32),
        )
        self._world_directive("Shape", "arraymesh", name=name, **parameters)

    @property
    def text(self) -> str:
        """The scene's text so far; meshes of arrays are named in it."""
        return "\n".join(self._lines) + "\n"

    def scene(self, **overrides: Any) -> Scene:
        """What was built, ready to be rendered. `overrides`: read_scene()."""
        self.world_begin()
        file = os.path.join(os.fspath(self._folder), "SceneBuilder")
        return _read(file, self.text, self._meshes, **overrides)
