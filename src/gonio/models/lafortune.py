"""Lafortune's generalized cosine lobe: as written in 1997, and scaled so that it conserves energy."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, dot, select
from ..formula.fields import param
from ..formula.warp import around, power_cosine, power_cosine_density, power_positive


class _CosineLobe(Reflectance, oriented=True):
    """max(C_x x_i x_o + C_y y_i y_o + C_z z_i z_o, 0)^n: a cosine lobe about the axis (C_x x_o, C_y y_o, C_z z_o)."""

    C_x: Any
    C_y: Any
    C_z: Any
    n: Any

    def axis(self, wo: Direction) -> tuple[Direction, Any]:
        """Unit vector along the lobe, and the length of (C_x x_o, C_y y_o, C_z z_o); z where that is 0."""
        axis = Direction(self.C_x * wo.x, self.C_y * wo.y, self.C_z * wo.z)
        length2 = dot(axis, axis)
        none = length2 < 1e-24
        length = ops.sqrt(ops.where(none, 1.0, length2))
        up = Direction(0.0 * axis.x, 0.0 * axis.y, 1.0 + 0.0 * axis.z)
        return select(none, up, axis / length), ops.where(none, 0.0, length)

    def lobe(self, wi: Direction, wo: Direction, largest: Any = 1.0) -> Any:
        dots = self.C_x * (wi.x * wo.x) + self.C_y * (wi.y * wo.y) + self.C_z * (wi.z * wo.z)
        return power_positive(dots / largest, self.n)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return around(self.axis(wo)[0], power_cosine(self.n, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        return power_cosine_density(self.n, dot(self.axis(wo)[0], wi))


class Lafortune(_CosineLobe):
    """Generalized cosine lobe: f = rho_s max(C_x x_i x_o + C_y y_i y_o + C_z z_i z_o, 0)^n.

    C_x = C_y = -1, C_z = 1 is a lobe about the mirror direction, a smaller C_z an off-specular one, positive C_x and
    C_y one towards the light. C_x = C_y is isotropic. Fits add several lobes, and a `Lambertian`. With
    -C_x = -C_y = C_z = ((n + 2)/(2 pi))^(1/n) this is `ModifiedPhong(rho_s, n)`.

    Looks    `Lafortune(0.5, n=20)` is a soft highlight; `C_z=0.6` makes it off-specular, weak but at the rim; `C_xy=1`
             shines back at the light.
    Shapes   rho_s, C_x, C_y, C_z, n: numbers or (..., C).
    Units    f and rho_s: 1/sr; the rest: 1.
    Error    rounding.
    Source   Lafortune et al. 1997, "Non-linear approximation of reflectance functions". Sampling: a cosine lobe about
             its axis, derived here.

    Example
    >>> off_specular = gn.Lafortune(0.5, C_z=0.6, n=20.0)
    >>> print(off_specular.f_angles(0.8, 0.0, [0.6, 0.8, 1.0], np.pi).round(4))
    [0.0016 0.0067 0.0119]
    """

    rho_s = param(1.0, 0.0, 1.0, "height of the lobe", unit="sr-1")
    C_x = param(-1.0, -1.15, 1.15, "coefficient of x", alias="C_xy")
    C_y = param("C_x", -1.15, 1.15, "coefficient of y")
    C_z = param(1.0, 0.0, 1.15, "coefficient of z")
    n = param(20.0, 0.0, 500.0, "exponent: the larger, the narrower", sampled="min")

    breaks: ClassVar[dict[str, str]] = {
        "energy": "nothing normalizes rho_s (...)^n: with the mirror's coefficients its albedo at normal incidence is "
        "2 pi rho_s/(n + 2), which exceeds 1 for n < 2 pi rho_s - 2; NormalizedLafortune carries the factor",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho_s * self.lobe(wi, wo)

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s * (2.0 * math.pi) / (self.n + 2.0) * power_positive(self.axis(wo)[1], self.n)


class NormalizedLafortune(_CosineLobe):
    """Generalized cosine lobe, scaled: f = rho_s (n + 2)/(2 pi) max((C_x x_i x_o + C_y y_i y_o + C_z z_i z_o)/C, 0)^n.

    C is the largest of |C_x|, |C_y|, C_z: the factor that Lafortune and Willems give the mirror lobe, which no choice
    of coefficients makes reflect more than rho_s. With C_x = C_y = -C_z this is `ModifiedPhong(rho_s, n)`.

    Looks    `NormalizedLafortune(0.5, C_xy=1, n=20)` shines back at the light; `n=20` alone is a soft
             highlight, `n=500` a small, bright one.
    Shapes   rho_s, C_x, C_y, C_z, n: numbers or (..., C).
    Units    f: 1/sr; the rest: 1.
    Error    rounding.
    Source   Lafortune et al. 1997, "Non-linear approximation of reflectance functions"; for other coefficients than
             the mirror's the scale is ours, and that it bounds the albedo is tested. Sampling as for `Lafortune`.

    Example
    >>> m = gn.NormalizedLafortune(0.5, n=500.0)
    >>> print(gn.albedo(m, gn.direction([0.0, 1.0], 0.0)).round(3))
    [0.5  0.27]
    """

    rho_s = param(0.5, 0.0, 1.0, "upper bound of the albedo")
    C_x = param(-1.0, -1.0, 1.0, "coefficient of x, relative to the others", alias="C_xy")
    C_y = param("C_x", -1.0, 1.0, "coefficient of y")
    C_z = param(1.0, 0.0, 1.0, "coefficient of z")
    n = param(20.0, 0.0, 1e3, "exponent: the larger, the narrower", sampled="min")

    def largest(self) -> Any:
        horizontal = ops.maximum(ops.absolute(self.C_x), ops.absolute(self.C_y))
        return ops.maximum(ops.maximum(horizontal, self.C_z), 1e-6)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho_s * (self.n + 2.0) * (0.5 / math.pi) * self.lobe(wi, wo, self.largest())

    def estimate(self, wo: Direction) -> Any:
        return self.rho_s * power_positive(self.axis(wo)[1] / self.largest(), self.n)
