"""The interface of light sources: delta lights arrive from one direction, the others are radiance over directions.

Directions point **to** the light; they and positions are in the world frame. A light is a formula on components, as a
model is: compiled, on every array library, and differentiable by all its numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from ..arrays import ops
from ..arrays.kinds import with_channels
from ..errors import ParameterError, TraceError, shown
from ..evaluate import batch
from ..evaluate.tracing import traced
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import part
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum
from ..formula.state import derived
from ..formula.world import moved, vector
from . import light_kernels

FAR = 1e30
"""The distance [m] of light from infinitely far away."""

ORIGIN = (0.0, 0.0, 0.0)


class Arrival(NamedTuple):
    """Light of a delta source at a position: unit directions to the source (..., 3), the irradiance [W m-2] of a plane
    perpendicular to them, with a channel axis, (..., 1) or (..., C), and the distance [m] of the source (...).

    Example
    >>> sun = gn.DistantLight([0, 0, 1], irradiance=1000.0)
    >>> arrival = sun.arrival(np.zeros(3))
    >>> print(arrival.w, arrival.irradiance)
    [0. 0. 1.] [1000.]
    """

    w: Any
    irradiance: Any
    distance: Any


class Light(Parametrised):
    """Base of the lights. A subclass is a delta light with `beam`, or gives `seen`, and `warp` and `density` if it can
    be sampled.

    Formulas have positions p and directions w as `Direction`s, and random numbers as numbers; what they return has no
    channel axis. `incident`, `sample`, `pdf`, `arrival` and `distance` are the same for arrays.

    Example
    >>> print(gn.lights()["ConstantLight"](2.0))
    ConstantLight(radiance=2.0)
    """

    _noun: ClassVar[str] = "a light"
    _reflects: ClassVar[str] = "gn.render(m, {}), with the reflectance first"
    _known_elsewhere: ClassVar[dict[str, str]] = dict.fromkeys(
        ("__call__", "f", "eval", "evaluate"), "gn.reflected_radiance(m, light, wo)"
    )
    is_delta: ClassVar[bool] = False
    has_edges: ClassVar[bool] = False
    """Whether it has edges, which move with its numbers and with the position that it is seen from."""
    can_sample: ClassVar[bool] = False
    """Whether integrals draw directions from it; those under other lights, which are smooth, are by quadrature."""
    has_horizon: ClassVar[bool] = False
    """Whether half of its directions are dark: pictures draw directions from it, integrals need not."""

    @classmethod
    @cache
    def _unwritten(cls) -> list[str]:
        """A light writes one of the two: `beam`, or `seen`."""
        return [] if cls.is_formula() or cls.incident is not Light.incident else ["beam or seen"]

    @classmethod
    def is_formula(cls) -> bool:
        """Whether it is a formula on components, for kernels: all but functions of arrays are.

        Example
        >>> print(gn.ConstantLight.is_formula(), gn.FunctionLight.is_formula())
        True False
        """
        return cls.beam is not Light.beam or cls.seen is not Light.seen

    # The formula, on components.

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        """Radiance [W m-2 sr-1] that arrives at p from w, 0 where w misses the light, and the distance [m] to where it
        comes from, `FAR` from infinitely far.

        Example
        >>> from gonio.authoring import NORMAL, Direction
        >>> print(gn.ConstantLight(2.0).seen(Direction(0.0, 0.0, 0.0), NORMAL))
        (2.0, 1e+30)
        """
        raise self._lacks("seen")

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        """A unit direction towards the light for two uniform numbers.

        Example
        >>> from gonio.authoring import Direction
        >>> print(gn.ConstantLight(2.0).warp(Direction(0.0, 0.0, 0.0), np.array(0.3), np.array(0.0)).z)
        1.0
        """
        raise self._lacks("warp")

    def density(self, p: Direction, w: Direction) -> Any:
        """The density [1/sr] of `warp`: 0 for directions that it does not give.

        Example
        >>> from gonio.authoring import NORMAL, Direction
        >>> print(round(gn.ConstantLight(2.0).density(Direction(0.0, 0.0, 0.0), NORMAL), 4))
        0.0796
        """
        raise self._lacks("density")

    def drawn(self, p: Direction, u0: Any, u1: Any) -> tuple[Direction, Any]:
        """`warp`, and the density there: of lights that know it then, without looking the direction up again.

        Example
        >>> from gonio.authoring import Direction
        >>> w, density = gn.ConstantLight(2.0).drawn(Direction(0.0, 0.0, 0.0), np.array(0.3), np.array(0.0))
        >>> print(w.z, round(density, 4))
        1.0 0.0796
        """
        w = self.warp(p, u0, u1)
        return w, self.density(p, w)

    def beam(self, p: Direction) -> tuple[Direction, Any, Any]:
        """Of delta lights, at p: the unit direction to the light, the irradiance [W m-2] of a plane perpendicular to
        it, and the distance [m].

        Example
        >>> from gonio.authoring import Direction
        >>> w, E, distance = gn.PointLight([0.0, 0.0, 2.0], 8.0).beam(Direction(0.0, 0.0, 0.0))
        >>> print(w.z, E, distance)
        1.0 2.0 2.0
        """
        raise self._lacks("beam")

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        """The irradiance [W m-2] at p of a surface with normal n in closed form; None where there is none.

        Example
        >>> from gonio.authoring import NORMAL, Direction
        >>> print(round(gn.ConstantLight(2.0).irradiance_on(Direction(0.0, 0.0, 0.0), NORMAL), 4))
        6.2832
        """
        return None

    @property
    def has_closed_form(self) -> bool:
        """Whether its irradiance has a closed form.

        Example
        >>> print(gn.ConstantLight().has_closed_form, gn.CIESky().has_closed_form)
        True False
        """
        return self.is_delta or type(self).irradiance_on is not Light.irradiance_on

    def holds(self, p: Direction) -> Any:
        """Whether p is in the light, or on it, where it says nothing: None for lights that no place is in.

        Example
        >>> from gonio.authoring import Direction
        >>> print(gn.SphereLight([0.0, 0.0, 2.0], radius=0.5).holds(Direction(0.0, 0.0, 1.8)))
        True
        """
        return None

    def strength(self, p: Direction) -> Any:
        """About the irradiance [W m-2] of a surface at p that faces the light: to choose one of many by.

        Example
        >>> from gonio.authoring import Direction
        >>> print(gn.PointLight([0.0, 0.0, 2.0], 8.0).strength(Direction(0.0, 0.0, 0.0)))
        2.0
        """
        if self.is_delta:
            return self.beam(p)[1]
        raise self._lacks("strength")

    def moved(self, by: Sequence[float]) -> Light:
        """The same light, moved by three lengths along x, y and z: where p + by is, it is as it was at p.

        Pictures move lights to where they see the scene from. By default the positions among its numbers move, its
        `vector(...)`s; of a light without any the formula gets p - by, if it asks where p is.

        Example
        >>> print(gn.PointLight([0.0, 0.0, 2.0]).moved((1.0, 0.0, 0.0)).position, gn.ConstantLight().moved((1, 0, 0)))
        [1.0, 0.0, 2.0] ConstantLight(radiance=1.0)
        """
        try:
            lengths = np.array([*ops.numbers(by)], dtype=float)
        except (TypeError, ValueError):
            lengths = np.zeros(0)
        if lengths.shape != (3,) or not np.isfinite(lengths).all():
            raise ParameterError(f"moved(by={shown(by)}): expected three lengths [m] along x, y and z")
        return self._moved(tuple(lengths.tolist()))

    def _moved(self, by: Sequence[float]) -> Light:
        """The same, for lights that know better where they are."""
        new = moved(self, by)
        return _Moved(self, tuple(by)) if new is self and _asks_where(self) else new

    # The same for arrays of any library.

    def incident(self, w: Any, position: Any = ORIGIN) -> Any:
        """Radiance [W m-2 sr-1] from unit world directions w (..., 3), with a channel axis: (..., 1) or (..., C).

        Example
        >>> sky = gn.ConstantLight(2.0)
        >>> print(sky.incident(gn.direction(0.5, 0.0)))
        [2.]
        """
        if not self.is_formula():
            raise self._lacks("seen")
        w, position = _arrays("w", w, position)
        return _with_channels(batch.run(light_kernels.INCIDENT, self, (w, position))[0], w, position)

    def distance(self, w: Any, position: Any = ORIGIN) -> Any:
        """The distance [m] (...) to where light comes from, along unit world directions w (..., 3).

        Example
        >>> print(gn.ConstantLight(2.0).distance(gn.direction(0.5, 0.0)))
        1e+30
        """
        return batch.run(light_kernels.DISTANCE, self, _arrays("w", w, position))[0]

    def sample(self, u: Any, position: Any = ORIGIN) -> tuple[Any, Any]:
        """World directions (..., 3) for uniform numbers u (..., 2), and their density per solid angle [1/sr] (...).

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> w, pdf = light.sample(np.array([[0.2, 0.7], [0.5, 0.5]]))
        >>> print(w.shape, np.allclose(pdf, light.pdf(w)))
        (2, 3) True
        """
        w, pdf = batch.run(light_kernels.SAMPLE, self, _arrays("u", u, position))
        return w, pdf

    def pdf(self, w: Any, position: Any = ORIGIN) -> Any:
        """Density [1/sr] (...) of `sample` at world directions w (..., 3).

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> sun = gn.direction(*gn.angles([-0.8, -0.7, 0.8]))
        >>> print(light.pdf(sun) > 10.0 * light.pdf(np.array([0.0, 0.0, 1.0])))
        True
        """
        return batch.run(light_kernels.PDF, self, _arrays("w", w, position))[0]

    def arrival(self, position: Any) -> Arrival:
        """The light that a delta light sends to `position` (..., 3).

        Example
        >>> print(gn.PointLight([0.0, 0.0, 2.0], 8.0).arrival([0.0, 0.0, 0.0]).irradiance)
        [2.]
        """
        (position,) = _arrays("position", position)
        w, E, distance = batch.run(light_kernels.ARRIVAL, self, (position,))
        return Arrival(w, _with_channels(E, position), distance)

    def irradiance_at(self, position: Any, normal: Any) -> Any:
        """Irradiance [W m-2] (..., 1) or (..., C) of surfaces with unit normals, in closed form; None without one.

        Example
        >>> print(gn.PointLight([0.0, 0.0, 2.0], 8.0).irradiance_at([0.0, 0.0, 0.0], [0.0, 0.6, 0.8]))
        [1.6]
        """
        if not self.has_closed_form:
            return None
        position, normal = _arrays("position", position, normal)
        found = batch.run(light_kernels.IRRADIANCE, self, (position, normal))[0]
        return _with_channels(found, position, normal)

    def check_position(self, position: Any) -> None:
        """Raises ParameterError where one of the positions (..., 3) is in the light; where they can be read.

        Example
        >>> try:
        ...     gn.PointLight([0.0, 0.0, 2.0]).check_position([0.0, 0.0, 2.0])
        ... except gn.Error as error:
        ...     print(error)
        ...
        PointLight is at the position (0, 0, 2), or around it; expected positions outside the light
        """
        if type(self).holds is Light.holds or self.like() is not None:
            return
        lib, (position,) = ops.as_arrays(position, name="position")
        known = lib.known(position)
        if known is None:
            return
        held = batch.run(light_kernels.HOLDS, self, (np.asarray(known, dtype=float),))[0]
        if np.any(held):
            where = ", ".join(f"{x:g}" for x in np.asarray(known)[np.asarray(held, dtype=bool)].reshape(-1, 3)[0])
            rule = "expected positions outside the light"
            raise ParameterError(f"{type(self).__name__} is at the position ({where}), or around it; {rule}")

    def in_numpy(self) -> Self:
        """The same light with all numbers as NumPy arrays, without derivatives by them.

        Example
        >>> sun = gn.DistantLight([0, 0, 1], irradiance=1000.0)
        >>> print(sun.in_numpy() == sun)
        True
        """
        return self if self.like() is None else tree.each(self, _in_numpy)

    def like(self) -> Any:
        """A number of this light that is an array of another library than NumPy; None where there is none.

        Example
        >>> print(gn.DistantLight([0, 0, 1], irradiance=1000.0).like())
        None
        """
        return self._facts[0]

    @derived
    def _facts(self) -> tuple[Any, bool, bool]:
        """See `like`; whether numbers have a channel axis; whether some are spectra."""
        leaves = list(tree.leaves(self))
        foreign = next((x for x in leaves if _is_foreign(x)), None)
        return foreign, any(getattr(x, "ndim", 0) for x in leaves), any(isinstance(x, Spectrum) for x in leaves)

    @property
    def has_channels(self) -> bool:
        """Whether some number has a channel axis.

        Example
        >>> print(gn.ConstantLight(1.0).has_channels, gn.ConstantLight([1.0, 0.9, 0.7]).has_channels)
        False True
        """
        return self._facts[1]

    @property
    def has_spectra(self) -> bool:
        """Whether some number is a spectrum.

        Example
        >>> print(gn.ConstantLight(gn.spectra.illuminant("D65")).has_spectra)
        True
        """
        return self._facts[2]


class _OfLight(Light, has_text=False):
    """Base of lights that are another one, elsewhere, turned, or in part: questions go to that one, and its answers
    back. A subclass says where a place of the world is in the light, and how directions turn on the way."""

    light = part(Light, None, "the light")

    @property
    def is_delta(self) -> bool:  # type: ignore[override]  # that of another light, asked of the object
        return bool(self.light.is_delta)

    @property
    def has_edges(self) -> bool:  # type: ignore[override]  # the same
        return bool(self.light.has_edges)

    @property
    def can_sample(self) -> bool:  # type: ignore[override]  # the same
        return bool(self.light.can_sample)

    @property
    def has_horizon(self) -> bool:  # type: ignore[override]  # the same
        return bool(self.light.has_horizon)

    @property
    def has_closed_form(self) -> bool:
        return bool(self.light.has_closed_form)

    @property
    def _shining(self) -> Light:
        """What radiance is asked of."""
        light: Light = self.light
        return light

    def _place(self, p: Direction) -> Direction:
        """A position of the world in the light."""
        return p

    def _inwards(self, w: Direction) -> Direction:
        """A direction of the world in the light."""
        return w

    def _outwards(self, w: Direction) -> Direction:
        """A direction of the light in the world."""
        return w

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        return self._shining.seen(self._place(p), self._inwards(w))

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        return self._outwards(self.light.warp(self._place(p), u0, u1))

    def density(self, p: Direction, w: Direction) -> Any:
        return self.light.density(self._place(p), self._inwards(w))

    def drawn(self, p: Direction, u0: Any, u1: Any) -> tuple[Direction, Any]:
        w, density = self.light.drawn(self._place(p), u0, u1)
        return self._outwards(w), density

    def beam(self, p: Direction) -> tuple[Direction, Any, Any]:
        w, E, distance = self._shining.beam(self._place(p))
        return self._outwards(w), E, distance

    def irradiance_on(self, p: Direction, n: Direction) -> Any:
        return self._shining.irradiance_on(self._place(p), self._inwards(n))

    def strength(self, p: Direction) -> Any:
        return self._shining.strength(self._place(p))

    def holds(self, p: Direction) -> Any:
        held = self.light.holds(self._place(p))
        return p.x < p.x if held is None else held


class _Moved(_OfLight):
    """A light elsewhere, whose formula depends on positions by other numbers than vectors."""

    by = vector((0.0, 0.0, 0.0), "by how much it is moved [m]")

    def _place(self, p: Direction) -> Direction:
        place: Direction = p - self.by.vector
        return place


def _asks_where(light: Light) -> bool:
    """Whether what a formula gives depends on the position."""
    try:
        return 0 in traced(light_kernels.PLACED, light, None).read
    except TraceError:
        return True


def _is_foreign(x: Any) -> bool:
    lib = ops.library_of_type(type(x))
    return lib is not None and lib.name != "numpy"


def _in_numpy(x: Any) -> Any:
    return ops.to_numpy(x).astype(float)[()] if _is_foreign(x) else x


def _arrays(name: str, *arrays: Any) -> Sequence[Any]:
    """The arrays of one call: see `ops.as_arrays`."""
    if all(type(x) is np.ndarray and x.dtype == np.float64 for x in arrays):
        return arrays
    return ops.as_arrays(*arrays, name=name)[1]


def _with_channels(value: Any, *arrays: Any) -> Any:
    """Values with a channel axis, which those of one number for each element of the batch lack."""
    axes = max(len(ops.library(x).shape(x)) for x in arrays) - 1
    value = value if hasattr(value, "ndim") else np.asarray(value)
    return with_channels(value, axes)
