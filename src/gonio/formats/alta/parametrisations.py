"""ALTA's parametrisations: from the numbers of a row to the angles of wi (light) and wo (view), and back.

Definitions are those of ALTA's params.h. Where its params.cpp contradicts them or itself this keeps the definition:
there, STARK_3D and NEUMANN_3D exchange light and view, STEREOGRAPHIC does not invert, azimuths between light and view
change their sign. All of that is invisible in data of reciprocal materials with a plane of symmetry. Parametrisations
with fewer than three numbers stand for one pair of directions each, as there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...base.angles import angles, direction
from ...tables.angle_systems import SYSTEMS


class Parameters(NamedTuple):
    """A parametrisation.

    size       numbers per row
    to_angles  of the columns of numbers: theta_i, phi_i, theta_o, phi_o [rad], each (n,)
    of_angles  of those angles: the columns; None where no file is written
    half       which of theta_h, phi_h, theta_d, phi_d the columns are, if they are; phi_d that of wo
    """

    size: int
    to_angles: Callable[..., tuple]
    of_angles: Callable[..., tuple] | None = None
    half: tuple[str, ...] = ()


def _of_vectors(view: np.ndarray, light: np.ndarray) -> tuple:
    return *angles(light), *angles(view)


def _stack(*components: Any) -> np.ndarray:
    return np.stack(np.broadcast_arrays(*components), axis=-1)


def _up(x: Any, y: Any) -> np.ndarray:
    """Unit vectors with these components along the surface; below it where there are none such."""
    z2 = 1.0 - x * x - y * y
    return _stack(x, y, np.where(z2 >= 0.0, np.sqrt(np.maximum(z2, 0.0)), -1.0))


def _half(theta_h: Any, phi_h: Any, theta_d: Any, phi_d: Any) -> tuple:
    view, light = SYSTEMS["half_difference"].pairs(theta_h, theta_d, phi_d, phi_h)
    return _of_vectors(view, light)


def _to_half(theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> tuple:
    light, view = direction(theta_i, phi_i), direction(theta_o, phi_o)
    theta_h, phi_h = angles(light + view)
    c, s, cp, sp = np.cos(theta_h), np.sin(theta_h), np.cos(phi_h), np.sin(phi_h)
    x, y, z = np.moveaxis(view, -1, 0)
    along = cp * x + sp * y
    theta_d, phi_d = angles(_stack(c * along - s * z, cp * y - sp * x, s * along + c * z))
    return theta_h, phi_h, theta_d, phi_d


def _cartesian(*x: Any) -> tuple:
    return _of_vectors(_stack(*x[:3]), _stack(*x[3:]))


def _to_cartesian(theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> tuple:
    vectors = np.concatenate([direction(theta_o, phi_o), direction(theta_i, phi_i)], axis=-1)
    return tuple(np.moveaxis(vectors, -1, 0))


def _stereographic(*x: Any) -> tuple:
    vectors = []
    for u, v in (x[:2], x[2:]):
        square = u * u + v * v
        vectors.append(_stack(2.0 * u, 2.0 * v, 1.0 - square) / (1.0 + square)[:, None])
    return _of_vectors(*vectors)


def _to_stereographic(theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> tuple:
    view, light = np.tan(0.5 * theta_o), np.tan(0.5 * theta_i)
    return view * np.cos(phi_o), view * np.sin(phi_o), light * np.cos(phi_i), light * np.sin(phi_i)


def _stark(along: Any, back: Any, phi: Any) -> tuple:
    """Of |H_p|, |B| and the azimuth between, H = (L + V)/2, B = (L - V)/2, which is perpendicular to H."""
    up2 = 1.0 - along * along - back * back
    up = np.sqrt(np.maximum(up2, 0.0))
    tilt = np.arctan2(up, -along * np.cos(phi))
    bx, by, bz = (back * x for x in (np.sin(tilt) * np.cos(phi), np.sin(tilt) * np.sin(phi), np.cos(tilt)))
    z = np.where(up2 >= 0.0, up, -1.0)
    return _of_vectors(_stack(along - bx, -by, z - bz), _stack(along + bx, by, z + bz))


def _to_stark(theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> tuple:
    light, view = direction(theta_i, phi_i), direction(theta_o, phi_o)
    half, back = 0.5 * (light + view), 0.5 * (light - view)
    phi = np.arctan2(back[:, 1], back[:, 0]) - np.arctan2(half[:, 1], half[:, 0])
    return np.hypot(half[:, 0], half[:, 1]), np.linalg.norm(back, axis=-1), np.mod(phi, 2.0 * math.pi)


def _neumann(along: Any, back: Any, phi: Any) -> tuple:
    """Of |H_p|, |B_p| and the azimuth between: projections of H and B on the surface."""
    x, y = back * np.cos(phi), back * np.sin(phi)
    return _of_vectors(_up(along - x, -y), _up(along + x, y))


def _to_neumann(theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> tuple:
    along, _, phi = _to_stark(theta_i, phi_i, theta_o, phi_o)
    back = 0.5 * (direction(theta_i, phi_i) - direction(theta_o, phi_o))
    return along, np.hypot(back[:, 0], back[:, 1]), phi


def _schlick(theta_i: Any, x: Any, y: Any) -> tuple:
    """View is the mirror direction of the light turned by pi about the back vector, at theta_k (cos phi, sin phi)."""
    back = direction(np.hypot(x, y), np.arctan2(y, x))
    mirror = direction(theta_i, 0.0 * x + math.pi)
    view = 2.0 * np.sum(back * mirror, axis=-1, keepdims=True) * back - mirror
    return theta_i, 0.0 * x, *angles(view)


def _retro(theta_i: Any, x: Any, y: Any) -> tuple:
    """View at the angle hypot(x, y) from the light, in the azimuth about it that counts from the normal."""
    apart, turn = np.hypot(x, y)[:, None], np.arctan2(y, x)[:, None]
    light, towards = direction(theta_i, 0.0 * x), _stack(-np.cos(theta_i), 0.0 * x, np.sin(theta_i))
    across = _stack(0.0 * x, 1.0 + 0.0 * x, 0.0 * x)
    view = np.cos(apart) * light + np.sin(apart) * (np.cos(turn) * towards + np.sin(turn) * across)
    return theta_i, 0.0 * x, *angles(view)


PARAMETERS = {
    "COS_TH": Parameters(1, lambda c: _half(np.arccos(c), 0.0, 0.0 * c, 0.0 * c), half=("theta_h",)),
    "COS_TK": Parameters(1, lambda c: (np.arccos(c), 0.0 * c, np.arccos(c), 0.0 * c + math.pi)),
    "COS_TLV": Parameters(1, lambda c: (0.0 * c, 0.0 * c, np.arccos(c), 0.0 * c)),
    "COS_TLR": Parameters(1, lambda c: (0.0 * c, 0.0 * c, np.arccos(c), 0.0 * c + math.pi)),
    "RUSIN_TH_TD": Parameters(2, lambda h, d: _half(h, 0.0, d, 0.0 * d + 0.5 * math.pi), half=("theta_h", "theta_d")),
    "COS_TH_TD": Parameters(
        2, lambda h, d: _half(np.arccos(h), 0.0, np.arccos(d), 0.0 * d), half=("theta_h", "theta_d")
    ),
    "ISOTROPIC_TV_TL": Parameters(2, lambda v, i: (i, 0.0 * v, v, 0.0 * v)),
    "ISOTROPIC_TV_PROJ_DPHI": Parameters(2, lambda x, y: (0.0 * x, 0.0 * x, np.hypot(x, y), np.arctan2(y, x))),
    "STARK_2D": Parameters(2, lambda h, b: _stark(h, b, 0.0 * b + 0.5 * math.pi)),
    "NEUMANN_2D": Parameters(2, lambda h, b: _neumann(h, b, 0.0 * b + 0.5 * math.pi)),
    "RUSIN_TH_TD_PD": Parameters(
        3,
        lambda h, d, p: _half(h, 0.0, d, p),
        lambda *a: (lambda h, _, d, p: (h, d, p))(*_to_half(*a)),
        ("theta_h", "theta_d", "phi_d"),
    ),
    "RUSIN_TH_PH_TD": Parameters(3, lambda h, p, d: _half(h, p, d, 0.0 * d), half=("theta_h", "phi_h", "theta_d")),
    "RUSIN_VH": Parameters(3, lambda x, y, z: (lambda w: _of_vectors(w, w))(_stack(x, y, z))),
    "SCHLICK_TL_TK_PROJ_DPHI": Parameters(3, _schlick),
    "RETRO_TL_TVL_PROJ_DPHI": Parameters(3, _retro),
    "ISOTROPIC_TV_TL_DPHI": Parameters(
        3, lambda v, i, p: (i, 0.0 * v, v, 0.0 - p), lambda ti, pi, to, po: (to, ti, pi - po)
    ),
    "ISOTROPIC_TL_TV_PROJ_DPHI": Parameters(
        3,
        lambda i, x, y: (i, 0.0 * x, np.hypot(x, y), np.arctan2(y, x)),
        lambda ti, pi, to, po: (ti, to * np.cos(po - pi), to * np.sin(po - pi)),
    ),
    "STARK_3D": Parameters(3, _stark, _to_stark),
    "NEUMANN_3D": Parameters(3, _neumann, _to_neumann),
    "RUSIN_TH_PH_TD_PD": Parameters(4, _half, _to_half, ("theta_h", "phi_h", "theta_d", "phi_d")),
    "SPHERICAL_TL_PL_TV_PV": Parameters(4, lambda *a: a, lambda *a: a),
    "STEREOGRAPHIC": Parameters(4, _stereographic, _to_stereographic),
    "CARTESIAN": Parameters(6, _cartesian, _to_cartesian),
}
