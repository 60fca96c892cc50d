"""The reflection equation: radiance leaving a surface point under any mix of lights.

L_o(wo) = integral of L_i(wi) f(wi, wo) cos+(theta_i) dwi, exact for delta lights and for delta lobes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import with_channels
from ..base.angles import check_unit
from ..base.frames import Frame, vectors
from ..base.kernels import with_holes
from ..base.light import Light
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..base.sides import lit_sides
from ..base.sums import Sum, drawn_apart
from ..declared.arguments import checked
from ..errors import ArrayTypeError, MissingDataWarning, ParameterError, warn
from ..evaluate import batch
from ..formula.direction import Direction
from ..lights.constant import ConstantLight
from ..machine import memory
from ..models.lambertian import Lambertian
from ..numerics.lattice import lattice
from ..numerics.quadrature import Integrals
from ..pictures.colour import transformed
from .by_arrays import reflected
from .cones import Hemisphere
from .glows import channels_of, glows, widths
from .maps import Wanted, over_places
from .over_directions import Radiance
from .over_hemisphere import Integral, integrate, mean_radiance
from .places import Places, SeenPoints

SAMPLED = 6e-3
"""Error of a lobe at a place on a map, relative to the mean radiance of a light that is sampled 4096 times."""


@checked
def reflected_radiance(
    m: Reflectance,
    lights: Light | Iterable[Light],
    wo: Any,
    normal: Any = (0.0, 0.0, 1.0),
    tangent: Any = None,
    position: Any = (0.0, 0.0, 0.0),
    samples: int = 4096,
    tolerance: float = 1e-4,
    return_error: bool = False,
) -> Any:
    """Radiance leaving towards wo under the given lights, without occlusion.

    L_o = sum over point sources of E f cos+ + integral of L_i f cos+ over the hemisphere for the other lights; for a
    material that transmits |cos| over the sphere, and wo may be behind the surface. Of a material that fluoresces
    the light of other wavelengths is added, L_o = sum_i F[o, i] E_i: a light's number is then that of a band, of light
    without channels the same for all; of a `gn.Spectrum` it is the power per nanometre.

    Shapes   wo, normal, tangent, position: (..., 3) in the world frame, broadcast; result (..., C), or (...) where
             neither the lights nor the reflectance have a channel axis. NumPy, PyTorch or JAX arrays. `tangent` is
             d_x (its part along the normal is removed); without it d_x is the world's x axis turned with the normal.
    Units    W m-2 sr-1; position: m.
    Error    Delta lights and delta lobes: rounding. Lights that cannot be sampled (constant, functions): `tolerance`
             times the light's scale, see `albedo`. Environment maps: multiple importance sampling with `samples`
             points per lobe and for the light: up to 6e-3 relative at 4096, 1e-3 at 16384. A delta light in a
             delta lobe contributes 0, by definition. Lambertian lobes under lights whose irradiance has a closed form:
             rounding. PyTorch and JAX: `samples` points under all lights with extent. With `return_error` an
             `Integral`, with the standard error (...), that of the channel with most: of lights that are sampled by the
             spread of eight lattices of samples/8 points, each shifted at random; `tolerance` where that rules.
    Source   Szeliski 2.83 to 2.85; lecture 4, eq. 4.10 and 4.11 (docs/equations.md). Balance heuristic: Veach &
             Guibas 1995.

    Example
    >>> sun = gn.DistantLight(gn.direction(0.5, 0.0), irradiance=800.0)
    >>> sky = gn.ConstantLight(60.0)
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), [sun, sky], up, normal=up).round(2))
    141.74
    """
    sources = as_lights(lights)
    lights = at_wavelengths(sources, m)
    wo = _joined(wo, lights)
    lib, (wo, normal, tangent, position) = vectors(wo=wo, normal=normal, tangent=tangent, position=position)
    if lib.channel_loop:
        raise ArrayTypeError(f"reflected_radiance takes NumPy, PyTorch or JAX arrays; got {lib.name}")
    shapes = [tuple(x.shape) for x in (wo, normal, tangent, position) if x is not None]
    shape = ops.broadcast_shape(shapes, "wo, normal, tangent, position")[:-1]
    if lib.name == "numpy":
        memory.check((*batch.full_shape(m, shape), 3), wo.dtype, "an array of directions")
    if (numbers := lib.known(wo)) is not None:
        check_unit("wo", numbers)
    wo = lib.module.broadcast_to(wo, (*shape, 3))
    local = Frame.of_arrays(lib, normal, tangent)
    local_wo = local.to_local(lib, wo)
    for light in lights:
        light.check_position(position)
        if exchanges(m) or not light.is_delta:
            check_channels(m.channels or 1, light, channels_of(light))
    glowing = glows(m, lights, widths(m) if exchanges(m) and any(map(has_spectra, sources)) else None)
    lit = [(m, light) for light in lights] + [(glow, light) for glow, several in glowing for light in several]
    parts = [delta_radiance(x, light, local, local_wo, position) for x, light in lit if light.is_delta]
    fields = [(x, light) for x, light in lit if not light.is_delta]
    variance: Any = np.zeros(shape)
    for whole, light in fields:
        lambertian, rest = _divided(whole)
        E = light.irradiance_at(position, lib.stack(local.n)) if lambertian else None
        if E is None:
            rest = whole
        else:
            parts += [_of_lambertian(weight, lobe, local_wo) * E for weight, lobe in lambertian]
        if rest is None:
            continue
        if lib.name != "numpy":
            if return_error:
                raise ArrayTypeError(f"reflected_radiance(return_error=True) takes NumPy arrays; got {lib.name}")
            parts.append(reflected(rest, light, local, local_wo, position, samples))
        elif light.can_sample:
            several = [_sampled(rest, light, local, local_wo, position, u) for u in _points(samples, return_error)]
            parts.append(np.mean(several, axis=0))
            if return_error:
                variance = variance + np.var(several, axis=0, ddof=1).max(axis=-1) / len(several)
        else:
            parts.append(_smooth(rest, light, local, local_wo, position, tolerance))
            bound = tolerance * mean_radiance(
                _from(light, _each(local, local_wo), _places(position, local_wo)), wo.size // 3
            )
            variance = variance + np.square(bound.reshape(shape))
    total = sum(parts[1:], parts[0])
    if fields:
        total = with_holes(total, m)  # integrals count NaN as 0
    channels = m.channels is not None or have_channels(lights) or total.shape[-1] > 1
    total = total if channels else total[..., 0][()]
    return Integral(total, np.sqrt(variance)[()]) if return_error else total


_UP = np.array([[0.0, 0.0, 1.0]])


def _divided(m: Reflectance) -> tuple[list[tuple[Any, Reflectance]], Reflectance | None]:
    """The Lambertian lobes of a material with their weights, and the others together; None where there are none."""
    if map_shape(m):  # places of maps share integrals
        return [], m
    lobes = list(drawn_apart(m))
    others = [weight * lobe for weight, lobe in lobes if not isinstance(lobe, Lambertian)]
    if len(others) == len(lobes):
        return [], m
    rest = Sum(*others) if len(others) > 1 else others[0] if others else None
    return [(weight, lobe) for weight, lobe in lobes if isinstance(lobe, Lambertian)], rest


def _of_lambertian(weight: Any, lobe: Reflectance, wo: Any) -> Any:
    """f (..., C) of a Lambertian lobe times its weight."""
    up = ops.library(wo).vectors(_UP[0], wo)
    return with_channels((weight * lobe).f(up, wo), wo.ndim - 1)


def _points(samples: int, return_error: bool) -> list[np.ndarray]:
    """One lattice, or eight that are shifted at random."""
    if not return_error:
        return [lattice(samples)]
    if samples < 8:
        raise ParameterError(f"reflected_radiance(samples={samples}, return_error=True): expected at least 8 samples")
    shifts = np.random.default_rng(0).random((8, 1, 2))
    return [(lattice(samples // 8) + shift) % 1.0 for shift in shifts]


def have_channels(lights: list[Light]) -> bool:
    """Whether a number of any of the lights has a channel axis."""
    return any(light.has_channels for light in lights)


def as_lights(lights: Any) -> list[Light]:
    """A light or a list of lights, as a list. Raises ParameterError for anything else, and for none."""
    listed = [lights] if isinstance(lights, Light) or not isinstance(lights, Iterable) else list(lights)
    if not listed or not all(isinstance(x, Light) for x in listed):
        raise ParameterError(
            f"lights={lights!r:.80}: expected a light or a non-empty list of lights, such as ConstantLight(1.0)"
        )
    return listed


def at_wavelengths(lights: list[Light], m: Reflectance) -> list[Light]:
    """The lights at the wavelengths of a material, where some of their numbers are spectra.

    Raises ParameterError for a material without wavelengths, and where a spectrum does not reach.
    """
    if not any(map(has_spectra, lights)):
        return lights
    if m.wavelengths is None:
        rule = "a light's number is a spectrum, and the material has no wavelengths"
        raise ParameterError(f"{rule}; write m.at(wavelengths), of linear RGB gn.spectra.upsampled(m).at(wavelengths)")
    return [light.at(m.wavelengths) if has_spectra(light) else light for light in lights]


def has_spectra(light: Light) -> bool:
    """Whether some number of a light is a spectrum."""
    return light.has_spectra


def _joined(wo: Any, lights: list[Light]) -> Any:
    """Directions of NumPy, or in lists, as arrays of the library that the lights' numbers are of."""
    like = next((x for light in lights if (x := light.like()) is not None), None)
    if like is None:
        return wo
    lib, (wo,) = ops.as_arrays(wo, name="wo")
    return ops.library(like).vectors(wo, like) if lib.name == "numpy" else wo


def check_channels(channels: int, light: Light, lit: int) -> None:
    """Raises ParameterError where a light of `lit` channels cannot light a material of so many."""
    if channels != lit and 1 not in (channels, lit):
        raise ParameterError(
            f"{type(light).__name__} has {lit} channels and the material has {channels}; expected as many, or a light "
            f"of one channel such as gn.ConstantLight(1.0)"
        )


def delta_radiance(
    m: Reflectance, light: Light, local: Frame, wo: Any, position: Any, colour: np.ndarray | None = None
) -> Any:
    """Radiance (..., C) that a delta light causes towards local wo (..., 3) at world positions: E f cos+(theta_i).

    `colour`, here and in `estimate`: a matrix (C, 3) that turns the reflectance's channels into others first.
    """
    lib = ops.library(wo)
    arrival = light.arrival(position)
    wi = local.to_local(lib, arrival.w)
    wi, wo = lib.broadcast(wi, wo)
    cos = ops.absolute(wi[..., 2:3])
    f = with_channels(m.f(wi, wo), wi.ndim - 1)
    f = f if colour is None else transformed(f, colour)
    check_channels(f.shape[-1], light, arrival.irradiance.shape[-1])
    return f * arrival.irradiance * cos


def _smooth(
    m: Reflectance, light: Light, local: Frame, wo: np.ndarray, position: np.ndarray, tolerance: float
) -> np.ndarray:
    sides = lit_sides(m)
    if isinstance(light, ConstantLight):
        deep = len(batch.full_shape(m, wo.shape[:-1]))
        seen = [with_channels(integrate(m, wo, tolerance, incident=False, sides=x).value, deep) for x in sides]
        lit: np.ndarray = sum(seen[1:], seen[0]) * light.incident(np.array([[0.0, 0.0, 1.0]], wo.dtype))[0]
        return lit
    radiance = _from(light, _each(local, wo), _places(position, wo))
    parts = [integrate(m, wo, tolerance, incident=False, radiance=radiance, sides=x).value for x in sides]
    total: np.ndarray = sum(parts[1:], parts[0])
    return total


def _each(local: Frame, wo: np.ndarray) -> list[list[np.ndarray]]:
    """The components of the axes of frames, for each of the flattened directions (n, 1)."""
    return [[np.broadcast_to(c, wo.shape[:-1]).reshape(-1, 1) for c in axis] for axis in local]


def _at(axes: list[list[np.ndarray]], index: np.ndarray) -> Frame:
    return Frame(*(Direction(*(c[index] for c in axis)) for axis in axes))


def _places(position: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """The position of each of the flattened directions (n, 1, 3)."""
    return np.broadcast_to(position, wo.shape).reshape(-1, 1, 3)


def _from(light: Light, axes: list[list[np.ndarray]], positions: np.ndarray) -> Radiance:
    def radiance(w: np.ndarray, index: np.ndarray) -> np.ndarray:
        there: np.ndarray = light.incident(
            _at(axes, index).to_world(ops.library(w), w), positions[index].astype(w.dtype)
        )
        return there

    return radiance


def _sampled(
    m: Reflectance, light: Light, local: Frame, wo: np.ndarray, position: np.ndarray, points: np.ndarray
) -> np.ndarray:
    shape, flat, axes, positions = wo.shape[:-1], wo.reshape(-1, 3), _each(local, wo), _places(position, wo)
    samples, points = len(points), points.astype(wo.dtype)
    missing = 0

    def direct(lobe: Reflectance, number: np.ndarray, places: Places, tolerance: float) -> Integrals:
        nonlocal missing
        there, here, towards = places.material(lobe), _at(axes, number), flat[number][:, None]
        at = positions[number]
        step, total = max(1, (1 << 19) // max(1, len(number))), np.zeros(())
        for start in range(0, samples, step):
            u = points[start : start + step]
            u = np.broadcast_to(u, (len(number), *u.shape))
            part, holes = estimate(there, light, SeenPoints(here, towards, at, u, u))
            part = np.broadcast_to(part, (*u.shape[:-1], part.shape[-1]))  # that of a delta lobe has no axis of samples
            total, missing = total + part.sum(axis=1), missing + holes
        return Integrals(total / samples, np.zeros(len(number)), np.zeros(len(number)))

    unit, goal = (
        mean_radiance(_from(light, axes, positions), len(flat)),
        SAMPLED * 4096 / samples * len(list(m.lobes())),
    )
    wanted = Wanted(shape, direct, Hemisphere(), flat.astype(float), goal, unit, coloured=True)
    value = over_places(m, wanted).value
    if missing:
        text = f"{missing} samples met directions without measured data, which count as 0"
        warn(text, MissingDataWarning)
    return value.reshape(*batch.full_shape(m, shape), -1).astype(wo.dtype)


def estimate(m: Reflectance, light: Light, at: SeenPoints, colour: np.ndarray | None = None) -> tuple[np.ndarray, int]:
    """One-sample estimates (..., C) of the radiance that a light with extent causes at points, and the number of
    samples in directions without measured data (they count as 0).

    Every lobe of the material is sampled with u and, where the light can be sampled, the light with v; the two are
    combined by the balance heuristic. Delta lobes are exact. A material that transmits is sampled as a whole.
    """
    local, wo, position, u, v = at
    lib = ops.library(wo)
    total: Any = 0.0
    missing = 0
    if light.can_sample:
        w, light_pdf = light.sample(v, position)
        to_light = local.to_local(lib, w)
        cos = to_light[..., 2:3]
        incoming = light.incident(w, position) * np.abs(cos)
        seen = light_pdf[..., None] > 0.0
    for weight, lobe in drawn_apart(m):

        def seen_values(values: np.ndarray, w: np.ndarray, weight: Any = weight) -> tuple[np.ndarray, int]:
            values, holes = without_holes(with_channels(values, w.ndim - 1))
            values = np.asarray(weight, wo.dtype) * values
            return (values if colour is None else transformed(values, colour)), holes

        if lobe.is_delta:
            s = lobe.sample(wo, np.zeros(2, wo.dtype))
            reflectance, _ = seen_values(s.weight, wo)
            total = total + reflectance * light.incident(local.to_world(lib, s.wi), position)
            continue
        s = lobe.sample(wo, u)
        w_material = local.to_world(lib, s.wi)
        material_weight, holes = seen_values(s.weight, s.wi)
        part = material_weight * light.incident(w_material, position)
        missing += holes
        if light.can_sample:
            other = light.pdf(w_material, position)
            share = s.pdf / np.maximum(s.pdf + other, 1e-30)
            part = part * np.where(s.delta, 1.0, share)[..., None]
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
