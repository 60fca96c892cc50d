"""Measurements that lie in a few half-planes of azimuth, such as scans in the plane of incidence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..formula import tree
from .gridded import Gridded
from .rows import SAME
from .scattered import Scattered

ALIKE = math.radians(0.5)
"""Angles [rad] up to which rows count as of one half-plane or one polar angle."""

APART = math.radians(45.0)
"""Gap [rad] between half-planes above which they are few."""


def half_planes(m: Gridded) -> np.ndarray:
    """Azimuths [rad] of wo, from that of wi, of the half-planes in which all values lie, if they are few; else none.

    Few: with a gap of more than 45 degrees between two of them, mirror images counted. Values along the normal lie in
    all of them. Grids of other angles than polar angles and azimuths have none.
    """
    none = np.zeros(0)
    if m.parameterization != "angles":
        return none
    if isinstance(m, Scattered):
        off = m.rows[(m.rows[:, 0] > ALIKE) & (m.rows[:, 2] > ALIKE)]
        phi = off[:, 3] - off[:, 1]
    elif tree.is_oriented(m):
        phi = (m.axes["phi_o"] - m.axes["phi_i"][:, None]).reshape(-1)
    else:
        phi = m.axes["phi"]
    phi = _merged(phi)
    if len(phi) == 0:
        return none
    images = np.sort(np.mod(np.concatenate([phi, -phi]) if m.is_mirrored else phi, 2.0 * math.pi))
    gaps = np.diff(images, append=images[0] + 2.0 * math.pi)
    return phi if gaps.max() > APART + SAME else none


def _merged(phi: np.ndarray) -> np.ndarray:
    """Azimuths in [0, 2 pi), those in one step of `ALIKE` once."""
    step = np.unique(np.mod(np.round(phi / ALIKE), round(2.0 * math.pi / ALIKE)))
    return step * ALIKE


def in_words(phi: Any) -> str:
    """What follows from values in few half-planes, for people; "" where there are none."""
    if len(phi) == 0:
        return ""
    listed = ", ".join(f"{math.degrees(x):.4g}°" for x in phi[:8]) + (", ..." if len(phi) > 8 else "")
    many = "1 half-plane" if len(phi) == 1 else f"{len(phi)} half-planes"
    return f"the values lie in {many} (azimuth {listed}): the albedo rests on interpolation in azimuth"
