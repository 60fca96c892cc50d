"""Solid angles of incidence or collection: cones and the hemisphere, with coordinates on them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import ops
from ..declared.notebooks import repr_html
from ..errors import ParameterError, shown
from ..formula.direction import Direction, dot
from ..formula.warp import cosine_hemisphere
from ..radiometry.solid_angles import projected_solid_angle_cone
from .domain import SAMPLED, Domain

MIRROR = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Hemisphere:
    """All directions above the surface.

    Example
    >>> diffuse = gn.Lambertian(0.5)
    >>> print(gn.reflectance(diffuse, gn.Hemisphere(), gn.Hemisphere()).round(4))
    0.5
    """

    _repr_html_ = repr_html

    projected = math.pi
    """Projected solid angle [sr]."""

    about_normal = True
    """Turning it about the normal changes nothing."""

    domain, seam = SAMPLED, 0.0

    def points(self, u0: Any, u1: Any) -> tuple[np.ndarray, Any]:
        """Directions (..., 3) for points of the unit square, and the projected solid angle per area of it.

        Example
        >>> w, area = gn.Hemisphere().points(np.array([0.2, 0.7]), np.array([0.5, 0.5]))
        >>> print(w.shape, gn.Hemisphere().contains(w))
        (2, 3) [ True  True]
        """
        return np.stack(cosine_hemisphere(u0, u1), axis=-1), math.pi

    def contains(self, w: np.ndarray) -> np.ndarray:
        """Whether directions (..., 3) lie in it.

        Example
        >>> print(gn.Hemisphere().contains(gn.direction([0.5, 2.0], 0.0)))
        [ True False]
        """
        return w[..., 2] > 0.0

    def mirrored(self) -> Hemisphere:
        """Its mirror image about the normal.

        Example
        >>> print(gn.Hemisphere().mirrored())
        Hemisphere()
        """
        return self


def _numbers(value: Any) -> np.ndarray:
    """The numbers of an argument; none where it has others."""
    try:
        return ops.numbers(value)
    except ValueError:
        return np.zeros(0)


@dataclass(frozen=True)
class Cone:
    """The part of a circular cone of directions above the horizon.

    axis         (3,) in the local frame, of any length
    half_angle   between the axis and the rim [rad], in (0, pi/2]

    Example
    >>> detector = gn.Cone(gn.direction(0.5, np.pi), np.radians(5.0))
    >>> glossy = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> print(gn.reflectance(glossy, gn.direction(0.5, 0.0), detector).round(5))
    0.00934
    """

    _repr_html_ = repr_html

    axis: Any
    half_angle: float

    def __post_init__(self) -> None:
        axis, angle = (_numbers(x) for x in (self.axis, self.half_angle))
        half_angle = float(angle) if angle.ndim == 0 else math.nan
        axis = axis.astype(float) if axis.shape == (3,) else np.zeros(3)
        length = math.hypot(*axis)
        if not 0.0 < length < math.inf:
            raise ParameterError(f"Cone(axis={shown(self.axis)}): expected a direction of three finite numbers, not 0")
        if not 0.0 < half_angle <= 0.5 * math.pi + 1e-12:
            raise ParameterError(
                f"Cone(half_angle={shown(self.half_angle)}): expected an angle in (0, pi/2] [rad]; for a single "
                f"direction give the direction itself"
            )
        axis = axis / length
        polar = math.atan2(math.hypot(axis[0], axis[1]), axis[2])
        if polar - half_angle >= 0.5 * math.pi:
            raise ParameterError(
                f"{self!r:.100}: the whole cone is below the horizon; its axis has a polar angle of {polar:.4g}, "
                f"expected less than pi/2 + half_angle = {0.5 * math.pi + half_angle:.4g}"
            )
        object.__setattr__(self, "axis", tuple(axis.tolist()))
        object.__setattr__(self, "half_angle", min(half_angle, 0.5 * math.pi))

    @cached_property
    def projected(self) -> float:
        """Projected solid angle above the horizon [sr].

        Example
        >>> print(round(gn.Cone([0, 0, 1], np.radians(5.0)).projected, 5))
        0.02386
        """
        return float(projected_solid_angle_cone(self.half_angle, self.polar))

    @property
    def polar(self) -> float:
        """Polar angle of the axis [rad].

        Example
        >>> print(round(float(gn.Cone(gn.direction(0.5, 0.0), 0.1).polar), 4))
        0.5
        """
        return math.atan2(math.hypot(self.axis[0], self.axis[1]), self.axis[2])

    @property
    def about_normal(self) -> bool:
        """Whether turning it about the normal changes nothing.

        Example
        >>> print(gn.Cone([0, 0, 1], 0.1).about_normal, gn.Cone(gn.direction(0.5, 0.0), 0.1).about_normal)
        True False
        """
        return self.axis[2] == 1.0

    def contains(self, w: np.ndarray) -> np.ndarray:
        """Whether directions (..., 3) lie in it; those on the rim do.

        Example
        >>> cone = gn.Cone(gn.direction(0.5, 0.0), np.radians(5.0))
        >>> print(cone.contains(gn.direction([0.45, 0.55, 0.6], 0.0)))
        [ True  True False]
        """
        return (w[..., 2] > 0.0) & (_angle(w, np.array(self.axis)) <= self.half_angle + 1e-12)

    def mirrored(self) -> Cone:
        """Its mirror image about the normal.

        Example
        >>> cone = gn.Cone(gn.direction(0.5, 0.0), np.radians(5.0))
        >>> print(cone.mirrored().contains(gn.direction(0.5, np.pi)))
        True
        """
        return Cone(MIRROR * self.axis, self.half_angle)

    # Polar coordinates about the axis: the first coordinate of the square goes with sin^2(r/2), so with solid angle,
    # the second with the azimuth, 0 towards the normal, on the part of the circle that is above the horizon.

    @cached_property
    def radii(self) -> tuple[float, float]:
        """The angles r from the axis between which directions are above the horizon."""
        return max(0.0, self.polar - 0.5 * math.pi), self.half_angle

    @cached_property
    def frame(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vectors across the axis: towards the normal, and to its left; and the axis."""
        axis = np.array(self.axis)
        s = math.hypot(axis[0], axis[1])
        x, y = (axis[0] / s, axis[1] / s) if s > 0.0 else (1.0, 0.0)
        t = np.array([-axis[2] * x, -axis[2] * y, s])
        return t, np.cross(axis, t), axis

    @cached_property
    def numbers(self) -> np.ndarray:
        """For kernels: frame, squared sines of half the radii, height of axis and t, squared chord to the rim."""
        t, b, axis = self.frame
        low, high = (math.sin(0.5 * r) ** 2 for r in self.radii)
        return np.array([*t, *b, *axis, low, high, axis[2], t[2], 4.0 * high, 0.0, 0.0])

    @cached_property
    def seam(self) -> float:
        """The first coordinate from which on the horizon cuts circles, or 0."""
        low, high = self.numbers[9:11]
        cut = (math.sin(0.5 * max(0.0, 0.5 * math.pi - self.polar)) ** 2 - low) / (high - low)
        return float(cut) if 0.0 < cut < 1.0 else 0.0

    @cached_property
    def domain(self) -> Domain:
        """Its coordinates, for kernels."""
        return Domain(_sampled_within, _in_cone, self.numbers, self.seam, self.contains, self._inverse)

    def points(self, u0: Any, u1: Any) -> tuple[np.ndarray, Any]:
        """Directions (..., 3) for points of the unit square, and the projected solid angle per area of it.

        Example
        >>> cone = gn.Cone(gn.direction(0.5, 0.0), np.radians(5.0))
        >>> w, area = cone.points(np.array([0.2, 0.7]), np.array([0.5, 0.5]))
        >>> print(w.shape, cone.contains(w))
        (2, 3) [ True  True]
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            w, density = _in_cone(None, None, u0, u1, self.numbers)
            return np.stack(np.broadcast_arrays(*w), axis=-1), np.maximum(w.z, 0.0) / density(w)

    def _inverse(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The coordinates of directions, outside the square for those outside, and the period of the second."""
        t, b, axis = self.frame
        low, high, up, across = self.numbers[9:13]
        h = np.sin(0.5 * _angle(w, axis)) ** 2
        arc = np.maximum(_half_arc(np.clip(h, low, high), up, across), 1e-9)
        return (h - low) / (high - low), 0.5 + 0.5 * np.arctan2(w @ b, w @ t) / arc, math.pi / arc


Geometry = Cone | Hemisphere


def _angle(w: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The angle between unit vectors, with all digits of small ones."""
    d, s = w - axis, w + axis
    return 2.0 * np.arctan2(np.sqrt((d * d).sum(axis=-1)), np.sqrt((s * s).sum(axis=-1)))


def _half_arc(h: Any, up: Any, across: Any) -> Any:
    """Half of the angle over which a circle about an axis is above the horizon; h is the squared sine of r/2."""
    s = 2.0 * ops.sqrt(ops.maximum(h * (1.0 - h), 1e-300))
    low = (1.0 - 2.0 * h) * up
    high = s * across
    cuts = high > ops.absolute(low)
    return ops.where(cuts, ops.arccos(-low / ops.where(cuts, high, 1.0)), ops.where(low > 0.0, math.pi, 0.0))


def _in_cone(mean: Any, fixed: Any, u0: Any, u1: Any, numbers: Any) -> tuple[Direction, Callable[[Direction], Any]]:
    t, b, axis = (Direction(*numbers[i : i + 3]) for i in (0, 3, 6))
    low, high, up, across = numbers[9:13]
    h = low + (high - low) * u0
    arc = _half_arc(h, up, across)
    phi, c, s = arc * (2.0 * u1 - 1.0), 1.0 - 2.0 * h, 2.0 * ops.sqrt(ops.maximum(h * (1.0 - h), 1e-300))
    x, y = s * ops.cos(phi), s * ops.sin(phi)
    return c * axis + x * t + y * b, lambda there: 0.25 / ((high - low) * ops.maximum(arc, 1e-30))


def _sampled_within(mean: Any, fixed: Any, u0: Any, u1: Any, numbers: Any) -> tuple[Direction, Callable]:
    axis, rim = Direction(*numbers[6:9]), numbers[13]

    def density(there: Direction) -> Any:
        apart = there - axis
        return ops.where(dot(apart, apart) <= rim, mean.density(there, fixed), 0.0)

    return mean.warp(fixed, u0, u1), density


@dataclass(frozen=True)
class Rings:
    """A cone by polar angles: the first coordinate of the square is the polar angle, the second runs along the arc of
    that circle in the cone. A function of the polar angle alone is constant along the second.

    The arc of half width a: sin^2(a/2) = sin((r + t)/2) sin((r - t)/2)/(sin(theta) sin(p)), of a cone of half angle r
    about an axis at polar angle p, with t = theta - p.
    """

    cone: Cone

    @property
    def projected(self) -> float:
        """Projected solid angle above the horizon [sr]."""
        return self.cone.projected

    @property
    def ends(self) -> tuple[float, float]:
        """The polar angles between which circles are partly in the cone."""
        p, r = self.cone.polar, self.cone.half_angle
        return abs(p - r), min(0.5 * math.pi, p + r)

    @property
    def seam(self) -> float:
        """The first coordinate up to which whole circles are in the cone, or 0."""
        low, high = self.ends
        return low / high if self.cone.polar < self.cone.half_angle else 0.0

    def points(self, u0: Any, u1: Any) -> tuple[np.ndarray, Any]:
        """Directions (..., 3) for points of the unit square, and the projected solid angle per area of it."""
        (low, high), p, r, seam = self.ends, self.cone.polar, self.cone.half_angle, self.seam
        v = 0.5 * math.pi * np.maximum(u0 - seam, 0.0) / (1.0 - seam)
        # Towards both ends the arc goes with a root: in v it is smooth.
        theta = np.where(u0 < seam, high * u0, low + (high - low) * np.sin(v) ** 2)
        theta = np.maximum(theta, 1e-12)  # at the normal itself azimuths mean nothing
        slope = np.where(u0 < seam, high, (high - low) * 0.5 * math.pi * np.sin(2.0 * v) / (1.0 - seam))
        s, c = np.sin(theta), np.cos(theta)
        ratio = np.sin(0.5 * (r + theta - p)) * np.sin(0.5 * (r - theta + p)) / (s * math.sin(p))
        a = 2.0 * np.arcsin(np.sqrt(np.clip(ratio, 0.0, 1.0)))
        phi = math.atan2(self.cone.axis[1], self.cone.axis[0]) + (2.0 * u1 - 1.0) * a
        w = np.stack(np.broadcast_arrays(s * np.cos(phi), s * np.sin(phi), c), axis=-1)
        return w, 2.0 * a * s * c * slope


def overlap(first: Geometry, second: Geometry) -> tuple[Callable, float] | None:
    """Coordinates, as `points`, on the directions that both contain, and their seam; None where there are none."""
    if isinstance(first, Hemisphere):
        first, second = second, first
    if isinstance(second, Hemisphere):
        return first.points, first.seam
    assert isinstance(first, Cone)
    t, b, axis = first.frame
    other = np.array(second.axis)
    between = float(_angle(axis, other))
    r0, r1 = first.radii
    r0, r1 = max(r0, between - second.half_angle), min(r1, between + second.half_angle)
    if r0 >= r1:
        return None
    towards = math.atan2(other @ b, other @ t)
    low, high = math.sin(0.5 * r0) ** 2, math.sin(0.5 * r1) ** 2
    up, across = first.numbers[11:13]

    def points(u0: Any, u1: Any) -> tuple[np.ndarray, Any]:
        # On a circle about the first axis: the arc above the horizon, and that inside the second cone.
        h = low + (high - low) * u0
        c, s = 1.0 - 2.0 * h, 2.0 * np.sqrt(h * (1.0 - h))
        above = _half_arc(h, up, across)
        gap = math.cos(second.half_angle) - c * math.cos(between)
        reach = s * math.sin(between)
        cuts = reach > np.abs(gap)
        inside = np.where(cuts, np.arccos(gap / np.where(cuts, reach, 1.0)), np.where(gap <= 0.0, math.pi, 0.0))
        starts, lengths = [], []
        for turn in (-2.0 * math.pi, 0.0, 2.0 * math.pi):
            start = np.maximum(-above, towards + turn - inside)
            starts.append(start)
            lengths.append(np.maximum(np.minimum(above, towards + turn + inside) - start, 0.0))
        whole = lengths[0] + lengths[1] + lengths[2]
        along = u1 * whole
        middle, last = starts[1] + along - lengths[0], starts[2] + along - lengths[0] - lengths[1]
        phi = np.where(along < lengths[0] + lengths[1], middle, last)
        phi = np.where(along < lengths[0], starts[0] + along, phi)
        w = c[..., None] * axis + (s * np.cos(phi))[..., None] * t + (s * np.sin(phi))[..., None] * b
        return w, np.maximum(w[..., 2], 0.0) * 2.0 * (high - low) * whole

    return points, 0.0
