"""The quarters of a reflectance: what it reflects in front and behind, and what it transmits, as a `Sheet` has them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sums import lobes_on, weighed
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import part
from ._wrapper import Reframed, WrappedLobe
from .across import Across
from .lambertian import Lambertian
from .sheet import Sheet
from .two_sided import TwoSided

QUARTERS = ("front", "back", "forward", "backward")
"""The parts of a `Sheet`: light and viewer in front, both behind, light from in front, light from behind."""


def quarters(m: Reflectance) -> dict[str, Reflectance]:
    """The quarters of a reflectance that are not black, each as a `Sheet` takes it; measured parts as they are."""
    if lobes_on(m, "front") is m:
        return {"front": m}
    if isinstance(m, Sheet):
        parts = {name: getattr(m, name) for name in QUARTERS}
    elif isinstance(m, TwoSided):
        parts = {"front": m.front, "back": m.back}
    else:
        parts = {name: _quarter(m, behind, across) for name, behind, across in _PLACES}
    return {name: quarter for name, quarter in parts.items() if quarter is not None and not _is_black(quarter)}


def sheet_of(parts: Mapping[str, Reflectance]) -> Any:
    """The `Sheet` of these quarters, black in the others; a reflectance in front alone stays itself."""
    if set(parts) == {"front"}:
        return parts["front"]
    return Sheet(**{name: parts.get(name, Lambertian(0.0)) for name in QUARTERS})


_PLACES = (("front", False, False), ("back", True, False), ("forward", True, True), ("backward", False, True))
"""Of each quarter, whether the viewer is behind, and whether light comes from the other side."""


def _is_black(m: Reflectance) -> bool:
    return isinstance(m, Lambertian) and not np.any(m.rho)


def _quarter(m: Reflectance, behind: bool, across: bool) -> Reflectance | None:
    """The lobes of a quarter as a reflectance in front, or None without any."""
    lobes = lobes_on(m, "across" if across else "front", behind).lobes()
    quarter = weighed((weight, tree.unchecked(_Folded, of=lobe) if across else lobe) for weight, lobe in lobes)
    return quarter if quarter.terms else None


class _Folded(WrappedLobe):
    """A lobe across the surface as a reflectance, the inverse of `Across`: wi is mirrored at the surface."""

    of = part(Reflectance, Across(), "lobe whose light comes through the surface", sides="any")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(_below(wi), wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return _below(self.of.warp(wo, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self.of.density(_below(wi), wo)

    def mirror(self, wo: Direction) -> Any:
        return self.of.mirror(wo)

    def mirrored(self, wo: Direction) -> Direction:
        return _below(self.of.mirrored(wo))

    def estimate(self, wo: Direction) -> Any:
        return self.of.estimate(wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield 1.0, self


class MirroredX(Reframed):
    """A reflectance with x of both directions turned round: seen from behind, with the azimuths of the front."""

    of = part(Reflectance, Lambertian(0.5), "reflectance before it is mirrored")

    def light_within(self, wi: Direction) -> Direction:
        return Direction(-wi.x, wi.y, wi.z)

    light_outside = light_within

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.formula(self.light_within(wi), self.light_within(wo))

    def mirror(self, wo: Direction) -> Any:
        return self.of.mirror(self.light_within(wo))


def _below(wi: Direction) -> Direction:
    return Direction(wi.x, wi.y, -wi.z)
