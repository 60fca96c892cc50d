"""Wolff's diffuse reflection: light that enters through a smooth surface, is scattered below it, and leaves."""

from __future__ import annotations

import math
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.fresnel.dielectric import dielectric_transmittance


class Wolff(Reflectance):
    """Diffuse reflection below a smooth interface: f = rho/pi (1 - F(theta_i, eta)) (1 - F(theta_t, 1/eta)).

    F is the Fresnel reflectance, from outside for theta_i, from inside for theta_t with eta sin(theta_t) =
    sin(theta_o). By Stokes' relations the second factor is 1 - F(theta_o, eta), so f is reciprocal.

    Looks    `Wolff(0.5, 1.5)` is the matt part of a smooth plastic: as Lambertian, with a darker rim; `Wolff(0.5, 3)`
             is darker altogether.
    Shapes   rho, eta: numbers or (..., C).
    Units    f: 1/sr; rho, eta: 1.
    Error    rounding: 6e-7 relative in float32.
    Source   Wolff 1994, "Diffuse-reflectance model for smooth dielectric surfaces", J. Opt. Soc. Am. A 11(11).

    Example
    >>> print((np.pi * gn.Wolff(0.5, eta=1.5).f_angles(0.0, 0.0, [0.0, 1.4], 0.0)).round(3))
    [0.461 0.29 ]
    """

    rho = param(0.5, 0.0, 1.0, "diffuse albedo of the inside")
    eta = param(1.5, 1.0, 5.0, "refractive index behind the surface")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return (
            self.rho
            * (1.0 / math.pi)
            * dielectric_transmittance(wi.z, self.eta)
            * dielectric_transmittance(wo.z, self.eta)
        )

    def estimate(self, wo: Direction) -> Any:
        return self.rho * dielectric_transmittance(wo.z, self.eta)
