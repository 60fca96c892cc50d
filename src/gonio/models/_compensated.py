"""What models share that give back the light lost by mirror facets."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import Direction
from ..formula.mueller import Mueller
from .microfacet import ggx_mirrors


class CompensatedMirrors(Reflectance):
    """Isotropic GGX facets, and a second lobe."""

    alpha: Any
    fresnel: Any

    @abstractmethod
    def other(self) -> type[CompensatedMirrors]:
        """Class of the second lobe, which has the same parameters."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        (_, first), (_, other) = self.lobes()
        return first.formula(wi, wo) + other.formula(wi, wo)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        (_, first), (_, other) = self.lobes()
        return first.polarized(wi, wo) + Mueller.depolarizer(other.formula(wi, wo))

    @property
    def polarizes(self) -> bool:
        return self.fresnel.polarizes

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        other = tree.unchecked(self.other(), **{name: self.__dict__[name] for name in self.fields})
        return [(1.0, ggx_mirrors(self.alpha, self.fresnel)), (1.0, other)]
