"""The fate of light: what is reflected, transmitted and absorbed."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from .albedo import kept_albedo
from .asked import Incidence, Tolerance
from .over_hemisphere import Integral
from .photons import reradiated_energy
from .scattered_once import tell_of_lost_light
from .transmittance import transmittance


class Fate(NamedTuple):
    """The result of `fate`: three fractions of the light that arrives, together 1.

    reflected     to the side that it came from
    transmitted   to the other side
    absorbed      neither; in thermal equilibrium this is the emissivity (Kirchhoff)

    Example
    >>> gn.fate(gn.ThinDielectric(1.5, depth=0.3), [0, 0, 1])
    Fate(reflected=0.0602, transmitted=0.6833, absorbed=0.2564)
    """

    reflected: Any
    transmitted: Any
    absorbed: Any

    def __repr__(self) -> str:
        shares = (f"{name}={np.array2string(np.asarray(x), precision=4)}" for name, x in self._asdict().items())
        return f"Fate({', '.join(shares)})"

    def _repr_html_(self) -> str | None:
        return repr_html(self)


@checked
def fate(m: Reflectance, wi: Incidence, tolerance: Tolerance = 1e-4) -> Fate:
    """What becomes of light from wi: the fractions reflected, transmitted and absorbed.

    Light that a model loses (facets that scatter twice) counts as absorbed, with a LeftOutWarning. Fractions are of
    energy, by the wavelength that arrives: what fluorescence sends out again, at any wavelength, is reflected.

    Shapes   wi: (..., 3), above or below the surface; each (...[, C]).
    Units    1.
    Error    `tolerance`, of reflected and transmitted; absorbed is what they leave.
    Source   Nicodemus et al. 1977, NBS Monograph 160; Kirchhoff 1860.

    Example
    >>> leaf = gn.Lambertian(0.1) + gn.DiffuseTransmission(0.2)
    >>> print(*(x.round(3) for x in gn.fate(leaf, [0, 0, 1])))
    0.1 0.2 0.7
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> print(gn.fate(ink, [0, 0, 1]).absorbed.round(3))  # gn.photon_albedo counts photons
    [0.5 0.4]
    """
    R, T = leaving(m, wi, tolerance)
    tell_of_lost_light("fate", m, wi)
    return Fate(R, T, 1.0 - R - T)


def leaving(m: Reflectance, wi: Any, tolerance: float, return_error: bool = False) -> Any:
    """The fractions of the energy of light from wi that leave to its side, at all wavelengths, and to the other one;
    with `return_error` both as `Integral`."""
    R, T = (of(m, wi, tolerance, return_error=return_error) for of in (kept_albedo, transmittance))
    if not exchanges(m):
        return R, T
    sent = reradiated_energy(m, wi, tolerance, return_error=return_error)
    return Integral(R.value + sent.value, R.error + sent.error) if return_error else R + sent, T
