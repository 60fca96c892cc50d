"""Roujean's kernels, the first of the kernel-driven models."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..formula.direction import Direction, dot, length
from ..formula.fields import param
from ..formula.special import sin_minus_x_cos
from ._power_cosine import PowerCosine
from .ross_li import phase_angle, scattering_by_leaves


class Roujean(PowerCosine):
    """Kernel-driven surface of soil and plants: BRF = k0 + k1 f1 + k2 f2, and f = BRF/pi.

    f1 = ((pi - phi) cos(phi) + sin(phi)) t_i t_o/(2 pi) - (t_i + t_o + |t_i - t_o|)/pi, t = tan(theta) as a vector
    of the plane, phi in [0, pi] with 0 for back-scatter: diffuse blocks and their shadows.
    f2 = 4/(3 pi) ((pi/2 - xi) cos(xi) + sin(xi))/(cos(theta_i) + cos(theta_o)) - 1/3: scattering by leaves at phase
    angle xi; 4/(3 pi) times the kernel `ross_thick` of `RossLi`.

    Looks    `Roujean(0.2, 0, 0.3)` is a thick canopy, at the rim brighter than Lambertian; `Roujean(0.2, 0.04, 0)` is
             ploughed soil, brightest where no shadow is seen.
    Shapes   k0, k1, k2: numbers or (..., C).
    Units    f: 1/sr; k0, k1, k2: 1, k0 is the BRF with light and viewer at the zenith.
    Error    rounding. Sampling is uniform over the hemisphere, for f1 grows as tan(theta).
    Source   Roujean, Leroy & Deschamps 1992, J. Geophys. Res. 97(D18):20455. Equations as in two independent
             descriptions.

    Example
    >>> soil = gn.Roujean(k0=0.2, k1=0.04, k2=0.0)
    >>> print((np.pi * soil.f_angles(0.7, 0.0, 0.7, [0.0, np.pi])).round(4))
    [0.1927 0.1571]
    """

    k0 = param(0.2, 0.0, 2.0, "weight of the constant: the BRF at the zenith")
    k1 = param(0.02, -1.0, 1.0, "weight of the geometric kernel")
    k2 = param(0.3, -2.0, 2.0, "weight of the volumetric kernel")

    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a sum of signed kernels: with k0 = 0.1, k1 = 0.1 the BRF at 45 degrees in the forward direction "
        "is -0.03",
        "energy": "the weights are free and f1 has no bound towards grazing: k0 = 0.2, k1 = -1 reflects 1.5 times the "
        "light that arrives at 60 degrees, 4.4 times at 85",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return (self.k0 + self.k1 * roujean_geometric(wi, wo) + self.k2 * roujean_volumetric(wi, wo)) * (1.0 / math.pi)

    def exponent(self, wo: Direction) -> Any:
        return 0.0

    def estimate(self, wo: Direction) -> Any:
        spread = ops.absolute(self.k1) + ops.absolute(self.k2)
        white_sky = self.k0 - 1.29 * self.k1 + 0.08 * self.k2
        return ops.maximum(white_sky, 0.1 * (self.k0 + spread)) + 0.0 * wo.z


def roujean_geometric(wi: Direction, wo: Direction) -> Any:
    """f1 = ((pi - phi) cos(phi) + sin(phi)) t_i t_o/(2 pi) - (t_i + t_o + |t_i - t_o|)/pi: blocks and their shadows."""
    ti, to = Direction(wi.x / wi.z, wi.y / wi.z, 0.0), Direction(wo.x / wo.z, wo.y / wo.z, 0.0)
    along, across = dot(ti, to), ops.absolute(ti.x * to.y - ti.y * to.x)
    product2 = along * along + across * across
    upright = product2 < 1e-30
    # With delta = pi - phi the bracket is sin(delta) - delta cos(delta), which cancels towards forward scattering.
    delta = ops.arctan2(across, ops.where(upright, 1.0, -along))
    product = ops.where(upright, 0.0, ops.sqrt(ops.where(upright, 1.0, product2)))
    paths = length(ti) + length(to) + length(ti - to)
    return product * sin_minus_x_cos(delta) * (0.5 / math.pi) - paths * (1.0 / math.pi)


def roujean_volumetric(wi: Direction, wo: Direction) -> Any:
    """f2 = 4/(3 pi) ((pi/2 - xi) cos(xi) + sin(xi))/(cos(theta_i) + cos(theta_o)) - 1/3: leaves."""
    xi = phase_angle(wi, wo)
    return (4.0 / (3.0 * math.pi)) * scattering_by_leaves(xi) / (wi.z + wo.z) - 1.0 / 3.0
