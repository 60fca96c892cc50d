"""Cameras: from a place in the picture to a ray."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..declared.numbers import numbers
from ..errors import ArrayTypeError, ParameterError, ShapeError
from ..formula.direction import Direction, cross, normalize
from ..formula.fields import param
from ..formula.parametrised import Parametrised
from ..formula.world import vector


class View(Parametrised):
    """Base of the cameras: from `eye` towards `target`, `up` being upwards; a place in the picture has a ray. Its
    positions are `vector(...)`s, which pictures move to where they see the scene from.

    Example
    >>> print(issubclass(gn.scenes.OrthographicCamera, gn.scenes.View))
    True
    """

    _noun: ClassVar[str] = "a camera: gn.scenes.Camera(eye, target=(x, y, z))"

    eye = vector((0.0, -4.0, 0.0), "where the camera is [m]")
    target = vector((0.0, 0.0, 0.0), "what is in the middle of the picture [m]")
    up = vector((0.0, 0.0, 1.0), "what is upwards in the picture", unit=True)

    @classmethod
    @cache
    def _unwritten(cls) -> list[str]:
        """A camera writes `ray`."""
        return ["ray"] if cls.ray is View.ray else []

    def ray(self, x: Any, y: Any) -> tuple[Direction, Direction]:
        """The origin and the unit direction of the ray through a place in the square picture, on components: x to the
        right and y up, from -1 to 1.

        Example
        >>> o, d = gn.scenes.Camera([0.0, -3.0, 0.0]).ray(0.0, 0.0)
        >>> print(o.y, d.y)
        -3.0 1.0
        """
        raise self._lacks("ray")

    def places(self, points: Any) -> np.ndarray | None:
        """Where points (N, 3) are in the picture: x and y (N, 2), those of rays; None where some are behind the camera,
        or nothing is known.

        Example
        >>> print(gn.scenes.OrthographicCamera(width=4.0).places(np.array([[1.0, 0.0, 2.0]])))
        [[0.5 1. ]]
        """
        return None

    def validate(self) -> None:
        along = np.asarray(self.target) - np.asarray(self.eye)
        length = float(np.linalg.norm(along))
        kind = type(self).__name__
        if not length > 0.0:
            raise ParameterError(f"{kind}: eye and target are one point, {self.eye}; expected two, to look along")
        if np.linalg.norm(np.cross(along / length, np.asarray(self.up))) < 1e-6:
            raise ParameterError(f"{kind}: up is along the view; expected another direction, such as up=[0, 1, 0]")

    @property
    def _axes(self) -> tuple[Direction, Direction, Direction]:
        """To the right, up and forward."""
        forward = normalize(self.target.vector - self.eye.vector)
        right = normalize(cross(forward, self.up.vector))
        return right, cross(right, forward), forward


class Camera(View):
    """A pinhole camera: things are the smaller the farther they are.

    Shapes   eye, target, up: (3,), up of any length, not along the view.
    Units    eye, target: m, as those of the scene; field_of_view: rad, across the whole picture.
    Error    rounding.
    Source   the pinhole camera: PBRT-4 section 5.2.2.

    Example
    >>> camera = gn.scenes.Camera([2.0, -4.0, 1.5], target=[0.0, 0.0, 0.2], field_of_view=0.5)
    >>> picture = gn.render(gn.material("gold"), size=16, samples=4, camera=camera)
    >>> print(picture.pixels.shape)
    (16, 16, 3)
    """

    field_of_view = param(0.6, 1e-4, 3.1, "angle across the picture", unit="rad")

    def ray(self, x: Any, y: Any) -> tuple[Direction, Direction]:
        right, up, forward = self._axes
        reach = ops.tan(0.5 * self.field_of_view)
        return self.eye.vector, normalize(forward + right * (x * reach) + up * (y * reach))

    def places(self, points: Any) -> np.ndarray | None:
        right, up, forward = (np.array(axis) for axis in self._axes)
        to = _points(points) - np.asarray(self.eye)
        depth = to @ forward
        if not (depth > 1e-6 * np.abs(depth).max(initial=0.0)).all():
            return None
        return np.stack([to @ right, to @ up], -1) / (depth * math.tan(0.5 * self.field_of_view))[:, None]


class OrthographicCamera(View):
    """A camera far away with a long lens: things have their size wherever they are. Behind the eye it sees nothing.

    Shapes   eye, target, up: (3,), up of any length, not along the view.
    Units    eye, target, width: m, as those of the scene; the width is that of the whole picture.
    Error    rounding.
    Source   orthographic projection.

    Example
    >>> camera = gn.scenes.OrthographicCamera([0.0, -4.0, 4.0], width=2.2)
    >>> print(gn.render(gn.material("gold"), size=16, samples=4, camera=camera).alpha.max())
    1.0
    """

    width = param(2.12, 1e-9, 1e30, "width of the picture", unit="m")

    def ray(self, x: Any, y: Any) -> tuple[Direction, Direction]:
        right, up, forward = self._axes
        half = 0.5 * self.width
        return self.eye.vector + right * (x * half) + up * (y * half), forward

    def places(self, points: Any) -> np.ndarray | None:
        right, up, _ = (np.array(axis) for axis in self._axes)
        to = _points(points) - np.asarray(self.eye)
        return np.stack([to @ right, to @ up], -1) / (0.5 * self.width)


def _points(points: Any) -> np.ndarray:
    try:
        found = numbers(points)
    except ValueError as error:
        raise ArrayTypeError(f"points: {error}; expected numbers (N, 3)") from None
    if found.ndim != 2 or found.shape[1] != 3:
        raise ShapeError(f"points are {found.shape}, expected (N, 3)")
    return found


class _Front(View, has_text=False):
    """That of a shape alone: along +y, x to the right, z up, far away. Places are in the world's lengths."""

    def ray(self, x: Any, y: Any) -> tuple[Direction, Direction]:
        return Direction(x, -2.0 + 0.0 * x, y), Direction(0.0, 1.0, 0.0)


FRONT: View = _Front()
"""The camera of pictures of one shape for which nobody asked for another."""

MARGIN = 1.06
"""Half the width of the picture, where shapes reach to 1."""


def facing(centre: np.ndarray, radius: float, tilt: float = 0.0) -> View:
    """A camera that sees a ball as `FRONT` sees the unit sphere, or from above it by an angle `tilt`."""
    back = 4.0 * radius * np.array([0.0, -math.cos(tilt), math.sin(tilt)])
    return OrthographicCamera(centre + back, centre, width=2.0 * MARGIN * radius)
