"""The generalized Harvey-Shack theory: scatter by surfaces from smooth to rough, at all angles."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param, part, wavelengths
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.conductor import Conductor
from ..formula.fresnel_term import Fresnel
from ._smooth_scatter import SmoothScatter, deviation2, mean_reflectance
from .abc import ABC
from .he_torrance import _series


class GeneralizedHarveyShack(SmoothScatter):
    """Scatter by a surface of any roughness: f = (Q/lambda^2) times the Fourier transform of H - exp(-g) at |D|/lambda.

    H(r) = exp(-g (1 - exp(-(r/tau)^2))) is the surface's transfer function for a Gaussian autocovariance of heights,
    g = ((2 pi sigma_rel/lambda) (cos(theta_i) + cos(theta_o)))^2. Summed over its orders,
    f = Q (pi tau^2/lambda^2) sum over m >= 1 of g^m exp(-g)/(m! m) exp(-(pi tau |D|/lambda)^2/m),
    with Q = sqrt(F(theta_i) F(theta_o)), and sigma_rel^2 = sigma^2 (1 - exp(-(pi tau/lambda)^2)) of the surface's
    wavelengths above lambda. exp(-g) of the light stays in the mirror: `unscattered`.

    Looks    `GeneralizedHarveyShack(20, 1500)` is a mirror's haze; `GeneralizedHarveyShack(280, 1770)` is roughened
             metal with a wide highlight, and no mirror left.
    Shapes   sigma, tau and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; sigma, tau, wavelength: nm. `m.at(wavelengths)` binds the wavelengths.
    Error    the sum: 1e-6 for g < 14, at most 1.3e-3 beyond (see `HeTorrance`). For g -> 0 it is Rayleigh-Rice with
             the factor (cos(theta_i) + cos(theta_o))^2/4 in place of cos(theta_i) cos(theta_o); for g -> infinity that
             of facets, `Microfacet(Beckmann(2 sigma/tau), F)`, next to the normal. Light that is
             diffracted beyond the horizon is lost: the theory's constant K, which gives it back to the other
             directions, depends on the angle of incidence, would break reciprocity, and is left out. Neither is there
             shadowing.
    Source   after Krywonos, Harvey & Choi 2011, "Linear systems formulation of scattering theory for rough surfaces
             with arbitrary incident and scattering angles", J. Opt. Soc. Am. A 28(6):1121. The sum for a Gaussian
             autocovariance, and Q, are derived here; a K-correlation would need a numerical transform.

    Example
    >>> metal = gn.GeneralizedHarveyShack(sigma=100.0, tau=1500.0, wavelength=550.0, fresnel=1.0)
    >>> print(metal.f_angles(0.5, 0.0, [0.3, 0.5, 0.7], np.pi).round(3))
    [2.843 7.524 3.452]
    """

    sigma = param(100.0, 0.0, 1e4, "RMS height of the surface", unit="nm", sampled="max")
    tau = param(1500.0, 300.0, 1e5, "autocorrelation length of the surface (1/e)", unit="nm", sampled="min")
    fresnel = part(Fresnel, Conductor(), "reflectance of a smooth surface", coerce=as_fresnel)
    wavelength = wavelengths(550.0)

    def _g(self, wi: Direction, wo: Direction) -> Any:
        ratio = math.pi * self.tau / self.wavelength
        seen = 1.0 - ops.exp(-ratio * ratio)
        phase = 2.0 * math.pi * self.sigma * (wi.z + wo.z) / self.wavelength
        return phase * phase * seen

    def unscattered(self, cos_theta: Any = 1.0) -> Any:
        """Reflectance F exp(-g) [1] of the mirror that remains, at a cosine.

        Example
        >>> print(round(float(gn.GeneralizedHarveyShack(sigma=50.0, fresnel=1.0).unscattered()), 4))
        0.2712
        """
        at = Direction(0.0, 0.0, cos_theta)
        return self.fresnel.F(cos_theta) * ops.exp(-self._g(at, at))

    def formula(self, wi: Direction, wo: Direction) -> Any:
        scale = math.pi * self.tau / self.wavelength
        factor = mean_reflectance(self.fresnel, wi, wo) * scale * scale * (1.0 / math.pi)
        return _series(self._g(wi, wo), scale * scale * deviation2(wi, wo), factor)

    # Sampled as a heavy-tailed lobe of |D|, as wide as diffraction and slopes make it.

    def _lobe(self, wo: Direction) -> ABC:
        diffraction, slope = self.wavelength / (math.pi * self.tau), 2.0 * self.sigma / self.tau
        spread = 2.0 * slope * (wo.z + slope)
        return tree.unchecked(ABC, B=1.0 / ops.minimum(diffraction * diffraction + spread * spread, 4.0), C=2.0)

    def estimate(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z) * (1.0 - ops.exp(-self._g(wo, wo)))
