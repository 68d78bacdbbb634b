"""Lucerna from Python: scenes, renders, measured lamps and images as NumPy arrays.

See docs/howto/python.md. Units are those of the command: metres (the scene's own unit in scenes), W or lm,
degrees; images have their top row first.
"""

from . import _processor  # must be first

_processor.require()

from ._errors import InputError, LucernaWarning
from ._illuminance import IlluminanceGrid, illuminance
from ._images import Image, compare, read_image, write_image
from ._lamps import LightField, PhotometricWeb, import_rays, open_ies
from ._lucerna import CalculationSurface, __version__
from ._maps import PhotonMap, PhotonMaps, read_photon_maps
from ._render import Result, render
from ._scenes import Scene, SceneBuilder, blackbody, read_scene, read_text, spectrum, texture

__all__ = [
    "CalculationSurface",
    "IlluminanceGrid",
    "Image",
    "InputError",
    "LightField",
    "LucernaWarning",
    "PhotometricWeb",
    "PhotonMap",
    "PhotonMaps",
    "Result",
    "Scene",
    "SceneBuilder",
    "__version__",
    "blackbody",
    "compare",
    "illuminance",
    "import_rays",
    "open_ies",
    "read_image",
    "read_photon_maps",
    "read_scene",
    "read_text",
    "render",
    "spectrum",
    "texture",
    "write_image",
]
