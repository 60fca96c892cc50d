"""Integrals under lights with extent, and albedo, for arrays of PyTorch and JAX: differentiable in all numbers.

What sampling decides is a constant for derivatives, so that these are the integrals of the integrand's derivatives;
directions that belong to the surface of a light near by move with it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import with_channels
from ..base.frames import Frame
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..base.sums import drawn_apart
from ..lights.constant import ConstantLight
from ..numerics.lattice import lattice
from .places import SeenPoints

_EVERYWHERE = ConstantLight(1.0)


def reflected(m: Reflectance, light: Light, local: Frame, wo: Any, position: Any, samples: int) -> Any:
    """Radiance (..., C) that a light with extent causes towards local wo (..., 3) at world positions (..., 3).

    Light from everywhere: the sum of a point of the light and one of the material, by the balance heuristic. A light
    at a place: points of the light alone, for where it begins and ends nothing can be differentiated. Delta lobes see
    the light in their own direction.
    """
    lib = ops.library(wo)
    u = lib.vectors(lattice(samples), wo)
    wo, position = wo[..., None, :], position[..., None, :]
    local = Frame(*(type(axis)(*(_wide(lib, c) for c in axis)) for axis in local))
    at = SeenPoints(local, wo, position, u, u)
    drawn_from = light if light.can_sample else _EVERYWHERE
    towards, light_pdf = drawn_from.sample(u, position)
    if light.has_edges:
        total = _mean(_lit(m, light, at, towards, 1.0 / light_pdf))
        return total + _mean(_of_deltas(m, light, at)) if m.has_delta else total
    towards, light_pdf = ops.stop_gradient(towards), ops.stop_gradient(light_pdf)
    w = ops.stop_gradient(local.to_local(lib, towards))
    both = light_pdf + ops.stop_gradient(m.pdf(w, wo))
    total = _mean(_lit(m, light, at, towards, 1.0 / both))
    s = m.sample(wo, u)
    w = ops.stop_gradient(s.wi)
    pdf = ops.stop_gradient(m.pdf(w, wo))
    usable = (pdf > 0.0) & ~s.delta
    towards = local.to_world(lib, w)
    both = pdf + ops.stop_gradient(drawn_from.pdf(towards, position))
    part = _lit(m, light, at, towards, ops.where(usable, 1.0 / ops.where(usable, both, 1.0), 0.0))
    total = total + _mean(part)
    return total + _mean(_of_deltas(m, light, at)) if m.has_delta else total


def _of_deltas(m: Reflectance, light: Light, at: SeenPoints) -> Any:
    """Radiance (..., n, C) by delta lobes: exact, n = 1, of those that are drawn apart; else by samples."""
    lib = ops.library(at.wo)
    total: Any = 0.0
    for weight, part in drawn_apart(m):
        if part.has_delta:
            seen = _of_delta(part, light, at) if part.is_delta else _of_some_deltas(part, light, at)
            total = total + seen * (weight if isinstance(weight, float) else lib.convert(weight, at.wo))
    return total


def _of_delta(lobe: Reflectance, light: Light, at: SeenPoints) -> Any:
    s = lobe.sample(at.wo, ops.library(at.wo).vectors(np.zeros(2), at.wo))
    return _arriving(with_channels(s.weight, s.wi.ndim - 1), s.wi, light, at)


def _of_some_deltas(m: Reflectance, light: Light, at: SeenPoints) -> Any:
    s, wo = m.sample(at.wo, at.u), at.wo
    drawn = with_channels(s.weight, s.wi.ndim - 1)
    through = (s.wi[..., 2:3] * wo[..., 2:3]) < 0.0
    across = (with_channels(m.delta_reflectance(wo, x), wo.ndim - 1) for x in (True, False))
    seen = ops.where(through, *across)
    has_density = s.delta[..., None] & (seen > 0.0)
    # One over the probability.
    times = ops.stop_gradient(ops.where(has_density, drawn / ops.where(has_density, seen, 1.0), 0.0))
    return _arriving(seen * times, s.wi, light, at)


def _arriving(share: Any, wi: Any, light: Light, at: SeenPoints) -> Any:
    """The share of the light that arrives from local directions."""
    return share * light.incident(at.local.to_world(ops.library(wi), wi), at.position)


def _wide(lib: Any, c: Any) -> Any:
    """A component (...) of axes, beside samples (..., n)."""
    return c[..., None] if getattr(c, "ndim", 0) else c


def _mean(values: Any) -> Any:
    """Over the samples, of values (..., n, C)."""
    return values.mean(-2)


def _lit(m: Reflectance, light: Light, at: SeenPoints, towards: Any, weight: Any) -> Any:
    """Radiance by light from world directions, times a weight."""
    local, wo, position, *_ = at
    lib = ops.library(wo)
    w = local.to_local(lib, towards)
    cos = ops.absolute(w[..., 2:3])
    w, wo = lib.broadcast(w, wo)
    f = with_channels(m.f(w, wo), w.ndim - 1)
    return f * light.incident(towards, position) * (cos * weight[..., None])


def albedo(m: Reflectance, wi: Any, samples: int) -> Any:
    """Albedo (...[, C]) for light from wi (..., 3), by samples of the material."""
    lib = ops.library(wi)
    u, w = lib.vectors(lattice(samples), wi), wi[..., None, :]
    s = m.sample(w, u)
    wo = ops.stop_gradient(s.wi)
    pdf = ops.stop_gradient(m.pdf(wo, w))
    wo, w = lib.broadcast(wo, w)
    usable = (pdf > 0.0) & ~s.delta & (wo[..., 2] * w[..., 2] > 0.0)
    weight = ops.where(usable, ops.absolute(wo[..., 2]) / ops.where(usable, pdf, 1.0), 0.0)
    f = m.f(wo, w)
    channels = f.ndim > w.ndim - 1
    total = (f * (weight[..., None] if channels else weight)).mean(-2 if channels else -1)
    deltas = [(k, lobe) for k, lobe in m.lobes() if lobe.is_delta]
    return total + m.delta_reflectance(wi) if deltas else total


DEFAULT = 4096
"""Samples of albedos."""
