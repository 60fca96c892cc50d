"""Grids about the specular direction as libbsdf has them, which SSDD and Integra's files share.

There the azimuth about the mirror direction counts from the direction in which the polar angle falls (towards the
normal), here from the opposite one: this one's is that one's plus pi.
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
    """Azimuths [rad] of a file's, rising, and the values in their order; of half a circle by mirroring."""
    if not mirrored:
        return np.radians(degrees + 180.0), values
    return np.radians(180.0 - degrees[::-1]), np.flip(values, axis)


def degrees(azimuth: np.ndarray, values: np.ndarray, axis: int, mirrored: bool) -> tuple[np.ndarray, np.ndarray]:
    """The inverse of `azimuths`, from 0 to 360 degrees."""
    if mirrored:
        return np.round(180.0 - plain_text.degrees(azimuth[::-1]), 10), np.flip(values, axis)
    found = np.round(plain_text.degrees(azimuth) - 180.0, 10)
    if found[0] >= 0.0:
        return found, values
    found = np.mod(found, 360.0)
    found, order = np.unique(found, return_index=True)
    return found, values.take(order, axis)


def offset(
    axes: Mapping[str, np.ndarray], values: np.ndarray, centres: np.ndarray, channels: Any, path: str, about: Any
) -> Gridded:
    """The measurement of a grid about other directions than the mirror's; `centres`: their polar angles [rad]."""
    turned = {**axes, "theta_i": centres}
    nodes = np.meshgrid(*turned.values(), indexing="ij")
    _, wo = SYSTEMS["specular"].pairs(*nodes)
    theta_i = np.meshgrid(*axes.values(), indexing="ij")[0]
    phi_i = nodes[3] if len(nodes) == 4 else 0.0 * theta_i
    rows = np.stack([theta_i, phi_i, *angles(wo)], axis=-1).reshape(-1, 4)
    pairs = direction_pairs.Pairs(rows, values.reshape(len(rows), *values.shape[len(axes) :]), channels=channels)
    return direction_pairs.material(pairs, path, about)


def expand(nodes: np.ndarray, values: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """A full circle of azimuths of one half, whose mirror image the other half is: [degrees], and values."""
    other = np.flatnonzero((nodes > 0.0) & (nodes < 180.0))[::-1]
    order: Sequence[int] = [*range(len(nodes)), *other]
    return np.concatenate([nodes, 360.0 - nodes[other]]), values.take(order, axis)
