"""Frames of surface points in the world, and constructions on directions, for arrays of any library."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import LIBRARIES, ops
from ..arrays.kinds import SCALAR, VECTOR
from ..declared.arguments import checked
from ..errors import ArrayTypeError, DirectionError, ParameterError, ShapeError, shown
from ..evaluate.labelled import takes_labels
from ..formula import direction as components
from ..formula.direction import Direction, cross, dot, select
from .angles import check_angle, numbers_of


class Frame(NamedTuple):
    """Local axes of surface points in the world, as components: d_x, d_y and the normal."""

    t: Direction
    b: Direction
    n: Direction

    @classmethod
    def of(cls, normal: Direction, tangent: Direction | None = None) -> Frame:
        """For world normals of any length; d_x is the part of the tangents along the surface, without these the
        world's x axis, turned with the normal."""
        n = components.normalize(normal)
        if tangent is None:
            up = n.z >= 0.0
            t, _ = components.frame(select(up, n, Direction(n.x, n.y, -n.z)))
            t = select(up, t, Direction(t.x, t.y, -t.z))
        else:
            t = components.normalize(tangent - n * dot(tangent, n))
        return cls(t, cross(n, t), n)

    @classmethod
    def of_arrays(cls, lib: ops.Library, normal: Any, tangent: Any = None) -> Frame:
        """`of` for vectors (..., 3). Raises DirectionError for normals of length 0 and tangents along the normal."""
        check_frame(lib, normal, tangent)
        return cls.of(split(lib, normal), None if tangent is None else split(lib, tangent))

    def local(self, w: Direction) -> Direction:
        """A world vector in the local frame."""
        return Direction(dot(w, self.t), dot(w, self.b), dot(w, self.n))

    def world(self, w: Direction) -> Direction:
        """A local vector in the world frame."""
        w_world: Direction = self.t * w.x + self.b * w.y + self.n * w.z
        return w_world

    def to_local(self, lib: ops.Library, w: Any) -> Any:
        """World vectors (..., 3) in the local frame."""
        return lib.stack(self.local(split(lib, w)))

    def to_world(self, lib: ops.Library, w: Any) -> Any:
        """Local vectors (..., 3) in the world frame."""
        return lib.stack(self.world(split(lib, w)))


class HalfDifferenceAngles(NamedTuple):
    """Rusinkiewicz' four angles [rad] of pairs of directions.

    Example
    >>> a = gn.directions.half_difference(gn.direction(0.5, 0.0), gn.direction(0.3, np.pi))
    >>> print(a.theta_h.round(4), a.theta_d.round(4))
    0.1 0.4
    """

    theta_h: Any
    phi_h: Any
    theta_d: Any
    phi_d: Any


@checked
def normalize(w: Any) -> Any:
    """Vectors divided by their length.

    Shapes   w: (..., 3) of any library; result the same.
    Units    none.
    Errors   DirectionError for a vector of length 0.
    Error    rounding.

    Example
    >>> gn.directions.normalize([3.0, 0.0, 4.0])
    array([0.6, 0. , 0.8])
    """
    lib, (w,) = vectors(w=w)
    _check_length(lib, "w", w)
    return _vector(components.normalize, lib, w)


@checked
def to_local(w: Any, normal: Any, tangent: Any = None) -> Any:
    """World vectors in the local frame of a surface point: z along the normal, x along the tangent.

    `tangent` is d_x: its part along the surface counts. Without it d_x is the world's x axis turned with the normal.

    Shapes   w, normal, tangent: (..., 3) that broadcast, of any library; normal and tangent of any length.
    Units    those of w.
    Errors   DirectionError for normals of length 0 and for tangents along the normal.
    Error    rounding.
    Source   docs/conventions.md; the turned axis: Duff et al. 2017, JCGT 6(1).

    Example
    >>> gn.directions.to_local([1.0, 0.0, 0.0], normal=[1.0, 0.0, 1.0]).round(3)
    array([0.707, 0.   , 0.707])
    """
    lib, (w, normal, tangent) = vectors(w=w, normal=normal, tangent=tangent)
    check_frame(lib, normal, tangent)
    axes = (normal,) if tangent is None else (normal, tangent)
    return _vector(lambda w, *axes: Frame.of(*axes).local(w), lib, w, *axes)


@checked
def to_world(w: Any, normal: Any, tangent: Any = None) -> Any:
    """Local vectors of a surface point in the world: the inverse of `to_local`.

    Shapes   w, normal, tangent: (..., 3) that broadcast, of any library; normal and tangent of any length.
    Units    those of w.
    Errors   DirectionError for normals of length 0 and for tangents along the normal.
    Error    rounding.
    Source   docs/conventions.md.

    Example
    >>> gn.directions.to_world([0.0, 0.0, 1.0], normal=[0.0, 3.0, 4.0])
    array([0. , 0.6, 0.8])
    """
    lib, (w, normal, tangent) = vectors(w=w, normal=normal, tangent=tangent)
    check_frame(lib, normal, tangent)
    axes = (normal,) if tangent is None else (normal, tangent)
    return _vector(lambda w, *axes: Frame.of(*axes).world(w), lib, w, *axes)


@checked
def reflect(w: Any, wm: Any) -> Any:
    """The mirror image of directions about facet normals: 2 (w . wm) wm - w. Both leave the surface.

    Shapes   w, wm: (..., 3) unit vectors that broadcast, of any library; result (..., 3).
    Units    none.
    Error    rounding.
    Source   definition.

    Example
    >>> gn.directions.reflect([0.6, 0.0, 0.8], [0.0, 0.0, 1.0])
    array([-0.6,  0. ,  0.8])
    """
    lib, (w, wm) = vectors(w=w, wm=wm)
    return _vector(components.reflect, lib, w, wm)


@checked
def refract(w: Any, wm: Any, eta: Any) -> Any:
    """The direction on the other side of a facet into which light from w is refracted, by Snell's law.

    sin(theta) = eta sin(theta_t), with w, wm and the result in one plane: -w/eta + (cos(theta)/eta - cos(theta_t)) wm.
    eta is the refractive index behind the facet over that in front, where wm points; light from behind (w . wm < 0)
    meets 1/eta. NaN where all light is reflected.

    Shapes   w, wm: (..., 3) unit vectors, eta: a number or an array (...); all broadcast; result (..., 3).
    Units    none.
    Error    rounding.
    Source   Snell's law in vector form.

    Example
    >>> w = gn.directions.refract(gn.direction(np.pi / 3, 0.0), [0.0, 0.0, 1.0], eta=1.5)
    >>> print(f"{np.degrees(gn.angles(-w)[0]):.2f}")  # sin 60° = 1.5 sin 35.26°
    35.26
    """
    lib, (w, wm) = vectors(w=w, wm=wm)
    eta = numbers_of("eta", eta)
    known = eta if isinstance(eta, float) else ops.library(eta).known(eta)
    if known is not None and np.any(known <= 0.0):
        raise ParameterError(f"eta={shown(eta)}: expected a ratio of refractive indices, above 0")
    if not isinstance(eta, float):
        eta = lib.convert(eta, w)

    def refracted(w: Direction, wm: Direction) -> Direction:
        cos = dot(w, wm)
        front = cos >= 0.0
        ratio = ops.where(front, 0.0 * cos + 1.0 / eta, 0.0 * cos + eta)
        sin2 = ratio * ratio * (1.0 - cos * cos)
        all_reflected = sin2 > 1.0
        cos_t = ops.sqrt(ops.where(all_reflected, 1.0, 1.0 - sin2))
        cos_t = ops.where(all_reflected, float("nan"), ops.where(front, cos_t, -cos_t))
        w_t: Direction = wm * (ratio * cos - cos_t) - w * ratio
        return w_t

    return _vector(refracted, lib, w, wm)


@checked
def half_difference(wi: Any, wo: Any) -> HalfDifferenceAngles:
    """Rusinkiewicz' angles of pairs of directions: those of the half vector, and those of wi about it.

    phi_d is 0 where wi lies in the plane of the half vector and the normal, on the side away from the normal.

    Shapes   wi, wo: (..., 3) unit vectors that broadcast, of any library; four results (...).
    Units    rad.
    Error    rounding, also near theta_d = 0; azimuths are 0 where a direction has none.
    Source   Rusinkiewicz 1998, "A new change of variables for efficient BRDF representation", EGSR.

    Example
    >>> a = gn.directions.half_difference(gn.direction(0.5, 0.0), gn.direction(0.3, np.pi))
    >>> print(f"theta_h {a.theta_h:.3f}, theta_d {a.theta_d:.3f}, phi_d {abs(a.phi_d):.3f}")
    theta_h 0.100, theta_d 0.400, phi_d 0.000
    """
    lib, pair = vectors(wi=wi, wo=wo)

    def four(wi: Direction, wo: Direction) -> tuple[Any, ...]:
        theta_h, theta_d, phi_d = components.half_difference(wi, wo)
        x, y = wi.x + wo.x, wi.y + wo.y
        pole = x * x + y * y < 1e-30
        phi_h = ops.arctan2(ops.where(pole, 0.0 * y, y), ops.where(pole, 0.0 * x + 1.0, x))
        return theta_h, phi_h, theta_d, phi_d

    return HalfDifferenceAngles(*_on_components(four, (SCALAR,) * 4, lib, pair))


@takes_labels(angles=("theta_h", "phi_h", "theta_d", "phi_d"), kinds=(VECTOR, VECTOR))
@checked
def from_half_difference(theta_h: Any, phi_h: Any, theta_d: Any, phi_d: Any) -> tuple[Any, Any]:
    """wi and wo of Rusinkiewicz' angles: the inverse of `half_difference`. Either may lie below the horizon.

    Shapes   angles: numbers or arrays of one library that broadcast; wi, wo (..., 3).
    Units    rad.
    Error    rounding.
    Source   Rusinkiewicz 1998.

    Example
    >>> wi, wo = gn.directions.from_half_difference(theta_h=0.1, phi_h=0.0, theta_d=0.4, phi_d=0.0)
    >>> print(f"{gn.angles(wi)[0]:.3f} {gn.angles(wo)[0]:.3f}")
    0.500 0.300
    """
    named = {"theta_h": theta_h, "phi_h": phi_h, "theta_d": theta_d, "phi_d": phi_d}
    given = [numbers_of(name, x) for name, x in named.items()]
    for name in ("theta_h", "theta_d"):
        check_angle(name, named[name], -math.pi, math.pi)
    lib, like = LIBRARIES["numpy"], np.zeros(())
    for x in given:
        if (library := ops.library_of_type(type(x))) not in (None, lib):
            lib, like = library, x
            break
    angles = [x if ops.library_of_type(type(x)) is lib else lib.convert(x, like) for x in given]
    ops.broadcast_shape([lib.shape(x) for x in angles], ", ".join(named))
    theta_h, phi_h, theta_d, phi_d = angles
    pair = components.from_half_difference(theta_h, phi_h, theta_d, phi_d)
    return lib.stack(pair[0]), lib.stack(pair[1])


def vectors(**given: Any) -> tuple[ops.Library, list[Any]]:
    """Some vectors (..., 3) as arrays of one library, with the dtype of the first of its arrays.

    A tangent of None stays None.
    """
    present = {name: w for name, w in given.items() if w is not None}
    for name in given.keys() - present.keys() - {"tangent"}:
        raise ArrayTypeError(f"{name}: got None, expected vectors (..., 3)")
    plain = (None, LIBRARIES["numpy"])
    foreign = [name for name, w in present.items() if ops.library_of_type(type(w)) not in plain]
    first = (foreign or list(present))[0]
    lib, (like,) = ops.as_arrays(present[first], name=first)
    for name, w in present.items():
        own = ops.library_of_type(type(w))
        if own not in (*plain, lib):
            ops.library(w, like)  # raises
        _, (array,) = ops.as_arrays(w, name=name)
        if own is not lib:
            array = lib.vectors(array, like)
        elif lib.dtype(array) != lib.dtype(like):
            array = lib.convert(array, like)
        if lib.shape(array)[-1:] != (3,):
            raise ShapeError(f"{name}: got shape {lib.shape(array)}, expected vectors (..., 3)")
        present[name] = array
    ops.broadcast_shape([lib.shape(w) for w in present.values()], ", ".join(present))
    return lib, [present.get(name) for name in given]


def split(lib: ops.Library, w: Any) -> Direction:
    """The components of vectors (..., 3)."""
    return Direction(*lib.split(w, lib.shape(w)[:-1], False))


def _on_components(
    function: Callable[..., Sequence[Any]], kinds: Sequence[str], lib: ops.Library, given: Sequence[Any]
) -> list[Any]:
    """Results of a function of the components of vectors, over their broadcast batch."""
    batch = ops.broadcast_shape([lib.shape(w) for w in given], "vectors")[:-1]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):  # infinite components become NaN
        results = function(*(Direction(*lib.split(w, batch, False)) for w in given))
    return lib.assemble(kinds, [results], given[0], batch, False)


def _vector(function: Callable[..., Direction], lib: ops.Library, *given: Any) -> Any:
    return _on_components(lambda *parts: [function(*parts)], (VECTOR,), lib, given)[0]


def check_frame(lib: ops.Library, normal: Any, tangent: Any) -> None:
    """Raises DirectionError for normals (..., 3) of length 0 and for tangents along the normal."""
    _check_length(lib, "normal", normal)
    known = None if tangent is None else lib.known(tangent)
    if known is None or (n := lib.known(normal)) is None:
        return
    across = np.linalg.norm(np.cross(n, known), axis=-1)
    if (across <= 1e-6 * np.linalg.norm(n, axis=-1) * np.linalg.norm(known, axis=-1)).any():
        raise DirectionError("tangent: parallel to the normal, or 0; expected d_x, a direction along the surface")


def _check_length(lib: ops.Library, name: str, w: Any) -> None:
    known = lib.known(w)
    if known is not None and np.isinf(known).any():
        raise DirectionError(f"{name}: a vector with infinite components has no direction; expected finite numbers")
    if known is not None and (np.einsum("...i,...i->...", known, known) == 0.0).any():
        raise DirectionError(f"{name}: a vector of length 0 has no direction; expected three numbers, not all 0")
