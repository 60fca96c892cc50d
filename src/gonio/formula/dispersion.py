"""Refractive indices by dispersion formulas: those that the files of refractiveindex.info name by number."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import ops
from ..declared.numbers import NANOMETRES
from ..errors import ParameterError
from .bands import edges
from .spectrum import Spectrum, as_wavelengths, require_within
from .text import shown

Coefficients = Sequence[float]

SAMPLES = 2001
"""Wavelengths at which a formula is tabulated, for `wavelengths`, `values` and means over bands."""


def _pairs(c: Coefficients) -> list[tuple[float, float]]:
    """C2 and C3, C4 and C5, ..."""
    return list(zip(c[1::2], c[2::2], strict=True))


def _sellmeier(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n^2 = 1 + C1 + C2 x^2/(x^2 - C3^2) + C4 x^2/(x^2 - C5^2) + ..."""
    return np.sqrt(1.0 + c[0] + sum(a * x**2 / (x**2 - b**2) for a, b in _pairs(c)))


def _sellmeier_2(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n^2 = 1 + C1 + C2 x^2/(x^2 - C3) + C4 x^2/(x^2 - C5) + ..."""
    return np.sqrt(1.0 + c[0] + sum(a * x**2 / (x**2 - b) for a, b in _pairs(c)))


def _polynomial(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n^2 = C1 + C2 x^C3 + C4 x^C5 + ..."""
    return np.sqrt(c[0] + sum(a * x**b for a, b in _pairs(c)))


def _general(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n^2 = C1 + C2 x^C3/(x^2 - C4^C5) + C6 x^C7/(x^2 - C8^C9) + C10 x^C11 + C12 x^C13 + ..."""
    resonances = [c[k : k + 4] for k in (1, 5) if any(c[k : k + 4])]
    poles = sum(a * x**power / (x**2 - b**e) for a, power, b, e in resonances)
    n: np.ndarray = np.sqrt(c[0] + poles + sum(a * x**power for a, power in zip(c[9::2], c[10::2], strict=True)))
    return n


def _cauchy(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n = C1 + C2 x^C3 + C4 x^C5 + ..."""
    return c[0] + sum(a * x**b for a, b in _pairs(c)) + 0.0 * x


def _gases(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n = 1 + C1 + C2/(C3 - x^-2) + C4/(C5 - x^-2) + ..."""
    return 1.0 + c[0] + sum(a / (b - x**-2.0) for a, b in _pairs(c)) + 0.0 * x


def _herzberger(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n = C1 + C2 L + C3 L^2 + C4 x^2 + C5 x^4 + C6 x^6, L = 1/(x^2 - 0.028)"""
    reach = 1.0 / (x**2 - 0.028)
    return c[0] + c[1] * reach + c[2] * reach**2 + c[3] * x**2 + c[4] * x**4 + c[5] * x**6


def _retro(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """(n^2 - 1)/(n^2 + 2) = C1 + C2 x^2/(x^2 - C3) + C4 x^2"""
    share = c[0] + c[1] * x**2 / (x**2 - c[2]) + c[3] * x**2
    return np.sqrt((1.0 + 2.0 * share) / (1.0 - share))


def _exotic(x: np.ndarray, c: Coefficients) -> np.ndarray:
    """n^2 = C1 + C2/(x^2 - C3) + C4 (x - C5)/((x - C5)^2 + C6)"""
    return np.sqrt(c[0] + c[1] / (x**2 - c[2]) + c[3] * (x - c[4]) / ((x - c[4]) ** 2 + c[5]))


FORMULAS: dict[int, tuple[Callable[[np.ndarray, Coefficients], np.ndarray], int]] = {
    1: (_sellmeier, 1),
    2: (_sellmeier_2, 1),
    3: (_polynomial, 1),
    4: (_general, 9),
    5: (_cauchy, 1),
    6: (_gases, 1),
    7: (_herzberger, 6),
    8: (_retro, 4),
    9: (_exotic, 6),
}
"""Number of a formula -> the formula, of wavelengths x [um], and the least number of its coefficients."""


class Dispersion(Spectrum):
    """The refractive index n by a dispersion formula: a spectrum that is exact at every wavelength.

    formula       1 and 2: Sellmeier, 3: polynomial, 4: general, 5: Cauchy, 6: gases, 7: Herzberger, 8: retro, 9: exotic
    coefficients  C1, C2, ... as in the files of refractiveindex.info, for wavelengths in um; those left out are 0
    reach         the first and the last wavelength [nm] for which the formula was fitted

    Shapes   coefficients: up to 25 numbers; reach: two.
    Units    reach: nm; coefficients: of wavelengths in um.
    Error    rounding; that of the fit itself is in the source.
    Source   Polyanskiy 2024, doi:10.1038/s41597-023-02898-2, "Dispersion formulas".

    Example
    >>> silica = gn.Dispersion(1, [0, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794, 9.896161], [210, 6700])
    >>> print(silica.at([486.1, 587.6, 656.3]).round(5))
    [1.46313 1.45846 1.45637]
    >>> m = gn.Microfacet(gn.GGX(0.1), gn.Dielectric(silica)).at([450.0, 650.0])
    """

    formula: int
    coefficients: tuple[float, ...]
    reach: tuple[float, float]

    def __init__(self, formula: Any, coefficients: Any, reach: Any):
        call = f"Dispersion({shown(formula)}, {shown(coefficients)})"
        if isinstance(formula, bool) or not isinstance(formula, int | float | np.integer) or formula not in FORMULAS:
            raise ParameterError(f"{call}: expected the number of a formula, 1 to {max(FORMULAS)}")
        function, least = FORMULAS[int(formula)]
        try:
            given = [float(x) for x in ops.numbers(coefficients).reshape(-1)]
            low, high = (float(x) for x in ops.numbers(reach))
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(f"{call}: expected coefficients, and the two wavelengths [nm] it is for") from None
        if not 0 < len(given) <= 25 or not all(map(math.isfinite, given)):
            raise ParameterError(f"{call}: expected 1 to 25 finite coefficients")
        if not NANOMETRES <= low < high < math.inf:
            rule = f"expected {NANOMETRES:g} <= first < last, in nm"
            hint = "; in micrometres? multiply by 1000" if 0.0 < low < high < NANOMETRES else ""
            raise ParameterError(f"{call}: from {low:g} to {high:g} nm; {rule}{hint}")
        pairwise = least in (1, 9)  # C1, and then pairs
        given += [0.0] * max(least - len(given), pairwise and 1 - len(given) % 2)
        object.__setattr__(self, "formula", int(formula))
        object.__setattr__(self, "coefficients", tuple(given))
        nm = np.linspace(low, high, SAMPLES)
        with np.errstate(all="ignore"):
            n = function(nm / 1000.0, given)
        real = np.isfinite(n)
        if real.sum() < 2:
            raise ParameterError(f"{call}: has no real value from {low:g} to {high:g} nm; expected one")
        object.__setattr__(self, "reach", (low, high))
        super().__init__(nm[real], n[real])

    def at(self, wavelengths: Any) -> Any:
        """The index at wavelengths [nm], of their shape.

        Raises ParameterError outside the formula's reach, and where it has no real value, as at a resonance.

        Example
        >>> silica = gn.Dispersion(1, [0, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794, 9.896161], [210, 6700])
        >>> print(silica.at([486.1, 587.6, 656.3]).round(4))
        [1.4631 1.4585 1.4564]
        """
        nm = np.asarray(ops.numbers(wavelengths), dtype=float)
        require_within(nm, *self.reach)
        with np.errstate(all="ignore"):
            n = FORMULAS[self.formula][0](nm / 1000.0, self.coefficients)
        if not np.isfinite(n).all():
            bad = nm[~np.isfinite(n)].flat[0]
            raise ParameterError(f"{self!r:.60}: has no real value at {bad:g} nm; take wavelengths at which it has one")
        return n[()]

    def bands(self, wavelengths: Any) -> np.ndarray:
        """The means over bands about wavelengths [nm], (C,), in which the formula has a real value throughout.

        Example
        >>> silica = gn.Dispersion(1, [0, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794, 9.896161], [210, 6700])
        >>> print(silica.bands([486.1, 587.6, 656.3]).round(3))
        [1.463 1.459 1.456]
        """
        nm = np.linspace(*self.reach, SAMPLES)
        ends = edges(np.atleast_1d(as_wavelengths(f"bands({shown(wavelengths)})", wavelengths)))
        self.at(nm[(nm >= ends.min()) & (nm <= ends.max())])
        return super().bands(wavelengths)

    def _key(self) -> tuple[Any, ...]:
        return self.formula, self.coefficients, self.reach

    def __repr__(self) -> str:
        return f"Dispersion({self.formula}, {list(self.coefficients)}, {list(self.reach)})"

    def to_json(self) -> dict[str, Any]:
        """The formula as JSON data.

        Example
        >>> print(gn.Dispersion(5, [1.5, 0.004, -2.0], [400, 700]).to_json()["coefficients"])
        [1.5, 0.004, -2.0]
        """
        return {
            "type": "Dispersion",
            "formula": self.formula,
            "coefficients": list(self.coefficients),
            "reach": list(self.reach),
        }
