"""Quantities that tables hold in place of the BRDF: each is f times a factor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..declared.numbers import NANOMETRES
from ..errors import MeaningWarning, ParameterError, warn
from ..formula.direction import HORIZON

QUANTITIES: dict[str, Callable[[Any, Any], Any]] = {
    "brdf": lambda cos_i, cos_o: 1.0,
    "brdf * cos(theta_o)": lambda cos_i, cos_o: cos_o,
    "brdf * cos(theta_i)": lambda cos_i, cos_o: cos_i,
    "reflectance factor": lambda cos_i, cos_o: math.pi,
}
"""Name -> the factor of the BRDF, from the cosines of wi and wo.

brdf * cos(theta_o) is the scattered density DSF; the reflectance factor is relative to a white Lambertian surface."""


def quantity_named(name: str) -> str:
    """The name itself. Raises ParameterError for one that is not in `QUANTITIES`."""
    if name not in QUANTITIES:
        raise ParameterError(f"quantity={name!r}: expected one of {', '.join(map(repr, QUANTITIES))}")
    return name


def to_brdf(quantity: str, values: Any, cos_i: Any, cos_o: Any) -> np.ndarray:
    """f [1/sr] from values of a quantity at pairs with these cosines; NaN where it cannot tell f (a cosine of 0)."""
    factor = np.asarray(QUANTITIES[quantity_named(quantity)](cos_i, cos_o), dtype=float)
    return np.asarray(values, dtype=float) / np.where(factor > HORIZON, factor, np.nan)


def from_brdf(quantity: str, f: Any, cos_i: Any, cos_o: Any) -> np.ndarray:
    """Values of a quantity from f [1/sr] at pairs with these cosines."""
    values: np.ndarray = np.asarray(f, dtype=float) * QUANTITIES[quantity_named(quantity)](cos_i, cos_o)
    return values


APART = 100.0
"""How far the next number is from one that may stand for a missing value."""

REPEATS = 3
"""In how many places it stands, at least."""


def mark_of_missing(values: np.ndarray, places: Callable[[], np.ndarray]) -> float | None:
    """A number that repeats exactly and stands decades apart from all others, as programs write for a missing value.

    values   of any shape; places: called for the place (..., k) of each, where there is such a number: what stands in
             one place counts once, as a peak along the normal that has every azimuth
    """
    finite = np.isfinite(values)
    for extreme, others in ((np.max, np.less), (np.min, np.greater)):
        lowest_or_highest = -np.inf if extreme is np.max else np.inf
        mark = float(extreme(values, where=finite, initial=lowest_or_highest))
        is_mark = values == mark
        if np.count_nonzero(is_mark) < REPEATS:
            continue
        following = float(extreme(values, where=others(values, mark) & finite, initial=lowest_or_highest))
        if extreme is np.max:
            is_apart = mark > APART * following > 0.0
        else:  # a negative number, as large as what was measured, where others are hardly negative
            measured = values[finite & (values > 0.0)]
            is_apart = mark < 0.0 < measured.size and following > mark / APART and -mark >= np.median(measured)
        if is_apart:
            where, at = places(), np.argwhere(is_mark)
            distinct = np.unique(where[tuple(at[:, : where.ndim - 1].T)].round(9) + 0.0, axis=0)
            if len(distinct) >= REPEATS:
                return mark
    return None


def suspect_units(quantity: str, values: np.ndarray, channels: Sequence[str | float] | None) -> None:
    """Warns of reflectance factors that look like percent, and of wavelengths that look like micrometres."""
    held = values[np.isfinite(values)]
    if quantity == "reflectance factor" and held.size and np.median(held) > 2.0 and held.max() <= 120.0:
        text = f"values: reflectance factors of {np.median(held):.3g} (median); in percent? divide by 100"
        warn(text, MeaningWarning)
    wavelengths = [x for x in channels or () if not isinstance(x, str)]
    if wavelengths and min(wavelengths) > 0.0 and max(wavelengths) < NANOMETRES:
        text = f"channels: wavelengths up to {max(wavelengths):g} nm"
        warn(f"{text}; in micrometres? multiply by 1000", MeaningWarning)
