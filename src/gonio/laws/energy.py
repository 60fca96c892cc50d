"""Energy: no more light leaves than arrives. The albedo is at most 1 at every incidence.

The rest is absorbed: A = 1 - R. Reflectances serve one hemisphere; a material that transmits will have R + T in the
place of R.

Measured   albedo at 11 angles of incidence, by quadrature
Holds if   <= 1.001
Tolerance  the quadrature is asked for 5e-4
"""

from __future__ import annotations

import numpy as np

from ..arrays.kinds import with_channels
from ..base.reflectance import Reflectance
from ..integrals.over_directions import integrate
from ._probes import degrees, in_channel, incidence, largest
from ._verdict import Findings, at_most

ORDER = 21
TOLERANCE = 1.0 + 1e-3  # the quadrature is asked for 5e-4


def albedos(m: Reflectance) -> tuple[np.ndarray, np.ndarray]:
    """Directions (K, 3) of incidence and the albedos there (K, C)."""
    w = incidence(m)
    return w, with_channels(integrate(m, w, tolerance=5e-4), 1)


def law(m: Reflectance) -> Findings:
    """The largest albedo, by quadrature in the coordinates of each lobe's sampling."""
    w, a = albedos(m)
    value, (at, c) = largest(np.where(np.isnan(a), np.inf, a))
    why = f"{value:.4g} of the light that arrives there leaves again{in_channel(m, c, a.shape[-1])}"
    yield at_most("energy", value, TOLERANCE, "max albedo = {value} <= {tolerance}", degrees(w[at]), why, placed=True)
