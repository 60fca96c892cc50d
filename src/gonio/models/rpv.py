"""Rahman, Pinty and Verstraete's model of land surfaces."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..formula.direction import Direction, dot, length
from ..formula.fields import param
from ._power_cosine import PowerCosine


class RPV(PowerCosine):
    """Semi-empirical land surface: BRF = rho_0 M F H, and f = BRF/pi.

    M = (cos(theta_i) cos(theta_o) (cos(theta_i) + cos(theta_o)))^(k - 1): bowl (k < 1) or bell (k > 1);
    F = (1 - Theta^2)/(1 + 2 Theta cos(g) + Theta^2)^(3/2), g the phase angle (0 is back-scatter): Theta < 0 scatters
    back, Theta > 0 forward; H = 1 + (1 - rho_c)/(1 + G), G = |tan(theta_i) - tan(theta_o)| as vectors of the plane:
    the hot spot, nothing for rho_c = 1. In the paper of 1993 rho_c = rho_0, as here unless it is given.

    Looks    `RPV(0.1, 0.7, -0.1)` is grassland, bright towards the rim and back to the light; `RPV(0.1, 1.2, 0.2)`
             darkens towards the rim and scatters forward.
    Shapes   rho_0, k, Theta, rho_c: numbers or (..., C).
    Units    f: 1/sr; the others: 1. rho_0 is no albedo: the BRF at the zenith is 2^(k - 1) rho_0 (2 - rho_c)
             (1 - Theta)/(1 + Theta)^2.
    Error    rounding.
    Source   Rahman, Pinty & Verstraete 1993, J. Geophys. Res. 98(D11):20791, in the angles' convention above; rho_c as
             a parameter of its own: Engelsen, Pinty, Verstraete & Martonchik 1996, EUR 16426. Equations as in two
             independent descriptions.

    Example
    >>> grass = gn.RPV(rho_0=0.1, k=0.7, Theta=-0.1)
    >>> print((np.pi * grass.f_angles(0.7, 0.0, 0.7, [0.0, np.pi])).round(4))
    [0.2668 0.1417]
    """

    rho_0 = param(0.1, 0.0, 1.0, "scale of the reflectance")
    k = param(0.7, 0.0, 2.0, "exponent: below 1 brighter towards grazing, above 1 darker", sampled="min")
    Theta = param(-0.1, -0.9, 0.9, "asymmetry of the phase function: back-scatter below 0, forward above")
    rho_c = param("rho_0", 0.0, 1.0, "hot spot: its height is 1 - rho_c")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "nothing normalizes it: for k < 1 the albedo grows as cos(theta_i)^(k - 1), and reaches 5.9 at 85 "
        "degrees for rho_0 = rho_c = 1, k = 0.5, Theta = 0",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        M = ops.power(wi.z * wo.z * (wi.z + wo.z), self.k - 1.0)
        return self.rho_0 * (1.0 / math.pi) * M * self._phase(wi, wo) * self._hot_spot(wi, wo)

    def _phase(self, wi: Direction, wo: Direction) -> Any:
        # 1 + 2 Theta cos(g) + Theta^2 by |wi + wo|^2 = 2 + 2 cos(g) or |wi - wo|^2 = 2 - 2 cos(g): no cancellation.
        back, t = self.Theta < 0.0, ops.absolute(self.Theta)
        total, apart = wi + wo, wi - wo
        q = (1.0 - t) * (1.0 - t) + t * ops.where(back, dot(apart, apart), dot(total, total))
        return (1.0 - t) * (1.0 + t) / (q * ops.sqrt(q))

    def _hot_spot(self, wi: Direction, wo: Direction) -> Any:
        apart = Direction(wi.x / wi.z - wo.x / wo.z, wi.y / wi.z - wo.y / wo.z, 0.0)
        return 1.0 + (1.0 - self.rho_c) / (1.0 + length(apart))

    def exponent(self, wo: Direction) -> Any:
        return self.k

    def estimate(self, wo: Direction) -> Any:
        return self.rho_0 + 0.0 * wo.z
