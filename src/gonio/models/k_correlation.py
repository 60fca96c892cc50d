"""Rayleigh-Rice scatter by a smooth mirror whose roughness has the K-correlation (ABC) spectrum."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Self

from ..arrays import ops
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param, part, wavelengths
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.conductor import Conductor
from ..formula.fresnel_term import Fresnel
from ._smooth_scatter import SmoothScatter, deviation2, mean_reflectance, ring_integral
from .abc import ABC
from .harvey_shack import HarveyShack


class KCorrelation(SmoothScatter):
    """A mirror's scatter by its roughness: f = (16 pi^2/lambda^4) cos(theta_i) cos(theta_o) Q S(|D|/lambda).

    S is the spectrum of the surface's heights, of two dimensions, at the spatial frequency |D|/lambda that diffracts
    light from wi to wo: S = A (1 + (B |D|/lambda)^2)^(-C/2), with A such that sigma^2 is the integral of S over all
    frequencies up to 1/shortest. D = (wi + wo) projected on the surface, Q = sqrt(F(theta_i) F(theta_o)). The mirror
    itself is an `IdealSpecular` beside it, which has the light that this does not scatter.

    Looks    `KCorrelation(100, 2e3, 2.5)` is a metal's wide haze; `KCorrelation(2, 1e4, 1.5)` is a polished mirror:
             hardly any.
    Shapes   sigma, B, C, shortest and the Fresnel term's parameters: numbers or (..., C).
    Units    f: 1/sr; sigma, B, shortest, wavelength: nm; C: 1. `m.at(wavelengths)` binds the wavelengths.
    Error    rounding: 1e-5 relative in float32. The theory's own: of first order in (4 pi sigma/lambda)^2, which
             should be below 0.05. Q is exact at the mirror direction for any polarization, and in the plane of
             incidence for light polarized across it; elsewhere it is an approximation whose error was not measured.
    Source   Stover 1995, Optical Scattering: Measurement and Analysis, SPIE Press (Rayleigh-Rice and Q); the spectrum:
             Dittman 2006, "K-correlation power spectral density and surface scatter model", Proc. SPIE 6291. The
             normalization is derived here: A = sigma^2 B^2 (C - 2)/(2 pi) for C > 2 and shortest -> 0.

    Example
    >>> mirror = gn.KCorrelation(sigma=2.0, B=1e4, C=1.5, fresnel=1.0)
    >>> print(mirror.f_angles(0.0, 0.0, [0.01, 0.1, 0.5], np.pi).round(4))
    [0.0018 0.0006 0.0001]
    """

    sigma = param(2.0, 0.0, 200.0, "RMS height of the surface, of its wavelengths above `shortest`", unit="nm")
    B = param(1e4, 100.0, 1e6, "2 pi times the correlation length: the wavelength of the knee", "nm", sampled="min")
    C = param(2.5, 0.01, 8.0, "slope of the spectrum at high frequencies, downwards", sampled="min")
    shortest = param(10.0, 0.1, 1e4, "the shortest wavelength on the surface that sigma counts", unit="nm")
    fresnel = part(Fresnel, Conductor(), "reflectance of a smooth surface", coerce=as_fresnel)
    wavelength = wavelengths(550.0)

    breaks: ClassVar[dict[str, str]] = {
        "energy": "first-order perturbation theory: the scatter grows as sigma^2, and is not bounded by 1 for sigma "
        "above lambda/13",
    }

    def psd(self, frequency: Any) -> Any:
        """S [nm^4] at a spatial frequency [1/nm]: 2 pi times the integral of S f df is sigma^2.

        Example
        >>> print(round(float(gn.KCorrelation(2.0, 1e4, 2.5).psd(1e-4)) / 1e6, 4))
        13.8203
        """
        x = self.B * frequency
        return self._peak() * ops.power(1.0 + x * x, -0.5 * self.C)

    def _peak(self) -> Any:
        """A [nm^4]."""
        whole = ring_integral(self.B * self.B, 0.5 * self.C, 1.0 / self.shortest)
        return self.sigma * self.sigma * self.B * self.B / (math.pi * whole)

    def roughness(self, shortest: Any) -> Any:
        """RMS height [nm] of the surface's wavelengths above another limit [nm], such as the wavelength of light.

        Example
        >>> print(round(float(gn.KCorrelation(2.0, 1e4, 2.5).roughness(550.0)), 4))
        1.7784
        """
        B2, half = self.B * self.B, 0.5 * self.C
        part = ring_integral(B2, half, 1.0 / shortest) / ring_integral(B2, half, 1.0 / self.shortest)
        return self.sigma * ops.sqrt(part)

    def tis(self, cos_theta: Any = 1.0) -> Any:
        """Total integrated scatter [1] by the relation F (4 pi sigma cos(theta)/lambda)^2, at a cosine.

        That is the albedo of a smooth surface whose correlation length is many wavelengths and whose lobe thus is
        narrow. Of others `gn.albedo` is lower, as the high frequencies in sigma scatter to no direction.

        Example
        >>> print(round(float(gn.KCorrelation(2.0, 1e5, 4.0, fresnel=1.0).tis()), 6))
        0.002088
        """
        phase = 4.0 * math.pi * self.sigma * cos_theta / self.wavelength
        return self.fresnel.F(cos_theta) * phase * phase

    def formula(self, wi: Direction, wo: Direction) -> Any:
        k = 4.0 * math.pi / (self.wavelength * self.wavelength)
        frequency = ops.sqrt(deviation2(wi, wo) + 1e-30) / self.wavelength
        return k * k * wi.z * wo.z * mean_reflectance(self.fresnel, wi, wo) * self.psd(frequency)

    def _lobe(self, wo: Direction) -> ABC:
        ratio = self.B / self.wavelength
        return tree.unchecked(ABC, B=ratio * ratio, C=0.5 * self.C)

    def estimate(self, wo: Direction) -> Any:
        phase = 4.0 * math.pi * self.roughness(self.wavelength) * wo.z / self.wavelength
        return self.fresnel.F(wo.z) * phase * phase

    @classmethod
    def from_harvey_shack(cls, m: HarveyShack, wavelength: float, fresnel: Any = 1.0, shortest: float = 10.0) -> Self:
        """The mirror that has, next to the normal, the lobe of a `HarveyShack` measured at this wavelength [nm].

        B = lambda/L, C = -s, and sigma from b0. f is that of the lobe times cos(theta_i) cos(theta_o) and Q over its
        value at the normal.

        Example
        >>> lobe = gn.HarveyShack(b0=1.0, L=0.01, s=-1.5)
        >>> mirror = gn.KCorrelation.from_harvey_shack(lobe, wavelength=550.0)
        >>> print(round(float(mirror.sigma), 3), round(float(mirror.B)), mirror.f([0, 0, 1], [0, 0, 1]).round(4))
        13.271 55000 1.0
        """
        unit = cls(sigma=1.0, B=wavelength / m.L, C=-m.s, shortest=shortest, fresnel=fresnel, wavelength=wavelength)
        k = 4.0 * math.pi / (wavelength * wavelength)
        return unit.replace(sigma=ops.sqrt(m.b0 / (k * k * unit.fresnel.F(1.0) * unit._peak())))
