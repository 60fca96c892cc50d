"""Polar angles and azimuths of unit vectors, and back: the public pair `direction` and `angles`; checks of both."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import SCALAR, VECTOR
from ..declared.arguments import checked
from ..errors import DirectionError, DirectionWarning, ParameterError, ShapeError, shown, warn
from ..evaluate.labelled import takes_labels
from ..numerics.lattice import lattice

TYPED = 1e-3
"""How far from 1 the length of a vector may be that was typed with three digits; what is further off is refused."""

LOOKED_AT = 1000
"""Angles of an array that are looked at for their unit."""


@takes_labels(angles=("theta", "phi"), kinds=(VECTOR,))
@checked
def direction(theta: Any, phi: Any, degrees: bool = False) -> Any:
    """Unit vectors (sin theta cos phi, sin theta sin phi, cos theta).

    theta is the angle to the surface normal, phi the azimuth from x towards y. A negative theta, as in scans to both
    sides of the normal, is the direction of -theta at phi + pi.

    Shapes   theta, phi: numbers or arrays of any library that broadcast; result (..., 3).
    Units    rad, or with `degrees` degrees.
    Errors   DirectionError where |theta| is above pi (180 degrees): such angles are in degrees, as a rule. Azimuths
             may be of any size; whole numbers above two turns give a DirectionWarning, and so do, with `degrees`,
             angles of which each is a whole number of degrees in radians. Values that a library does not know yet
             (jax.jit, torch.compile) or has on a GPU are not looked at.
    Error    rounding.
    Source   definition; docs/conventions.md.

    Example
    >>> gn.direction(np.pi / 6, 0.0).round(3)
    array([0.5  , 0.   , 0.866])
    >>> gn.direction([0, 30], 180, degrees=True).round(3) + 0.0
    array([[ 0.   ,  0.   ,  1.   ],
           [-0.5  ,  0.   ,  0.866]])
    """
    theta, phi = (numbers_of(name, x) for name, x in (("theta", theta), ("phi", phi)))
    # Numbers become arrays of the other's library.
    theta, phi = (b * 0.0 + a if isinstance(a, (int, float)) else a for a, b in ((theta, phi), (phi, theta)))
    lib = ops.library(theta, phi)
    ops.broadcast_shape([lib.shape(x) for x in (theta, phi) if not isinstance(x, float)] or [()], "theta, phi")
    check_angle("theta", theta, -math.pi, math.pi, degrees)
    if not degrees:
        _suspect_degrees(phi)
    else:
        _suspect_radians(theta, phi)
        theta, phi = theta * (math.pi / 180.0), phi * (math.pi / 180.0)
    s = ops.sin(theta)
    return lib.stack([s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta) + 0.0 * phi])


@takes_labels("w", kinds=(SCALAR, SCALAR))
@checked
def angles(w: Any) -> tuple[Any, Any]:
    """theta in [0, pi] and phi in (-pi, pi] of vectors of any length.

    Shapes   w: (..., 3), of any library; theta, phi: (...).
    Units    rad. phi = 0 at the poles.
    Error    rounding.
    Source   definition; docs/conventions.md.

    Example
    >>> theta, phi = gn.angles([0.5, 0.0, 0.75**0.5])
    >>> print(f"{np.degrees(theta):.1f} {np.degrees(phi):.1f}")
    30.0 0.0
    """
    lib, (w,) = ops.as_arrays(w)
    if lib.shape(w)[-1:] != (3,):
        raise ShapeError(f"angles: got directions of shape {lib.shape(w)}, expected (..., 3)")
    x, y, z = lib.split(w, lib.shape(w)[:-1], False)
    return ops.arctan2(ops.sqrt(x * x + y * y), z), ops.arctan2(y + 0.0, x + 0.0)


def check_angle(name: str, angle: Any, low: float, high: float, degrees: bool = False) -> None:
    """Raises DirectionError where an angle [rad], or with `degrees` its bounds' in degrees, is out of bounds.

    `angle`: a number, a list or an array of any library. NaN passes.
    """
    unit = 180.0 / math.pi if degrees else 1.0
    angle = numbers_of(name, angle)
    values = angle if isinstance(angle, (int, float)) else ops.library(angle).known(angle)
    if values is None:
        return
    slack = 1e-6 * unit  # pi in single precision is above pi
    out = (values < low * unit - slack) | (values > high * unit + slack)
    if not np.any(out):
        return
    got = float(np.asarray(values)[out].flat[0])
    if degrees:
        rule = f"expected {low * unit:g} to {high * unit:g} degrees"
    else:
        bound = {0.0: "0", 0.5 * math.pi: "pi/2", math.pi: "pi", -math.pi: "-pi"}
        rule = f"expected {bound.get(low, low)} to {bound.get(high, high)} [rad]"
        if math.pi < abs(got) <= 360.0:
            rule += f"; in degrees? numpy.radians({got:g}) = {math.radians(got):.4g}"
    raise DirectionError(f"{name}: {got:g} is no polar angle here; {rule}")


def check_unit(name: str, w: np.ndarray) -> None:
    """Raises DirectionError for vectors (..., 3) that are not of unit length, up to `TYPED`. NaN passes."""
    squares = np.einsum("...i,...i->...", w, w)
    off = np.abs(squares - 1.0) > 2.0 * TYPED
    if off.any():
        got = w[off][0]
        length = math.sqrt(squares[off].flat[0])
        cure = (
            "a vector of length 0 has no direction" if length == 0.0 else "divide by it: gonio.directions.normalize(w)"
        )
        raise DirectionError(
            f"{name}: {np.array2string(got, precision=4, separator=', ')} has length {length:.4g}, expected unit "
            f"vectors; {cure}"
        )


def numbers_of(name: str, angle: Any) -> Any:
    """A number, or an array of any library, of numbers that a caller gave. Raises ParameterError for others."""
    try:
        numbers = ops.plain(angle)
        if isinstance(numbers, np.ndarray):
            numbers = ops.numbers(numbers)
        elif isinstance(numbers, (int, float)) and not isinstance(numbers, bool):
            numbers = float(numbers)
        if isinstance(numbers, (float, np.ndarray)):
            if np.isinf(numbers).any():
                raise ValueError("infinite")
            return numbers
        if ops.dtype_of(numbers).startswith(("float", "int", "uint", "bfloat")):
            return numbers
        reason = f"a {type(angle).__name__} is no number"
    except (ValueError, OverflowError) as error:
        reason = str(error)
    raise ParameterError(f"{name}={shown(angle)}: {reason}; expected an angle [rad] or an array of them")


def _suspect_degrees(phi: Any) -> None:
    values = phi if isinstance(phi, (int, float)) else ops.library(phi).known(phi)
    if values is None or not np.size(values):
        return
    largest = np.abs(values).max()
    if 4.0 * math.pi < largest <= 360.0 and np.all(values == np.rint(values)):
        text = f"phi: whole numbers up to {float(largest):g}, which is {float(largest) / (2 * math.pi):.0f} turns [rad]"
        warn(f"{text}; in degrees? numpy.radians(phi), or degrees=True for both angles", DirectionWarning)


def _suspect_radians(*angles: Any) -> None:
    known = [x if isinstance(x, float) else ops.library(x).known(x) for x in angles]
    values = np.concatenate([np.ravel(x)[:LOOKED_AT] for x in known if x is not None] or [np.zeros(0)]).astype(float)
    values = values[values != 0.0]
    if not values.size or np.abs(values).max() > 2.0 * math.pi + 1e-6:
        return
    turned = np.degrees(values)
    if np.all(np.abs(turned - np.rint(turned)) < 1e-9 * np.maximum(np.abs(turned), 1.0)):
        first = float(values.flat[0])
        text = f"degrees=True: {first:.6g} is taken as degrees, and is {math.degrees(first):.0f} degrees in radians"
        warn(f"{text}; for radians leave degrees=True out", DirectionWarning)


def lattice_pairs(count: int, least: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Evenly spread pairs of directions with cosines of at least `least`."""
    u = lattice(count, 4)
    theta = np.arccos(1.0 - (1.0 - least) * u[:, :2])
    return direction(theta[:, 0], 2.0 * math.pi * u[:, 2]), direction(theta[:, 1], 2.0 * math.pi * u[:, 3])
