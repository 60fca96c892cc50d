"""A result as a laboratory quotes it: value, standard uncertainty, coverage interval."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from ..declared.arguments import Declared, checked
from ..declared.notebooks import repr_html
from ..errors import ParameterError
from .latent import Latent

if TYPE_CHECKING:
    from uncertainties import UFloat


@dataclass(frozen=True, eq=False)
class Quoted:
    """A result with its uncertainty: a number, or an array (...[, C]). Prints as 0.1234(56).

    value            the result; of a Monte Carlo calculation the mean of all draws (JCGM 101, 7.6)
    u                its standard uncertainty, NaN where that of the table is unknown
    u_noise          the component by the errors of the values, 0 where the table states none
    u_interpolation  the component by interpolation between nodes and by what is beyond them: u^2 is the sum of squares
    at_estimate      the result of the table as it is: the same, but for a Monte Carlo calculation of something
                     non-linear
    method           "first order", or "Monte Carlo" with the number of draws
    assumed          the assumption about the errors of the table, and what there is to say of where it was measured
    draws            (draws, ...[, C]) of a Monte Carlo calculation, with both components, else None

    Example
    >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
    >>> f = np.full((3, 3, 2), 0.1)
    >>> m = gn.Gridded("angles", axes, f, uncertainty=0.02 * f)
    >>> q = gn.with_uncertainty(gn.albedo, m, [0, 0, 1], correlation="common")
    >>> print(q.value.round(4), q.u.round(4))
    0.3141 0.0063
    """

    _repr_html_ = repr_html

    value: Any
    u: Any
    u_noise: Any
    u_interpolation: Any
    at_estimate: Any
    method: str
    assumed: str
    latent: Latent | None = field(repr=False, default=None)
    draws: np.ndarray | None = field(repr=False, default=None)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance matrix (n, n) of the n numbers, in the order of `np.ravel(value)`.

        Example
        >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
        >>> f = np.full((3, 3, 2), 0.1)
        >>> m = gn.Gridded("angles", axes, f, uncertainty=0.02 * f)
        >>> q = gn.with_uncertainty(gn.albedo, m, [0, 0, 1], correlation="common")
        >>> print(q.covariance.shape)
        (1, 1)
        """
        if self.latent is not None:
            return self.latent.covariance(self.latent)
        assert self.draws is not None
        return np.cov(self.draws.reshape(len(self.draws), -1), rowvar=False).reshape(np.size(self.value), -1)

    @checked
    def interval(self, p: float = 0.95) -> tuple[Any, Any]:
        """Ends of the coverage interval of probability p, with as much left out below as above.

        First order: value -+ k u of a normal distribution (k = 1.96 for p = 0.95). Monte Carlo: the quantiles of the
        draws (JCGM 101, 7.7.2).

        Example
        >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
        >>> f = np.full((3, 3, 2), 0.1)
        >>> m = gn.Gridded("angles", axes, f, uncertainty=0.02 * f)
        >>> q = gn.with_uncertainty(gn.albedo, m, [0, 0, 1], correlation="common")
        >>> low, high = q.interval(p=0.95)
        >>> print(low.round(4), high.round(4))
        0.3018 0.3264
        """
        if not 0.0 < p < 1.0:
            raise ParameterError(f"interval(p={p!r:.40}): expected a probability between 0 and 1, such as 0.95")
        if self.draws is not None:
            low, high = np.quantile(self.draws, [0.5 - 0.5 * p, 0.5 + 0.5 * p], axis=0)
            return low[()], high[()]
        k = NormalDist().inv_cdf(0.5 + 0.5 * p)
        return self.value - k * self.u, self.value + k * self.u

    @checked
    def expanded(self, k: float = 2.0) -> Any:
        """Expanded uncertainty U = k u.

        Example
        >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
        >>> f = np.full((3, 3, 2), 0.1)
        >>> m = gn.Gridded("angles", axes, f, uncertainty=0.02 * f)
        >>> q = gn.with_uncertainty(gn.albedo, m, [0, 0, 1], correlation="common")
        >>> print(q.expanded(k=2.0).round(4))
        0.0126
        """
        return k * self.u

    @checked
    def text(self, k: Annotated[float, Declared("coverage factor of the uncertainty", 0.0, 1e6)] = 1.0) -> Any:
        """ "0.1234 ± 0.0056 (k = 1: noise 0.0012, interpolation 0.0055)": the value with the expanded uncertainty k u,
        two digits of it, and its components; an array of these for an array.

        Example
        >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
        >>> f = np.full((3, 3, 2), 0.1)
        >>> m = gn.Gridded("angles", axes, f, uncertainty=0.02 * f)
        >>> q = gn.with_uncertainty(gn.albedo, m, [0, 0, 1], correlation="common")
        >>> print(q.text(k=2.0).split(" (")[0])
        0.314 ± 0.013
        """
        return self._in_words(k, f"k = {k:g}: ")

    def _in_words(self, k: float, factor: str = "") -> Any:
        return _each(
            lambda v, u, *parts: f"{rounded(v, k * u, ' ± ')} ({factor}{components(k, *parts)})",
            *(self.value, self.u, self.u_noise, self.u_interpolation),
        )

    def ufloat(self) -> UFloat | np.ndarray:
        """The same for calculations with the package `uncertainties`: a number, or an array (dtype object) of them.

        Results of first order from the same table with the same correlation are correlated as they should be, from
        one call or from several, so that their difference or ratio has the right uncertainty. Of Monte Carlo results,
        those of one call are.

        Example
        >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
        >>> f = np.full((3, 3, 2), 0.1)
        >>> m = gn.Gridded("angles", axes, f, uncertainty=0.02 * f)
        >>> q = gn.with_uncertainty(gn.albedo, m, [0, 0, 1], correlation="common")
        >>> print((q.ufloat() - q.ufloat()).std_dev)
        0.0
        """
        from uncertainties import correlated_values

        flat = np.ravel(self.value).astype(float)
        array = np.empty(flat.size, dtype=object)
        array[:] = correlated_values(flat, self.covariance) if self.latent is None else self.latent.ufloats(flat)
        return array.reshape(np.shape(self.value))[()]

    def __str__(self) -> str:
        return str(_each(rounded, self.value, self.u)).replace("'", "")

    def __repr__(self) -> str:
        return str(self._in_words(1.0)).replace("'", "")


def _each(write: Any, *numbers: Any) -> Any:
    if np.ndim(numbers[0]) == 0:
        return write(*map(float, numbers))
    flat = [write(*map(float, x)) for x in zip(*map(np.ravel, numbers), strict=True)]
    return np.array(flat).reshape(np.shape(numbers[0]))


def components(k: float, noise: float, interpolation: float) -> str:
    """ "noise 0.0012, interpolation 0.0055", times k."""
    return f"noise {_short(k * noise)}, interpolation {_short(k * interpolation)}"


def _short(u: float) -> str:
    return "unknown" if math.isnan(u) else f"{u:.2g}"


def rounded(value: float, u: float, sign: str = "") -> str:
    """A value with two digits of its uncertainty, as the GUM writes it (7.2.2): 0.1234(56), or with a sign between
    them, 0.1234 ± 0.0056."""
    from uncertainties import ufloat

    if not math.isfinite(value):
        return f"{value:g}"
    if not math.isfinite(u) or u == 0.0:
        spread = "0" if u == 0.0 else "unknown"
        return f"{value:.6g}{sign}{spread}" if sign else f"{value:.6g}({spread})"
    return f"{ufloat(value, u):.2u{'' if sign else 'S'}}".replace("+/-", sign)
