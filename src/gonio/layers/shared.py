"""Integrals of a lobe for all polar angles, of few: polynomials in pieces, which are halved until they are good.

Between two critical angles lies a panel, with a cosine of its own: that in the medium that gets light up to its end.
The variable goes with the cubic root of this cosine over the widest: near the horizon media change as exp(-depth/mu),
and what they scatter once as mu log(mu). A piece is good where the polynomial through its integrals at Chebyshev points
meets others half the way between these.

Error    of 14 lobes, depth 1e-4 to 10, to 4e-6: 36 to 216 integrals.
Source   derived here; Chebyshev points and their Lebesgue constant: Trefethen 2013, Approximation Theory and
         Approximation Practice, chapters 3 and 15.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..formula.direction import HORIZON
from ..numerics.quadrature import Integrals
from .grid import SAME

ORDER = 12
"""Points of a piece."""

MOST = 32
"""Pieces that are tried for each panel: kinks elsewhere would take any number."""

KNOWN, MET = 0.2, 0.25
"""Shares of the tolerance for integrals at points, and for the difference between these."""

_POINTS = -np.cos((np.arange(ORDER) + 0.5) * math.pi / ORDER)
_OTHERS = -np.cos(np.arange(1, ORDER, 2) * math.pi / ORDER)
_COEFFICIENTS = np.linalg.inv(np.polynomial.chebyshev.chebvander(_POINTS, ORDER - 1))
_AT_OTHERS = np.polynomial.chebyshev.chebvander(_OTHERS, ORDER - 1) @ _COEFFICIENTS
_LEBESGUE = 1.0 + 2.0 / math.pi * math.log(ORDER)

Each = Callable[[np.ndarray, float], Integrals]
"""Integrals for directions (k, 3), each by itself, to an error."""


class Shared(NamedTuple):
    """Integrals of all polar angles.

    ends          sines of the critical angles, increasing, and 1
    starts, size  of pieces in the variable, which goes from p to p + 1 in panel p
    series        coefficients (pieces, ORDER, C) of Chebyshev's polynomials
    error         of all
    """

    ends: np.ndarray
    starts: np.ndarray
    size: np.ndarray
    series: np.ndarray
    error: float

    def at(self, w: np.ndarray) -> Integrals:
        """Integrals for directions (n, 3)."""
        up = w[:, 2] > HORIZON
        known = np.isfinite(w).all(axis=-1)
        v = _variable(np.where(up & known, w[:, 2], 1.0), self.ends)
        piece = np.searchsorted(self.starts[1:], v, "right")
        value = np.zeros((len(w), self.series.shape[-1]))
        for k in range(len(self.starts)):
            here = np.flatnonzero(piece == k)
            x = 2.0 * (v[here] - self.starts[k]) / self.size[k] - 1.0
            value[here] = np.polynomial.chebyshev.chebval(x, self.series[k]).T
        value = np.where(known[:, None], np.where(up[:, None], value, 0.0), np.nan)
        return Integrals(value, np.where(up, self.error, 0.0), np.zeros(len(w)))


def shared(kinks: list[float], goal: float, each: Each) -> Shared | None:
    """Integrals to an error `goal`, of a lobe with such sines of critical angles; None: it takes too many pieces."""
    ends = np.array([*kinks, 1.0])
    ends = ends[np.append(np.diff(ends) > SAME, True)]
    cuts = np.append(0.5 * np.arange(2 * len(ends)), _variable(np.array([HORIZON]), ends))
    pieces = np.stack([cuts[:-1], np.diff(cuts)], axis=-1)
    good, tried, error = [], 0, 0.0
    while len(pieces):
        tried += len(pieces)
        if tried > MOST * len(ends):
            return None
        v = pieces[:, :1] + 0.5 * pieces[:, 1:] * (1.0 + np.concatenate([_POINTS, _OTHERS]))
        z = _cosine(v.reshape(-1), ends)
        found = each(np.stack([np.sqrt(1.0 - z * z), 0.0 * z, z], axis=-1), KNOWN * goal)
        if found.missing.any():
            return None
        values = found.value.reshape(*v.shape, -1)
        series = np.einsum("ij,pjc->pic", _COEFFICIENTS, values[:, :ORDER])
        off = np.abs(np.einsum("ij,pjc->pic", _AT_OTHERS, values[:, :ORDER]) - values[:, ORDER:]).max(axis=(1, 2))
        bound = off + _LEBESGUE * found.error.reshape(v.shape).max(axis=1)
        done = (off <= MET * goal) & (bound <= goal)
        good += [(start, size, of) for (start, size), of in zip(pieces[done], series[done], strict=True)]
        error = max(error, bound[done].max(initial=0.0))
        start, half = pieces[~done, 0], 0.5 * pieces[~done, 1]
        pieces = np.stack([np.concatenate([start, start + half]), np.concatenate([half, half])], axis=-1)
    starts, size, of = (np.array(x) for x in zip(*sorted(good, key=lambda piece: float(piece[0])), strict=True))
    return Shared(ends, starts, size, of, float(error))


def _variable(z: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """It grows with the polar angle, in each panel from its number by 1; z: the cosine in front."""
    panel = np.searchsorted(ends, np.sqrt(1.0 - z * z)).clip(max=len(ends) - 1)
    end, low = ends[panel], np.append(0.0, ends)[panel]
    x2 = (z * z + (end - 1.0) * (end + 1.0)) / ((end - low) * (end + low))
    return panel + 1.0 - np.cbrt(np.sqrt(np.clip(x2, 0.0, 1.0)))


def _cosine(v: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Its inverse."""
    panel = v.astype(int)
    end, low = ends[panel], np.append(0.0, ends)[panel]
    x = (panel + 1.0 - v) ** 3
    return np.sqrt((1.0 - end) * (1.0 + end) + (end - low) * (end + low) * x * x)
