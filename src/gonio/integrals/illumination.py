"""The reflection equation: radiance leaving a surface point under any mix of lights.

L_o(wo) = integral of L_i(wi) f(wi, wo) cos+(theta_i) dwi, exact for delta lights and for delta lobes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ..arrays import LIBRARIES, ops
from ..arrays.kinds import with_channels
from ..base.kernels import with_holes
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..compile import memory
from ..errors import ArrayTypeError, MissingDataWarning, ParameterError, warn
from ..evaluate import batch
from ..formula.direction import Direction, cross, dot, frame, normalize, select
from ..numerics.lattice import lattice
from ..pictures.colour import transformed
from .over_directions import integrate


class Frame(NamedTuple):
    """Local axes of surface points in the world: d_x, d_y and the normal."""

    t: Direction
    b: Direction
    n: Direction


def reflected_radiance(
    m: Reflectance,
    lights: Light | Iterable[Light],
    wo: Any,
    normal: Any = (0.0, 0.0, 1.0),
    tangent: Any = None,
    position: Any = (0.0, 0.0, 0.0),
    samples: int = 4096,
    tolerance: float = 1e-4,
) -> Any:
    """Radiance leaving towards wo under the given lights, without occlusion.

    L_o = sum over point sources of E f cos+ + integral of L_i f cos+ over the hemisphere for the other lights.

    Shapes   wo, normal, tangent, position: (..., 3) in the world frame, broadcast; result (..., C), or (...) where
             neither the lights nor the reflectance have a channel axis. NumPy, PyTorch or JAX arrays. `tangent` is
             d_x (its part along the normal is removed); without it d_x is the world's x axis turned with the normal.
    Units    W m-2 sr-1; position: m.
    Error    Delta lights and delta lobes: rounding. Lights that cannot be sampled (constant, functions): `tolerance`
             times the light's scale, see `albedo`. Environment maps: multiple importance sampling with `samples`
             points per lobe and for the light: up to 6e-3 relative at 4096, 1e-3 at 16384. A delta light in a
             delta lobe contributes 0, by definition.
    Source   Szeliski 2.83 to 2.85; lecture 4, eq. 4.10 and 4.11 (docs/equations.md). Balance heuristic: Veach &
             Guibas 1995.

    Example
    >>> sun = gn.DistantLight(gn.direction(0.5, 0.0), irradiance=800.0)
    >>> sky = gn.ConstantLight(60.0)
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), [sun, sky], up, normal=up).round(2))
    141.74
    """
    lights = as_lights(lights)
    lib, wo, (normal, tangent, position), shape = _world_arrays(wo, normal, tangent, position)
    shape = batch.full_shape(m, shape)
    if lib.name == "numpy":
        memory.check((*shape, 3), wo.dtype, "an array of directions")
        _check_frame(normal, tangent)
    wo = lib.module.broadcast_to(wo, (*shape, 3))
    local = surface_frame(lib, normal, tangent)
    local_wo = to_local(lib, local, wo)
    fields = [light for light in lights if not light.is_delta]
    parts = [delta_radiance(m, light, local, local_wo, position) for light in lights if light.is_delta]
    if fields and lib.name != "numpy":
        raise ArrayTypeError(
            f"{type(fields[0]).__name__} under {lib.name} directions: lights with extent are integrated on NumPy arrays"
            f" only; expected NumPy, or delta lights"
        )
    for light in fields:
        if light.can_sample:
            parts.append(_sampled(m, light, local, local_wo, samples))
        else:
            parts.append(_smooth(m, light, local, local_wo, tolerance))
    total = sum(parts[1:], parts[0])
    if fields:
        total = with_holes(total, m)  # integrals count NaN as 0
    channels = m.channels is not None or have_channels(lights) or total.shape[-1] > 1
    return total if channels else total[..., 0][()]


def have_channels(lights: list[Light]) -> bool:
    """Whether a number of any of the lights has a channel axis."""
    return any(getattr(v, "ndim", 0) for light in lights for v in light.leaves())


def as_lights(lights: Any) -> list[Light]:
    """A light or a list of lights, as a list. Raises ParameterError for anything else, and for none."""
    listed = [lights] if isinstance(lights, Light) or not isinstance(lights, Iterable) else list(lights)
    if not listed or not all(isinstance(x, Light) for x in listed):
        raise ParameterError(
            f"lights={lights!r:.80}: expected a light or a non-empty list of lights, such as ConstantLight(1.0)"
        )
    return listed


def _world_arrays(wo: Any, *others: Any) -> tuple[ops.Library, Any, list[Any], tuple[int, ...]]:
    """The library of wo, wo and the others as its arrays, and the shape of the batch."""
    lib, (wo,) = ops.as_arrays(wo)
    if lib.channel_loop:
        raise ArrayTypeError(f"reflected_radiance takes NumPy, PyTorch or JAX arrays; got {lib.name}")
    arrays = []
    for x in others:
        if x is not None:
            library = ops.library_of_type(type(x))
            if library not in (None, lib, LIBRARIES["numpy"]):
                ops.library(x, wo)
            try:
                x = lib.convert(ops.numbers(x) if library in (None, LIBRARIES["numpy"]) else x, wo)
            except ValueError as error:
                raise ArrayTypeError(f"normal, tangent or position: {error}; expected vectors (..., 3)") from None
        arrays.append(x)
    shapes = [tuple(x.shape) for x in (wo, *arrays) if x is not None]
    return lib, wo, arrays, ops.broadcast_shape(shapes, "wo, normal, tangent, position")[:-1]


def _check_frame(normal: np.ndarray, tangent: np.ndarray | None) -> None:
    length = np.linalg.norm(normal, axis=-1)
    if (length == 0.0).any():
        raise ParameterError("normal: a vector of length 0 is no direction; expected the surface normal")
    if tangent is not None:
        across = np.linalg.norm(np.cross(normal, tangent), axis=-1)
        if (across <= 1e-6 * length * np.linalg.norm(tangent, axis=-1)).any():
            raise ParameterError("tangent: parallel to the normal, or 0; expected d_x, a direction along the surface")


def surface_frame(lib: ops.Library, normal: Any, tangent: Any) -> Frame:
    """Local axes for world normals (..., 3), and tangents if given."""
    n = normalize(Direction(*lib.split(normal, (), False)))
    if tangent is None:
        up = n.z >= 0.0
        t, _ = frame(select(up, n, Direction(n.x, n.y, -n.z)))
        t = select(up, t, Direction(t.x, t.y, -t.z))
        return Frame(t, cross(n, t), n)
    t = Direction(*lib.split(tangent, (), False))
    t = normalize(t - n * dot(t, n))
    return Frame(t, cross(n, t), n)


def to_local(lib: ops.Library, local: Frame, w: Any) -> Any:
    """World vectors (..., 3) in the local frame."""
    d = Direction(*lib.split(w, (), False))
    return lib.stack([dot(d, local.t), dot(d, local.b), dot(d, local.n)])


def to_world(lib: ops.Library, local: Frame, w: Any) -> Any:
    """Local vectors (..., 3) in the world frame."""
    d = Direction(*lib.split(w, (), False))
    return lib.stack(local.t * d.x + local.b * d.y + local.n * d.z)


def delta_radiance(
    m: Reflectance, light: Light, local: Frame, wo: Any, position: Any, colour: np.ndarray | None = None
) -> Any:
    """Radiance (..., C) that a delta light causes towards local wo (..., 3) at world positions: E f cos+(theta_i).

    `colour`, here and in `estimate`: a matrix (C, 3) that turns the reflectance's channels into others first.
    """
    lib = ops.library(wo)
    arrival = light.arrival(position)
    wi = to_local(lib, local, arrival.w)
    wi, wo = lib.broadcast(wi, wo)
    cos = ops.maximum(wi[..., 2:3], 0.0)
    f = with_channels(m.f(wi, wo), wi.ndim - 1)
    return (f if colour is None else transformed(f, colour)) * arrival.irradiance * cos


def _smooth(m: Reflectance, light: Light, local: Frame, wo: np.ndarray, tolerance: float) -> np.ndarray:
    lib = ops.library(wo)
    axes = [[np.broadcast_to(c, wo.shape[:-1]).reshape(-1, 1) for c in axis] for axis in local]

    def radiance(w: np.ndarray, index: np.ndarray) -> np.ndarray:
        here = Frame(*(Direction(*(c[index] for c in axis)) for axis in axes))
        return light.incident(to_world(lib, here, w))

    return integrate(m, wo, tolerance, incident=False, radiance=radiance)


def _sampled(m: Reflectance, light: Light, local: Frame, wo: np.ndarray, samples: int) -> np.ndarray:
    shape = wo.shape[:-1]
    points = lattice(samples).astype(wo.dtype).reshape(samples, *(1 for _ in shape), 2)
    step = max(1, (1 << 19) // max(1, int(np.prod(shape, dtype=int))))
    total: Any = 0.0
    missing = 0
    for start in range(0, samples, step):
        u = points[start : start + step]
        u = np.broadcast_to(u, (len(u), *shape, 2))
        part, holes = estimate(m, light, local, wo, u, u)
        part = np.broadcast_to(part, (*u.shape[:-1], part.shape[-1]))  # that of a delta lobe has no axis of samples
        total, missing = total + part.sum(axis=0), missing + holes
    if missing:
        text = f"{missing} samples met directions without measured data, which count as 0"
        warn(text, MissingDataWarning)
    return total / samples


def estimate(
    m: Reflectance,
    light: Light,
    local: Frame,
    wo: np.ndarray,
    u: np.ndarray,
    v: np.ndarray,
    colour: np.ndarray | None = None,
) -> tuple[np.ndarray, int]:
    """One-sample estimates (..., C) of the radiance that a light with extent causes towards local wo (..., 3), and the
    number of samples in directions without measured data (they count as 0).

    Every lobe of the material is sampled with u (..., 2) and, where the light can be sampled, the light with v; the
    two are combined by the balance heuristic. Delta lobes are exact.
    """
    lib = ops.library(wo)
    total: Any = 0.0
    missing = 0
    if light.can_sample:
        w, light_pdf = light.sample(v)
        to_light = to_local(lib, local, w)
        incoming = light.incident(w) * np.maximum(to_light[..., 2:3], 0.0)
        seen = light_pdf[..., None] > 0.0
    for weight, lobe in m.lobes():

        def seen_values(values: np.ndarray, w: np.ndarray, weight: Any = weight) -> tuple[np.ndarray, int]:
            values, holes = without_holes(with_channels(values, w.ndim - 1))
            values = np.asarray(weight, wo.dtype) * values
            return (values if colour is None else transformed(values, colour)), holes

        if lobe.is_delta:
            mirrored = lobe.sample(wo, np.zeros(2, wo.dtype)).wi
            reflectance, _ = seen_values(lobe.delta_reflectance(wo), wo)
            total = total + reflectance * light.incident(to_world(lib, local, mirrored))
            continue
        s = lobe.sample(wo, u)
        w_material = to_world(lib, local, s.wi)
        material_weight, holes = seen_values(s.weight, s.wi)
        part = material_weight * light.incident(w_material)
        missing += holes
        if light.can_sample:
            other = light.pdf(w_material)
            part = part * (s.pdf / np.maximum(s.pdf + other, 1e-30))[..., None]
            both = (lobe.pdf(to_light, wo) + light_pdf)[..., None]
            f, holes = seen_values(lobe.f(to_light, wo), to_light)
            missing += holes
            part = part + np.where(seen, f * incoming / np.where(seen, both, 1.0), 0.0)
        total = total + part
    return total, missing


def without_holes(values: np.ndarray) -> tuple[np.ndarray, int]:
    """Values (..., C) with 0 where a measurement holds none, and the number of such places."""
    absent = np.isnan(values)
    if not absent.any():
        return values, 0
    return np.where(absent, 0.0, values).astype(values.dtype), int(absent.any(axis=-1).sum())
