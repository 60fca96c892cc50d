"""libbsdf's grids about another direction than the mirror's, which SSDD and Integra's files may hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...base.angles import angles
from ...tables.angle_systems import SYSTEMS
from ...tables.gridded import Gridded
from . import direction_pairs


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
