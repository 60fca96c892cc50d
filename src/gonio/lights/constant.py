"""The same radiance from every direction: an overcast day, or the furnace of a test."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

from ..base.light import Light, channel_vector, spectrum
from ..formula.fields import param


class ConstantLight(Light):
    """Constant illumination: L(w) = radiance.

    Shapes   radiance: a number or (C,).
    Units    radiance: W m-2 sr-1.
    Error    none.
    Source   lecture 4, eq. 4.11 (docs/equations.md).
    """

    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")

    words: ClassVar[dict[str, str]] = {"constant[:L]": "radiance L from everywhere; default 1"}

    @classmethod
    def of_word(cls, numbers: Sequence[float]) -> Self:
        return cls(spectrum(numbers, 1.0))

    def incident(self, w: Any) -> Any:
        return channel_vector(self.radiance, w) + 0.0 * w[..., :1]
