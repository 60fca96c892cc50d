"""Reflectance factors between a direction or a geometry and a geometry: integrals over one, or over both."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..numerics.quadrature import NODES, CellSums, Goal, Integrals, cubature, place, weighed
from ..numerics.unique_rows import unique_rows
from .cones import MIRROR, Cone, Geometry, Rings, overlap
from .over_directions import Over, over_directions
from .places import Places

OUTER, INNER, DELTA = 0.7, 0.2, 0.1
"""Shares of the tolerance of a double integral for the outer and the inner one, and for that of delta lobes."""

FEW = 2
"""First cells along a side, of both: details that one inner integral misses others find."""


def single_integral(
    m: Reflectance, fixed: np.ndarray, places: Places, geometry: Geometry, over: Over, goal: Goal
) -> Integrals:
    """Reflectance factors (n, C) between fixed directions and a geometry, times the radiance of the light there; the
    unit of the goal is a radiance. `over`: which of both are light."""
    size = geometry.projected / math.pi
    value, error, missing = _smooth(m, fixed, places, geometry, over, goal)
    for weight, lobe in m.lobes():
        if lobe.is_delta:
            mirrored = places.material(lobe).sample(fixed[:, None], np.zeros(2)).wi[:, 0]
            part = _delta(weight, lobe, fixed[:, None], places)[:, 0]
            part = np.where(geometry.contains(mirrored)[:, None], part, 0.0)
            if over.radiance is not None:
                part = part * over.radiance(mirrored[:, None], places.elements)[:, 0]
            value = value + part
    return Integrals(value / size, error / size, missing)


def _smooth(m: Reflectance, fixed: np.ndarray, places: Places, geometry: Geometry, over: Over, goal: Goal) -> Integrals:
    """The same without delta lobes, times the geometry's share of the hemisphere."""
    goal = goal._replace(unit=geometry.projected / math.pi * goal.unit)
    return over_directions(m, fixed, places, over._replace(domain=geometry.domain), goal)


def _delta(weight: Any, lobe: Reflectance, w: np.ndarray, places: Places) -> np.ndarray:
    """Reflectance (n, k, C) of a delta lobe for directions (n, k, 3) at places (n,)."""
    return with_channels(places.material(lobe).delta_reflectance(w), 2) * places.values(weight)[:, None]


def _check_level(lobe: Reflectance) -> None:
    """Raises ParameterError for a mirror that is tilted."""
    w = direction(np.array([0.2, 0.9]), np.array([0.3, 2.0]))
    if not np.allclose(lobe.sample(w, np.zeros(2)).wi, w * MIRROR, atol=1e-6):
        raise ParameterError(
            f"{lobe!r:.80}: a tilted mirror between two cones; expected a level one, or a direction on one side"
        )


def square_nodes(cells: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Points (k, nodes) of the unit square in cells, and their areas."""
    return place(cells.T[..., None], NODES.T)


def smaller_first(of: Geometry, to: Geometry) -> bool:
    """Whether the outer integral is over the first of two geometries: the smaller one, in which less may change."""
    return of.projected <= to.projected


def double_integral(m: Reflectance, of: Geometry, to: Geometry, places: Places, tolerance: float) -> Integrals:
    """Reflectance factors (n, C) between two geometries: outside the integral over the smaller one."""
    outward = smaller_first(of, to)
    outer, inner = (of, to) if outward else (to, of)

    def single(w: np.ndarray, there: Places) -> Integrals:
        integral = _smooth(m, w, there, inner, Over(outward), Goal(INNER * tolerance, side=FEW))
        size = inner.projected / math.pi
        return Integrals(integral.value / size, integral.error / size, integral.missing)

    value, error, missing = averaged(m, outer, places, Goal(tolerance), inner.about_normal, single)
    mirrors = [(weight, lobe) for weight, lobe in m.lobes() if lobe.is_delta]
    for _, lobe in mirrors:
        _check_level(lobe)
    both = overlap(of, to.mirrored())
    if not mirrors or both is None:
        return Integrals(value, error, missing)
    points, seam = both
    scale = math.pi / (of.projected * to.projected)

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> CellSums:
        u, area = square_nodes(cells)
        w, solid = points(*u)
        total = sum((_delta(weight, lobe, w, places.of(rows)) for weight, lobe in mirrors), np.zeros(()))
        return CellSums(weighed(total * (scale * area * solid)[..., None]), 0.0, 0.0)

    delta = cubature(evaluate, len(places.elements), Goal(DELTA * tolerance), seam)
    return Integrals(value + delta.value, error + delta.error, missing)


def averaged(m: Reflectance, outer: Geometry, places: Places, goal: Goal, turns: bool, single: Any) -> Integrals:
    """Averages (n, C) over a geometry, weighed by the cosine, of the integrals `single(directions, places)`.

    `turns`: whether turning directions about the normal changes nothing but for the material.
    """
    same = turns and m.is_isotropic()
    around: Geometry | Rings = Rings(outer) if same and isinstance(outer, Cone) and not outer.about_normal else outer

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> CellSums:
        u, area = square_nodes(cells)
        w, solid = around.points(*u)
        area = area * solid / around.projected
        index = np.repeat(places.elements[rows], w.shape[1])
        flat = w.reshape(-1, 3)
        back: Any = slice(None)
        if same:  # one direction for each polar angle
            first, back, _ = unique_rows(np.stack([flat[:, 2], index], axis=-1))
            z, index = flat[first, 2], index[first]
            flat = np.stack([np.sqrt(np.maximum(1.0 - z * z, 0.0)), np.zeros_like(z), z], axis=-1)
        inner = single(flat, Places(places.shape, index))
        value, error, missing = (x[back].reshape(*area.shape, -1) for x in inner)
        share = NODES[:, 2] * area
        sums = weighed(value * area[..., None])
        return CellSums(sums, (share * error[..., 0]).sum(axis=-1), (share * missing[..., 0]).sum(axis=-1))

    goal = Goal(OUTER * goal.tolerance, goal.unit, FEW)
    return cubature(evaluate, len(places.elements), goal, around.seam)
