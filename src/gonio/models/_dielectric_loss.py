"""How much light a rough dielectric of GGX facets loses by counting the first scattering only: l(mu, alpha, eta).

l is 1 less the light that `RoughDielectric(GGX(alpha), eta)` reflects and transmits. It has no closed form, so that a
table stands here, at 48 indices, 56 widths and 80 angles, from the thinner and from the denser side, 16 bits each. It
is the piecewise linear function next to integrals over the visible normals (320 times 160 Gauss nodes from the denser
side, 128 times 64 from the thinner) at twice as many indices and widths. The file keeps its third differences, which
deflate better. tests/models/test_transmission.py holds it to cubature.

Error    of l, by linear interpolation, at 30,000 places of eta in [1.02, 3], alpha in [0.001, 1]: 7e-4 at most, 2.5e-4
         at 99 % of them.
"""

from __future__ import annotations

import math
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..formula.distribution import ALPHA_LOW

LOWEST, HIGHEST = 1.02, 3.0
"""Indices of the table: those of the denser medium over the thinner."""

_SHAPE = (48, 56, 80)
_FIRST, _LAST = (((eta - 1.0) / (eta + 1.0)) ** 0.25 for eta in (LOWEST, HIGHEST))
_NARROWEST = math.sqrt(ALPHA_LOW)

Corners = list[tuple[Any, Any]]


@cache
def _table() -> np.ndarray:
    """l at (side, eta, alpha, mu): side 0 is the thinner one."""
    with resources.files("gonio.data").joinpath("ggx_dielectric_loss.npz").open("rb") as file:
        numbers = np.load(file)["differences"]
    for axis in (1, 2, 3):
        numbers = np.cumsum(numbers, axis=axis, dtype=np.uint16)
    return np.asarray(numbers * (1.0 / 65535.0))


@cache
def _on_average() -> np.ndarray:
    """L = 2 integral of l mu dmu of the interpolated table, at (side, eta, alpha): Gauss's rule between nodes."""
    x, w = np.polynomial.legendre.leggauss(8)
    alpha = np.linspace(_NARROWEST, 1.0, _SHAPE[1])[:, None, None] ** 2
    mu = _cosine(np.linspace(0.0, 1.0, _SHAPE[2]), alpha[..., 0])
    low, high = mu[:, :-1, None], mu[:, 1:, None]
    at = low + (high - low) * 0.5 * (x + 1.0)
    place = (_place(at, alpha) + 0.5) * (_SHAPE[2] - 1) - np.arange(_SHAPE[2] - 1)[:, None]
    table = _table()[..., None]
    values = table[..., :-1, :] * (1.0 - place) + table[..., 1:, :] * place
    return np.asarray((values * 2.0 * at * (high - low) * 0.5 * w).sum(axis=(-2, -1)))


def _cosine(place: Any, alpha: Any) -> np.ndarray:
    """The inverse of `_place` + 1/2."""
    b = 1.0 + 2.0 * alpha - 2.0 * place
    return np.asarray(0.5 * (np.sqrt(b * b + 8.0 * place * alpha) - b))


def _place(mu: Any, alpha: Any) -> Any:
    """Where mu stands in a row of the table, from its middle, in [-1/2, 1/2]: half of it where facets are at grazing.

    From the middle, for narrow facets stand there at small mu, where l falls as 1/mu^2: the digits of mu are kept.
    """
    return 0.5 * (mu - alpha * (1.0 - mu) / (mu + alpha))


def tables() -> dict[str, Fixed]:
    """The table and its averages, flat, by the names that formulas know them by."""
    return {"loss": Fixed(lambda: _table().reshape(-1)), "losses": Fixed(lambda: _on_average().reshape(-1))}


def _cell(x: Any, count: int, low: float = 0.0) -> tuple[Any, Any]:
    """The cell of [low, low + 1] that x lies in, of count - 1, and the place in it."""
    position, first = ops.clip(x, low, low + 1.0) * (count - 1.0), low * (count - 1.0)
    start = ops.minimum(ops.floor(position - first), count - 2.0)
    return ops.to_index(start), position - (start + first)


def corners(alpha: Any, eta: Any) -> Corners:
    """The rows of the table to interpolate, with their weights; `eta` of the denser medium over the thinner."""
    i, u = _cell((ops.sqrt(ops.sqrt((eta - 1.0) / (eta + 1.0))) - _FIRST) * (1.0 / (_LAST - _FIRST)), _SHAPE[0])
    j, v = _cell((ops.sqrt(alpha) - _NARROWEST) * (1.0 / (1.0 - _NARROWEST)), _SHAPE[1])
    first = i * _SHAPE[1] + j
    rows = ((0, (1.0 - u) * (1.0 - v)), (1, (1.0 - u) * v), (_SHAPE[1], u * (1.0 - v)), (_SHAPE[1] + 1, u * v))
    return [(first + step, weight) for step, weight in rows]


def _rows(denser: Any) -> Any:
    """The first row of a side: `denser` is 1 or 0."""
    return ops.to_index(denser) * (_SHAPE[0] * _SHAPE[1])


def lost(table: Any, at: Corners, denser: Any, mu: Any, alpha: Any) -> Any:
    """l(mu): the share of light at the cosine mu that is lost, from the denser side (1) or the thinner (0)."""
    k, v = _cell(_place(mu, alpha), _SHAPE[2], -0.5)
    start, total = _rows(denser), 0.0 * mu
    for row, weight in at:
        place = (start + row) * _SHAPE[2] + k
        low, high = ops.take(table, place), ops.take(table, place + 1)
        total = total + weight * (low + v * (high - low))
    return total


def lost_on_average(table: Any, at: Corners, denser: Any) -> Any:
    """L: the same for diffuse light."""
    start = _rows(denser)
    values = [weight * ops.take(table, start + row) for row, weight in at]
    return values[0] + values[1] + values[2] + values[3]


def diffuse_reflectance(eta: Any) -> Any:
    """F of a smooth interface for diffuse light from the thinner side, eta from 1.02 to 3: a fit, to 1e-3.

    Source   least squares on Walsh's closed form: Duntley 1942, J. Opt. Soc. Am. 32:61.
    """
    x = (eta - 1.0) / (eta + 1.0)
    return x * (0.548078 - x * (0.918607 - x * (2.757624 - x * 1.813123)))
