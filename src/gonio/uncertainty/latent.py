"""Results as sums of independent errors, and the covariances that follow."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

if TYPE_CHECKING:
    from uncertainties import UFloat

NEGLIGIBLE = 1e-12
"""Variance, relative to the largest, that is taken for rounding."""


class Ledger:
    """The results of one table, under one assumption about its errors, that are `ufloat`s already.

    Each is a sum over independent variables. A new result gets the part of it that is correlated with earlier ones
    from their variables, and for the rest variables of its own: Cholesky's decomposition of the covariance matrix of
    all results, row by row.
    """

    def __init__(self) -> None:
        self.rows: list[Any] = []
        self.factor = np.zeros((0, 0))
        self.variables: list[Any] = []

    def add(self, rows: sparse.csr_array) -> np.ndarray:
        """Enter results, rows (n, latents); their coefficients (n, variables)."""
        from uncertainties import ufloat

        earlier = sparse.vstack(self.rows, format="csr") if self.rows else rows[:0]
        across, among = (rows @ earlier.T).toarray(), (rows @ rows.T).toarray()
        shared = np.linalg.lstsq(self.factor, across.T, rcond=None)[0].T if self.rows else np.zeros((len(among), 0))
        values, vectors = np.linalg.eigh(among - shared @ shared.T)
        new = values > NEGLIGIBLE * max(among.diagonal().max(initial=0.0), 1e-300)
        rest = vectors[:, new] * np.sqrt(values[new])
        self.variables += [ufloat(0.0, 1.0) for _ in range(rest.shape[1])]
        above = np.zeros((len(self.factor), rest.shape[1]))
        self.factor = np.block([[self.factor, above], [shared, rest]])
        self.rows.append(rows)
        return self.factor[-len(among) :]


class Latent:
    """n results as rows (n, latents) of coefficients of independent errors with standard deviation 1.

    The last `parts` of these are errors of interpolation.
    """

    def __init__(self, rows: sparse.csr_array, unknown: np.ndarray, ledger: Ledger, parts: int = 0):
        """`unknown` (n,): whether an uncertainty behind the result is not known."""
        self.rows, self.unknown, self.ledger, self.parts = rows, unknown, ledger, parts
        self._ufloats: list[Any] | None = None

    def joined(self, interpolation: np.ndarray) -> Latent:
        """With errors of interpolation (n, parts)."""
        rows = sparse.hstack([self.rows, sparse.csr_array(interpolation)], format="csr")
        return Latent(sparse.csr_array(rows), self.unknown, self.ledger, interpolation.shape[1])

    @property
    def u(self) -> np.ndarray:
        """Standard uncertainties (n,), NaN where unknown."""
        return np.where(self.unknown, np.nan, _norm(self.rows))

    @property
    def u_noise(self) -> np.ndarray:
        """The component by errors of the values."""
        return np.where(self.unknown, np.nan, _norm(self.rows[:, : self.rows.shape[1] - self.parts]))

    @property
    def u_interpolation(self) -> np.ndarray:
        """The component by interpolation."""
        return _norm(self.rows[:, self.rows.shape[1] - self.parts :])

    def covariance(self, other: Latent) -> np.ndarray:
        """Covariances (n, m) with the results of another, under the same assumption about the same table."""
        covariance = (self.rows @ other.rows.T).toarray()
        covariance[self.unknown] = np.nan
        covariance[:, other.unknown] = np.nan
        return covariance

    def ufloats(self, values: np.ndarray) -> list[UFloat]:
        """The results (n,) as correlated numbers of the package `uncertainties`; the same ones when asked again."""
        from uncertainties import ufloat

        if self._ufloats is None:
            coefficients = self.ledger.add(self.rows)
            self._ufloats = []
            for value, row, unknown in zip(values, coefficients, self.unknown, strict=True):
                terms = [c * z for c, z in zip(row, self.ledger.variables, strict=False) if c != 0.0]
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", UserWarning)  # that an uncertainty may be 0 is known here
                    self._ufloats.append(ufloat(value, np.nan if unknown else 0.0) + sum(terms))
        return self._ufloats


def _norm(rows: sparse.csr_array) -> np.ndarray:
    return np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).reshape(-1))
