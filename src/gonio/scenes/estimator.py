"""The light that pixels receive, from the ray to the sum over samples as one formula: compiled as one kernel.

A sample is a point of the pixel, a direction drawn by the material and one drawn by each light, combined by the balance
heuristic (Veach & Guibas 1995). Delta lobes and delta lights are exact. Bodies shadow each other and themselves, but
for a convex one that is alone; nothing is lit by what another body reflects.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

from ..arrays import ops
from ..arrays.kinds import COUNT, SCALAR, TOTAL
from ..base import kernels
from ..base.frames import Frame
from ..base.light import FAR, Light
from ..base.reflectance import Reflectance
from ..base.sides import is_lit
from ..base.sums import weighed
from ..base.textured import placed
from ..evaluate.computation import Computation
from ..formula.direction import NORMAL, Direction, cross, dot, select
from ._bodies import Solid
from .camera import MARGIN as MARGIN
from .hit import Hit
from .points import DIMENSIONS, shifted

NEAR = 1e-5
"""How far from a surface the rays that leave it start, over the size of the scene."""

_OF_LIGHT = ("light", "light of channel 1", "light of channel 2")


@cache
def direct(colours: int = 1, each: bool = False, one_of_several: bool = False, backdrop: bool = False) -> Computation:
    """Sums over points of pixels: "light" (radiance, 0 where rays miss), "seen" (how many points count) and "holes"
    (directions without data, which count as black).

    A pixel is its column, its row and the six numbers by which its points are shifted. The scene has `material` (with
    `maps`, where it has textures), `lights`, `bodies`, `camera`, and `scale` and `margin`, by which a place in the
    picture becomes one of the camera's. `colours`: the channels of the lights, where these are not the material's; then
    each of `lights` is one of as many lights, and there are as many results "light". `each`: whether what is seen is
    counted for each channel, for then all results are sums of one kind. `one_of_several`: only the body parts of number
    `part` count. `backdrop`: where rays miss, the lights are seen.
    """

    def sums(scene: Any, mean: Any, pixel: Any, point: Any) -> tuple[Any, ...]:
        u = [shifted(a, b) for a, b in zip(point, pixel[2:], strict=True)]
        o, d = ray(scene, pixel[0] + u[0], pixel[1] + u[1])
        at, part = first(scene.bodies.parts, o, d)
        counts = at.met & (ops.absolute(part - scene.part) < 0.5) if one_of_several else at.met
        local = Frame(at.tangent, cross(at.normal, at.tangent), at.normal)
        wo = local.local(-d)
        lights = [_channels(light) if colours > 1 else (light,) for light in scene.lights.parts]
        merged = [light[0] for light in lights] if colours > 1 else mean.lights.parts
        m, m_mean = placed(scene, at.u, at.v), placed(mean, at.u, at.v, merged=True)
        several, holes = _reflected(m, m_mean, lights, merged, _Shown(scene, at, counts), local, wo, u[2:])
        none = 0.0 * u[0]
        several = [ops.where(counts, light + none, 0.0) for light in several]
        seen = ops.where(counts, 1.0 + none, 0.0)
        if backdrop:
            seen = ops.where(at.met, seen, 1.0)
            beyond = [light for light in lights if not light[0].is_delta]
            for i in range(colours):
                for light in beyond:
                    several[i] = several[i] + ops.where(at.met, 0.0, light[i].seen(o, d)[0])
        return *several, ops.where(counts, holes + none, 0.0), seen

    results = dict.fromkeys((*_OF_LIGHT[:colours], "holes"), TOTAL) | {"seen": TOTAL if each else COUNT}
    return Computation(sums, {"pixel": 2 + DIMENSIONS, "point": DIMENSIONS}, results)


def _channels(light: Any) -> tuple[Light, ...]:
    """The channels of a light, of which what they share is computed once."""
    first, *others = light.parts
    return (first, *(other.sharing(first) for other in others))


@cache
def shares(parts: int) -> Computation:
    """How many points of pixels meet each of some parts of bodies."""

    def sums(scene: Any, mean: Any, pixel: Any, point: Any) -> tuple[Any, ...]:
        x, y = (pixel[i] + shifted(point[i], pixel[2 + i]) for i in (0, 1))
        at, part = first(scene.bodies.parts, *ray(scene, x, y))
        return tuple(ops.where(at.met & (ops.absolute(part - k) < 0.5), 1.0 + 0.0 * x, 0.0) for k in range(parts))

    return Computation(sums, {"pixel": 2 + DIMENSIONS, "point": DIMENSIONS}, {f"{k}": COUNT for k in range(parts)})


def _fronts(scene: Any, mean: Any, place: Any) -> tuple[Any, ...]:
    """Whether rays through places in the picture meet anything, and its front."""
    o, d = ray(scene, *place)
    at, _ = first(scene.bodies.parts, o, d)
    none = 0.0 * place[0]
    return ops.where(at.met, 1.0 + none, 0.0), ops.where(at.met & (dot(d, at.face) < 0.0), 1.0 + none, 0.0)


FRONTS = Computation(_fronts, {"place": 2}, {"met": SCALAR, "front": SCALAR})


def ray(scene: Any, x: Any, y: Any) -> tuple[Direction, Direction]:
    """The ray through a place in the picture, in pixels from its upper left corner."""
    rays: tuple[Direction, Direction] = scene.camera.ray(x * scene.scale - scene.margin, scene.margin - y * scene.scale)
    return rays


def first(bodies: Sequence[Any], o: Direction, d: Direction) -> tuple[Hit, Any]:
    """What rays meet first of some bodies, and the number of its material."""
    nearest, part = bodies[0].first(o, d)
    for body in bodies[1:]:
        at, other = body.first(o, d)
        nearer = at.met & (ops.where(nearest.met, nearest.distance, FAR) > at.distance)
        chosen = (
            select(nearer, a, b) if isinstance(a, Direction) else ops.where(nearer, a, b)
            for a, b in zip(at[1:], nearest[1:], strict=True)
        )
        nearest = Hit(nearest.met | at.met, *chosen)
        part = ops.where(nearer, other + 0.0 * d.x, part)
    return nearest, part


class _Shown(NamedTuple):
    """Points that are seen, among bodies."""

    scene: Any
    at: Hit
    counts: Any

    def open(self, m: Reflectance, w: Direction, distance: Any, asked: Any) -> Any:
        """Whether nothing stands between points and what is so far away in direction w, where that is `asked`; None
        where nothing can."""
        bodies = self.scene.bodies.parts
        if len(bodies) == 1 and isinstance(bodies[0], Solid):
            return None
        side = dot(w, self.at.face)
        asked = asked & self.counts & is_lit(m, side)
        reach = NEAR * self.scene.size + 1e-6 * self.at.distance
        p = self.at.point + self.at.face * ops.where(side < 0.0, -reach, reach)
        far = ops.where(asked, distance * (1.0 - 1e-4), -1.0)
        free = asked
        for body in bodies:
            free = free & ~body.blocks(p, w, far)
        return free


def _if(free: Any, share: Any) -> Any:
    return share if free is None else ops.where(free, share, 0.0)


def _reflected(
    m: Reflectance,
    mean: Reflectance,
    lights: list[tuple[Light, ...]],
    merged: list[Light],
    shown: _Shown,
    local: Frame,
    wo: Direction,
    u: list[Any],
) -> tuple[list[Any], Any]:
    """Radiance towards local wo, one for each of the channels of lights, and the number of directions without data."""
    totals, holes, p = [0.0 * wo.z for _ in lights[0]], 0.0 * wo.z, shown.at.point
    extended = [i for i, light in enumerate(merged) if not light.is_delta]
    for i, light in enumerate(merged):
        if light.is_delta:
            towards, _, distance = lights[i][0].beam(p)
            wi = local.local(towards)
            f, hole = _known(kernels.value(m, mean, wi, wo)[0])
            cos = ops.absolute(wi.z)
            holes = holes + hole
            f = _if(shown.open(m, towards, distance, is_lit(m, wi.z)), f)
            totals = [total + f * cos * x.beam(p)[1] for total, x in zip(totals, lights[i], strict=True)]
    if not extended:
        return totals, holes
    for share, w in _mirrored(m, wo):
        share, hole = _known(share)
        holes = holes + hole
        for i in extended:
            towards = local.world(w)
            free = shown.open(m, towards, merged[i].seen(p, towards)[1], wo.z > -2.0)
            totals = [
                total + _if(free, share) * x.seen(p, towards)[0] for total, x in zip(totals, lights[i], strict=True)
            ]
    m, mean = _spread(m), _spread(mean)
    if not any(True for _ in m.lobes()):
        return totals, holes
    # What sampling decides is a constant for derivatives, which then are samples of the integrand's derivatives.
    w, _, pdf, _ = kernels.sample(m, mean, wo, (u[0], u[1]))
    w, pdf = _constant(w), ops.stop_gradient(pdf)
    f, hole = _known(kernels.value(m, mean, w, wo)[0])
    holes = holes + hole
    f = ops.where(pdf > 0.0, f * ops.absolute(w.z), 0.0)
    towards = local.world(w)
    for i in extended:
        by_light = merged[i].can_sample or merged[i].has_horizon
        both = pdf
        if by_light:
            both = pdf + ops.stop_gradient(merged[i].density(p, towards))
        free = shown.open(m, towards, merged[i].seen(p, towards)[1], (pdf > 0.0) & is_lit(m, w.z))
        share = _if(free, f / ops.where(both > 0.0, both, 1.0))
        totals = [total + share * x.seen(p, towards)[0] for total, x in zip(totals, lights[i], strict=True)]
        if by_light:
            drawn, density = merged[i].drawn(p, u[2], u[3])
            drawn, density = _constant(drawn), ops.stop_gradient(density)
            wi = local.local(drawn)
            g, hole = _known(kernels.value(m, mean, wi, wo)[0])
            holes = holes + hole
            both = density + ops.stop_gradient(kernels.pdf(m, mean, wi, wo)[0])
            free = shown.open(m, drawn, merged[i].seen(p, drawn)[1], (density > 0.0) & is_lit(m, wi.z))
            share = ops.where(density > 0.0, g * ops.absolute(wi.z) / ops.where(both > 0.0, both, 1.0), 0.0)
            share = _if(free, share)
            totals = [total + share * x.seen(p, drawn)[0] for total, x in zip(totals, lights[i], strict=True)]
    return totals, holes


def _constant(w: Direction) -> Direction:
    return Direction(*map(ops.stop_gradient, w))


def _known(f: Any) -> tuple[Any, Any]:
    """f with 0 where there is none, and 1 there."""
    finite = f <= float("inf")
    return ops.where(finite, f, 0.0), ops.where(finite, 0.0, 1.0)


def _spread(m: Reflectance) -> Reflectance:
    """The lobes that are no delta lobes."""
    return weighed((weight, lobe) for weight, lobe in m.lobes() if not lobe.is_delta) if m.has_delta else m


def _mirrored(m: Reflectance, wo: Direction) -> list[tuple[Any, Direction]]:
    """The delta lobes: the share of the light that each sends to wo, and where that comes from."""
    behind, hidden, above, seen = kernels.from_viewer(wo, m)
    up = select(hidden, NORMAL, above)
    return [
        (ops.where(hidden, 0.0, weight * lobe.mirror(up)), kernels.turned_over(behind, lobe.mirrored(up)))
        for weight, lobe in seen.lobes()
        if lobe.is_delta
    ]
