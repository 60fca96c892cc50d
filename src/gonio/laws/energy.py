"""Energy: no more light leaves than arrives. The albedo is at most 1 at every incidence.

What is not reflected is absorbed: A = 1 - R. Reflectances serve one hemisphere; a material that transmits will have
R + T in the place of R.

Measured   albedo at 11 angles of incidence, by quadrature
Holds if   <= 1.001
Tolerance  the quadrature is asked for 5e-4
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..integrals.over_directions import integrate
from ._probes import INCIDENCE, azimuths, degrees, in_channel
from ._verdict import Law

ORDER = 21
TOLERANCE = 1.0 + 1e-3  # the quadrature is asked for 5e-4


def albedos(m: Reflectance, incident: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Directions (K, 3) at INCIDENCE and the integrals of f cos over the others (K, C); over wi if not `incident`."""
    w = direction(INCIDENCE[:, None], azimuths(m)[None, :]).reshape(-1, 3)
    a = integrate(m, w, tolerance=5e-4, incident=incident)
    return w, a if a.ndim == 2 else a[:, None]


def law(m: Reflectance) -> Iterator[Law | str]:
    """The largest albedo, by quadrature in the coordinates of each lobe's sampling."""
    w, a = albedos(m)
    a = np.where(np.isnan(a), np.inf, a)
    at, c = np.unravel_index(int(a.argmax()), a.shape)
    value = float(a[at, c])
    passed = value <= TOLERANCE
    where = in_channel(m, int(c), a.shape[-1])
    why = "" if passed else f"{value:.4g} of the light that arrives there leaves again{where}"
    yield Law("energy", passed, value, TOLERANCE, "max albedo = {value} <= {tolerance}", degrees(w[at]), why)
