"""Brushed lines: scratches along x, of random places, lengths and depths."""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated

import numpy as np

from ..declared.arguments import Declared, Seed, checked
from .height_field import HeightField


@checked
def brushed(
    slope: Annotated[
        float, Declared("of the deepest scratches' sides; others have slopes evenly spread below it", 1e-4, 5.0)
    ] = 0.3,
    density: Annotated[
        float,
        Declared("how many scratches lie over a place on average: at 2, one eighth of the plane is left", 0.01, 20.0),
    ] = 2.0,
    *,
    width: Annotated[float, Declared("half the width of a scratch, in cells", 1.0, 100.0)] = 5.0,
    length: Annotated[float, Declared("of a scratch, in cells; at most `size`", 4.0, 4096.0)] = 200.0,
    size: Annotated[int, Declared("cells along x and y: the surface is periodic", 16, 4096)] = 512,
    seed: Seed = 0,
) -> HeightField:
    """Brushed metal: V-shaped scratches along x in a plane, which become shallow towards their ends.

    slope    of the deepest scratches' sides; others have slopes evenly spread below it
    density  how many scratches lie over a place on average: at 2, one eighth of the plane is left
    width    half the width of a scratch, in cells
    length   of a scratch, in cells; at most `size`
    size     cells along x and y: the surface is periodic

    Where scratches cross, the deeper one counts.

    Example
    >>> lines = gn.surfaces.brushed(0.3, size=128, length=100)
    >>> along, across = lines.rms_slopes
    >>> print(along < 0.2 * across)
    True
    """
    rng = np.random.default_rng([19, seed])
    length = min(length, float(size))
    count = max(1, round(density * size * size / (2.0 * width * length)))
    heights = np.zeros((size, size), np.float32)
    reach, half = math.ceil(width), math.ceil(0.5 * length)
    for x, y, depth in zip(*(rng.random((3, count)) * np.array([[size], [size], [slope]])), strict=True):
        rows, columns = math.floor(y) + np.arange(-reach, reach + 2), math.floor(x) + np.arange(-half, half + 1)
        if len(columns) > size:
            columns = columns[:size]
        across = np.maximum(width - np.abs(rows - y), 0.0)
        along = np.maximum(1.0 - (2.0 * (columns - x) / length) ** 2, 0.0)
        place = np.ix_(rows % size, columns % size)
        heights[place] = np.minimum(heights[place], -depth * np.minimum(across[:, None], width * along))
    return HeightField(
        heights,
        turn=math.pi,
        again=partial(brushed, slope, density, width=width, length=length, size=size),
        seed=seed,
        title=f"brushed lines, slopes up to {slope:g}, density {density:g}",
    )
