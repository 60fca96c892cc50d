"""Grazing: towards the horizon f stays finite, has no jump, and f cos(theta) does not grow without bound.

f itself may grow: 1/cos(theta) is the limit, where the radiance that a beam of fixed irradiance causes stays the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..interface import Reflectance, direction
from ..measurement import Measured
from .probes import degrees, values
from .verdict import Law

GROWTH = 1.25  # of f cos per tenth of the cosine: what tends to a limit is at 1, what grows as 1/sqrt(cos) at 3.2
JUMP = 1e-2  # of the largest f cos on the way; a square root's kink leaves 1e-4
HALVINGS = 24
FAR = np.radians([89.99, 89.999])
COSINES = np.geomspace(np.cos(np.radians(80.0)), 1e-5, 64)
OTHERS = np.radians([0.0, 30.0, 60.0, 80.0])
AZIMUTHS = 0.3 + np.radians([0.0, 60.0, 120.0, 180.0, 270.0])


class Way(NamedTuple):
    """Ways to the horizon: the azimuth of the direction that moves, the direction that stays, and which is which."""

    phi: np.ndarray
    fixed: np.ndarray
    light_moves: bool


def ways() -> list[Way]:
    """All ways that are tried, light and viewer moving in turn."""
    theta, phi = (x.ravel() for x in np.meshgrid(OTHERS, AZIMUTHS, indexing="ij"))
    return [Way(phi, direction(theta, 0.3), light_moves) for light_moves in (True, False)]


def along(m: Reflectance, way: Way, cosine: np.ndarray) -> np.ndarray:
    """f cos(theta) (..., N, C) of the N directions that move, at cosines that broadcast with (..., N)."""
    cosine = np.broadcast_to(cosine, np.broadcast_shapes(np.shape(cosine), way.phi.shape))
    sine = np.sqrt((1.0 - cosine) * (1.0 + cosine))
    moving = np.stack([sine * np.cos(way.phi), sine * np.sin(way.phi), cosine], -1)
    fixed = np.broadcast_to(way.fixed, moving.shape)
    return values(m, *((moving, fixed) if way.light_moves else (fixed, moving))) * cosine[..., None]


def law(m: Reflectance) -> Iterator[Law | str]:
    """Growth from 89.99 to 89.999 degrees, and the largest jump between 80 and 89.9994, whichever is worse."""
    found = [verdict for way in ways() for verdict in (_growth(m, way), _jump(m, way))]
    worst = max(found, key=lambda law: law.value / law.tolerance)
    measured = any(isinstance(lobe, Measured) for _, lobe in m.lobes())
    if measured and not worst.passed and worst.tolerance == JUMP:
        yield f"towards grazing the data jump, by {worst.value:.2g} of the largest f cos(theta) on the way"
        worst = max((law for law in found if law.tolerance == GROWTH), key=lambda law: law.value)
    yield worst


def _place(way: Way, n: int, cosine: float) -> dict[str, float]:
    moving = direction(np.arccos(cosine), way.phi[n])
    return degrees(moving, way.fixed[n]) if way.light_moves else degrees(way.fixed[n], moving)


def _growth(m: Reflectance, way: Way) -> Law:
    whole = np.abs(along(m, way, COSINES[:, None]))
    near, last = np.abs(along(m, way, np.cos(FAR)[:, None]))
    infinite = np.isinf(whole).any(axis=(0, 2)) | np.isinf(last).any(axis=-1)
    floor = 1e-6 * np.nan_to_num(np.where(np.isinf(whole), 0.0, whole)).max(axis=0) + 1e-30
    growth = np.nan_to_num(last / np.fmax(near, floor), posinf=np.inf).max(axis=-1)
    growth = np.where(infinite, np.inf, growth)
    n = int(growth.argmax())
    value = float(growth[n])
    passed, why = value <= GROWTH, ""
    if not passed:
        who = "light" if way.light_moves else "viewer"
        why = "f is infinite" if np.isinf(value) else f"f cos(theta) grows {value:.3g}-fold as the {who} goes on"
    rule = "f cos at 89.999/at 89.99 deg = {value} <= {tolerance}"
    return Law("grazing", passed, value, GROWTH, rule, {} if passed else _place(way, n, float(np.cos(FAR[1]))), why)


def _jump(m: Reflectance, way: Way) -> Law:
    """The largest change between neighbours is halved again and again: what is smooth loses it, a jump keeps it."""
    whole = along(m, way, COSINES[:, None])
    size = np.fmax.reduce(np.abs(_finite(whole)), axis=0) + 1e-30
    step = _change(whole[:-1], whole[1:], size).argmax(axis=0)
    high, low = COSINES[step], COSINES[step + 1]
    f_high, f_low = (np.take_along_axis(whole, i[None, :, None], 0)[0] for i in (step, step + 1))
    for _ in range(HALVINGS):
        middle = 0.5 * (high + low)
        f = along(m, way, middle)
        upper = _change(f_high, f, size) > _change(f, f_low, size)
        high, low = np.where(upper, high, middle), np.where(upper, middle, low)
        f_high, f_low = np.where(upper[:, None], f_high, f), np.where(upper[:, None], f, f_low)
    jump = _change(f_high, f_low, size)
    n = int(jump.argmax())
    value = float(jump[n])
    passed = value <= JUMP
    why = "" if passed else f"f cos(theta) jumps by {value:.3g} of its largest value on the way to the horizon"
    rule = "largest jump of f cos = {value} <= {tolerance}"
    return Law("grazing", passed, value, JUMP, rule, {} if passed else _place(way, n, float(low[n])), why)


def _finite(f: np.ndarray) -> np.ndarray:
    return np.where(np.isinf(f), 0.0, f)


def _change(a: np.ndarray, b: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Relative to the largest value on the way, over channels; 0 beside a hole in the data."""
    return np.nan_to_num(np.abs(_finite(a) - _finite(b)) / size).max(axis=-1)
