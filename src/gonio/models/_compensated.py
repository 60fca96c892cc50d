"""What models share that give the light back which mirror facets do not reflect at once."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from .microfacet import ggx_mirrors


class CompensatedMirrors(Reflectance):
    """Isotropic GGX facets, and a second lobe."""

    alpha: Any
    fresnel: Any

    @property
    def first(self) -> Reflectance:
        """Light that a facet reflects once."""
        return ggx_mirrors(self.alpha, self.fresnel)

    @property
    @abstractmethod
    def further(self) -> Reflectance:
        """The lobe of other light."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.first.formula(wi, wo) + self.further.formula(wi, wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        return [(1.0, self.first), (1.0, self.further)]
