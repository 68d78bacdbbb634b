# Declares the part of the extension that the package's own files call.
import os
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

_Path = Union[str, "os.PathLike[str]"]
_Floats = npt.NDArray[np.float32]
_Doubles = npt.NDArray[np.float64]
_Progress = Optional[Callable[[str, float], object]]

__version__: str

class InputError(ValueError): ...

class Image:
    def __init__(
        self, channels: List[str], values: _Floats, attributes: Dict[str, str], colour_space: Optional[str]
    ) -> None: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def channels(self) -> List[str]: ...
    @property
    def attributes(self) -> Dict[str, str]: ...
    @property
    def colour_space(self) -> str: ...
    def array(self, channels: List[str]) -> _Floats: ...
    def write_exr(self, file: _Path) -> None: ...
    def write_png(
        self, file: _Path, exposure: Optional[float], tone: str, white_balance: Optional[float]
    ) -> None: ...

def read_exr(file: _Path) -> Image: ...
def compare_json(
    images: List[Image], reference: Image, mask_above: float, cells: int, flip: bool, threads: Optional[int]
) -> str: ...

class Mesh:
    def __init__(
        self,
        vertices: _Doubles,
        triangles: npt.NDArray[np.int32],
        normals: Optional[_Doubles],
        uv: Optional[_Floats],
    ) -> None: ...

class Scene:
    @property
    def file(self) -> os.PathLike[str]: ...

class Rendered:
    @property
    def image(self) -> Image: ...
    @property
    def report(self) -> str: ...
    @property
    def complete(self) -> bool: ...

def read_scene(
    file: _Path,
    text: Optional[str],
    integrator: str,
    resolution: Optional[Tuple[int, int]],
    colour_space: Optional[str],
    skip_missing: bool,
    strict: bool,
    meshes: Dict[str, Mesh],
    threads: Optional[int],
    progress: _Progress,
) -> Scene: ...
def render(
    scene: Scene,
    integrator: str,
    settings: List[Tuple[str, Any]],
    spp: int,
    passes: int,
    time: float,
    error: float,
    seed: int,
    threads: Optional[int],
    layers: bool,
    denoise: bool,
    adaptive: bool,
    crop: Optional[Tuple[int, int, int, int]],
    progress: _Progress,
    keep_partial: bool,
) -> Rendered: ...

class CalculationSurface:
    def __init__(
        self,
        name: str,
        corner: Sequence[float],
        u: Sequence[float],
        v: Sequence[float],
        kind: str = ...,
        points: Optional[Tuple[int, int]] = ...,
        facing: Optional[Sequence[float]] = ...,
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def points(self) -> Tuple[int, int]: ...

def illuminance(
    scene: Scene,
    surfaces: Optional[List[CalculationSurface]],
    precision: float,
    time: float,
    samples: int,
    seed: int,
    threads: Optional[int],
    progress: _Progress,
) -> List[Dict[str, Any]]: ...

class Lumigraph:
    @property
    def flux(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def colour(self) -> Tuple[float, float, float]: ...
    @property
    def coloured(self) -> bool: ...
    @property
    def xyz(self) -> Tuple[float, float, float]: ...
    @property
    def missed(self) -> float: ...
    @property
    def lumens_per_watt(self) -> float: ...
    @property
    def provenance(self) -> str: ...
    @property
    def slab_count(self) -> int: ...
    def slabs(self) -> List[Lumigraph]: ...
    @property
    def normal(self) -> Tuple[float, float, float]: ...
    @property
    def views(self) -> Tuple[int, int]: ...
    @property
    def spacing(self) -> Tuple[float, float]: ...
    @property
    def pixels(self) -> Tuple[int, int]: ...
    @property
    def pixel(self) -> Tuple[float, float]: ...
    @property
    def distance(self) -> float: ...
    @property
    def centre(self) -> Tuple[float, float, float]: ...
    @property
    def u(self) -> _Doubles: ...
    @property
    def v(self) -> _Doubles: ...
    def array(self) -> _Floats: ...
    def with_array(self, array: _Floats) -> Lumigraph: ...
    def save(self, file: _Path) -> None: ...
    def project(
        self,
        distance: float,
        size: Tuple[float, float],
        resolution: Tuple[int, int],
        centre: Tuple[float, float],
        side: str,
        xyz: bool,
        threads: Optional[int],
    ) -> _Doubles: ...
    def frame(
        self, distance: float, side: str, threads: Optional[int]
    ) -> Tuple[Tuple[float, float], Tuple[float, float]]: ...
    def far_field(
        self, polar_step: float, azimuth_step: float, efficacy: float, threads: Optional[int]
    ) -> Web: ...

def read_lumigraph(file: _Path) -> Lumigraph: ...
def made_lumigraph(
    array: _Floats,
    spacing: Tuple[float, float],
    pixel: Tuple[float, float],
    distance: float,
    unit: str,
    centre: Tuple[float, float, float],
    provenance: str,
    basis: str,
) -> Lumigraph: ...
def import_rays(
    files: Sequence[_Path],
    drive: List[float],
    views: Optional[Tuple[int, int]],
    pixels: Optional[Tuple[int, int]],
    distance: Optional[float],
    capture: float,
    slabs: int,
    height: Optional[float],
    threads: Optional[int],
    progress: _Progress,
) -> Lumigraph: ...

class Web:
    def __init__(self, polar: _Doubles, azimuth: _Doubles, candela: _Floats) -> None: ...
    @property
    def flux(self) -> float: ...
    @property
    def peak(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def planes(self) -> str: ...
    @property
    def polar(self) -> _Doubles: ...
    @property
    def azimuth(self) -> _Doubles: ...
    @property
    def candela(self) -> _Floats: ...
    @property
    def keywords(self) -> List[Tuple[str, str]]: ...
    @property
    def provenance(self) -> str: ...
    def intensity(self, directions: _Doubles) -> _Doubles: ...
    def write_ies(self, file: _Path, title: str) -> None: ...

def read_photometric(file: _Path) -> Web: ...

def read_photon_maps(file: _Path) -> Dict[str, Any]: ...
