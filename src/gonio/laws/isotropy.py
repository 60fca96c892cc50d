"""Isotropy: turning the surface about its normal changes nothing, unless the class says that x and y differ.

Measured   largest change of f when both directions turn about the normal, by four angles
Holds if   <= 1e-4
Tolerance  as for reciprocity; a class that is `oriented` may change, which is noted
"""

from __future__ import annotations

import math

import numpy as np

from ..base.reflectance import Reflectance
from ..formula import tree
from ._probes import degrees, difference, everywhere, largest, pairs, some, values
from ._verdict import Findings, at_most

ORDER = 13
TOLERANCE = 1e-4  # as for reciprocity
TURNS = np.radians([23.0, 63.0, 90.0, 143.0])
COUNT = 1 << 14  # pairs that are turned


def turned(w: np.ndarray, turn: float) -> np.ndarray:
    """Directions turned about the normal, from x towards y."""
    c, s = math.cos(turn), math.sin(turn)
    return w @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def law(m: Reflectance) -> Findings:
    """The largest change of f by any of TURNS, relative; notes where angles can be saved, and where they cannot."""
    wi, wo = everywhere(m, *pairs(some(m, COUNT)))
    f = values(m, wi, wo)
    changes = np.stack([difference(f, values(m, turned(wi, t), turned(wo, t))).max(axis=-1) for t in TURNS])
    value, (k, at) = largest(changes)
    turn, flip = math.degrees(TURNS[k]), np.array([1.0, -1.0, 1.0])
    flipped = float(difference(f, values(m, wi * flip, wo * flip)).max())
    isotropic, bilateral = value <= TOLERANCE, flipped <= TOLERANCE
    if isotropic and bilateral:
        yield "three angles are enough: f depends on theta_i, theta_o and |phi_i - phi_o|"
    elif isotropic:
        yield (
            f"isotropic, but handed: phi -> -phi changes f by up to {flipped:.2g} of its mean; f depends on theta_i, "
            "theta_o and phi_o - phi_i with its sign"
        )
    if not isotropic and any(tree.is_oriented(lobe) for _, lobe in m.lobes()):
        changes_too = "phi -> -phi changes nothing" if bilateral else "so does phi -> -phi"
        yield f"anisotropic: turning by {turn:.0f} degrees changes f by {value:.2g} of its mean, {changes_too}"
        return
    why = f"turning both directions by {turn:.0f} degrees changes f; `class ...(..., oriented=True)` declares it"
    rule = "|f - f turned|/mean = {value} <= {tolerance}"
    yield at_most("isotropy", value, TOLERANCE, rule, degrees(wi[at], wo[at]), why)
