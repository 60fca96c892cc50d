"""Spheres on a plane, at random places, none in another."""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated

import numpy as np

from ..declared.arguments import Declared, Seed, checked
from ..errors import ParameterError
from .height_field import HeightField

TRIALS = 2000
"""Places tried for a sphere."""


@checked
def spheres(
    coverage: Annotated[float, Declared("share of the plane that spheres cover, seen from above", 0.001, 0.5)] = 0.3,
    sunk: Annotated[
        float, Declared("how deep they are in the plane, in radii: 0 spheres that touch it, 1 hemispheres", 0.0, 1.9)
    ] = 0.0,
    *,
    radius: Annotated[float, Declared("of a sphere, in cells", 2.0, 200.0)] = 16.0,
    size: Annotated[int, Declared("cells along x and y: the surface is periodic", 16, 4096)] = 512,
    seed: Seed = 0,
) -> HeightField:
    """Equal spheres on a plane, at random places, none in another.

    coverage  share of the plane that spheres cover, seen from above
    sunk      how deep they are in the plane, in radii: 0 spheres that touch it, 1 hemispheres
    radius    of a sphere, in cells
    size      cells along x and y: the surface is periodic

    A height field has no undersides: below its widest place a sphere stands on a cylinder, whose wall is one cell wide.

    Example
    >>> print(gn.surfaces.spheres(0.3, sunk=1.0, size=128).heights.max() > 8.0)
    True
    """
    rng = np.random.default_rng([23, seed])
    widest = radius * math.sqrt(max(1.0 - max(sunk - 1.0, 0.0) ** 2, 0.0))
    count = max(1, round(coverage * size * size / (math.pi * widest * widest)))
    if size < 4.0 * radius:
        raise ParameterError(f"spheres(size={size}, radius={radius:g}): expected a size of at least {4.0 * radius:g}")
    places = np.zeros((0, 2))
    for _ in range(count):
        tried = rng.random((TRIALS, 2)) * size
        apart = np.abs(tried[:, None] - places)
        apart = np.minimum(apart, size - apart)
        free = ((apart**2).sum(-1) >= 4.0 * widest * widest).all(axis=1)
        if not free.any():
            break
        places = np.concatenate([places, tried[free][:1]])
    heights = np.zeros((size, size))
    reach = np.arange(-math.ceil(widest), math.ceil(widest) + 2)
    for x, y in places:
        rows, columns = math.floor(y) + reach, math.floor(x) + reach
        apart = (rows[:, None] - y) ** 2 + (columns - x) ** 2
        inside = apart < widest * widest
        top = radius * (1.0 - sunk) + np.sqrt(np.maximum(radius * radius - apart, 0.0))
        place = np.ix_(rows % size, columns % size)
        heights[place] = np.maximum(heights[place], np.where(inside, top, 0.0))
    return HeightField(
        heights,
        turn=0.0,
        again=partial(spheres, coverage, sunk, radius=radius, size=size),
        seed=seed,
        title=f"spheres on a plane, coverage {len(places) * math.pi * widest * widest / size**2:.3g}, sunk {sunk:g}",
    )
