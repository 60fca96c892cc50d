"""Woven threads: plain weave, over one and under one."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from ..declared.arguments import Declared, checked
from .height_field import HeightField


@checked
def weave(
    thickness: Annotated[
        float, Declared("of a thread, in distances between threads; half of it is above its middle line", 0.01, 2.0)
    ] = 0.4,
    width: Annotated[
        float,
        Declared(
            "of a thread, in distances between threads: what is left are gaps, open down to the lowest thread", 0.1, 1.0
        ),
    ] = 0.95,
    crimp: Annotated[float, Declared("how far a thread's middle line goes up and down", 0.0, 2.0)] = 0.3,
    *,
    size: Annotated[int, Declared("cells along the two threads after which the weave repeats", 16, 2048)] = 128,
) -> HeightField:
    """Plain weave: threads along x and along y, each over one and under one of the others.

    thickness  of a thread, in distances between threads; half of it is above its middle line
    width      of a thread, in distances between threads: what is left are gaps, open down to the lowest thread
    crimp      how far a thread's middle line goes up and down
    size       cells along the two threads after which the weave repeats

    A thread is an ellipse in section, its middle line a cosine. The surface is the upper of the two threads.

    Source: Westin, Arvo & Torrance 1992, "Predicting reflectance functions from complex surfaces", section 6 (woven
    cylinders as an example of a mesostructure); the shape is our own.

    Example
    >>> cloth = gn.surfaces.weave(size=32)
    >>> print(cloth.period, cloth.turn == np.pi)
    (2.0, 2.0) True
    """
    at = (np.arange(size) + 0.5) * 2.0 / size
    number = np.floor(at)
    aside = 2.0 * (at - number - 0.5) / width
    section = 0.5 * thickness * np.sqrt(np.maximum(1.0 - aside**2, 0.0))
    within = np.abs(aside) < 1.0
    middle = 0.5 * crimp * np.cos(math.pi * (at - 0.5))[:, None] * np.where(number == 0.0, 1.0, -1.0)
    lowest = -0.5 * crimp
    along_y = np.where(within, middle + section, lowest)
    along_x = np.where(within[:, None], -middle.T + section[:, None], lowest)
    return HeightField(
        np.maximum(along_x, along_y),
        (2.0 / size, 2.0 / size),
        turn=math.pi,
        title=f"plain weave, thickness {thickness:g}, width {width:g}, crimp {crimp:g}",
    )
