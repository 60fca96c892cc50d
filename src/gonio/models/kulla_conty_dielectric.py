"""Rough dielectric that gives back the light which its facets scatter more than once."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..base.reflectance import Reflectance
from ..distributions.ggx import GGX
from ..errors import ParameterError, shown
from ..formula import tree
from ..formula.direction import Direction
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW
from ..formula.fields import param
from ._between_media import BetweenMedia
from ._dielectric_loss import (
    HIGHEST,
    LOWEST,
    corners,
    diffuse_reflectance,
    lost,
    lost_on_average,
    tables,
)
from .rough_dielectric import STEEP, facets


class KullaContyDielectric(BetweenMedia):
    """GGX facets that reflect and refract, and two lobes for the light they lose: nothing is absorbed, R + T = 1.

    f_r = l_o(mu_i) l_o(mu_o) (1 - b_o)/(pi L_o),  f_t = l_i(mu_i) l_o(mu_o) b_i/(pi L_o),  L = 2 integral of l mu

    beside `RoughDielectric(GGX(alpha), eta)`, which loses the share l(mu) of the light from the side i or o. Of this b
    goes through: b_i = T_i min(L_i, L_o)/L_i, T_i that of diffuse light through a smooth interface. As T_i n_i^2 is the
    same for both sides, f/n_o^2 stays reciprocal.

    Looks    `KullaContyDielectric(0.5, 1.5)` is roughly ground glass as bright as it should be, where `RoughDielectric`
             is grey.
    Shapes   alpha, eta: numbers or (..., C).
    Units    f: 1/sr; alpha, eta: 1.
    Error    l, a table: 7e-4 for eta of 1.02 and more (or their inverses), 2.5e-4 at 99 % of angles; so is R + T. How
             the light is shared out to the two sides is the method's; between it and a simulation nothing was compared.
             The table is of isotropic GGX: Beckmann's facets lose other shares, for which another table would stand
             here, of 230 kB.
    Raises   ParameterError for eta between 1/1.02 and 1.02.
    Source   Kulla & Conty 2017, "Revisiting physically based shading at Imageworks", for two sides; b is derived here.
             Diffuse light: Walsh 1926, Duntley 1942.

    Example
    >>> wi = gn.direction([0.0, 1.0, 2.0], 0.0)
    >>> print(gn.absorptance(gn.KullaContyDielectric(0.5, 1.5), wi).round(2) + 0.0)
    [0. 0. 0.]
    >>> rough = gn.RoughDielectric(gn.GGX(0.5), 1.5)
    >>> print((1.0 - gn.albedo(rough, wi) - gn.transmittance(rough, wi)).round(2))
    [0.03 0.11 0.37]
    """

    breaks = STEEP
    alpha = param(0.3, ALPHA_LOW, ALPHA_HIGH, "slope scale of the facets", sampled="max")
    eta = param(1.5, 1.0 / HIGHEST, HIGHEST, "refractive index behind the surface over that in front")

    def validate(self) -> None:
        eta = self.eta
        if isinstance(eta, (float, np.ndarray)) and (np.abs(np.log(eta)) < math.log(LOWEST) - 1e-12).any():
            rule = f"expected an index of at least {LOWEST:g}, or of at most 1/{LOWEST:g}"
            raise ParameterError(f"{type(self).__name__}(eta={shown(eta)}): {rule}; for others take RoughDielectric")

    def _keep(self) -> dict[str, Fixed]:
        return super()._keep() | tables()

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield from facets(tree.unchecked(GGX, alpha_x=self.alpha, alpha_y=self.alpha), self.eta)
        for lobe_class in (_Returned, _PassedOn):
            yield 1.0, self._as(lobe_class)

    def _as(self, lobe_class: type[_FurtherScattering]) -> Reflectance:
        """A lobe with the same numbers and tables."""
        names = ("alpha", "eta", "loss", "losses")
        values = {name: self.__dict__[name] for name in names if name in self.__dict__}
        return lobe_class._made_of(
            values, {"_tied": {}, "_derived": {}, "_alike": {}, "_kept": tables(), "_is_bound": self._is_bound}
        )


class _FurtherScattering(KullaContyDielectric):
    """Light that facets scatter more than once."""

    loss: Any
    losses: Any

    lobes = Reflectance.lobes

    @property
    def above(self) -> Any:
        """1 where the viewer is in the denser medium, else 0."""
        return ops.where(self.eta > 1.0, 0.0, 1.0)

    def corners(self) -> Any:
        """Where the tables are to be read."""
        return corners(self.alpha, ops.maximum(self.eta, 1.0 / self.eta))

    def shared(self, at: Any) -> tuple[Any, Any, Any, Any]:
        """b_o, the share of the light from the viewer's side that goes through; 1 - b_o; and L of both sides."""
        here, there = (lost_on_average(self.losses, at, side) for side in (self.above, 1.0 - self.above))
        R = diffuse_reflectance(ops.maximum(self.eta, 1.0 / self.eta))
        T = ops.where(self.eta > 1.0, 1.0 - R, (1.0 - R) * self.eta * self.eta)
        R = ops.where(self.eta > 1.0, R, 1.0 - T)
        least = ops.minimum(here, there)
        return T * least / here, R + T * (here - least) / here, here, there

    @abstractmethod
    def formula(self, wi: Direction, wo: Direction) -> Any:
        """f of this share of the light."""

    def seen(self, at: Any, wo: Direction) -> Any:
        """l_o(mu_o)."""
        return lost(self.loss, at, self.above, wo.z, self.alpha)


class _Returned(_FurtherScattering):
    """What comes back."""

    sides = "front"

    def turned(self, back: Any) -> Reflectance:
        return Reflectance.turned(self, back)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        at = self.corners()
        _, kept, L, _ = self.shared(at)
        return self.seen(at, wi) * self.seen(at, wo) * kept / (math.pi * L)

    def estimate(self, wo: Direction) -> Any:
        at = self.corners()
        return self.seen(at, wo) * self.shared(at)[1]


class _PassedOn(_FurtherScattering):
    """What goes through."""

    sides = "across"

    def formula(self, wi: Direction, wo: Direction) -> Any:
        at = self.corners()
        b, _, _, L = self.shared(at)  # b_o L_o n_o^2 is b_i L_i n_i^2
        there = lost(self.loss, at, 1.0 - self.above, -wi.z, self.alpha)
        return there * self.seen(at, wo) * b / (math.pi * L * self.eta * self.eta)

    def estimate(self, wo: Direction) -> Any:
        at = self.corners()
        return self.seen(at, wo) * self.shared(at)[0] / (self.eta * self.eta)
