"""Shapes to render, a function each, in a file of its name, seen along +y of the world (z up, x to the right).

A shape takes x and y of the picture, from -1 to 1, and gives normals (..., 3) and tangents (..., 3), unit vectors of
the world, and whether a parallel camera sees it there. It is found by being here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ... import discover

Shape = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]

SHAPES: dict[str, Shape] = discover.functions(__name__)
"""Name -> function."""
