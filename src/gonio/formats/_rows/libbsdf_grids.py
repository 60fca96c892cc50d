"""libbsdf's grids about the specular direction, which SSDD and Integra's files share.

libbsdf counts the azimuth about the mirror direction from the side of the normal, gonio from the opposite side: gonio's
azimuth is libbsdf's plus pi.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...base.angles import angles
from ...tables.angle_systems import SYSTEMS
from ...tables.gridded import Gridded
from .._reading import plain_text
from . import direction_pairs


def azimuths(degrees: np.ndarray, values: np.ndarray, axis: int, mirrored: bool) -> tuple[np.ndarray, np.ndarray]:
    """Rising azimuths [rad] from those of a file, and the values in their order; half a circle is mirrored."""
    if not mirrored:
        return np.radians(degrees + 180.0), values
    return np.radians(180.0 - degrees[::-1]), np.flip(values, axis)


def degrees(azimuth: np.ndarray, values: np.ndarray, axis: int, mirrored: bool) -> tuple[np.ndarray, np.ndarray]:
    """The inverse of `azimuths`, from 0 to 360 degrees."""
    if mirrored:
        return np.round(180.0 - plain_text.degrees(azimuth[::-1]), 10), np.flip(values, axis)
    phi = np.round(plain_text.degrees(azimuth) - 180.0, 10)
    if phi[0] >= 0.0:
        return phi, values
    phi, order = np.unique(np.mod(phi, 360.0), return_index=True)
    return phi, values.take(order, axis)


def offset(
    axes: Mapping[str, np.ndarray], values: np.ndarray, centres: np.ndarray, channels: Any, path: str, about: Any
) -> Gridded:
    """The measurement of a grid about other directions than the mirror's; `centres`: their polar angles [rad]."""
    nodes = np.meshgrid(*{**axes, "theta_i": centres}.values(), indexing="ij")
    _, wo = SYSTEMS["specular"].pairs(*nodes)
    theta_i = np.meshgrid(*axes.values(), indexing="ij")[0]
    phi_i = nodes[3] if len(nodes) == 4 else 0.0 * theta_i
    rows = np.stack([theta_i, phi_i, *angles(wo)], axis=-1).reshape(-1, 4)
    pairs = direction_pairs.Pairs(rows, values.reshape(len(rows), *values.shape[len(axes) :]), channels=channels)
    return direction_pairs.material(pairs, path, about)


def expand(nodes: np.ndarray, values: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """A full circle of azimuths [degrees], and values, from one half and its mirror image."""
    other = np.flatnonzero((nodes > 0.0) & (nodes < 180.0))[::-1]
    order: Sequence[int] = [*range(len(nodes)), *other]
    return np.concatenate([nodes, 360.0 - nodes[other]]), values.take(order, axis)
