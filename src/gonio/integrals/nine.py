"""The nine reflectances of Nicodemus and their factors: a direction, a cone or the hemisphere on either side."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..evaluate import batch
from ..formula.direction import Direction
from ..numerics.lattice import lattice
from ..numerics.quadrature import NODES, Found, Sums, cubature, place, weighed
from .cones import MIRROR, Cone, Geometry, Hemisphere, Rings, overlap
from .illumination import Frame, as_lights, estimate
from .over_directions import (
    Integral,
    Place,
    Radiance,
    directions,
    in_double,
    of_places,
    over_directions,
    report,
    texels,
)

OUTER, INNER, DELTA = 0.7, 0.2, 0.1
"""What shares of the tolerance of a double integral the outer and the inner one may use, and that of delta lobes."""

FEW = 2
"""First cells along a side, of both: small things that one inner integral misses others find."""

SAMPLES = (1 << 13, 1 << 20)
"""How many samples lights that are sampled get for a direction at first and at most."""


def reflectance(
    m: Reflectance,
    incident: Any = Hemisphere(),  # noqa: B008  (a value without state)
    collected: Any = Hemisphere(),  # noqa: B008
    sky: Light | Iterable[Light] | None = None,
    tolerance: float = 1e-4,
    error: bool = False,
) -> Any:
    """Flux collected over flux that arrives, each in a direction, a cone or the hemisphere.

    rho = 1/Omega_i times the integral of f over Omega_i and Omega_o, the projected solid angles: light that comes
    equally from all of `incident`. With a `sky` of radiance L its light in `incident` is taken instead:
    rho = integral of L f over both, over integral of L over Omega_i.

        incident, collected         name (Nicodemus)                      Schaepman-Strub et al.
        direction, Cone             directional-conical reflectance       case 2
        direction, Hemisphere       directional-hemispherical, `albedo`   case 3, DHR, "black-sky albedo"
        Cone, Cone                  biconical                             case 5
        Cone, Hemisphere            conical-hemispherical                 case 6
        Hemisphere, Cone            hemispherical-conical                 case 8
        Hemisphere, Hemisphere      bihemispherical                       case 9, BHR, "white-sky albedo"

    What a single direction collects is infinitely little: the other three cases (1, 4, 7) are reflectance factors, see
    `reflectance_factor`.

    Shapes   directions: (..., 3) NumPy arrays; result (...[, C]), or with `error` an `Integral` of it and (...).
    Units    1.
    Error    at most `tolerance` times Omega_o/pi (relative where the reflectance factor is above 1), so that small
             cones keep their digits, or a ToleranceWarning. Delta lobes and environment maps: `reflectance_factor`.
    Source   Nicodemus et al. 1977, NBS Monograph 160; Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27.
    """
    to = _geometry("collected", collected)
    if not isinstance(to, (Cone, Hemisphere)):
        raise ParameterError(
            "reflectance(collected=...): got a direction, which collects infinitely little light; expected Cone or "
            "Hemisphere; reflectance_factor takes directions on both sides"
        )
    found = _factor(m, incident, to, sky, tolerance)
    share = to.projected / math.pi
    value = found.value * share
    return Integral(value, found.error * share) if error else value


def reflectance_factor(
    m: Reflectance,
    incident: Any = Hemisphere(),  # noqa: B008
    collected: Any = Hemisphere(),  # noqa: B008
    sky: Light | Iterable[Light] | None = None,
    tolerance: float = 1e-4,
    error: bool = False,
) -> Any:
    """Flux collected over what an ideal white Lambertian surface in its place would send there; all nine cases.

    R = pi/(Omega_i Omega_o) times the integral of f over Omega_i and Omega_o, the projected solid angles. Directions
    are the limits of narrow cones: from one to another R = pi f. With a `sky` of radiance L its light in `incident` is
    taken: R = pi/Omega_o times the integral of L f over both, over the integral of L over Omega_i.

        incident    collected: direction        Cone                       Hemisphere
        direction   bidirectional, BRF          directional-conical        directional-hemispherical
        Cone        conical-directional         biconical, CCRF            conical-hemispherical
        Hemisphere  hemispherical-directional,  hemispherical-conical,     bihemispherical
                    HDRF                        HCRF

    Row by row these are cases 1 to 9 of Schaepman-Strub et al. R of a white Lambertian surface is 1, of a mirror in
    small cones it exceeds 1 by far. For a whole hemisphere collected R is the reflectance.

    Shapes   directions: (..., 3) NumPy arrays that broadcast; result (...[, C]), or with `error` an `Integral` of it
             and (...).
    Units    1.
    Error    at most `tolerance`, absolute (relative where R is above 1), or a ToleranceWarning. Delta lobes are exact,
             but for the integral of their reflectance over a cone; from a direction to a direction they contribute 0,
             as in `f`. Environment maps are sampled, up to 2^20 times: the error returned is then twice the standard
             error of 16 parts.
    Source   Nicodemus et al. 1977, NBS Monograph 160; Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27.
    """
    found = _factor(m, incident, _geometry("collected", collected), sky, tolerance)
    return found if error else found.value


# What is common to all: the reflectance factor.


def _geometry(name: str, value: Any) -> Any:
    """A cone, the hemisphere, or directions (..., 3)."""
    if isinstance(value, (Cone, Hemisphere)):
        return value
    if isinstance(value, type) or callable(value):
        raise ParameterError(
            f"{name}={value!r:.60}: expected a direction (..., 3), Cone(axis, half_angle) or Hemisphere()"
        )
    return directions(value)


def _factor(m: Reflectance, incident: Any, to: Any, sky: Any, tolerance: float) -> Integral:
    of = _geometry("incident", incident)
    if not 0.0 < tolerance < 1.0:
        raise ParameterError(f"tolerance={tolerance!r}: expected a number between 0 and 1")
    if sky is not None and not isinstance(of, (Cone, Hemisphere)):
        raise ParameterError(
            "incident is a direction, without room for a sky; expected Hemisphere or Cone, or a DistantLight as sky"
        )
    own, other = (x if isinstance(x, np.ndarray) else None for x in (of, to))
    if own is not None and other is not None:
        value = math.pi * m.f(own, other)
        return Integral(value, np.zeros(np.shape(value)[: np.ndim(value) - (m.channels is not None)])[()])
    batch_of = own if own is not None else other if other is not None else np.zeros(3)
    shape = batch.full_shape(m, batch_of.shape[:-1])
    known = in_double(np.broadcast_to(batch_of, (*shape, 3)))
    here = Place(shape, np.arange(len(known)))
    if sky is not None:
        found, channels = _under(m, as_lights(sky), of, to if other is None else known, here, tolerance)
    else:
        channels = False
        if own is not None:
            found = _single(m, known, here, to, True, tolerance)
        elif other is not None:
            found = _single(m, known, here, of, False, tolerance)
        else:
            found = _double(m, of, to, here, tolerance)
    report(found, tolerance * np.maximum(1.0, np.abs(found.value).max(axis=-1, initial=0.0)), stacklevel=4)
    value = found.value.reshape(*shape, found.value.shape[-1]).astype(batch_of.dtype)
    channels = channels or m.channels is not None
    return Integral(value if channels else value[..., 0][()], found.error.reshape(shape)[()])


def _single(
    m: Reflectance,
    known: np.ndarray,
    here: Place,
    over: Geometry,
    incident: bool,
    tolerance: Any,
    delta: bool = True,
    radiance: Radiance | None = None,
    unit: float = 1.0,
    side: int | None = None,
) -> Found:
    """Reflectance factors (n, C) between known directions and a geometry, times `radiance` of the light there.

    `unit`: the radiance that the tolerance goes with.
    """
    size = over.projected / math.pi
    found = over_directions(m, known, here, tolerance, incident, over.domain, radiance, size * unit, side)
    value = found.value
    for weight, lobe in m.lobes():
        if delta and lobe.is_delta:
            mirrored = texels(lobe, here.shape, here.of).sample(known[:, None], np.zeros(2)).wi[:, 0]
            part = _delta(weight, lobe, known[:, None], here, here.of)[:, 0]
            part = np.where(over.contains(mirrored)[:, None], part, 0.0)
            if radiance is not None:
                part = part * radiance(mirrored[:, None], here.of)[:, 0]
            value = value + part
    return Found(value / size, found.error / size, found.missing)


def _delta(weight: Any, lobe: Reflectance, w: np.ndarray, here: Place, index: np.ndarray) -> np.ndarray:
    """Reflectance (n, k, C) of a delta lobe for directions (n, k, 3) at places (n,)."""
    found = texels(lobe, here.shape, index).delta_reflectance(w)
    found = found if found.ndim == 3 else found[..., None]
    return found * of_places(weight, here.shape, index)[:, None]


def _check_level(lobe: Reflectance) -> None:
    """Raises ParameterError for a mirror that is tilted."""
    w = direction(np.array([0.2, 0.9]), np.array([0.3, 2.0]))
    if not np.allclose(lobe.sample(w, np.zeros(2)).wi, w * MIRROR, atol=1e-6):
        raise ParameterError(
            f"{lobe!r:.80}: a tilted mirror between two cones; expected a level one, or a direction on one side"
        )


def _nodes(cells: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Points (k, nodes) of the unit square in cells, and their areas."""
    return place(cells.T[..., None], NODES.T)


def smaller_first(of: Geometry, to: Geometry) -> bool:
    """Whether the outer integral is over the first of two geometries: the smaller one, in which less may change."""
    return of.projected <= to.projected


def _double(m: Reflectance, of: Geometry, to: Geometry, here: Place, tolerance: float) -> Found:
    """Reflectance factors (n, C) between two geometries: outside the integral over the smaller one."""
    outward = smaller_first(of, to)
    outer, inner = (of, to) if outward else (to, of)
    found = _averaged(
        m,
        outer,
        here,
        tolerance,
        turns=inner.about_normal,
        single=lambda w, there: _single(m, w, there, inner, outward, INNER * tolerance, delta=False, side=FEW),
    )
    mirrors = [(weight, lobe) for weight, lobe in m.lobes() if lobe.is_delta]
    for _, lobe in mirrors:
        _check_level(lobe)
    both = overlap(of, to.mirrored())
    if not mirrors or both is None:
        return found
    points, seam = both
    scale = math.pi / (of.projected * to.projected)

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> Sums:
        u, area = _nodes(cells)
        w, solid = points(*u)
        total: Any = 0.0
        for weight, lobe in mirrors:
            total = total + _delta(weight, lobe, w, here, rows)
        return Sums(weighed(total * (scale * area * solid)[..., None]), 0.0, 0.0)

    delta = cubature(evaluate, len(here.of), DELTA * tolerance, seam=seam)
    return Found(found.value + delta.value, found.error + delta.error, found.missing)


def _averaged(
    m: Reflectance, outer: Geometry, here: Place, tolerance: float, turns: bool, single: Any, unit: Any = 1.0
) -> Found:
    """Averages (n, C) over a geometry, weighed by the cosine, of what `single(directions, places)` finds.

    `turns`: whether turning directions about the normal changes nothing but for the material.
    """
    maps = batch.full_shape(m, ()) != ()
    same = turns and not maps and m.is_isotropic()
    around: Geometry | Rings = Rings(outer) if same and isinstance(outer, Cone) and not outer.about_normal else outer

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> Sums:
        u, area = _nodes(cells)
        w, solid = around.points(*u)
        area = area * solid / around.projected
        index = np.repeat(here.of[rows], w.shape[1])
        flat = w.reshape(-1, 3)
        back: Any = slice(None)
        if same:  # one direction for each polar angle
            key, first, back = np.unique(
                np.stack([flat[:, 2], index], axis=-1), axis=0, return_index=True, return_inverse=True
            )
            z, index = key[:, 0], index[first]
            flat = np.stack([np.sqrt(np.maximum(1.0 - z * z, 0.0)), np.zeros_like(z), z], axis=-1)
            back = back.reshape(-1)
        found = single(flat, Place(here.shape, index))
        value, error, missing = (x[back].reshape(*area.shape, -1) for x in found)
        share = NODES[:, 2] * area
        sums = weighed(value * area[..., None])
        return Sums(sums, (share * error[..., 0]).sum(axis=-1), (share * missing[..., 0]).sum(axis=-1))

    return cubature(evaluate, len(here.of), OUTER * tolerance, unit, around.seam, side=FEW)


# Under a sky.

_LOCAL = Frame(Direction(1.0, 0.0, 0.0), Direction(0.0, 1.0, 0.0), Direction(0.0, 0.0, 1.0))


class _Within:
    """The part of a light that comes from a geometry; what sampling it needs."""

    is_delta, can_sample = False, True

    def __init__(self, light: Light, part: Geometry):
        self.light, self.part = light, part
        self.sample, self.pdf = light.sample, light.pdf

    def incident(self, w: Any) -> Any:
        return np.where(self.part.contains(w)[..., None], self.light.incident(w), 0.0)


def _under(
    m: Reflectance, lights: list[Light], of: Geometry, to: Geometry | np.ndarray, here: Place, tolerance: float
) -> tuple[Found, bool]:
    """Reflectance factors (n, C) under lights as far as they are in a geometry, and whether these have channels.

    `to`: a geometry, or directions (n, 3). The factor is the sum of pi L_o over the sum of E, light by light.
    """
    count = len(here.of)
    sums: list[Found] = []  # pi L_o
    arriving: list[np.ndarray] = []
    for light in lights:
        if light.is_delta:
            arrival = light.arrival(np.zeros(3))
            w = np.asarray(arrival.w, dtype=float).reshape(3)
            E = np.asarray(arrival.irradiance, dtype=float).reshape(-1) * max(w[2], 0.0) * bool(of.contains(w))
            if isinstance(to, np.ndarray):
                f = texels(m, here.shape, here.of).f(w[None, None], to[:, None])[:, 0]
                R = Found(math.pi * f.reshape(count, -1), np.zeros(count), np.zeros(count))
            else:
                R = _single(m, np.broadcast_to(w, (count, 3)), here, to, True, tolerance)
            found = Found(R.value * E, R.error * E.max(), R.missing)
        elif light.can_sample:
            E, found = _by_samples(m, _Within(light, of), to, here, tolerance)
        else:
            E, found = _by_quadrature(m, light, of, to, here, tolerance)
        arriving.append(E)
        sums.append(found)
    E = sum(arriving[1:], arriving[0])
    if not E.min() > 0.0:
        raise ParameterError(f"sky: its irradiance from `incident` is {E}; expected light in every channel")
    value = sum((x.value for x in sums[1:]), sums[0].value) / E
    error = sum((x.error for x in sums[1:]), sums[0].error) / E.min()
    return Found(value, error, np.max([x.missing for x in sums], axis=0)), len(E) > 1 or _coloured(lights)


def _coloured(lights: list[Light]) -> bool:
    return any(getattr(v, "ndim", 0) for light in lights for v in light.leaves())


def _by_quadrature(
    m: Reflectance, light: Light, of: Geometry, to: Geometry | np.ndarray, here: Place, tolerance: float
) -> tuple[np.ndarray, Found]:
    """Irradiance (C,) by a light that is a function of direction, and pi L_o (n, C)."""

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> Sums:
        u, area = _nodes(cells)
        w, solid = of.points(*u)
        return Sums(weighed(light.incident(w) * (area * solid)[..., None]), 0.0, 0.0)

    u, _ = _nodes(np.array([[0.0, 1.0, 0.0, 0.0, 1.0, 1.0]]))
    w, solid = of.points(*u)
    size = float(np.abs(light.incident(w) * np.broadcast_to(solid, u[0].shape)[..., None]).mean())
    E = cubature(evaluate, 1, 0.1 * tolerance, size, seam=of.seam).value[0]
    size = np.abs(E)  # what each channel of the factor is divided by
    unit = float(max(size.min(), 1e-3 * size.max())) / of.projected

    def radiance(there: np.ndarray, index: np.ndarray) -> np.ndarray:
        return light.incident(there)

    def single(known: np.ndarray, place: Place, share: float = INNER, side: int | None = FEW) -> Found:
        return _single(m, known, place, of, False, share * tolerance, radiance=radiance, unit=unit, side=side)

    if isinstance(to, np.ndarray):
        found = single(to, here, 1.0, None)
    else:
        found = _averaged(m, to, here, tolerance, turns=False, single=single, unit=unit)
    return E, Found(found.value * of.projected, found.error * of.projected, found.missing)


def _by_samples(
    m: Reflectance, light: Any, to: Geometry | np.ndarray, here: Place, tolerance: float
) -> tuple[np.ndarray, Found]:
    """Irradiance (C,) by a light that is sampled, and pi L_o (n, C): each the mean of the parts of a lattice."""
    parts, n = 16, SAMPLES[0]
    count, most = len(here.of), SAMPLES[1]
    while True:
        u = lattice(n, 2 if isinstance(to, np.ndarray) else 4)
        w, pdf = light.sample(lattice(1 << 18))
        E = light.incident(w) * (np.maximum(w[:, 2], 0.0) / np.where(pdf > 0.0, pdf, np.inf))[:, None]
        E = E.mean(axis=0)
        value, error, holes = [], [], []
        for k in range(count):
            material = texels(m, here.shape, here.of[k : k + 1])
            if isinstance(to, np.ndarray):
                wo, share = np.broadcast_to(to[k], (n, 3)), np.ones(n)
            else:
                wo, solid = to.points(u[:, 2], u[:, 3])
                share = np.broadcast_to(solid / to.projected, n)
            radiance, missing = _estimates(material, light, wo, u[:, :2])
            radiance = radiance * share[:, None]
            means = math.pi * radiance.reshape(parts, n // parts, -1).mean(axis=1)
            value.append(means.mean(axis=0))
            error.append(2.0 * means.std(axis=0, ddof=1).max() / math.sqrt(parts))
            holes.append(missing / n)
        found = Found(np.array(value), np.array(error), np.array(holes))
        goal = tolerance * np.maximum(E.max(), np.abs(found.value).max(axis=-1))
        if n >= most or not (found.error > goal).any():
            return E, found
        n *= 4


def _estimates(m: Reflectance, light: Any, wo: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, int]:
    found, holes = [], 0
    for start in range(0, len(u), 1 << 17):
        part = slice(start, start + (1 << 17))
        values, missing = estimate(m, light, _LOCAL, wo[part], u[part], u[part])
        found.append(np.broadcast_to(values, (len(u[part]), values.shape[-1])))
        holes += missing
    return np.concatenate(found), holes
