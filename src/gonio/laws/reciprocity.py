"""Reciprocity: light takes the same way back, f(wi, wo) = f(wo, wi). By Helmholtz.

Between media of different indices it is f/n_o^2 that stays the same: radiance grows as n^2 where light enters.

Measured   largest |f(wi, wo) - f(wo, wi)| over the mean of both, at the same pairs; of materials that polarize also
           all elements of M(wo, wi) - D M(wi, wo)^T D, D = diag(1, 1, -1, 1), over that mean, at 16384 of them
Holds if   <= 1e-4
Tolerance  formulas stay below 1e-9, interpolated tables below 1e-5
"""

from __future__ import annotations

import numpy as np

from ..base.reflectance import Reflectance
from ._probes import PAIRS, degrees, difference, everywhere, index, largest, pairs, some, values
from ._verdict import Findings, at_most

ORDER = 12
EVERY = PAIRS >> 14
_D = np.array([1.0, 1.0, -1.0, 1.0])
TOLERANCE = 1e-4  # formulas in double precision stay below 1e-9, tables that are read by interpolation below 1e-5


def _of_matrices(m: Reflectance, wi: np.ndarray, wo: np.ndarray, mean: np.ndarray) -> tuple[float, int]:
    """The largest difference of an element of the Mueller matrix for exchanged directions, over the mean f."""
    there, back = m.mueller(wi, wo), np.swapaxes(m.mueller(wo, wi), -1, -2) * np.outer(_D, _D)
    there, back = (M.reshape(len(wi), -1, 4, 4) for M in (there, back))
    n = index(m)
    there, back = there / n(wo)[..., None, None] ** 2, back / n(wi)[..., None, None] ** 2
    error = np.abs(there - back).max(axis=(-1, -2))
    scale = np.abs(mean) + 1e-6 * np.nanmedian(np.abs(mean)) + 1e-30
    value, (at, _) = largest(np.nan_to_num(error / scale))
    return value, at


def law(m: Reflectance) -> Findings:
    """The largest difference on exchanging the directions, relative to the mean of both values."""
    wi, wo = everywhere(m, *pairs(some(m, PAIRS)))
    n = index(m)
    there, back = values(m, wi, wo) / n(wo) ** 2, values(m, wo, wi) / n(wi) ** 2
    error = difference(there, back)
    value, (at, c) = largest(error)
    median = np.median(error[error > 0.0]) if value > 0.0 else 0.0
    why = (
        f"f(wi, wo) = {there[at, c]:.4g} but f(wo, wi) = {back[at, c]:.4g} sr-1; "
        f"of the pairs that differ, half do by more than {median:.2g}"
    )
    rule = "|f - f swapped|/mean = {value} <= {tolerance}"
    if m.polarizes:
        # copies: `realizability` asks for arrays without gaps too, and the kernel of a matrix takes long to compile
        some_wi, some_wo = (np.ascontiguousarray(w[::EVERY]) for w in (wi, wo))
        polarized, where = _of_matrices(m, some_wi, some_wo, 0.5 * (there + back)[::EVERY])
        if polarized > max(value, TOLERANCE):
            value, at = polarized, where * EVERY
            why = "M(wo, wi) is not D M(wi, wo)^T D: polarized light does not take the same way back"
    yield at_most("reciprocity", value, TOLERANCE, rule, degrees(wi[at], wo[at]), why)
