"""Fluorescence of a reflectance: the calls that follow from the hook `reradiated`.

The matrices of pairs of wavelengths are computed in `reradiation.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Self

from ..errors import ParameterError
from ..formula import tree
from ..formula.fields import Part
from ..formula.parametrised import Parametrised
from ..formula.state import derived
from . import reradiation
from ._hooks import Hooks
from .channel_names import _Channelled


class Fluorescent(_Channelled):
    """Light that leaves a reflectance at another wavelength than it arrived at."""

    @property
    def fluoresces(self) -> bool:
        """Whether light may leave at another wavelength than it arrived at; a model that does this says `True`.

        Example
        >>> print(gn.Lambertian(0.5).fluoresces, gn.Donaldson([[0.2, 0.0], [0.3, 0.6]]).fluoresces)
        False True
        """
        return any(part.fluoresces for part in self._reflectances())

    def reradiation(self, wi: Any, wo: Any) -> Any:
        """The bispectral matrix F of light that leaves at wavelength o and arrived at i: L_o = sum_i F[o, i] E_i.

        E_i and L_o are irradiance and radiance of whole bands (on an even grid also their densities by wavelength). `f`
        is the part that keeps its wavelength, and stands on the diagonal; without fluorescence the rest is 0. Elements
        above the diagonal, where wavelengths ascend, take light from longer waves to shorter ones.

        Shapes   wi, wo: (..., 3), broadcast against each other; result (..., C, C), the wavelength that leaves first.
        Units    1/sr; 0 where a direction is below the horizon.
        Error    rounding. 41 wavelengths take 13 kB for each pair of directions, in double precision.
        Source   Donaldson 1954, Br. J. Appl. Phys. 5:210; with directions Hullin et al. 2010, ACM TOG 29(4):97.

        Example
        >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
        >>> F = ink.reradiation([0, 0, 1], [0, 0, 1])
        >>> print((np.pi * F @ [1.0, 0.0]).round(3))  # the radiance factor under violet light alone
        [0.2 0.3]
        """
        self._require_passed_on()
        return reradiation.matrix(self, wi, wo)

    @derived
    def _pairs(self) -> Parametrised:
        """This material with a channel for each pair of wavelengths."""
        return reradiation.pairs(self, self.channels or 1)

    def _with_rounds(self, matrix: Callable[[str, Any], Any], prefix: str = "") -> Self:
        """With `matrix(path, coat)` in each coat that sends light back to a dye, where it may excite again: what goes
        to and fro takes part in all wavelengths at once, and formulas know two."""
        parts = ((name, self.__dict__[name]) for name, field in self.fields.items() if isinstance(field, Part))
        inner = {
            name: x._with_rounds(matrix, f"{prefix}{name}.")
            for name, x in parts
            if isinstance(x, Fluorescent) and x.fluoresces
        }
        changes = {name: x for name, x in inner.items() if x is not self.__dict__[name]}
        return self._changed(changes) if changes else self

    def _reflectances(self) -> Iterable[Fluorescent]:
        """The reflectances that this is made of."""
        return (part for part in tree.components(self) if isinstance(part, Fluorescent))

    def _require_bands(self, channels: int) -> None:
        """Raises ParameterError where numbers of this model do not fit so many bands."""

    def _require_passed_on(self, channels: int | None = None) -> None:
        """Raises ParameterError where a part fluoresces, and the model around it does not say where that light goes, or
        the part does not fit this material's bands."""
        channels = channels or self.channels or 1
        self._require_bands(channels)
        for inner in self._reflectances() if self.fluoresces else ():
            if inner.fluoresces and type(self).reradiated is Hooks.reradiated:
                raise ParameterError(
                    f"{type(self).__name__}: {inner!r:.60} in it fluoresces, and this model does not say where that "
                    f"light goes; expected it in a sum, a product, Rotated or Coated, or a model with reradiated"
                )
            inner._require_passed_on(channels)
