"""The lobes of a stack in closed form: light that is mirrored, refracted straight on, or scattered once."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..base.sums import weighed
from ..distributions.ggx import GGX
from ..formula import tree
from ..formula.direction import BEHIND, NORMAL, Direction, select
from ..formula.fresnel.dielectric import Dielectric, fresnel_dielectric
from ..formula.mueller import Mueller, scaled_to
from ..models.hanrahan_krueger import passed_once, scattered_once
from ..models.microfacet import Microfacet
from ..models.rough_dielectric import facets, refracted
from . import polarized
from .layer import Medium, RoughInterface
from .layered import _Lobe, upward


class _Passing(_Lobe):
    """A lobe of light that goes straight through some layers."""

    def rough(self) -> RoughInterface:
        """The first rough interface, from the side of the viewer on."""
        return next(layer for layer in self._seen() if isinstance(layer, RoughInterface))

    def to_light(self, wi: Direction) -> list[tuple[Any, Direction, Any]]:
        """`passage` of the light."""
        return self.passage(wi)

    def arriving(self, wi: Direction) -> list[Mueller]:
        """What interfaces do to light on its way to each place of `to_light`."""
        return self.crossed(wi)

    def mirrored_and_passed(self, wo: Direction) -> tuple[Any, Any]:
        """What delta lobes reflect of light along wo, and what they let through, of all layers."""
        *above, (_, below, _) = self.passage(wo)
        mirrored: Any = 0.0 * wo.z + 0.0 * self.channel
        passed = mirrored + 1.0
        if self.base is not None and len(above) == len(self.layers):
            for weight, lobe in self.base.lobes():
                if lobe.is_delta:
                    mirrored = mirrored + weight * lobe.mirror(below)
        for layer, (_, w, _) in reversed(list(zip(self._seen(), above, strict=False))):
            if isinstance(layer, Medium):
                mirrored = mirrored * ops.exp(-2.0 * layer.depth / w.z)
                passed = passed * ops.exp(-layer.depth / w.z)
            else:
                once = fresnel_dielectric(w.z, layer.eta)
                again = 1.0 - once * mirrored
                passed = (1.0 - once) * passed / again
                mirrored = once + (1.0 - once) * (1.0 - once) * mirrored / again
        return mirrored, passed

    def polarized_mirrored_and_passed(self, wo: Direction) -> tuple[Mueller, Mueller]:
        """The same for polarized light, in matrices whose first elements differ: bounces are of s and of p apart."""
        passage, mirror = self.passage(wo), None
        if self.base is not None and len(passage) == len(self.layers) + 1:
            mirror = polarized.mirror_of(self.base.lobes(), passage[-1][1])
        return polarized.mirrored_and_passed(self._seen(), passage, mirror)


class _Mirrors(_Passing):
    """The delta lobe of a stack: light that is mirrored to and fro between its smooth interfaces and its base."""

    @property
    def is_delta(self) -> bool:
        return True

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.0 * wi.z + 0.0 * self.channel

    def mirror(self, wo: Direction) -> Any:
        return self.mirrored_and_passed(wo)[0]

    def polarized_mirror(self, wo: Direction) -> Mueller:
        return scaled_to(self.polarized_mirrored_and_passed(wo)[0], self.mirror(wo))

    def estimate(self, wo: Direction) -> Any:
        return self.mirror(wo)


def ground(layer: RoughInterface) -> GGX:
    """The facets of a rough interface."""
    return tree.unchecked(GGX, alpha_x=layer.alpha, alpha_y=layer.alpha)


def mirroring(layer: RoughInterface) -> Reflectance:
    """What a rough interface reflects at once."""
    fresnel = tree.unchecked(Dielectric, eta=layer.eta)
    return tree.unchecked(Microfacet, distribution=ground(layer), fresnel=fresnel, masking="separable")


def outside(w: Direction, n: Any) -> tuple[Any, Direction]:
    """Whether light along w, in a medium of index n, leaves through smooth interfaces, and how: upwards."""
    z2 = 1.0 - n * n * (w.x * w.x + w.y * w.y)
    leaves = z2 > 1e-12
    return leaves, select(leaves, Direction(n * w.x, n * w.y, ops.sqrt(ops.where(leaves, z2, 1.0))), NORMAL)


class _AtOnce(_Passing):
    """A lobe behind smooth interfaces and media, by light that gets straight to it and from it."""

    @property
    @abstractmethod
    def lobe(self) -> Reflectance:
        """What light meets behind them."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        (lit, ti, _), (seen, to, n) = self.to_light(wi)[-1], self.passage(wo)[-1]
        return lit * seen / (n * n) * self.lobe.formula(ti, to)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        M = self.lobe.polarized(self.to_light(wi)[-1][1], self.passage(wo)[-1][1])
        return polarized.between(self.arriving(wi)[-1], M, self.crossed(wo)[-1], self.formula(wi, wo))

    def estimate(self, wo: Direction) -> Any:
        seen, to, _ = self.passage(wo)[-1]
        return seen * seen * self.lobe.estimate(to)


class _Reflected(_AtOnce):
    """What the first rough interface reflects at once."""

    @property
    def lobe(self) -> Reflectance:
        return mirroring(self.rough())

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        _, to, n = self.passage(wo)[-1]
        ti = self.lobe.warp(to, u0, u1)
        leaves, wi = outside(ti, n)
        return select(leaves & (ti.z > 0.0), wi, BEHIND)

    def density(self, wi: Direction, wo: Direction) -> Any:
        (lit, ti, n), (_, to, _) = self.passage(wi)[-1], self.passage(wo)[-1]
        return ops.where(lit > 0.0, self.lobe.density(ti, to) * wi.z / (n * n * ti.z), 0.0)


class _Seen(_AtOnce):
    """A lobe of the base."""

    base: Reflectance

    @property
    def lobe(self) -> Reflectance:
        return self.base


class _ScatteredOnce(_Passing):
    """Light that is scattered once, in a medium that it gets straight to and from."""

    @abstractmethod
    def once(self, medium: Medium, ti: Direction, to: Direction) -> Any:
        """f of a medium by itself."""

    def scattered(self, wi: Direction, wo: Direction) -> dict[int, Any]:
        """f of each medium, by the number of the layer from the viewer on."""
        f_of_layer = {}
        ways = zip(self._seen(), self.to_light(wi), self.passage(wo), strict=False)
        for number, (layer, (lit, ti, _), (seen, to, n)) in enumerate(ways):
            if isinstance(layer, Medium):
                once = self.once(layer, ti, to)
                f_of_layer[number] = lit * seen / (n * n) * once
        return f_of_layer

    def formula(self, wi: Direction, wo: Direction) -> Any:
        total: Any = 0.0
        for f in self.scattered(wi, wo).values():
            total = total + f
        return total

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        into, out, total = self.arriving(wi), self.crossed(wo), Mueller.depolarizer(0.0 * wi.z)
        for number, f in self.scattered(wi, wo).items():
            total = total + polarized.scattered(into[number], out[number], f)
        return total

    def estimate(self, wo: Direction) -> Any:
        shares = [
            seen * layer.albedo
            for layer, (seen, _, _) in zip(self._seen(), self.passage(wo), strict=False)
            if isinstance(layer, Medium)
        ]
        return 0.25 * sum(shares[1:], shares[0])


class _Once(_ScatteredOnce):
    """Light that is scattered once and leaves where it came from: Hanrahan & Krueger's first order."""

    def once(self, medium: Medium, ti: Direction, to: Direction) -> Any:
        return scattered_once(medium.depth, medium.albedo, medium.g, ti, to)


class _Across(_Passing):
    """A lobe of light from the other side."""

    @property
    def sides(self) -> str:
        return "across"

    def turned(self, back: Any) -> Reflectance:
        other = self._as(type(self), behind=not self.behind)
        return weighed([(choose(back, 0.0, 1.0), self), (choose(back, 1.0, 0.0), other)])

    def _fixed_behind(self, incident: bool) -> bool:
        return self.behind != incident

    def to_light(self, wi: Direction) -> list[tuple[Any, Direction, Any]]:
        """The same as `passage` for light from the other side: the direction in each layer, towards the light, and the
        share that gets there; in the order of layers from that side on, indices over that there."""
        passage = self.other().passage(upward(wi))
        return [(passed, Direction(w.x, w.y, -w.z), n) for passed, w, n in passage]

    def arriving(self, wi: Direction) -> list[Mueller]:
        return self.other().crossed(upward(wi))

    def other(self) -> _Lobe:
        """A lobe of the stack seen from the other side."""
        return self._as(_Mirrors, behind=not self.behind)


class _Straight(_Across, _Mirrors):
    """The delta lobe across: light that is refracted by smooth interfaces, and not scattered."""

    def mirror(self, wo: Direction) -> Any:
        index = self.index
        return self.mirrored_and_passed(wo)[1] / (index * index)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        return scaled_to(self.polarized_mirrored_and_passed(wo)[1], self.mirror(wo))

    def mirrored(self, wo: Direction) -> Direction:
        return refracted(wo, NORMAL, self.index)


class _PassedOnce(_Across, _ScatteredOnce):
    """Light that is scattered once on its way through smooth interfaces and media."""

    def once(self, medium: Medium, ti: Direction, to: Direction) -> Any:
        return passed_once(medium.depth, medium.albedo, medium.g, ti, to)

    def to_light(self, wi: Direction) -> list[tuple[Any, Direction, Any]]:
        return super().to_light(wi)[-2::-1]  # from the viewer on, without what lies behind all

    def arriving(self, wi: Direction) -> list[Mueller]:
        return super().arriving(wi)[-2::-1]


class _Refracted(_Across, _AtOnce):
    """Light that one rough interface refracts, on its straight way through smooth interfaces and media."""

    @property
    def lobe(self) -> Reflectance:
        layer = self.rough()
        _, (_, lobe) = facets(ground(layer), layer.eta)
        return lobe

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        to, n = self.passage(wo)[-1][1], self.to_light(BEHIND)[-1][2]
        ti = self.lobe.warp(to, u0, u1)
        leaves, wi = outside(ti, n)
        return select(leaves & (ti.z < 0.0), Direction(wi.x, wi.y, -wi.z), NORMAL)

    def density(self, wi: Direction, wo: Direction) -> Any:
        (lit, ti, n), (_, to, _) = self.to_light(wi)[-1], self.passage(wo)[-1]
        return ops.where(lit > 0.0, self.lobe.density(ti, to) * wi.z / (n * n * ti.z), 0.0)

    def estimate(self, wo: Direction) -> Any:
        seen, to, n = self.passage(wo)[-1]
        return seen * self.lobe.estimate(to) / (n * n)
