"""Saved photon maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Optional

import numpy as np
import numpy.typing as npt

from . import _lucerna
from ._images import FloatArray, Path


@dataclass(frozen=True)
class PhotonMap:
    """The photons of one class, one row each."""

    positions: npt.NDArray[np.float64]
    """(n, 3), in the scene's world."""
    directions: FloatArray
    """(n, 3), unit vectors: the directions in which the photons travelled."""
    powers: FloatArray
    """(n, 3), linear, already divided by the number of light paths."""
    normals: Optional[FloatArray]
    """(n, 3), of the surfaces, on the side that was hit; None for photons in media."""
    lights: npt.NDArray[np.uint32]
    """(n,), indices of the lights that the photons came from."""
    bounces: npt.NDArray[np.uint8]
    """(n,), before this place; 255 stands for all above, too."""

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True)
class PhotonMaps:
    """What `lucerna render --save-maps FILE.photons` has written."""

    scene: str
    """Name of the scene's file; empty for a scene in memory."""
    unit: str
    """Of the powers: "W" or "lm"."""
    light_paths: int
    maps: Dict[str, PhotonMap]
    """By name: direct, global, caustic, volume; those that were built."""
    made_for: Dict[str, str]
    """What must be the same where the file is loaded: the hash of the scene, the seed, settings."""


def read_photon_maps(path: Path) -> PhotonMaps:
    """Reads the maps of any scene. InputError: not such a file, or a damaged one."""
    read: Dict[str, Any] = _lucerna.read_photon_maps(path)
    return PhotonMaps(
        scene=read["scene"],
        unit=read["unit"],
        light_paths=read["light_paths"],
        maps={name: PhotonMap(**arrays) for name, arrays in read["maps"].items()},
        made_for=read["made_for"],
    )
