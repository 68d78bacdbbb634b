"""Images: arrays of named channels, in files and compared."""

from __future__ import annotations

import json
import math
import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _lucerna

FloatArray = npt.NDArray[np.float32]
Path = Union[str, "os.PathLike[str]"]

_TRIPLES = (("R", "G", "B"), ("X", "Y", "Z"))


def _grouped(names: Sequence[str]) -> Dict[str, List[str]]:
    """Channels by the layer that they belong to: albedo.R, .G and .B are "albedo"."""
    groups: Dict[str, List[str]] = {}
    known = set(names)
    for name in names:
        layer, dot, last = name.rpartition(".")
        for triple in _TRIPLES:
            members = [layer + dot + letter for letter in triple]
            if dot and last in triple and known.issuperset(members):
                groups[layer] = members
                break
        else:
            groups[name] = [name]
    return groups


class Image:
    """An image of named channels, as an EXR file of the project holds it.

    `image` is R, G and B, (H, W, 3) float32, or the first channel three times where there is no R, G and B.
    """

    def __init__(self, held: _lucerna.Image) -> None:
        self._held = held

    @property
    def image(self) -> FloatArray:
        names = self.channels
        if all(letter in names for letter in "RGB"):
            return self._held.array(["R", "G", "B"])
        return self._held.array([names[0]] * 3)

    @property
    def variance(self) -> Optional[FloatArray]:
        """Of each pixel's mean, (H, W, 3); None where the file has none."""
        names = ["variance.R", "variance.G", "variance.B"]
        return self._held.array(names) if set(names) <= set(self.channels) else None

    @property
    def denoised(self) -> Optional[FloatArray]:
        """What the denoiser made of the image, (H, W, 3); None where it was not asked for."""
        names = ["denoised.R", "denoised.G", "denoised.B"]
        return self._held.array(names) if set(names) <= set(self.channels) else None

    @property
    def layers(self) -> Dict[str, FloatArray]:
        """All other channels: (H, W, 3) where they are three of a kind, else (H, W)."""
        own = {"R", "G", "B", "variance", "denoised"}
        layers: Dict[str, FloatArray] = {}
        for layer, names in _grouped(self.channels).items():
            if layer in own:
                continue
            values = self._held.array(names)
            layers[layer] = values if len(names) > 1 else values[..., 0]
        return layers

    @property
    def channels(self) -> List[str]:
        return self._held.channels

    def channel(self, name: str) -> FloatArray:
        """One channel, (H, W). KeyError if there is none of that name."""
        return self._held.array([name])[..., 0]

    @property
    def attributes(self) -> Dict[str, str]:
        """The texts of the file's header: what was rendered, how, and "lucerna.unit" of the numbers."""
        return self._held.attributes

    @property
    def width(self) -> int:
        return self._held.width

    @property
    def height(self) -> int:
        return self._held.height

    @property
    def colour_space(self) -> str:
        """Of R, G and B: "srgb" (linear), "rec2020" or "acescg"."""
        return self._held.colour_space

    def save(
        self,
        path: Path,
        exposure: Optional[float] = None,
        tone: str = "neutral",
        white_balance: Optional[float] = None,
    ) -> None:
        """Writes all channels (.exr), or a tone-mapped picture (.png) of the denoised image if there is one.

        `exposure` in stops (None: automatic), `tone` "neutral" or "linear", `white_balance` in kelvins; these
        three are the picture's alone.
        """
        if os.fspath(path).lower().endswith(".png"):
            shown = self._held
            denoised = self.denoised
            if denoised is not None:
                shown = _lucerna.Image(["R", "G", "B"], denoised, {}, self.colour_space)
            shown.write_png(path, exposure, tone, white_balance)
        elif os.fspath(path).lower().endswith(".exr"):
            self._held.write_exr(path)
        else:
            raise _lucerna.InputError(f"{os.fspath(path)}: the name must end in .exr (values) or .png (a picture)")

    def __repr__(self) -> str:
        return f"<lucerna.{type(self).__name__} {self.width} x {self.height}, {len(self.channels)} channels>"


Picture = Union[Image, npt.ArrayLike, Path]


def read_image(path: Path) -> Image:
    """An EXR file. R, G and B of other chromaticities are brought to linear sRGB."""
    return Image(_lucerna.read_exr(path))


def _image_of(
    picture: Picture,
    channels: Optional[Sequence[str]] = None,
    attributes: Optional[Mapping[str, str]] = None,
    colour_space: Optional[str] = None,
) -> Image:
    if isinstance(picture, Image):
        return picture
    if isinstance(picture, (str, os.PathLike)):
        return read_image(picture)
    values = np.asarray(picture, dtype=np.float32)
    if values.ndim == 2:
        values = values[..., np.newaxis]
    if values.ndim != 3:
        raise _lucerna.InputError(f"image: shape {values.shape} is not accepted; expected (height, width, channels)")
    if channels is None:
        usual = {1: ["Y"], 3: ["R", "G", "B"]}.get(values.shape[2])
        if usual is None:
            raise _lucerna.InputError(
                f"image: names of {values.shape[2]} channels are needed; 1 and 3 have usual ones"
            )
        channels = usual
    return Image(_lucerna.Image(list(channels), values, dict(attributes or {}), colour_space))


def write_image(
    path: Path,
    image: Picture,
    channels: Optional[Sequence[str]] = None,
    attributes: Optional[Mapping[str, str]] = None,
    colour_space: Optional[str] = None,
    **look: Any,
) -> None:
    """Writes an Image or an array, (H, W) or (H, W, channels), as .exr or .png (`look`: Image.save).

    Names of channels default to Y of one and R, G and B of three.
    """
    _image_of(image, channels, attributes, colour_space).save(path, **look)


def compare(
    image: Union[Picture, List[Picture]],
    reference: Picture,
    mask: float = math.inf,
    cells: int = 1,
    flip: bool = True,
    threads: Optional[int] = None,
) -> Dict[str, Any]:
    """How far an image, or each of a list that differ in their seeds, is from its reference.

    What `lucerna compare --json` writes. Images are files, Images or arrays. `mask`: pixels of which the
    reference is above this are left out. `cells`: side of the squares that the z-test takes for one value.
    """
    images = image if isinstance(image, list) else [image]
    held = [_image_of(one)._held for one in images]
    numbers: Dict[str, Any] = json.loads(
        _lucerna.compare_json(held, _image_of(reference)._held, mask, cells, flip, threads)
    )
    return numbers
