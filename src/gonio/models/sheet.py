"""A sheet that reflects and transmits, each side and each way by a reflectance of its own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..base.sums import weighed
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import part
from ..formula.state import inferred, note
from ._reversed import is_reverse
from .across import Across
from .lambertian import Lambertian


class Sheet(Reflectance):
    """A sheet of which four blocks are known: reflection in front and behind, transmission forward and backward.

    front and back: what is reflected, as in `TwoSided`. forward: light that arrives in front and leaves behind;
    backward: the other way. The last two are reflectances that `Across` takes: f(wi mirrored at the surface, wo), so
    that the mirror direction is straight through. For a viewer behind, directions are turned half a turn about y.

    Looks    `Sheet(Lambertian(0.4), Lambertian(0.2), Lambertian(0.3), Lambertian(0.3))` is a blind or thin paper.
    Its index is 1: what is behind is what is in front, as in air. Reciprocal where `backward` is the reverse of
    `forward`, as it is of one reciprocal reflectance; measured blocks, or two of a user's, need not be.

    Shapes   as the parts.
    Units    f: 1/sr.
    Error    none of its own.
    Source   definition; blocks as in "WINDOW" files of LBNL.

    Example
    >>> blind = gn.Sheet(gn.Lambertian(0.4), gn.Lambertian(0.2), gn.Lambertian(0.1), gn.Lambertian(0.3))
    >>> wi = np.array([[0, 0, 1.0], [0, 0, -1.0]])
    >>> print(gn.albedo(blind, wi).round(2), gn.transmittance(blind, wi).round(2))
    [0.4 0.2] [0.1 0.3]
    """

    sides = "both"
    breaks: ClassVar[dict[str, str]] = note({})
    front = part(Reflectance, Lambertian(0.4), "reflectance in front")
    back = part(Reflectance, Lambertian(0.4), "reflectance behind")
    forward = part(Reflectance, Lambertian(0.3), "transmission of light from in front, as `Across` takes it")
    backward = part(Reflectance, Lambertian(0.3), "transmission of light from behind, as `Across` takes it")

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """Those of the parts that have any."""
        parts = (self.front, self.back, self.forward, self.backward)
        return next((names for part in parts if (names := part.channel_names) is not None), None)

    def validate(self) -> None:
        why = "forward and backward are two reflectances: light need not take the same way back through the sheet"
        self._hold(breaks={} if is_reverse(self.forward, self.backward) else {"reciprocity": why})

    def formula(self, wi: Direction, wo: Direction) -> Any:
        raise self._lacks("formula")

    def turned(self, back: Any) -> Reflectance:
        before, behind = choose(back, 0.0, 1.0), choose(back, 1.0, 0.0)
        backward, forward = (tree.unchecked(Across, of=m) for m in (self.backward, self.forward))
        return weighed([(before, self.front), (before, backward), (behind, self.back), (behind, forward)])

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        return self.turned(False).lobes()
