"""Two-sided: a reflectance in front and another one behind, and no light between them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..base.sums import weighed
from ..formula.direction import Direction
from ..formula.fields import part
from ..formula.state import inferred
from .lambertian import Lambertian


class TwoSided(Reflectance):
    """An opaque sheet: `front` where it is seen from in front, `back` from behind, each lit from its own side.

    Each is given as its own front shows it: seen from behind, directions are turned half a turn about the y axis.

    Looks    `TwoSided(Lambertian([0.8, 0.7, 0.2]), Microfacet())` is gilt paper: yellow in front, metal behind;
             `TwoSided(Lambertian(0.8), Lambertian(0.1))` is carbon paper.
    Shapes   as front and back.
    Units    f: 1/sr.
    Error    none of its own.
    Source   definition.

    Example
    >>> paper = gn.TwoSided(gn.Lambertian(0.8), gn.Lambertian(0.1))
    >>> print(gn.albedo(paper, [[0, 0, 1], [0, 0, -1]]).round(2))
    [0.8 0.1]
    """

    sides = "both"
    front = part(Reflectance, Lambertian(0.8), "reflectance seen from in front")
    back = part(Reflectance, Lambertian(0.2), "reflectance seen from behind")

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """Those of the parts that have any."""
        return next((names for part in (self.front, self.back) if (names := part.channel_names) is not None), None)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        raise self._lacks("formula")

    def turned(self, back: Any) -> Reflectance:
        behind, before = choose(back, 1.0, 0.0), choose(back, 0.0, 1.0)
        return weighed([(before, self.front), (behind, self.back)])

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        return self.turned(False).lobes()
