"""Rendering."""

from __future__ import annotations

import json
import math
from typing import Any, Callable, Dict, Optional, Tuple, Union

import numpy as np

from . import _lucerna
from ._images import Image
from ._scenes import Scene

Setting = Union[bool, int, float, str]
Progress = Callable[[str, float], object]


def _setting(name: str, value: Any) -> Tuple[str, Setting]:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, (bool, str)):
        return name, value
    if isinstance(value, (int, float)):
        return name, float(value)
    raise _lucerna.InputError(f"{name}: {value!r} is not accepted; expected a number, a string, True or False")


class Result(Image):
    """What was rendered: an image, and what is known about its making."""

    def __init__(self, rendered: _lucerna.Rendered) -> None:
        super().__init__(rendered.image)
        self._report: Dict[str, Any] = json.loads(rendered.report)
        self._complete = rendered.complete

    @property
    def report(self) -> Dict[str, Any]:
        """Times, counts and settings: what `--stats` writes."""
        return self._report

    @property
    def complete(self) -> bool:
        """False: it was interrupted, and this is what there was."""
        return self._complete


def render(
    scene: Scene,
    integrator: Optional[str] = None,
    spp: Optional[int] = None,
    time: Optional[float] = None,
    error: Optional[float] = None,
    seed: int = 0,
    threads: Optional[int] = None,
    layers: bool = False,
    denoise: bool = False,
    progress: Optional[Progress] = None,
    stop: str = "raise",
    passes: Optional[int] = None,
    adaptive: bool = True,
    crop: Optional[Tuple[int, int, int, int]] = None,
    **settings: Setting,
) -> Result:
    """Renders a scene: the same bits as `lucerna render` with the same options.

    What is not given is as the scene says. `time` in seconds and `error` as a share (0.02: 2 %) end the
    render; given one of them and no integrator, settings, spp nor passes, the method is chosen, too.
    `settings` are the integrator's parameters (`lucerna info --integrators`). `layers` keeps what the light
    is made of, and denoises; `adaptive` counts where it is denoised. `crop`: x0, y0, x1, y1 in pixels.

    The interpreter's lock is released while it renders. `progress(phase, share)` is called several times a
    second by the thread that renders; what it raises ends the render and is raised here. Ctrl-C ends it and
    raises KeyboardInterrupt; with stop="return" what there is by then is returned, with `complete` False.
    Python delivers signals to the main thread alone: a render in another does not hear them.

    InputError: an unknown or ill-typed setting, or what the scene's text has wrong.
    """
    if stop not in ("raise", "return"):
        raise _lucerna.InputError(f'stop: "{stop}" is not accepted; expected "raise" or "return"')
    for name, value, least in (("spp", spp, 1), ("passes", passes, 1), ("time", time, 0), ("error", error, 0)):
        if value is not None and not (value >= least and value > 0 and math.isfinite(value)):
            raise _lucerna.InputError(f"{name}: {value} is not accepted; expected a number above 0")
    for name, count in (("spp", spp), ("passes", passes)):
        if count is not None and count > 1 << 24:
            raise _lucerna.InputError(f"{name}: {count} is not accepted; expected at most {1 << 24}")
    return Result(
        _lucerna.render(
            scene._held,
            integrator or "",
            [_setting(name, value) for name, value in settings.items()],
            spp or 0,
            passes or 0,
            math.inf if time is None else time,
            error or 0.0,
            seed,
            threads,
            layers,
            denoise,
            adaptive,
            crop,
            progress,
            stop == "return",
        )
    )
