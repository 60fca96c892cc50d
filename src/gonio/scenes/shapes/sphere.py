"""A sphere."""

from __future__ import annotations

import numpy as np


def sphere(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The unit sphere; tangents point towards increasing azimuth, east."""
    depth2 = 1.0 - x * x - y * y
    hit = depth2 > 0.0
    n = np.stack([x, -np.sqrt(np.maximum(depth2, 0.0)), y], -1)
    n[~hit] = (0.0, -1.0, 0.0)
    ring = np.hypot(n[..., 0], n[..., 1])
    t = np.stack([-n[..., 1], n[..., 0], np.zeros_like(ring)], -1) / np.maximum(ring, 1e-12)[..., None]
    t[ring < 1e-9] = (1.0, 0.0, 0.0)
    return n, t, hit
