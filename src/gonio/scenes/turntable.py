"""A turntable: a shape that turns, or lights that go round it, as a moving picture."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..base.shown_channels import is_coloured
from ..declared.arguments import Declared, Seed, checked
from ..errors import ParameterError, said_once
from ..files import target
from ..integrals.illumination import as_lights
from ..lights.environment import EnvironmentLight
from ..lights.turned import turned
from ..pictures.animation import SUFFIXES, save_animation
from ..pictures.image import Image
from .asked import Backdrop, PixelTolerance, Samples, Size
from .camera import FRONT, View, facing
from .rendering import default_light, render
from .scene import Scene
from .stage import Stage


@checked
def write_turntable(
    m: Reflectance | Scene,
    path: str | os.PathLike[str] | None = None,
    lights: Light | Iterable[Light] | None = None,
    frames: Annotated[int, Declared("pictures of a turn", 2, 1000)] = 24,
    shape: Any = "sphere",
    size: Size = 256,
    samples: Samples | None = None,
    seed: Seed = 0,
    seconds: Annotated[float, Declared("duration of a turn", 0.02, 3600.0, "s")] = 4.0,
    exposure: Annotated[float, Declared("stops by which pictures are brightened", -200.0, 200.0)] = 0.0,
    progress: Callable[[int, int], None] | None = None,
    channels: Any = None,
    tolerance: PixelTolerance | None = None,
    turns: Annotated[str, Declared("what turns", words=("lights", "shape"))] = "lights",
    camera: View | None = None,
    ground: Reflectance | None = None,
    backdrop: Backdrop = False,
) -> list[Image]:
    """Pictures of a lit shape while all lights go round it, once, about the vertical axis through 0, 0, 0, or, with
    `turns="shape"`, while it turns itself under lights, and before a camera, that stay.

    `path`: a .png (animated, with coverage) or a .gif (256 colours) that shows the frames for so many `seconds` again
    and again; without one they are only returned, to be saved each by itself in any format. In frame k what turns is
    turned by 2 pi k/frames, counterclockwise as seen from above (`TurnedLight`). All frames are one compiled formula.
    The other arguments are those of `render`, and `exposure`, in stops.

    Errors   those of `render`; ParameterError for another suffix, and for channels that are no colours.

    Example
    >>> light = gn.EnvironmentLight.studio(height=32)
    >>> pictures = gn.scenes.write_turntable(gn.material("gold"), "gold.png", light, frames=3, size=16, samples=4)
    >>> print(len(pictures), pictures[1])
    3 Image(16 x 16, 3 channels, alpha)
    """
    if path is not None:
        if Path(path).suffix.lower() not in SUFFIXES:
            raise ParameterError(f"{path}: expected a name that ends in {' or '.join(SUFFIXES)}")
        if isinstance(m, Reflectance) and not is_coloured(m, channels):
            raise ParameterError(f"{path}: frames of {m.channels} channels, expected 1 or 3; choose three, channels=")
        target(path)
    if lights is None:
        of = m if isinstance(m, Reflectance) else next((x.material for x in m.parts if x.material is not None), None)
        lights = EnvironmentLight.studio() if of is None else default_light(of, channels)
    given = as_lights(lights)
    view = camera
    pictures = []
    with said_once():
        for k in range(frames):
            angle = 2.0 * math.pi * k / frames * (1.0 if turns == "lights" else -1.0)
            if turns == "shape":  # which is the same as all else going round the other way
                view = _turned(_camera(m if isinstance(m, Scene) else shape, camera, ground), angle)
            round_ = [turned(light, angle) for light in given]
            options = {
                "channels": channels,
                "tolerance": tolerance,
                "camera": view,
                "ground": ground,
                "backdrop": backdrop,
            }
            pictures.append(render(m, round_, shape, size, samples, seed, **options))
            if progress is not None:
                progress(k + 1, frames)
    if path is not None:
        save_animation(pictures, path, seconds, exposure)
    return pictures


def _camera(shape: Any, camera: View | None, ground: Reflectance | None) -> View:
    """The camera of `render`, as one that can be anywhere."""
    view = Stage.of(shape, camera, ground).camera
    return facing(np.zeros(3), 1.0) if view is FRONT else view


def _turned(view: View, angle: float) -> View:
    """A camera turned by an angle about the vertical axis."""
    cos, sin = math.cos(angle), math.sin(angle)
    by = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return view.replace({name: by @ np.asarray(getattr(view, name)) for name in ("eye", "target", "up")})
