"""What all models with mirror facets share."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from ..base.reflectance import Reflectance
from ..base.results import Hints
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine, reflect
from ..formula.distribution import Distribution
from ..formula.fields import part
from ..formula.maskings import MASKINGS
from ..formula.mueller import Mueller, about_facet


class Facets(Reflectance):
    """Reflection by mirror facets: D F G / (4 cos cos), sampled by drawing a facet's normal."""

    fresnel: Any
    masking: str
    smooth_maskings: ClassVar[tuple[str, ...]] = ("height_correlated", "separable")
    """Those without kinks, with which quadrature by smooth rules converges."""

    @property
    @abstractmethod
    def facets(self) -> Distribution:
        """The distribution of normals."""

    @property
    def hints(self) -> Hints:
        smooth = getattr(self, "masking", None) in self.smooth_maskings
        return Hints(spread=self.facets.slope_spread if smooth else None)

    @property
    def _single_scatter(self) -> Any:
        return tree.unchecked(_White, of=self)

    def G(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        """The fraction of facets wm that is both lit and seen."""
        return MASKINGS[self.masking](self.facets, wi, wo, wm)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        return self.facets.D(wm) * self.fresnel.F(cos_d) * self.G(wi, wo, wm) / (4.0 * wi.z * wo.z)

    def without_fresnel(self, wi: Direction, wo: Direction, wm: Direction) -> Any:
        """f of facets whose F is 1: D G / (4 cos cos)."""
        return self.facets.D(wm) * self.G(wi, wo, wm) / (4.0 * wi.z * wo.z)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        wm, cos_d = half_and_cosine(wi, wo)
        facet = self.fresnel.polarized(cos_d)
        if facet is None:
            return super().polarized(wi, wo)
        return about_facet(facet * self.without_fresnel(wi, wo, wm), wi, wo)

    @property
    def polarizes(self) -> bool:
        return self.fresnel.polarizes

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return reflect(wo, self.facets.warp_normal(wo, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        return self.facets.normal_density(wo, wm, cos_d) / (4.0 * cos_d)

    def estimate(self, wo: Direction) -> Any:
        return self.fresnel.F(wo.z)


class _White(Reflectance, has_text=False, oriented=True):
    """Facets that reflect all light."""

    of = part(Reflectance, None, "the facets of another reflectance")

    @property
    def hints(self) -> Hints:
        hints: Hints = self.of.hints
        return hints

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.of.without_fresnel(wi, wo, half_and_cosine(wi, wo)[0])

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return self.of.warp(wo, u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self.of.density(wi, wo)
