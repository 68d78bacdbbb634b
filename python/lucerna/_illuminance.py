"""Illuminance on calculation surfaces: what `lucerna lux` computes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from . import _lucerna
from ._lucerna import CalculationSurface
from ._render import Progress
from ._scenes import Scene

_Doubles = npt.NDArray[np.float64]


@dataclass(frozen=True)
class IlluminanceGrid:
    """The illuminance at the points of one surface, and what follows from it.

    Arrays have the shape (points along v, points along u), the first row at the surface's corner. A pair is a
    value and the half-width of its 95 % confidence interval.
    """

    name: str
    kind: str
    unit: str  # "lx", or "W/m^2" if the scene's lights count in W
    positions: _Doubles  # (v, u, 3): positions of the points in the scene
    values: _Doubles
    half_width: _Doubles  # of each value's 95 % confidence interval
    direct: _Doubles  # direct light from lamps and sky
    groups: Dict[str, _Doubles]  # the contribution of each light group of the scene
    mean: Tuple[float, float]
    least: Tuple[float, float]
    greatest: Tuple[float, float]
    uniformity: Tuple[float, float]  # U_0 = least / mean
    precision: float  # the widest interval of all surfaces, relative like `precision` of illuminance()

    def dimmed(self, **factors: float) -> _Doubles:
        """The values with light groups dimmed: `grid.dimmed(ceiling=0.5)`. No other render is needed."""
        values = self.values.copy()
        for name, factor in factors.items():
            if name not in self.groups:
                known = ", ".join(self.groups) or "none"
                raise _lucerna.InputError(f"{name}: not a light group of the scene; it has {known}")
            values += (factor - 1) * self.groups[name]
        return values


def illuminance(
    scene: Scene,
    surfaces: Optional[Sequence[CalculationSurface]] = None,
    precision: float = 0.02,
    time: Optional[float] = None,
    samples: Optional[int] = None,
    seed: int = 0,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> List[IlluminanceGrid]:
    """Illuminance on surfaces, by default those that the scene names: the numbers of `lucerna lux`.

    It ends when no point's 95 % interval is wider than ± `precision` of its illuminance (or of the surface's
    mean, if that is more), or after `time` seconds; with `samples`, of each sensor, the numbers are the same in
    every run. The scene is read again for it.

    InputError: a scene without surfaces, or surfaces that are not accepted.
    """
    for name, value in (("precision", precision), ("time", time), ("samples", samples)):
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise _lucerna.InputError(f"{name}: {value} is not accepted; a number above 0 is")
    grids = _lucerna.illuminance(
        scene._held,
        None if surfaces is None else list(surfaces),
        precision,
        math.inf if time is None else time,
        samples or 0,
        seed,
        threads,
        progress,
    )
    return [IlluminanceGrid(**grid) for grid in grids]
