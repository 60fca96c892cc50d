"""Energy: no more light leaves than arrives. The albedo is at most 1 at every incidence.

The rest is absorbed: A = 1 - R. A material that transmits has R + T in the place of R, from both sides, and a note says
what becomes of the light.

Measured   albedo, and transmittance, at 11 angles of incidence to either side, by quadrature
Holds if   <= 1.001
Tolerance  the quadrature is asked for 5e-4
"""

from __future__ import annotations

import numpy as np

from ..arrays.kinds import with_channels
from ..base.reflectance import Reflectance
from ..integrals.over_hemisphere import integrate
from ._probes import degrees, in_channel, incidence, largest
from ._verdict import Findings, at_most

ORDER = 21
TOLERANCE = 1.0 + 1e-3  # the quadrature is asked for 5e-4


def albedos(m: Reflectance, sides: str = "front") -> tuple[np.ndarray, np.ndarray]:
    """Directions (K, 3) of incidence and the albedos there (K, C); "across": the transmittances."""
    w = incidence(m)
    return w, with_channels(integrate(m, w, tolerance=5e-4, sides=sides).value, 1)


def law(m: Reflectance) -> Findings:
    """The largest albedo, by quadrature in the coordinates of each lobe's sampling."""
    w, a = albedos(m)
    if (w[:, 2] < 0.0).any():
        T = albedos(m, "across")[1]
        yield from (_fate(w, a, T, behind) for behind in (False, True))
        a = a + T
    value, (at, c) = largest(np.where(np.isnan(a), np.inf, a))
    why = f"{value:.4g} of the light that arrives there leaves again{in_channel(m, c, a.shape[-1])}"
    yield at_most("energy", value, TOLERANCE, "max albedo = {value} <= {tolerance}", degrees(w[at]), why, placed=True)


def _fate(w: np.ndarray, R: np.ndarray, T: np.ndarray, behind: bool) -> str:
    """What becomes of the light of one side, at normal incidence and on the way to grazing, in words."""
    cosine = -w[:, 2] if behind else w[:, 2]
    shares = []
    for angle in (0.0, 60.0, 80.0):
        k = int(np.abs(cosine - np.cos(np.radians(angle))).argmin())
        r, t = (float(x[k].mean()) for x in (R, T))
        shares.append(f"{r:.3f} + {t:.3f} + {1.0 - r - t:.3f} at {angle:.0f} deg")
    return f"reflected + transmitted + absorbed, from {'behind' if behind else 'in front'}: {', '.join(shares)}"
