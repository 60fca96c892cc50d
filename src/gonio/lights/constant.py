"""The same radiance from every direction: an overcast day, or the furnace of a test."""

from __future__ import annotations

from typing import Any

from ..base.light import Light, channel_vector
from ..formula.fields import param
from ._words import Word, spectrum


class ConstantLight(Light):
    """Constant illumination: L(w) = radiance.

    Shapes   radiance: a number or (C,).
    Units    radiance: W m-2 sr-1.
    Error    none.
    Source   lecture 4, eq. 4.11 (docs/equations.md).

    Example
    >>> sky = gn.ConstantLight([0.3, 0.5, 1.0])
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), sky, up, normal=up).round(3))
    [0.15 0.25 0.5 ]
    """

    radiance = param(1.0, 0.0, 1e30, "radiance", unit="W m-2 sr-1")

    def incident(self, w: Any) -> Any:
        return channel_vector(self.radiance, w) + 0.0 * w[..., :1]


WORDS = [
    Word("constant[:L]", "radiance L from everywhere; default 1", lambda numbers: ConstantLight(spectrum(numbers, 1.0)))
]
