"""Smooth dielectric: a clear interface, as two delta lobes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import NORMAL, Direction
from ..formula.fields import param
from ..formula.fresnel.dielectric import Dielectric
from ..formula.mueller import Mueller
from ._between_media import BetweenMedia
from .ideal_specular import IdealSpecular
from .rough_dielectric import refracted, smooth_refraction


class SmoothDielectric(BetweenMedia):
    """Clear glass, one interface: F of the radiance of the mirror direction and (1 - F) n_o^2/n_i^2 of that refracted.

    n is 1 in front and eta behind. From behind it is the interface of 1/eta, with total reflection beyond the critical
    angle. `f` is 0 pointwise; `sample`, `albedo`, `transmittance` and `reflected_radiance` treat both deltas exactly.

    Looks    `SmoothDielectric(1.5)` is the surface of a block of glass, `SmoothDielectric(1.33)` still water;
             `SmoothDielectric(2.4)` diamond.
    Shapes   eta: a number or (..., C); `sample` takes one index, for each refracts to another direction.
    Units    eta: 1.
    Error    rounding.
    Source   Snell's law and Fresnel's formulas: Born & Wolf, Principles of Optics, 7th ed., section 1.5; n_o^2/n_i^2:
             Walter, Marschner, Li & Torrance 2007, EGSR.

    Example
    >>> water = gn.SmoothDielectric(1.33)
    >>> wi = gn.direction([0.0, 1.0, np.pi - 1.0], 0.0)  # the last one under water
    >>> print(gn.albedo(water, wi).round(4), gn.transmittance(water, wi).round(4))
    [0.0201 0.0493 1.    ] [0.9799 0.9507 0.    ]
    """

    eta = param(1.5, 0.2, 5.0, "refractive index behind the surface over that in front")

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield 1.0, tree.unchecked(IdealSpecular, reflectance=tree.unchecked(Dielectric, eta=self.eta))
        yield 1.0, tree.unchecked(_Refraction, eta=self.eta)


class _Refraction(SmoothDielectric):
    """The light that is refracted."""

    sides = "across"
    is_delta = True

    lobes = Reflectance.lobes

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * self.mirror(wo)

    def mirror(self, wo: Direction) -> Any:
        return (1.0 - tree.unchecked(Dielectric, eta=self.eta).F(wo.z)) / (self.eta * self.eta)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        return smooth_refraction(wo, self.eta) * self.mirror(wo)

    @property
    def polarizes(self) -> bool:
        return True

    def mirrored(self, wo: Direction) -> Direction:
        return refracted(wo, NORMAL, self.eta)

    def estimate(self, wo: Direction) -> Any:
        return self.mirror(wo)
