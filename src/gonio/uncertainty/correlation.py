"""The correlation of the errors of a table: one factor per axis; their product turns independent errors into them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from ..errors import ParameterError

CHANNEL = "channel"

WORDS = ("independent", "common", "channel")

LOST = 1e-12
"""The share of the variance along an axis that may be left out."""

SPARSE = 1e-3
"""The largest share of numbers other than 0 in rows that stay sparse, for errors correlated over some distance."""

Lengths = dict[str, float]
"""Axis -> correlation length: 0 for independent errors, infinite for one error that is common along the axis."""


def lengths(correlation: str | float | Mapping[str, float], axes: Sequence[str]) -> Lengths:
    """The lengths that `correlation` means, for each axis of angles and for "channel".

    "independent"   every value has an error of its own
    "common"        one error for all: calibration, scale
    "channel"       one error for all values of a channel, another for each channel
    a number        correlation length [rad] along every angle; channels are independent
    a mapping       axis -> correlation length [rad; "channel": nm], the others independent; math.inf: common along it
    """
    if isinstance(correlation, str):
        if correlation not in WORDS:
            raise ParameterError(
                f"correlation={correlation!r:.60}: expected one of {', '.join(map(repr, WORDS))}, a correlation length "
                f"[rad], or a mapping from axes to correlation lengths"
            )
        angle = 0.0 if correlation == "independent" else math.inf
        return {**dict.fromkeys(axes, angle), CHANNEL: math.inf if correlation == "common" else 0.0}
    names = (*axes, CHANNEL)
    along = dict.fromkeys(names, 0.0)
    for axis, length in (correlation if isinstance(correlation, Mapping) else dict.fromkeys(axes, correlation)).items():
        if axis not in names:
            raise ParameterError(f"correlation: no axis {axis!r:.60}; expected some of {', '.join(names)}")
        try:
            along[axis] = float(length)
        except (TypeError, ValueError):
            along[axis] = -1.0
        if not along[axis] >= 0.0:
            raise ParameterError(
                f"correlation length {length!r:.60} along {axis}: expected a number that is 0 (independent) or above; "
                f"math.inf for errors that are common along it"
            )
    return along


def factor(nodes: np.ndarray, length: float, period: float | None = None) -> np.ndarray | None:
    """F (n, r) with the correlation matrix R = F F^T of the nodes of an axis; None where R is the identity.

    R = exp(-d^2 / 2 length^2) with the distance d of two nodes; round a circle of period p, d is p/pi sin(pi d/p),
    which is the same for small d. Both are correlation matrices whatever the nodes are (their
    Fourier transforms are positive). Components that hold `LOST` of the variance are left out.
    """
    n = len(nodes)
    if length == 0.0:
        return None
    if math.isinf(length):
        return np.ones((n, 1))
    apart = np.asarray(nodes, dtype=float)[:, None] - np.asarray(nodes, dtype=float)
    if period is not None:
        apart = period / math.pi * np.sin(math.pi / period * apart)
    values, vectors = np.linalg.eigh(np.exp(-0.5 * (apart / length) ** 2))
    kept = values > LOST * n
    return vectors[:, kept] * np.sqrt(values[kept])


class Factors:
    """The factors of a table's axes and of its channels: errors = (F_1 x F_2 x ... ) independent errors.

    angles     a factor per axis of the grid, None where errors are independent
    shared     (nodes, n): which nodes have the error of one measurement, where there are more nodes than these
    channels   (C, r)
    """

    def __init__(
        self,
        axes: Mapping[str, np.ndarray],
        channels: int | np.ndarray,
        lengths_: Lengths,
        periods: Mapping[str, float],
        shared: np.ndarray | None = None,
    ):
        """`channels`: how many, or their wavelengths [nm]. `shared`: the number of the measurement of each node."""
        self.shape = tuple(len(x) for x in axes.values())
        self.angles = [factor(x, lengths_[name], periods.get(name)) for name, x in axes.items()]
        self.shared = None
        if shared is not None and not any(lengths_[name] for name in axes):
            flat = np.unique(shared, return_inverse=True)[1].reshape(-1)
            self.shared = sparse.csr_array((np.ones(flat.size), (np.arange(flat.size), flat)))
        length = lengths_[CHANNEL]
        if isinstance(channels, int) and 0.0 < length < math.inf:
            raise ParameterError(
                f"correlation length {length:g} nm along channel: the channels have no wavelengths; expected 0 or "
                f"math.inf"
            )
        n = channels if isinstance(channels, int) else len(channels)
        across = factor(np.zeros(n) if isinstance(channels, int) else channels, length)
        self.channels = np.eye(n) if across is None else across

    def on_angles(self, rows: sparse.csr_array) -> sparse.csr_array:
        """Rows (n, nodes) of sensitivities to errors of the table -> to the independent errors that make them."""
        if self.shared is not None:
            return sparse.csr_array(rows @ self.shared)
        wide = any(f is not None and f.shape[1] > 1 for f in self.angles)
        if wide and rows.nnz > SPARSE * math.prod(rows.shape):
            tables = (rows[[i]].toarray().reshape(self.shape) for i in range(rows.shape[0]))
            parts = [sparse.csr_array(_along_axes(table, self.angles, 0).reshape(1, -1)) for table in tables]
            return sparse.vstack(parts, format="csr")
        for spread in self._of_axes:
            rows = sparse.csr_array(rows @ spread)
        return rows

    @cached_property
    def _of_axes(self) -> list[Any]:
        """The factors of axes as matrices on whole tables, one after the other."""
        sizes, found = list(self.shape), []
        for axis, f in enumerate(self.angles):
            if f is not None:
                before, behind = (sparse.eye_array(math.prod(part)) for part in (sizes[:axis], sizes[axis + 1 :]))
                found.append(sparse.kron(sparse.kron(before, f), behind, format="csr"))
                sizes[axis] = f.shape[1]
        return found

    def draw(self, random: np.random.Generator) -> np.ndarray:
        """A table (nodes, C) of errors with standard deviation 1."""
        channels = self.channels.shape[1]
        if self.shared is not None:
            errors = random.standard_normal((self.shared.shape[1], channels))[self.shared.indices]
        else:
            sizes = [n if f is None else f.shape[1] for n, f in zip(self.shape, self.angles, strict=True)]
            errors = _along_axes(random.standard_normal((*sizes, channels)), self.angles, 1)
        return errors.reshape(-1, channels) @ self.channels.T


def _along_axes(table: np.ndarray, factors: Sequence[np.ndarray | None], side: int) -> np.ndarray:
    """A table with each axis multiplied by its factor, along the factor's axis `side`."""
    for axis, f in enumerate(factors):
        if f is not None:
            table = np.moveaxis(np.tensordot(table, f, (axis, side)), -1, axis)
    return table


def in_words(correlation: Any) -> str:
    """The correlation, for people."""
    if isinstance(correlation, str):
        return {
            "independent": "independent errors",
            "common": "an error common to all values",
            "channel": "an error common to the values of a channel",
        }[correlation]
    if isinstance(correlation, Mapping):
        return "errors correlated along " + ", ".join(f"{axis} ({length:g})" for axis, length in correlation.items())
    return f"errors correlated over {float(correlation):g} rad"
