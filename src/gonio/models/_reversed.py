"""The transmission of the other way through a sheet."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import part
from ..formula.state import inferred
from .lambertian import Lambertian


class Reversed(Reflectance):
    """The transmission of the other way, by reciprocity between two sides of one index: f(wi, wo) is that of light from
    wo seen from wi."""

    of = part(Reflectance, Lambertian(0.5), "transmission one way, as a `Sheet` takes it")

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        return self.of.channel_names

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(Direction(-wo.x, wo.y, wo.z), Direction(-wi.x, wi.y, wi.z))


def is_reverse(forward: Reflectance, backward: Reflectance) -> bool:
    """Whether two ways through a sheet are one reflectance, or one was made as the other's reverse."""
    pairs = ((forward, backward), (backward, forward))
    return forward == backward or any(isinstance(a, Reversed) and a.of == b for a, b in pairs)
