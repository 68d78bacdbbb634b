"""Measured lamps: light fields, ray files, photometric webs."""

from __future__ import annotations

import os
from typing import Callable, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _lucerna
from ._images import FloatArray, Path

DoubleArray = npt.NDArray[np.float64]
Progress = Callable[[str, float], object]


class LightField:
    """A lamp's measured light field; it never changes.

    Light leaves along +z through two planes: S with the filters ("views"), and M at a `distance` with the
    pixels of each view. Lengths in metres. A lamp that shines to several sides has several `slabs`, each a
    light field by itself; what is told of planes and numbers is then told of each of them alone.
    """

    def __init__(self, held: _lucerna.Lumigraph) -> None:
        self._held = held

    @classmethod
    def open(cls, path: Path) -> LightField:
        """A light field's file (.exr)."""
        return cls(_lucerna.read_lumigraph(path))

    @classmethod
    def from_array(
        cls,
        array: npt.ArrayLike,
        spacing: Tuple[float, float],
        pixel: Tuple[float, float],
        distance: float,
        unit: str = "W",
        centre: Tuple[float, float, float] = (0, 0, 0),
        provenance: str = "",
        basis: str = "box",
    ) -> LightField:
        """Of coefficients as `array` has them: filters `spacing` apart, pixels of size `pixel`, unit "W" or "lm".
        What a pixel stands for: its "box", as a camera measures, or its "hat", which has no steps."""
        values = np.asarray(array, dtype=np.float32)
        return cls(_lucerna.made_lumigraph(values, spacing, pixel, distance, unit, centre, provenance, basis))

    @property
    def array(self) -> FloatArray:
        """The coefficients E[m, n, k, l], in `unit` per m^4: views along u and v, pixels along s and t, all
        upwards. Of several colours (..., 3): CIE X, Y and Z, Y on the flux's scale. A copy."""
        return self._held.array()

    def with_array(self, array: npt.ArrayLike) -> LightField:
        """The same planes with other coefficients, shaped as `array`; a coloured field of (u, v, s, t) alone
        has one colour. What the file said to be missed of the lamp's flux is 0."""
        return LightField(self._held.with_array(np.asarray(array, dtype=np.float32)))

    def save(self, path: Path) -> None:
        """Writes the file. It holds halves times a power of 2: numbers are rounded to 11 bits."""
        if not os.fspath(path).lower().endswith(".exr"):
            raise _lucerna.InputError(f"{os.fspath(path)}: a light field's name must end in .exr")
        self._held.save(path)

    @property
    def flux(self) -> float:
        """What the field holds, in `unit`."""
        return self._held.flux

    @property
    def unit(self) -> str:
        """ "W" or "lm"."""
        return self._held.unit

    @property
    def missed(self) -> float:
        """Flux of the lamp that the field does not hold."""
        return self._held.missed

    @property
    def lumens_per_watt(self) -> float:
        """Luminous efficacy of the radiation of a lamp in W; 0: not known."""
        return self._held.lumens_per_watt

    @property
    def colour(self) -> Tuple[float, float, float]:
        """Of all its light: linear sRGB of luminance 1, negative outside the gamut."""
        return self._held.colour

    @property
    def xyz(self) -> Tuple[float, float, float]:
        """Of all its light: CIE XYZ with Y = 1."""
        return self._held.xyz

    @property
    def coloured(self) -> bool:
        """Whether not all its light is of one colour."""
        return self._held.coloured

    @property
    def provenance(self) -> str:
        return self._held.provenance

    @property
    def slabs(self) -> List[LightField]:
        return [LightField(slab) for slab in self._held.slabs()]

    @property
    def normal(self) -> Tuple[float, float, float]:
        """Where the slab looks, in the lamp's frame."""
        return self._held.normal

    @property
    def views(self) -> Tuple[int, int]:
        """Filters along u and v."""
        return self._held.views

    @property
    def spacing(self) -> Tuple[float, float]:
        """Between filters, in the coordinate of S in which they are even."""
        return self._held.spacing

    @property
    def u(self) -> DoubleArray:
        """Where the filters stand along u on S."""
        return self._held.u

    @property
    def v(self) -> DoubleArray:
        return self._held.v

    @property
    def pixels(self) -> Tuple[int, int]:
        """Of one view's image, along s and t."""
        return self._held.pixels

    @property
    def pixel(self) -> Tuple[float, float]:
        """The size of a pixel, in the coordinate of M in which they are even."""
        return self._held.pixel

    @property
    def distance(self) -> float:
        """From S to M."""
        return self._held.distance

    @property
    def centre(self) -> Tuple[float, float, float]:
        """Of S, in the frame of the lamp's file."""
        return self._held.centre

    def project(
        self,
        distance: float,
        size: Union[float, Tuple[float, float]],
        resolution: Tuple[int, int] = (512, 512),
        centre: Tuple[float, float] = (0, 0),
        side: str = "+z",
        xyz: bool = False,
        threads: Optional[int] = None,
    ) -> DoubleArray:
        """Irradiance, W/m^2 or lx, on a screen across the lamp's axis: mean of each pixel, (H, W), y upwards,
        so that the top row comes first. `xyz`: (H, W, 3), CIE X, Y and Z.

        `distance` counts from S, of a lamp of several slabs from the middle of its box. Where the light is
        weaker than its noise values may be negative: they sum to the flux that was measured.
        """
        width, height = (size, size) if isinstance(size, (int, float)) else size
        return self._held.project(distance, (width, height), resolution, centre, side, xyz, threads)

    def frame(
        self, distance: float, side: str = "+z", threads: Optional[int] = None
    ) -> Tuple[Tuple[float, float], Tuple[float, float]]:
        """Size and centre of a square screen that holds about 96 % of the light in each direction."""
        return self._held.frame(distance, side, threads)

    def far_field(
        self,
        polar_step: float = 1,
        azimuth_step: float = 5,
        efficacy: float = 0,
        threads: Optional[int] = None,
    ) -> PhotometricWeb:
        """What is left of it from so far away that only the direction counts. Steps in degrees.
        `efficacy`: lumens for each W of a lamp in W; 0: intensities stay in W/sr."""
        return PhotometricWeb(self._held.far_field(polar_step, azimuth_step, efficacy, threads))

    def __repr__(self) -> str:
        return f"<lucerna.LightField {self.flux:.6g} {self.unit}, {self._held.slab_count} slab(s)>"


def import_rays(
    path: Union[Path, Sequence[Path]],
    drive: Sequence[float] = (),
    views: Optional[Tuple[int, int]] = None,
    pixels: Optional[Tuple[int, int]] = None,
    distance: Optional[float] = None,
    capture: float = 0.993,
    slabs: int = 0,
    height: Optional[float] = None,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> LightField:
    """The light field of a ray file, or of several that shine as one lamp: `lucerna light import`.

    What is not given is chosen from the rays. `drive`: what each file's flux is multiplied by.
    """
    files = [path] if isinstance(path, (str, os.PathLike)) else list(path)
    return LightField(
        _lucerna.import_rays(
            files, list(drive), views, pixels, distance, capture, slabs, height, threads, progress
        )
    )


class PhotometricWeb:
    """A lamp's intensity over directions: a far field, or a photometric file's."""

    def __init__(self, held: _lucerna.Web) -> None:
        self._held = held

    @classmethod
    def from_array(cls, polar: npt.ArrayLike, azimuth: npt.ArrayLike, candela: npt.ArrayLike) -> PhotometricWeb:
        """Of C planes: angles in degrees from nadir (n) and around it (m), intensities (m, n) in candela."""
        return cls(
            _lucerna.Web(
                np.asarray(polar, dtype=np.float64),
                np.asarray(azimuth, dtype=np.float64),
                np.asarray(candela, dtype=np.float32),
            )
        )

    @property
    def polar(self) -> DoubleArray:
        """Degrees from nadir (+z of the lamp's frame), for `planes` "C"."""
        return self._held.polar

    @property
    def azimuth(self) -> DoubleArray:
        """Degrees around it: the planes."""
        return self._held.azimuth

    @property
    def array(self) -> FloatArray:
        """Intensities, (azimuth, polar), in `unit`."""
        return self._held.candela

    @property
    def planes(self) -> str:
        """ "C", "B" or "A"."""
        return self._held.planes

    @property
    def unit(self) -> str:
        """Of intensities: "cd" or "W/sr"."""
        return self._held.unit

    @property
    def flux(self) -> float:
        """lm, or W."""
        return self._held.flux

    @property
    def peak(self) -> float:
        return self._held.peak

    @property
    def keywords(self) -> List[Tuple[str, str]]:
        """Of an IES file, in its order."""
        return self._held.keywords

    @property
    def provenance(self) -> str:
        return self._held.provenance

    def intensity(self, directions: npt.ArrayLike) -> DoubleArray:
        """Towards directions (n, 3) in the lamp's frame; 0 where the web has no light."""
        return self._held.intensity(np.asarray(directions, dtype=np.float64))

    def write_ies(self, path: Path, title: str = "") -> None:
        """IES LM-63-2002, absolute. A lamp in W needs far_field(efficacy=...)."""
        self._held.write_ies(path, title or os.path.splitext(os.path.basename(os.fspath(path)))[0])

    def __repr__(self) -> str:
        unit = "lm" if self.unit == "cd" else "W"
        return f"<lucerna.PhotometricWeb {self.flux:.6g} {unit}, peak {self.peak:.6g} {self.unit}>"


def open_ies(path: Path) -> PhotometricWeb:
    """A photometric file: IES LM-63, EULUMDAT, IES TM-33 or GLDF (with `#variant` behind its name)."""
    return PhotometricWeb(_lucerna.read_photometric(path))
