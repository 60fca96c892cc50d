"""Axes of Stokes vectors: of the surface, of the facet, of Mitsuba; and Mueller matrices from ones to others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import ops
from ..base.angles import check_unit, numbers_of
from ..declared.arguments import Numbers, checked
from ..errors import NotFoundError, ParameterError, ShapeError, shown
from ..formula.direction import Direction
from ..formula.mueller import Mueller, facet_turns, fixed_turns, horizontal, turn_to, turned_axes


@checked
def frames(w: Numbers, arrives: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """The axes x and y of Stokes vectors in `m.mueller`, of light that leaves along w, or arrives from there.

    x = s lies along the surface, towards increasing azimuth; y = p = k x s with k = w, or -w if light arrives. Along
    the normal the azimuth counts as 0: x is then the surface's y axis.

    Shapes   w: (..., 3), unit vectors; x, y: (..., 3).
    Error    rounding.

    Example
    >>> x, y = gn.polarization.frames(gn.direction(0.5, 0.0))
    >>> print(x.round(3), y.round(3))
    [0. 1. 0.] [-0.878  0.     0.479]
    """
    w = _directions("w", w)
    h = np.stack(np.broadcast_arrays(*horizontal(Direction(*np.moveaxis(w, -1, 0)))), -1)
    x = h / np.linalg.norm(h, axis=-1, keepdims=True) + 0.0  # no -0
    return x, np.cross(-w if arrives else w, x) + 0.0


@checked
def rotator(psi: Any) -> np.ndarray:
    """The matrix that expresses Stokes vectors in axes turned by psi, from x towards y: S' = rotator(psi) @ S.

    Shapes   psi: (...); result (..., 4, 4).
    Units    psi: rad.
    Error    rounding.

    Example
    >>> print((gn.polarization.rotator(np.pi / 4) @ [1, 0, 1, 0]).round(3))  # at 45 degrees: along the new x
    [1. 1. 0. 0.]
    """
    twice = 2.0 * plain_angle("psi", psi)
    return as_array(turned_axes(np.cos(twice), np.sin(twice)))


@checked
def to_frames(M: Numbers, wi: Numbers, wo: Numbers, to: str, given: str = "surface") -> np.ndarray:
    """A Mueller matrix of reflection in other axes.

    "surface"   those of `m.mueller`, see `frames`
    "facet"     x = s across the plane of wi and wo, y = k x s: those of a mirror facet, and of KAIST's files
    "xyxy"      those of the surface at azimuth 0, carried along as they are at the normal: NIST's and SCATMECH's files
    "mitsuba"   those that Mitsuba's BSDFs return, in its local frame: x = `stokes_basis(k)` of the direction of travel

    Shapes   M: (..., 4, 4), or (..., C, 4, 4) with channels; wi, wo: (..., 3).
    Units    none.
    Error    rounding; axes of the facet where wi and wo are closer than 1e-7 are those of the surface.
    Source   "mitsuba": the basis of Duff et al. 2017, JCGT 6(1), as Mitsuba 3 has it.

    Example
    >>> metal = gn.Microfacet(gn.GGX(0.3), gn.Conductor(1.2, 6.0))
    >>> wi, wo = gn.direction(1.2, 0.0), gn.direction(0.9, 2.0)
    >>> M = gn.polarization.to_frames(metal.mueller(wi, wo), wi, wo, "facet")
    >>> print((M / M[0, 0]).round(3))
    [[ 1.     0.074  0.     0.   ]
     [ 0.074  1.     0.     0.   ]
     [ 0.     0.    -0.962 -0.261]
     [ 0.     0.     0.261 -0.962]]
    """
    for name in (to, given):
        if name not in _TURNS:
            raise NotFoundError(f"to_frames: no axes {shown(name)}; expected one of {', '.join(_TURNS)}")
    M = _matrices(M)
    wi, wo = _directions("wi", wi), _directions("wo", wo)
    batch = np.broadcast_shapes(wi.shape[:-1], wo.shape[:-1])
    sides = [Direction(*np.moveaxis(np.broadcast_to(w, (*batch, 3)), -1, 0)) for w in (wi, wo)]
    (i, o), (back_i, back_o) = ([as_array(turn) for turn in _TURNS[name](*sides)] for name in (to, given))
    into, out = back_i @ np.swapaxes(i, -1, -2), o @ np.swapaxes(back_o, -1, -2)
    if M.ndim == len(batch) + 3:
        into, out = into[..., None, :, :], out[..., None, :, :]
    turned: np.ndarray = out @ M @ into
    return turned


def _mitsuba(wi: Direction, wo: Direction) -> tuple[Mueller, Mueller]:
    def basis(k: Direction) -> Direction:
        sign = np.copysign(1.0, k.z)
        a = -1.0 / (sign + k.z)
        return Direction(1.0 + sign * k.x * k.x * a, sign * k.x * k.y * a, -sign * k.x)

    return turn_to(wi, basis(-wi), -1.0), turn_to(wo, basis(wo), 1.0)


def _surface(wi: Direction, wo: Direction) -> tuple[Mueller, Mueller]:
    none = turned_axes(1.0 + 0.0 * wi.z, 0.0 * wi.z)
    return none, none


_TURNS: dict[str, Callable[[Direction, Direction], tuple[Mueller, Mueller]]] = {
    "surface": _surface,
    "xyxy": fixed_turns,
    "facet": facet_turns,
    "mitsuba": _mitsuba,
}
"""From the axes of the surface to others, for light along -wi and light along wo."""


def as_array(M: Mueller) -> np.ndarray:
    """A matrix of components as an array (..., 4, 4)."""
    elements = np.broadcast_arrays(*(x for row in M.rows for x in row))
    return np.stack(elements, -1).reshape((*elements[0].shape, 4, 4))


def plain_angle(name: str, angle: Any) -> np.ndarray:
    """An angle, or an array of them, as a NumPy array. Raises ParameterError for infinite ones and no numbers."""
    given = numbers_of(name, angle)
    try:
        return np.asarray(ops.numbers(given), float)
    except ValueError as error:
        raise ParameterError(f"{name}: got {error}; expected an angle [rad] or an array of them") from None


def _directions(name: str, w: Any) -> np.ndarray:
    w = np.asarray(w, float)
    if w.shape[-1:] != (3,):
        raise ShapeError(f"{name}: got shape {w.shape}, expected (..., 3)")
    check_unit(name, w)
    return w


def _matrices(M: Any) -> np.ndarray:
    M = np.asarray(M, float)
    if M.shape[-2:] != (4, 4):
        raise ShapeError(f"M: got shape {M.shape}, expected (..., 4, 4)")
    return M
