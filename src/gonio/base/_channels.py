"""Channels of a reflectance: how many there are, their names and wavelengths, and how these are declared and kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..arrays.labels import Labels
from ..evaluate import batch
from ..formula.state import inferred, known
from . import channel_names, textured
from ._hooks import Hooks


class Channelled(Hooks):
    """A reflectance's channels. What is asked of their names is computed in `channel_names.py`."""

    if TYPE_CHECKING:

        @property
        def channel_names(self) -> tuple[Any, ...] | None:
            """Names of the channels, or wavelengths [nm]; None: as the parameters imply (three: linear sRGB)."""

    else:

        @inferred
        def channel_names(self) -> tuple[Any, ...] | None:
            return channel_names.known_to_formula(self)

    declares: ClassVar[Mapping[str, str]] = MappingProxyType({"wavelengths": "float | Array | None"})

    @known
    def wavelengths(self) -> np.ndarray | None:
        """The wavelengths [nm] of the channels, (C,); None for channels in RGB, with names in words, or none.

        They are declared by the constructor (`wavelengths=`), by `at`, or by `with_channels`; equality, `repr`, JSON
        and pickles have them.

        Example
        >>> field = gn.Lambertian([0.05, 0.3], wavelengths=[645.0, 858.5])
        >>> print(field.wavelengths, gn.Lambertian([0.6, 0.1, 0.05]).wavelengths)
        [645.  858.5] None
        >>> field == gn.Lambertian([0.05, 0.3], wavelengths=[650.0, 858.5])
        False
        """
        return channel_names.in_nanometres(self.channel_names)

    def _declared(self, **given: Any) -> Self:
        return channel_names.with_wavelengths(self, given["wavelengths"])

    def _at(self, wavelengths: Any, known: np.ndarray | None) -> Self:
        own = self.wavelengths
        new = super()._at(wavelengths, known if own is None else own)
        given = channel_names.in_nanometres(self._given("channel_names"))
        return new if given is None else channel_names.declared(new, wavelengths)

    def at(self, wavelengths: Any = None, uv: Any = None) -> Self:
        """A copy with the numbers at wavelengths [nm], which are its channels from then on: see `Parametrised.at`.

        `uv`: or at places (..., 2) on the surface, where parameters are textures: each is then an array (..., C).

        Example
        >>> paint = gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.2, 0.8])).at([450.0, 650.0])
        >>> print(paint.wavelengths, gn.albedo(paint, [0, 0, 1]).round(3))
        [450. 650.] [0.3 0.7]
        >>> print(gn.Lambertian(gn.Texture([[0.2, 0.8]])).at(uv=[0.5, 0.5]))
        Lambertian(rho=[0.5])
        """
        if uv is not None:
            placed = textured.at(self, uv)
            return placed if wavelengths is None else placed.at(wavelengths)
        return channel_names.with_axis(super().at(wavelengths), wavelengths)

    def _key(self) -> tuple[Any, ...]:
        return (*super()._key(), ("wavelengths", self._declared_wavelengths()))

    def _declared_wavelengths(self) -> np.ndarray | None:
        """The wavelengths that this was given itself, beside those of its parts and of its formula."""
        return channel_names.in_nanometres(self._given("channel_names"))

    def _written(self) -> dict[str, Any]:
        declared = self._declared_wavelengths()
        return super()._written() | ({} if declared is None else {"wavelengths": declared})

    def with_channels(self, names: Iterable[str | float] | None) -> Self:
        """A copy whose channels have these names, or wavelengths; `None` takes them away.

        Sums, products, coats and `replace` keep them, as long as the number of channels stays the same; JSON files too.
        Numbers that look like micrometres are announced by a MeaningWarning.

        Shapes   names: one for each channel.
        Units    wavelengths: nm.

        Example
        >>> field = gn.RossLi(f_iso=[0.05, 0.3], f_vol=[0.02, 0.16], f_geo=[0.01, 0.03]).with_channels(["red", "nir"])
        >>> (field + gn.Lambertian(0.01)).channel_names
        ('red', 'nir')
        """
        if names is None:
            return self.with_notes(channel_names=None)
        return channel_names.named(self, names)

    def _name_channels(self, whole: Labels) -> None:
        names = whole.channel_names
        if names is not None and self.channel_names is None and self.channels == len(names):
            self._hold(channel_names=channel_names.checked(names, self))

    def _replaced(self, grouped: dict[str, Any]) -> Self:
        new = super()._replaced(grouped)
        names = self._given("channel_names")
        if names is not None and self.channels == len(names) != new.channels:
            return new.with_notes(channel_names=None)
        return new

    def to_json(self) -> dict[str, Any]:
        return super().to_json() | self._names_in_json()

    def _names_in_json(self) -> dict[str, Any]:
        names, declared = self._given("channel_names"), self._declared_wavelengths()
        if declared is not None:
            return {"wavelengths": declared.tolist()}
        return {} if names is None else {"channel_names": list(names)}

    @property
    def channels(self) -> int | None:
        """The number of channels of f, which the parameters decide; None where f has no channel axis.

        Example
        >>> print(gn.Lambertian(0.5).channels, gn.Lambertian([0.6, 0.1, 0.05]).channels)
        None 3
        """
        return batch.channels(self)
