"""Lobes in space: f of a few angles of incidence on grids of directions that are finest about the mirror direction."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np

from ...arrays.kinds import with_channels
from ...base.angles import direction
from ...base.reflectance import Reflectance
from ...base.sides import hemispheres
from ...figures._slices import bounded, lit_range, one_number, plane

INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)
"""Angles of incidence [degrees] of the lobes."""

POLAR, AROUND = 72, 120
"""Directions of a grid by polar angle and by azimuth."""

NARROW = 0.03
"""Angle [degrees] beside the mirror direction within which directions are spread evenly."""

DECADES = 4.0
"""Powers of ten that the logarithmic radius shows."""

NAMED = (("codes", "peak"), ("through", "peak_through"))
"""What the table of each side is called, and its largest value."""

LARGEST = (1 << 16) - 1
"""The largest code; 0 means that there are no data."""


def _clustered(low: float, high: float, count: int, centres: dict[float, float]) -> np.ndarray:
    """Numbers from `low` to `high`: some evenly, the others as dense about each centre as its weight and the inverse
    of the distance from it say. The heaviest centre is one of them."""
    x = np.unique(np.concatenate([np.linspace(low, high, 4001), *(_beside(c) for c in centres)]))
    x = x[(x >= low) & (x <= high)]
    density = np.full(len(x), 1.2 / (high - low))
    for centre, weight in centres.items():
        density = density + weight / (np.abs(x - centre) + NARROW) / math.log(45.0 / NARROW)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(x))])
    spaced = np.interp(np.linspace(0.0, total[-1], count), total, x)
    centre = max(centres, key=lambda c: centres[c], default=low)
    inner = np.abs(spaced[1:-1] - centre).argmin() + 1
    if low < centre < high:
        spaced[inner] = centre
    return spaced


def _beside(centre: float) -> np.ndarray:
    steps = np.geomspace(1e-3, 60.0, 160)
    return np.concatenate([[centre], centre + steps, centre - steps])


def grid(theta_i: float) -> tuple[np.ndarray, np.ndarray]:
    """Polar angles, and azimuths from the plane of the mirror direction [degrees], of a lobe."""
    polar = _clustered(0.0, 90.0, POLAR, {theta_i: 1.0})
    around = np.linspace(-180.0, 180.0, AROUND + 1)
    if theta_i > 1.0:
        around = _clustered(-180.0, 180.0, AROUND + 1, {0.0: 1.0, -180.0: 0.2, 180.0: 0.2})
    return polar, around


def incidences(m: Reflectance) -> list[float]:
    """Angles of incidence [degrees] of which a material has data."""
    low, high = lit_range(m)
    inside = [theta for theta in INCIDENCES if low - 0.5 <= theta <= high + 0.5]
    return inside or [0.5 * (low + high)]


def values(m: Reflectance, theta_i: float, through: bool = False) -> np.ndarray:
    """f [1/sr] as one number on the grid of a lobe (polar, around); NaN where there are no data."""
    number, _ = one_number(m)
    phi = plane(m)
    polar, around = (np.radians(x) for x in grid(theta_i))
    polar = np.minimum(polar, math.radians(89.95))
    wo = direction((math.pi - polar if through else polar)[:, None], phi + math.pi + around[None, :])
    return np.asarray(number(with_channels(bounded(m).f(direction(math.radians(theta_i), phi), wo), 2)), float)


def lobes(m: Reflectance) -> dict[str, Any]:
    """The lobes of a material for the page: codes of log10 f, from `low` to `high`, as base64 of 16-bit numbers."""
    thetas = incidences(m)
    sides = hemispheres(m)
    tables = {theta: [values(m, theta, z < 0.0) for z in sides] for theta in thetas}
    above_zero = np.concatenate([t[np.isfinite(t) & (t > 0.0)] for of_sides in tables.values() for t in of_sides])
    high = math.log10(above_zero.max()) if above_zero.size else 0.0
    low = min(max(math.log10(above_zero.min()), high - DECADES), high - 0.5) if above_zero.size else high - 1.0
    floor = high - 8.0  # codes reach further down than the radius: the linear one needs no more
    number, unit = one_number(m)
    lobes = []
    for theta, of_sides in tables.items():
        polar, around = grid(theta)
        lobe: dict[str, Any] = {
            "theta_i": theta,
            "polar": polar.round(4).tolist(),
            "around": around.round(4).tolist(),
        }
        for (codes, peak), table in zip(NAMED, of_sides, strict=False):
            lobe |= {codes: _codes(table, floor, high), peak: _largest(table)}
        if m.has_delta:
            wo = direction(math.radians(theta), plane(m))
            shares = [number(with_channels(m.delta_reflectance(wo, across=z < 0.0), 0)) for z in sides]
            lobe["delta"] = [*map(float, shares), 0.0][:2]
        lobes.append(lobe)
    return {"low": low, "high": high, "floor": floor, "unit": unit, "lobes": lobes}


def _codes(f: np.ndarray, floor: float, high: float) -> str:
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (np.log10(np.maximum(f, 0.0)) - floor) / max(high - floor, 1e-9)
    codes = 1.0 + np.clip(np.nan_to_num(share, neginf=0.0), 0.0, 1.0) * (LARGEST - 1)
    return base64.b64encode(np.where(np.isfinite(f), codes.round(), 0.0).astype("<u2").tobytes()).decode()


def _largest(f: np.ndarray) -> float:
    finite = f[np.isfinite(f)]
    return float(finite.max()) if finite.size else float("nan")
