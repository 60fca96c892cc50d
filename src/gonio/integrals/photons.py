"""What leaves of light of each wavelength, at all wavelengths together: the photons, or the energy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sides import refuse_transmission
from ..base.under_light import _OverBands
from ..declared.arguments import checked
from ..errors import ParameterError
from ..evaluate.labelled import takes_labels
from ..formula.direction import Direction
from ..formula.fields import param
from .albedo import kept_albedo
from .asked import Incidence, ReturnError, Tolerance
from .over_hemisphere import Integral, directions, integrate


@checked
def photon_albedo(m: Reflectance, wi: Incidence, tolerance: Tolerance = 1e-4, return_error: ReturnError = False) -> Any:
    """Photons that leave, to all sides and at all wavelengths, over photons that arrive from wi, by wavelength.

    N(wi)_i = sum_o (lambda_o/lambda_i) integral of F[o, i](wi, wo) cos(theta_o) dwo: a photon's energy is hc/lambda.
    Of a material that does not fluoresce it is the albedo. Fluorescence may send back more light of a wavelength than
    arrives, but never more photons: above 1 this is no matter that absorbs one photon for each that it sends out.

    Shapes   wi: (..., 3) NumPy array; result (..., C), or with `return_error` an `Integral` of it and (..., C).
    Units    1.
    Error    at most `tolerance`, as for `gn.albedo`.
    Raises   ParameterError for a material that fluoresces, and transmits light or does not know its wavelengths.
    Source   Donaldson 1954, Br. J. Appl. Phys. 5:210 (external quantum efficiency by wavelength).

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> print(gn.photon_albedo(ink, [0, 0, 1]).round(4))  # 0.2 + 0.3 550/400
    [0.6125 0.6   ]
    """
    albedo = integrate(counted(m) if m.fluoresces else m, wi, tolerance)
    return albedo if return_error else albedo.value


def counted(m: Reflectance) -> Reflectance:
    """A fluorescent material as a reflectance of photons: of channel i, what leaves at all wavelengths."""
    rule = "it transmits light, of which the photons are not counted; expected a material lit and seen in front only"
    refuse_transmission(m, f"photons of {m!r:.60}: {rule}")
    if m.wavelengths is None:
        raise ParameterError(
            f"photons of {m!r:.60}: its wavelengths are not known, and photons of long ones have less energy; expected "
            f"m.with_channels(wavelengths) [nm]"
        )
    return _Leaving(of=m, worth=m.wavelengths)


@takes_labels("wi")
def reradiated_energy(m: Reflectance, wi: Any, tolerance: float, return_error: bool) -> Any:
    """The energy that is re-radiated, at all wavelengths together, over that of light from wi, by its wavelength: 0 of
    light from behind."""
    wi = directions(wi, True)
    in_front = np.where(wi[..., 2:] > 0.0, wi, [0.0, 0.0, 1.0]).astype(wi.dtype)
    R = integrate(_Leaving(of=m, worth=1.0).sent(), in_front, tolerance)
    value = np.where(wi[..., 2:] > 0.0, R.value, 0.0)
    return Integral(value, R.error) if return_error else value


def exchanged_in_words(m: Reflectance) -> str:
    """How much of the light that arrives along the normal leaves at another wavelength."""
    up = np.array([0.0, 0.0, 1.0])
    sent, kept = reradiated_energy(m, up, 1e-3, False), kept_albedo(m, up, 1e-3)
    most = int(np.argmax(sent))
    where = f"in channel {most}" if m.wavelengths is None else f"at {m.wavelengths[most]:g} nm"
    share = sent.sum() / max(float((sent + kept).sum()), 1e-300)
    return f"{sent[most]:.0%} of what arrives {where}, {share:.0%} of all that leaves of light of all wavelengths alike"


class _Leaving(_OverBands):
    """What leaves at all wavelengths, over what arrives at this channel's: per steradian, without the cosine."""

    worth = param(1.0, 0.0, 1e30, "of how much a unit of energy counts, by wavelength: photons by the wavelength")

    def _weights(self) -> Any:
        return self.worth

    def _summed_first(self, matrix: np.ndarray) -> np.ndarray:
        return matrix

    def _pair(self, own: Reflectance, summed: Reflectance) -> tuple[Reflectance, Reflectance]:
        return summed, own

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(wi, wo) + self._total(wi, wo) / self.worth

    def lobes(self) -> Any:
        yield from self.of.lobes()
        yield 1.0, self.sent()

    def sent(self) -> Reflectance:
        """What leaves at other wavelengths than it arrived at."""
        return _Sent._made_of(self.__dict__, {"_derived": {}, "_alike": {}})


class _Sent(_Leaving):
    """What leaves at other wavelengths than it arrived at."""

    lobes = Reflectance.lobes

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self._total(wi, wo) / self.worth
