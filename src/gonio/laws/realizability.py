"""Realizability: no light leaves more polarized than it can be: a Mueller matrix is a sum of what amplitudes do.

Measured   how far the smallest eigenvalue of `gn.polarization.coherency` is below 0, over the largest, and how far the
           degree of polarization of light that leaves is above 1, for unpolarized, linear and circular light, at 16384
           pairs and where formulas break: wi = wo, mirror pairs, along the normal; of materials that polarize
Holds if   <= 1e-6
Tolerance  formulas stay below 1e-12, beside the critical angle 1e-8; the published digits of tables are fewer
"""

from __future__ import annotations

import numpy as np

from ..base.reflectance import Reflectance
from ..polarization import coherency, dop
from ._probes import PAIRS, degrees, exact_pairs, in_channel, largest, pairs, some
from ._verdict import Findings, at_most

ORDER = 25
TOLERANCE = 1e-6  # formulas stay below 1e-12, beside the critical angle 1e-8; tables are published with fewer digits

EVERY = PAIRS >> 14
_STATES = np.array([[1, 1, 1, 1, 1, 1, 1], [0, 1, -1, 0, 0, 0, 0], [0, 0, 0, 1, -1, 0, 0], [0, 0, 0, 0, 0, 1, -1]])
"""Stokes vectors, as columns: unpolarized, horizontal, vertical, along both diagonals, circular both ways."""


def law(m: Reflectance) -> Findings:
    """The worst of all pairs; a material that does not polarize is left out."""
    if not m.polarizes:
        return
    usual, hard = [w[::EVERY] for w in pairs(some(m, PAIRS))], exact_pairs()
    wi, wo = (np.concatenate(w) for w in zip(usual, hard, strict=True))
    M = m.mueller(wi, wo)
    M = M if M.ndim == 4 else M[:, None]
    unknown = ~np.isfinite(M).all(axis=(-1, -2)) | ~(M[..., 0, 0] > 1e-30 * np.nanmax(M[..., 0, 0]))
    M = np.where(unknown[..., None, None], np.diag([1.0, 0.0, 0.0, 0.0]), M)
    eigenvalues = coherency(M)
    below = np.maximum(-eigenvalues[..., 0], 0.0) / eigenvalues[..., -1]
    out = np.swapaxes(M @ _STATES, -1, -2)
    faint = out[..., 0] < 1e-3 * M[..., None, 0, 0]  # of what all but goes out, the degree is rounding
    above = np.where(faint, 0.0, dop(np.where(faint[..., None], 1.0, out)) - 1.0).max(-1)
    value, (at, c) = largest(np.maximum(below, above))
    lowest, degree = eigenvalues[at, c, 0] / eigenvalues[at, c, -1], 1.0 + above[at, c]
    why = f"the smallest eigenvalue is {lowest:.3g} of the largest, light leaves with a degree of polarization up to "
    why += f"{degree:.4g}{in_channel(m, c, M.shape[1])}; {(below > TOLERANCE).mean():.2g} of the matrices cannot be"
    rule = "largest excess of eigenvalues below 0 and of polarization above 1 = {value} <= {tolerance}"
    yield at_most("realizability", value, TOLERANCE, rule, degrees(wi[at], wo[at]), why)
