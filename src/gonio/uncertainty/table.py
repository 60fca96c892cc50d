"""The errors of one measured table under an assumption about their correlation."""

from __future__ import annotations

import math
import weakref
from typing import Any

import numpy as np
from scipy import sparse

from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..tables.gridded import Gridded
from ..tables.scattered import Scattered
from .correlation import Factors, in_words, lengths
from .functionals import Linear
from .latent import Latent, Ledger
from .sensitivity import FEWEST, MOST, STEADY, TRIED, Coefficients, by_channel, coefficients

SCALE = "scale_uncertainty"
"""The key in `about` of the relative standard uncertainty that all values have in common."""


class TableErrors:
    """Standard uncertainties of the f of a table, the correlation of its errors, and a common error of scale.

    u            (nodes, C) [1/sr], NaN where unknown
    scale        relative standard uncertainty of all values together
    """

    def __init__(self, m: Reflectance, correlation: Any, scale: float | None = None):
        if not isinstance(m, Gridded):
            raise ParameterError(
                f"{m!r:.80}: expected a measured table with uncertainties; gn.tabulate makes a table of any "
                f"reflectance, and t.with_brdf(t.brdf(), u) gives it the standard uncertainties u [1/sr]"
            )
        self.m = m
        self.scale = scale_uncertainty(m, scale)
        self.u = by_channel(_uncertainty(m, self.scale), m)
        along = lengths(correlation, tuple(m.axes))
        self.assumed = in_words(correlation) + (f", and of scale ({self.scale:.2g})" if self.scale else "")
        names = m.channel_names
        numbers = names is not None and not any(isinstance(x, str) for x in names)
        channels: Any = np.array(names, dtype=float) if numbers else self.u.shape[1]
        circles = {name: p for k, (name, p) in enumerate(m.periods.items()) if not (m.is_mirrored and k == 0)}
        shared = m.nodes[2] if isinstance(m, Scattered) else None
        self.factors = Factors(m.axes, channels, along, circles, shared)
        self.ledger = _ledger(m, (*along.items(), self.scale))

    def results(self, of: Linear, values: Any) -> Latent:
        """Results (...[, C]) of a linear function in terms of independent errors."""
        n = self._enough(of) if of.sampled else 1
        return self.latent(coefficients(self.m, of, n), np.reshape(values, (-1, self.u.shape[1])))

    def latent(self, by: Coefficients, values: np.ndarray) -> Latent:
        """Results (n, C) with these coefficients in terms of independent errors; `values` for the error of scale."""
        count, channels = values.shape
        rows, unknown = [], []
        for c in range(channels):
            rates = by.of(c)
            u = np.nan_to_num(self.u[:, c])
            parts = self.factors.on_angles(sparse.csr_array(rates.multiply(u[None])))
            rows.append(sparse.kron(sparse.csr_array(self.factors.channels[c : c + 1]), parts, format="csr"))
            unknown.append(rates @ np.isnan(self.u[:, c]).astype(float) > 0.0)
        order = np.arange(count * channels).reshape(channels, count).T.reshape(-1)
        stacked = sparse.csr_array(sparse.vstack(rows, format="csr"))[order]
        flat = values.reshape(-1)
        if self.scale:
            common = sparse.csr_array(self.scale * np.nan_to_num(flat)[:, None])
            stacked = sparse.hstack([stacked, common], format="csr")
        missing = np.stack(unknown, axis=1).reshape(-1) | np.isnan(flat)
        return Latent(sparse.csr_array(stacked), missing, self.ledger)

    def least(self, of: Linear) -> float:
        """Roughly the smallest standard uncertainty of a few results of a linear function; infinite if all are 0."""
        u = self._tried(of, FEWEST)
        return float(np.min(u[u > 0.0], initial=math.inf))

    def draw(self, random: np.random.Generator) -> Gridded:
        """The table as it may have been measured. Unknown uncertainties count as 0."""
        f = self.m.brdf()
        noise = self.factors.draw(random) * np.nan_to_num(self.u)
        table = (f + noise.reshape(f.shape)) * (1.0 + self.scale * random.standard_normal())
        return self.m.redrawn(table)

    def _enough(self, of: Linear) -> int:
        """The number of pairs per result that is enough for steady uncertainties."""
        n, before = FEWEST, np.zeros(0)
        while n < MOST:
            u = self._tried(of, n)
            if before.size and not (np.abs(u - before) > STEADY * u).any():
                break
            before, n = u, 2 * n
        return n

    def _tried(self, of: Linear, n: int) -> np.ndarray:
        """Standard uncertainties of the first results of a linear function by n pairs each, without that of scale."""
        count = min(math.prod(of.shape), TRIED)
        return self.latent(coefficients(self.m, of, n, count), np.zeros((count, self.u.shape[1]))).u


def _ledger(m: Gridded, key: tuple) -> Ledger:
    """The ledger of a table's results under an assumption: kept as long as the table is."""
    if id(m) not in _LEDGERS:
        _LEDGERS[id(m)] = {}
        weakref.finalize(m, _LEDGERS.pop, id(m), None)
    return _LEDGERS[id(m)].setdefault(key, Ledger())


_LEDGERS: dict[int, dict[tuple, Ledger]] = {}


def has_uncertainty(m: Any) -> bool:
    """Whether a reflectance is a measured table with uncertainties."""
    return isinstance(m, Gridded) and (m.uncertainty is not None or bool(scale_uncertainty(m)))


def scale_uncertainty(m: Gridded, scale: float | None = None) -> float:
    """Relative standard uncertainty that all values have in common: `scale`, else the measurement's own, else 0."""
    value = m.about.get(SCALE, 0.0) if scale is None else scale
    try:
        u = float(value)
    except (TypeError, ValueError):
        u = -1.0
    if not 0.0 <= u < math.inf:
        raise ParameterError(
            f"{SCALE}={value!r:.40}: expected a relative standard uncertainty such as 0.02 for 2 %, or 0"
        )
    return u


def _uncertainty(m: Gridded, scale: float) -> np.ndarray:
    """Standard uncertainties of f [1/sr] at the nodes."""
    u = m.brdf_uncertainty()
    if u is None:
        if not scale:
            raise ParameterError(
                f"{m!r:.80}: holds no uncertainty; give it one, as m.with_brdf(m.brdf(), u) with an array u [1/sr], or "
                f"scale=0.02 for a relative error that all values have in common"
            )
        return np.zeros(m.brdf().shape)
    if (u < 0.0).any():
        raise ParameterError(f"{m!r:.80}: has negative uncertainties; expected standard uncertainties, 0 or above")
    return u
