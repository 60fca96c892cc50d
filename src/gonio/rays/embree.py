"""Rays by Embree, through embreex, which lets other threads run while it shoots."""

from __future__ import annotations

from typing import Any

import numpy as np


class Embree:
    """Triangles (F, 3) of vertices (V, 3), both contiguous. Raises ImportError where embreex is not installed."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray):
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene: Any = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, vertices, faces)

    def first(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> tuple[np.ndarray, ...]:
        """Face or -1, distance, and barycentric coordinates u, v of what each ray meets first."""
        hit = self._scene.run(origins, directions, far, output=1)
        return hit["primID"], hit["tfar"], hit["u"], hit["v"]

    def face(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """The face alone."""
        return self._scene.run(origins, directions, far)

    def any(self, origins: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Whether a ray meets any triangle nearer than `far`."""
        return self._scene.run(origins, directions, far, query="OCCLUDED") >= 0
