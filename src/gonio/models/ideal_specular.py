"""Ideal specular: a perfect mirror, as a delta lobe."""

from __future__ import annotations

from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import part
from ..formula.fresnel import as_fresnel
from ..formula.fresnel.constant import Constant
from ..formula.fresnel_term import Fresnel
from ..formula.mueller import Mueller


class IdealSpecular(Reflectance):
    """Mirror: f = k delta(theta_i - theta_o) delta(phi_i + pi - phi_o) / (sin theta_i cos theta_i).

    `f` is 0 pointwise; `sample`, `albedo`, `reflected_radiance` and `render` treat the delta exactly, so that
    L_o(wo) = k L_i(mirror of wo).

    Looks    `IdealSpecular()` is a chrome ball: the surroundings, undimmed; `IdealSpecular(Dielectric(1.5))` is black
             glass, dark in the middle and bright at the rim.
    Shapes   reflectance: a number, (..., C), or a Fresnel term: `IdealSpecular(Conductor(0.2, 3.9))`.
    Units    reflectance k: 1.
    Error    rounding.
    Source   lecture 4, eq. 4.3 to 4.6 with their errata (docs/equations.md).

    Example
    >>> glass = gn.IdealSpecular(gn.Dielectric(1.5))
    >>> print(glass.delta_reflectance(gn.direction([0.0, 1.0, 1.5], 0.0)).round(4))
    [0.04   0.0775 0.6704]
    """

    reflectance = part(Fresnel, Constant(1.0), "reflectance of the mirror", coerce=as_fresnel)

    is_delta = True

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * self.reflectance.F(wo.z)

    def mirror(self, wo: Direction) -> Any:
        return self.reflectance.F(wo.z)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        found = self.reflectance.polarized(wo.z)
        return super().polarized_mirror(wo) if found is None else found

    @property
    def polarizes(self) -> bool:
        return self.reflectance.polarizes

    def estimate(self, wo: Direction) -> Any:
        return self.reflectance.F(wo.z)
