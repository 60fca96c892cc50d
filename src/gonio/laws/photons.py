"""Photons: fluorescence sends out no more photons than arrive. Of light of any wavelength at most one leaves for each.

Energy by wavelength is no law of fluorescence: more green light may leave than arrives. Photons are counted, from all
wavelengths that leave, for light of each that arrives; those of longer waves have less energy, and the rest is heat. A
note says how much of the light leaves at shorter waves than it had (against Stokes' rule).

Measured   photons that leave over those that arrive, at 11 angles of incidence, by quadrature; the lowest re-radiation
           at 256 pairs of directions
Holds if   <= 1.001, and no re-radiation is negative
Tolerance  the quadrature is asked for 5e-4
"""

from __future__ import annotations

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sides import is_lit
from ..integrals.over_hemisphere import integrate
from ..integrals.photons import counted
from ._probes import channel, degrees, in_channel, incidence, largest, pairs, some
from ._verdict import Findings, Law, at_most

ORDER = 24
TOLERANCE = 1.0 + 1e-3  # the quadrature is asked for 5e-4
PAIRS = 256


def law(m: Reflectance) -> Findings:
    """The most photons for one that arrives."""
    if not m.fluoresces:
        return
    if m.wavelengths is None:
        yield "photons are not counted: the wavelengths of the channels are not known (m.with_channels)"
        return
    if is_lit(m, -1.0):
        yield "photons are not counted: the material transmits light"
        return
    every = pairs()
    wi, wo = (w[:: len(w) // some(m, PAIRS, m.channels or 1)] for w in every)
    F = m.reradiation(wi, wo)
    lowest, (at, o, i) = largest(np.where(np.isnan(F), -np.inf, -F))
    lowest = -lowest
    if lowest < 0.0:
        why = f"light of {channel(m, i)} takes light of {channel(m, o)} away"
        yield Law("photons", False, lowest, 0.0, "min re-radiation = {value}", degrees(wi[at], wo[at]), why)
        return
    w = incidence(m)
    sent = integrate(counted(m), w, tolerance=5e-4).value
    value, (at, c) = largest(np.where(np.isnan(sent), np.inf, sent))
    why = f"{value:.4g} photons leave for each that arrives there{in_channel(m, c, sent.shape[-1])}"
    yield at_most("photons", value, TOLERANCE, "max photons = {value} <= {tolerance}", degrees(w[at]), why, placed=True)
    nm = m.wavelengths
    photons = np.nansum(F, 0) * nm[:, None] / nm
    against, off = photons[nm[:, None] < nm].sum(), photons[nm[:, None] != nm].sum()
    if against > 1e-6 * off:
        yield f"{against / off:.2%} of the photons that change their wavelength leave with a shorter one (anti-Stokes)"
