"""The interface of light sources: delta lights arrive from one direction, the others are radiance over directions.

Directions point **to** the light and are in the world frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from ..arrays import ops
from ..formula.fields import Param, Vector
from ..formula.parametrised import Parametrised


class Arrival(NamedTuple):
    """Light of a delta source at a position: unit directions to the source (..., 3), and the irradiance [W m-2] of a
    plane perpendicular to them, with a channel axis: (..., 1) or (..., C).

    Example
    >>> sun = gn.DistantLight([0, 0, 1], irradiance=1000.0)
    >>> arrival = sun.arrival(np.zeros(3))
    >>> print(arrival.w, arrival.irradiance)
    [0. 0. 1.] [1000.]
    """

    w: Any
    irradiance: Any


class Light(Parametrised):
    """Base of the lights. A subclass is a delta light with `arrival`, or gives `incident`, and `sample` and `pdf` if
    it can be sampled.

    Example
    >>> print(gn.lights()["ConstantLight"](2.0))
    ConstantLight(radiance=2.0)
    """

    noun: ClassVar[str] = "a light"
    reflects: ClassVar[str] = "gn.render(m, {}), with the reflectance first"
    known_elsewhere: ClassVar[dict[str, str]] = dict.fromkeys(
        ("__call__", "f", "eval", "evaluate"), "gn.reflected_radiance(m, light, wo)"
    )
    is_delta: ClassVar[bool] = False
    can_sample: ClassVar[bool] = False

    @classmethod
    @cache
    def unwritten(cls) -> list[str]:
        """A light writes one of the two: `arrival`, or `incident`.

        Example
        >>> from gonio.authoring import Light
        >>> print(Light.unwritten(), gn.DistantLight.unwritten())
        ['arrival or incident'] []
        """
        written = cls.arrival is not Light.arrival or cls.incident is not Light.incident
        return [] if written else ["arrival or incident"]

    def arrival(self, position: Any) -> Arrival:
        """The light that a delta light sends to `position` (..., 3)."""
        raise self._lacks("arrival")

    def in_numpy(self) -> Self:
        """The same light with all numbers as NumPy arrays, without derivatives by them.

        Example
        >>> sun = gn.DistantLight([0, 0, 1], irradiance=1000.0)
        >>> print(sun.in_numpy() == sun)
        True
        """
        other = {name: ops.to_numpy(x) for name, x in self._of_libraries()}
        return self._changed(other) if other else self

    def like(self) -> Any:
        """A number of this light that is an array of another library than NumPy; None where there is none.

        Example
        >>> print(gn.DistantLight([0, 0, 1], irradiance=1000.0).like())
        None
        """
        return next((x for _, x in self._of_libraries()), None)

    def _of_libraries(self) -> Iterator[tuple[str, Any]]:
        for name, field in self.fields.items():
            value = self.__dict__[name]
            if isinstance(field, (Param, Vector)) and not isinstance(value, (float, np.ndarray)):
                yield name, value

    def incident(self, w: Any) -> Any:
        """Radiance [W m-2 sr-1] from unit world directions w (..., 3), with a channel axis: (..., 1) or (..., C).

        Example
        >>> sky = gn.ConstantLight(2.0)
        >>> print(sky.incident(gn.direction(0.5, 0.0)))
        [2.]
        """
        raise self._lacks("incident")

    def sample(self, u: Any) -> tuple[Any, Any]:
        """World directions (..., 3) for uniform numbers u (..., 2), and their density per solid angle [1/sr] (...).

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> w, pdf = light.sample(np.array([[0.2, 0.7], [0.5, 0.5]]))
        >>> print(w.shape, np.allclose(pdf, light.pdf(w)))
        (2, 3) True
        """
        raise self._lacks("sample")

    def pdf(self, w: Any) -> Any:
        """Density [1/sr] (...) of `sample` at world directions w (..., 3).

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> sun = gn.direction(*gn.angles([-0.8, -0.7, 0.8]))
        >>> print(light.pdf(sun) > 10.0 * light.pdf(np.array([0.0, 0.0, 1.0])))
        True
        """
        raise self._lacks("pdf")


def channel_vector(value: Any, like: Any) -> Any:
    """A light's spectrum as (..., C) in the library and dtype of `like`; a number becomes one channel.

    Example
    >>> from gonio.authoring import channel_vector
    >>> print(channel_vector(2.0, np.zeros(3)), channel_vector([0.3, 0.5, 1.0], np.zeros(3)))
    [2.] [0.3 0.5 1. ]
    """
    lib = ops.library(like)
    array = lib.convert(value, like)
    return array[None] if array.ndim == 0 else array


def vector_of(value: Any, like: Any) -> Any:
    """A light's vector (3,) in the library and dtype of `like`."""
    return ops.library(like).convert(np.array(value) if isinstance(value, np.ndarray) else value, like)
