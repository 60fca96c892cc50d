"""Grazing: towards the horizon f stays finite, has no jump, and f cos(theta) stops growing.

f itself may grow: 1/cos(theta) is the limit, where the radiance that a beam of fixed irradiance causes stays the same.

Measured   f cos(theta) at 89.999° over that at 89.99°; largest jump of f between 80° and 89.9994°
Holds if   <= 1.25; <= 0.01
Tolerance  a finite limit gives 1, 1/sqrt(cos) 3.2; 24 halvings of a step leave 1e-4 of a kink
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..base.sides import hemispheres
from ._probes import degrees, is_measured, largest, together, values
from ._verdict import Findings, Law, at_most

ORDER = 41
FOLLOWS = ("energy",)
GROWTH = 1.25  # of f cos per tenth of the cosine: 1 for a finite limit, 3.2 for 1/sqrt(cos)
JUMP = 1e-2  # of the value there, from a millionth of the largest up; a square root's kink leaves 1e-4
HALVINGS = 24
FAR = np.radians([89.99, 89.999])
COSINES = np.geomspace(np.cos(np.radians(80.0)), 1e-5, 64)
OTHERS = np.radians([0.0, 30.0, 60.0, 80.0])
AZIMUTHS = 0.3 + np.radians([0.0, 60.0, 120.0, 180.0, 270.0])


class _HorizonWays(NamedTuple):
    """Ways to the horizon: the azimuth of the direction that moves, the direction that stays, which is which, and the
    side of the surface that moves (1 or -1)."""

    phi: np.ndarray
    fixed: np.ndarray
    light_moves: bool
    side: float = 1.0


def ways(sides: Sequence[float] = (1.0,)) -> list[_HorizonWays]:
    """All ways that are tried, light and viewer moving in turn, on these sides of the surface."""
    theta, phi = (x.ravel() for x in np.meshgrid(OTHERS, AZIMUTHS, indexing="ij"))
    return [
        _HorizonWays(phi, direction(theta, 0.3) * np.array([1.0, 1.0, other]), light_moves, side)
        for light_moves in (True, False)
        for side in sides
        for other in sides
    ]


def _parts(m: Reflectance) -> Iterator[_HorizonWays]:
    """The same, as many together as have few values."""
    for way in ways(hemispheres(m)):
        step = together(m, len(way.phi), len(COSINES))
        for at in range(0, len(way.phi), step):
            part = slice(at, at + step)
            yield way._replace(phi=way.phi[part], fixed=way.fixed[part])


def along(m: Reflectance, way: _HorizonWays, cosine: np.ndarray) -> np.ndarray:
    """f cos(theta) (..., N, C) of the N directions that move, at cosines that broadcast with (..., N)."""
    cosine = np.broadcast_to(cosine, np.broadcast_shapes(np.shape(cosine), way.phi.shape))
    sine = np.sqrt((1.0 - cosine) * (1.0 + cosine))
    moving = np.stack([sine * np.cos(way.phi), sine * np.sin(way.phi), way.side * cosine], -1)
    fixed = np.broadcast_to(way.fixed, moving.shape)
    return values(m, *((moving, fixed) if way.light_moves else (fixed, moving))) * cosine[..., None]


def law(m: Reflectance) -> Findings:
    """Growth from 89.99 to 89.999 degrees, and the largest jump between 80 and 89.9994, whichever is worse."""
    verdicts = [verdict for way in _parts(m) for verdict in (_growth(m, way), _jump(m, way))]
    worst = max(verdicts, key=lambda law: law.value / law.tolerance)
    if is_measured(m) and not worst.passed and worst.tolerance == JUMP:
        yield f"towards grazing the data jump, by up to {worst.value:.2g} of their value"
        worst = max((law for law in verdicts if law.tolerance == GROWTH), key=lambda law: law.value)
    yield worst


def _place(way: _HorizonWays, n: int, cosine: float) -> dict[str, float]:
    moving = direction(np.arccos(way.side * cosine), way.phi[n])
    return degrees(moving, way.fixed[n]) if way.light_moves else degrees(way.fixed[n], moving)


def _growth(m: Reflectance, way: _HorizonWays) -> Law:
    whole = np.abs(along(m, way, COSINES[:, None]))
    near, last = np.abs(along(m, way, np.cos(FAR)[:, None]))
    infinite = np.isinf(whole).any(axis=(0, 2)) | np.isinf(last).any(axis=-1)
    floor = 1e-6 * np.fmax.reduce(_finite(whole), axis=0) + 1e-30
    growth = np.nan_to_num(_finite(last) / np.fmax(_finite(near), floor)).max(axis=-1)
    growth = np.where(infinite, np.inf, growth)
    n = int(growth.argmax())
    value = float(growth[n])
    mover = "light" if way.light_moves else "viewer"
    why = "f is infinite" if np.isinf(value) else f"f cos(theta) grows {value:.3g}-fold as the {mover} goes on"
    rule = "f cos at 89.999/at 89.99 deg = {value} <= {tolerance}"
    return at_most("grazing", value, GROWTH, rule, _place(way, n, float(np.cos(FAR[1]))), why)


def _jump(m: Reflectance, way: _HorizonWays) -> Law:
    """Every step on the way is halved again and again, towards the larger change: of a smooth f none is left."""
    high, low = (np.repeat(c[:, None], len(way.phi), axis=1) for c in (COSINES[:-1], COSINES[1:]))
    whole = _finite(along(m, way, COSINES[:, None]) / COSINES[:, None, None])
    above, below = whole[:-1], whole[1:]
    floor = 1e-6 * np.fmax.reduce(np.abs(whole), axis=0) + 1e-30
    for _ in range(HALVINGS):
        middle = 0.5 * (high + low)
        f = _finite(along(m, way, middle) / middle[..., None])
        upper = _change(above, f, floor) > _change(f, below, floor)
        high, low = np.where(upper, high, middle), np.where(upper, middle, low)
        above, below = np.where(upper[..., None], above, f), np.where(upper[..., None], f, below)
    value, (k, n) = largest(_change(above, below, floor))
    why, rule = f"f jumps by {value:.3g} of its value there", "largest jump of f = {value} <= {tolerance}"
    return at_most("grazing", value, JUMP, rule, _place(way, n, float(low[k, n])), why)


def _finite(f: np.ndarray) -> np.ndarray:
    return np.where(np.isinf(f), 0.0, f)


def _change(a: np.ndarray, b: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Relative to the larger value, the worst over channels; 0 beside a hole in the data."""
    change = np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), floor)
    return np.asarray(np.fmax.reduce(change, axis=-1, initial=0.0))
