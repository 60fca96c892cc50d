"""The errors of one measured table under an assumption about their correlation."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..machine.caches import at_end
from ..tables import half_planes
from ..tables.gridded import Gridded
from ..tables.scattered import Scattered
from .correlation import Factors, in_words, lengths
from .functionals import Linear
from .latent import Latent, Ledger
from .rehearsal import ErrorPart, Rehearsal
from .row_rehearsal import RowRehearsal
from .sensitivity import FEWEST, MOST, STEADY, TRIED, Coefficients, by_channel, coefficients

SCALE = "scale_uncertainty"
"""The key in `about` of the relative standard uncertainty that all values have in common."""

ROUNDING = 1e-13
"""Size of a part, relative to the largest f, up to which it is rounding."""


class TableErrors:
    """Standard uncertainties of the f of a table, the correlation of its errors, and a common error of scale.

    u            (nodes, C) [1/sr], NaN where unknown
    scale        relative standard uncertainty of all values together
    """

    def __init__(self, m: Reflectance, correlation: Any, scale: float | None = None):
        if not isinstance(m, Gridded):
            raise ParameterError(
                f"{m!r:.80}: expected a measured table; gn.tables.tabulate makes a table of any "
                f"reflectance, and t.with_brdf(t.brdf(), u) gives it the standard uncertainties u [1/sr]"
            )
        self.m = m
        self.scale = scale_uncertainty(m, scale)
        u = _uncertainty(m)
        self.noisy = u is not None
        self.u = by_channel(np.zeros(m.brdf().shape) if u is None else u, m)
        if correlation is None and self.noisy:
            raise ParameterError(
                "correlation: the measurement states uncertainties, but no file says how its errors are correlated; "
                "expected correlation='independent' (repeatability), 'common' (calibration) or another that "
                "gn.with_uncertainty knows"
            )
        along = lengths("independent" if correlation is None else correlation, tuple(m.axes))
        self.assumed = _assumed(m, correlation, self.noisy, self.scale)
        names = m.channel_names
        numbers = names is not None and not any(isinstance(x, str) for x in names)
        channels: Any = np.array(names, dtype=float) if numbers else self.u.shape[1]
        circles = {name: p for k, (name, p) in enumerate(m.periods.items()) if not (m.is_mirrored and k == 0)}
        shared = m.nodes[2] if isinstance(m, Scattered) else None
        self.factors = Factors(m.axes, channels, along, circles, shared)
        self.ledger = _ledger(m, (*along.items(), self.scale))

    def results(self, of: Linear, values: Any, interpolation: np.ndarray) -> Latent:
        """Results (...[, C]) of a linear function in terms of independent errors; `interpolation`: those of it."""
        return self.noise(of, values).joined(interpolation.reshape(-1, interpolation.shape[-1]))

    def noise(self, of: Linear, values: Any, minus: Linear | None = None) -> Latent:
        """Results (...[, C]) of a linear function, less those of another, by errors of the values alone."""
        values = np.reshape(values, (-1, self.u.shape[1]))
        if not self.noisy:
            nothing = sparse.csr_array((values.size, 1))
            return self._scaled(nothing, np.zeros(values.size, bool), values)
        by = coefficients(self.m, of, self._enough(of) if of.sampled else 1)
        if minus is not None:
            other = coefficients(self.m, minus, 1)
            by = Coefficients([a - b for a, b in zip(by.rows, other.rows, strict=True)], by.pattern)
        return self.latent(by, values)

    def interpolation(self, of: Linear, minus: Linear | None = None) -> np.ndarray:
        """Standard uncertainties (n, C, parts) by interpolation, each with its sign, of results of a linear function,
        less those of another.

        What noise makes of the parts is taken off the sum of their squares: it is in the component by noise already.
        """
        parts = self.rehearsal.parts(of, self.noisy)
        if minus is not None:
            parts = [a.less(b) for a, b in zip(parts, self.rehearsal.parts(minus, self.noisy), strict=True)]
        errors = np.stack([part.error for part in parts], axis=-1)
        errors = np.where(np.abs(errors) > ROUNDING * np.abs(self.rehearsal.table).max(initial=0.0), errors, 0.0)
        if not self.noisy:
            return errors
        noise = np.stack([self._noise_of(part) for part in parts], axis=-1)
        has_coefficients = np.array([part.of_values is not None for part in parts])
        squares = (errors[..., has_coefficients] ** 2).sum(axis=-1)
        left = np.maximum(squares - (noise**2).sum(axis=-1), 0.0) / np.where(squares > 0.0, squares, 1.0)
        return np.where(has_coefficients, errors * np.sqrt(left)[..., None], errors)

    @cached_property
    def rehearsal(self) -> Rehearsal | RowRehearsal:
        return RowRehearsal(self.m) if isinstance(self.m, Scattered) else Rehearsal(self.m)

    def _noise_of(self, part: ErrorPart) -> np.ndarray:
        """The standard uncertainty (n, C) of a part by errors of the values, 0 where that is unknown."""
        if part.of_values is None:
            return np.zeros(part.error.shape)
        by = Coefficients([part.of_values], np.zeros(self.u.shape[1], int))
        return np.nan_to_num(self.latent(by, np.zeros(part.error.shape), scaled=False).u.reshape(part.error.shape))

    def latent(self, by: Coefficients, values: np.ndarray, scaled: bool = True) -> Latent:
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
        missing = np.stack(unknown, axis=1).reshape(-1)
        return self._scaled(stacked, missing, values, scaled)

    def _scaled(self, rows: sparse.csr_array, missing: np.ndarray, values: np.ndarray, scaled: bool = True) -> Latent:
        """Rows with the error of scale of the values, if that is asked for."""
        flat = values.reshape(-1)
        if self.scale and scaled:
            common = sparse.csr_array(self.scale * np.nan_to_num(flat)[:, None])
            rows = sparse.hstack([rows, common], format="csr")
        return Latent(sparse.csr_array(rows), missing | np.isnan(flat), self.ledger)

    def least(self, of: Linear, interpolation: np.ndarray) -> float:
        """Roughly the smallest standard uncertainty of a few results of a linear function; 0 if all are."""
        u = np.sqrt((interpolation**2).sum(axis=-1)).reshape(-1)
        if self.noisy:
            noise = self._tried(of, FEWEST)
            u = np.hypot(noise, u[: len(noise)])
        return float(np.min(u[u > 0.0])) if (u > 0.0).any() else 0.0

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


def _assumed(m: Gridded, correlation: Any, noisy: bool, scale: float) -> str:
    """What uncertainties rest on, for people."""
    words = in_words(correlation) if noisy else "by interpolation alone: the measurement states no uncertainties"
    if scale:
        words = (words if noisy else "no uncertainties of values are stated") + f", and of scale ({scale:.2g})"
    few = half_planes.in_words(half_planes.half_planes(m))
    return f"{words}; {few}" if few else words


def _ledger(m: Gridded, key: tuple) -> Ledger:
    """The ledger of a table's results under an assumption: kept as long as the table is."""
    if id(m) not in _LEDGERS:
        at_end(m, _LEDGERS.pop, id(m))
        _LEDGERS[id(m)] = {}
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


def _uncertainty(m: Gridded) -> np.ndarray | None:
    """Standard uncertainties of f [1/sr] at the nodes, or None."""
    u = m.brdf_uncertainty()
    if u is not None and (u < 0.0).any():
        raise ParameterError(f"{m!r:.80}: has negative uncertainties; expected standard uncertainties, 0 or above")
    return u
