"""Reflectance factors under lights of any kind: exact for delta lights, by quadrature, or by samples."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.frames import Frame
from ..base.light import ORIGIN, Light
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..formula.direction import Direction
from ..numerics.lattice import lattice
from ..numerics.quadrature import CellSums, Goal, Integrals, cubature, weighed
from .cones import Geometry
from .factor_between import FEW, INNER, averaged, single_integral, square_nodes
from .illumination import estimate, have_channels
from .over_directions import Over
from .places import Places, SeenPoints

SAMPLES = (1 << 13, 1 << 20)
"""Samples of a light for a direction, at first and at most."""

_HERE = np.zeros(3)
_LOCAL = Frame(Direction(1.0, 0.0, 0.0), Direction(0.0, 1.0, 0.0), Direction(0.0, 0.0, 1.0))


class _Within:
    """The part of a light that comes from a geometry, to be sampled."""

    is_delta, can_sample = False, True

    def __init__(self, light: Light, part: Geometry):
        self.light, self.part = light, part
        self.sample, self.pdf = light.sample, light.pdf

    def incident(self, w: Any, position: Any = ORIGIN) -> Any:
        return np.where(self.part.contains(w)[..., None], self.light.incident(w), 0.0)


def factor_under(
    m: Reflectance, lights: list[Light], of: Geometry, to: Geometry | np.ndarray, places: Places, tolerance: float
) -> tuple[Integrals, bool]:
    """Reflectance factors (n, C) under the part of lights in a geometry, and whether these have channels.

    `to`: a geometry, or directions (n, 3). The factor is the sum of pi L_o over the sum of E, light by light.
    """
    count = len(places.elements)
    sums: list[Integrals] = []  # pi L_o
    arriving: list[np.ndarray] = []
    for light in lights:
        if light.is_delta:
            arrival = light.arrival(np.zeros(3))
            w = np.asarray(arrival.w, dtype=float).reshape(3)
            E = np.asarray(arrival.irradiance, dtype=float).reshape(-1) * max(w[2], 0.0) * bool(of.contains(w))
            if isinstance(to, np.ndarray):
                f = places.material(m).f(w[None, None], to[:, None])[:, 0]
                R = Integrals(math.pi * f.reshape(count, -1), np.zeros(count), np.zeros(count))
            else:
                R = single_integral(m, np.broadcast_to(w, (count, 3)), places, to, Over(True), Goal(tolerance))
            reflected = Integrals(R.value * E, R.error * E.max(), R.missing)
        elif light.can_sample:
            E, reflected = _by_samples(m, _Within(light, of), to, places, tolerance)
        else:
            E, reflected = _by_quadrature(m, light, of, to, places, tolerance)
        arriving.append(E)
        sums.append(reflected)
    E = sum(arriving[1:], arriving[0])
    if not E.min() > 0.0:
        raise ParameterError(f"sky: its irradiance from `incident` is {E}; expected light in every channel")
    value = sum((x.value for x in sums[1:]), sums[0].value) / E
    error = sum((x.error for x in sums[1:]), sums[0].error) / E.min()
    return Integrals(value, error, np.max([x.missing for x in sums], axis=0)), len(E) > 1 or have_channels(lights)


def _by_quadrature(
    m: Reflectance, light: Light, of: Geometry, to: Geometry | np.ndarray, places: Places, tolerance: float
) -> tuple[np.ndarray, Integrals]:
    """Irradiance (C,) by a light that is a function of direction, and pi L_o (n, C)."""

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> CellSums:
        u, area = square_nodes(cells)
        w, solid = of.points(*u)
        return CellSums(weighed(light.incident(w) * (area * solid)[..., None]), 0.0, 0.0)

    u, _ = square_nodes(np.array([[0.0, 1.0, 0.0, 0.0, 1.0, 1.0]]))
    w, solid = of.points(*u)
    size = float(np.abs(light.incident(w) * np.broadcast_to(solid, u[0].shape)[..., None]).mean())
    E = cubature(evaluate, 1, Goal(0.1 * tolerance, size), of.seam).value[0]
    size = np.abs(E)  # the divisor of each channel of the factor
    unit = float(max(size.min(), 1e-3 * size.max())) / of.projected

    def radiance(there: np.ndarray, index: np.ndarray) -> np.ndarray:
        return light.incident(there)

    def single(w: np.ndarray, there: Places, share: float = INNER, side: int | None = FEW) -> Integrals:
        return single_integral(m, w, there, of, Over(False, radiance=radiance), Goal(share * tolerance, unit, side))

    if isinstance(to, np.ndarray):
        value, error, missing = single(to, places, 1.0, None)
    else:
        value, error, missing = averaged(m, to, places, Goal(tolerance, unit), False, single)
    return E, Integrals(value * of.projected, error * of.projected, missing)


def _by_samples(
    m: Reflectance, light: Any, to: Geometry | np.ndarray, places: Places, tolerance: float
) -> tuple[np.ndarray, Integrals]:
    """Irradiance (C,) by a light that is sampled, and pi L_o (n, C): each the mean of the parts of a lattice."""
    parts, n = 16, SAMPLES[0]
    while True:
        u = lattice(n, 2 if isinstance(to, np.ndarray) else 4)
        w, pdf = light.sample(lattice(1 << 18))
        E = light.incident(w) * (np.maximum(w[:, 2], 0.0) / np.where(pdf > 0.0, pdf, np.inf))[:, None]
        E = E.mean(axis=0)
        value, error, holes = [], [], []
        for k in range(len(places.elements)):
            material = places.of(np.array([k])).material(m)
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
        reflected = Integrals(np.array(value), np.array(error), np.array(holes))
        goal = tolerance * np.maximum(E.max(), np.abs(reflected.value).max(axis=-1))
        if n >= SAMPLES[1] or not (reflected.error > goal).any():
            return E, reflected
        n *= 4


def _estimates(m: Reflectance, light: Any, wo: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, int]:
    """`estimate` in blocks of samples."""
    blocks, holes = [], 0
    for start in range(0, len(u), 1 << 17):
        part = slice(start, start + (1 << 17))
        values, missing = estimate(m, light, SeenPoints(_LOCAL, wo[part], _HERE, u[part], u[part]))
        by_sample = np.asarray(values).reshape(-1, values.shape[-1])  # the one place of the material left out
        blocks.append(np.broadcast_to(by_sample, (len(u[part]), by_sample.shape[-1])))
        holes += missing
    return np.concatenate(blocks), holes
