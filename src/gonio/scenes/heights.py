"""A height field as a mesh, lying flat: to be looked at as a piece of the surface."""

from __future__ import annotations

import numpy as np

from ..surfaces.height_field import HeightField
from .mesh import Mesh


def laid(surface: HeightField) -> Mesh:
    """One period of a surface, about the origin, z up; u grows with x and v falls with y, each from 0 to 1."""
    heights = np.pad(surface.heights.astype(float), ((0, 1), (0, 1)), mode="wrap")
    rows, columns = heights.shape
    v, u = np.meshgrid(np.linspace(1.0, 0.0, rows), np.linspace(0.0, 1.0, columns), indexing="ij")
    x, y = (u - 0.5) * surface.period[0], (0.5 - v) * surface.period[1]
    vertices = np.stack([x, y, heights], -1).reshape(-1, 3)
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    b, c, d = a + 1, a + columns + 1, a + columns
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])  # cells are cut from (0, 0) to (1, 1)
    return Mesh((vertices, faces), uv=np.stack([u, v], -1).reshape(-1, 2))
