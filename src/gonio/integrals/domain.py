"""The directions that integrals run over, with the coordinates in which kernels do it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..formula.direction import Direction

Coordinates = Callable[..., tuple[Direction, Callable[[Direction], Any]]]
"""Coordinates on directions, for kernels: `(mean, fixed, u0, u1, numbers)` gives the direction for a point of the unit
square, and a function that gives the density [1/sr] at a direction, 0 outside."""


class Domain(NamedTuple):
    """Directions to integrate over: all (`SAMPLED`), or a part, with coordinates of its own.

    within      a lobe's own sampling, with density 0 outside
    coordinates the part's own
    numbers     (16,), for both
    seam        of `coordinates`
    contains    whether directions (..., 3) are inside
    inverse     place x, y in the plane of the unit square of directions (n, K, 3), and the period of y: each (n, K)
    """

    within: Coordinates
    coordinates: Coordinates | None
    numbers: np.ndarray
    seam: float = 0.0
    contains: Callable[[np.ndarray], np.ndarray] | None = None
    inverse: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]] | None = None


def _sampled(mean: Any, fixed: Direction, u0: Any, u1: Any, numbers: Any) -> tuple[Direction, Callable]:
    return mean.warp(fixed, u0, u1), lambda there: mean.density(there, fixed)


SAMPLED = Domain(_sampled, None, np.zeros(16))
"""All directions, in the coordinates of a lobe's own sampling."""
