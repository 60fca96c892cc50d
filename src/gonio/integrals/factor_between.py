"""Reflectance factors between a direction or a geometry and a geometry: integrals over one, or over both."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..evaluate import batch
from ..numerics.quadrature import NODES, Found, Sums, cubature, place, weighed
from .cones import MIRROR, Cone, Geometry, Rings, overlap
from .over_directions import Radiance, over_directions
from .places import Place, of_places, texels

OUTER, INNER, DELTA = 0.7, 0.2, 0.1
"""What shares of the tolerance of a double integral the outer and the inner one may use, and that of delta lobes."""

FEW = 2
"""First cells along a side, of both: small things that one inner integral misses others find."""


def single_integral(
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


def square_nodes(cells: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Points (k, nodes) of the unit square in cells, and their areas."""
    return place(cells.T[..., None], NODES.T)


def smaller_first(of: Geometry, to: Geometry) -> bool:
    """Whether the outer integral is over the first of two geometries: the smaller one, in which less may change."""
    return of.projected <= to.projected


def double_integral(m: Reflectance, of: Geometry, to: Geometry, here: Place, tolerance: float) -> Found:
    """Reflectance factors (n, C) between two geometries: outside the integral over the smaller one."""
    outward = smaller_first(of, to)
    outer, inner = (of, to) if outward else (to, of)
    found = averaged(
        m,
        outer,
        here,
        tolerance,
        turns=inner.about_normal,
        single=lambda w, there: single_integral(m, w, there, inner, outward, INNER * tolerance, delta=False, side=FEW),
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
        u, area = square_nodes(cells)
        w, solid = points(*u)
        total: Any = 0.0
        for weight, lobe in mirrors:
            total = total + _delta(weight, lobe, w, here, rows)
        return Sums(weighed(total * (scale * area * solid)[..., None]), 0.0, 0.0)

    delta = cubature(evaluate, len(here.of), DELTA * tolerance, seam=seam)
    return Found(found.value + delta.value, found.error + delta.error, found.missing)


def averaged(
    m: Reflectance, outer: Geometry, here: Place, tolerance: float, turns: bool, single: Any, unit: Any = 1.0
) -> Found:
    """Averages (n, C) over a geometry, weighed by the cosine, of what `single(directions, places)` finds.

    `turns`: whether turning directions about the normal changes nothing but for the material.
    """
    maps = batch.full_shape(m, ()) != ()
    same = turns and not maps and m.is_isotropic()
    around: Geometry | Rings = Rings(outer) if same and isinstance(outer, Cone) and not outer.about_normal else outer

    def evaluate(rows: np.ndarray, cells: np.ndarray) -> Sums:
        u, area = square_nodes(cells)
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
