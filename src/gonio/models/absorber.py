"""Absorber: a clear filter, which light passes straight and weakened."""

from __future__ import annotations

from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.fields import param
from ..formula.mueller import Mueller, turned_axes


class Absorber(Reflectance):
    """A filter without surfaces, such as dyed gelatine or smoke: L_o(wo) = exp(-depth/cos_o) L_i(-wo).

    It reflects nothing and scatters nothing: a delta lobe straight through, which leaves polarization as it
    is. `ThinDielectric` is the one with faces.

    Looks    `Absorber([0.1, 1, 2])` is a red filter, deeper red at a slant; `Absorber(0)` is nothing at all.
    Shapes   depth: a number or (..., C).
    Units    depth: 1, the absorption coefficient times the thickness.
    Error    rounding.
    Source   Beer–Lambert law: Bouguer 1729, Lambert 1760, Beer 1852.

    Example
    >>> red = gn.Absorber([0.1, 1.0, 2.0])
    >>> print(gn.transmittance(red, gn.direction([0.0, 1.0], 0.0)).round(3))
    [[0.905 0.368 0.135]
     [0.831 0.157 0.025]]
    """

    sides = "across"
    is_delta = True
    depth = param(0.5, 0.0, 50.0, "absorption coefficient times thickness")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * self.mirror(wo)

    def mirror(self, wo: Direction) -> Any:
        return ops.exp(-self.depth / wo.z)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        unchanged: Mueller = turned_axes(1.0, 0.0) * self.mirror(wo)
        return unchanged

    @property
    def polarizes(self) -> bool:
        return True

    def estimate(self, wo: Direction) -> Any:
        return self.mirror(wo)
