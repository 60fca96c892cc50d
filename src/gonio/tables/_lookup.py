"""f between the nodes of a grid: the nodes around a pair of directions, and the weighted mean of their values."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import Fixed, Roomy, ops
from ..formula.direction import Direction
from ..formula.state import note, state
from ..formula.table_warp import Slices
from .angle_systems import AngleSystem, angle_system
from .axes import Axis, nearest
from .drawing import Sampled

LEAST_KNOWN = 1e-3
"""Share of the weights, of nodes with data, below which f is NaN."""


class Interpolated(Sampled):
    """Base of tables: the formula that looks them up. Subclasses hold the values, and have the constructors."""

    interpolation: str
    outside: str
    channel: Any
    parameterization: str = state()
    """Name of the system of angles of the axes."""
    axes: dict[str, np.ndarray] = note()
    """Nodes [rad] of each axis, as given."""
    layout: tuple[Axis, ...] = state()
    width: int = state()
    """Channels, or 1."""
    holes: bool = state()
    """Whether f is NaN at some nodes."""
    values: Any  # f at the nodes, flat; of bound materials only

    @property
    def system(self) -> AngleSystem:
        """The system of angles of the axes."""
        return angle_system(self.parameterization)

    def brdf(self) -> np.ndarray:
        """f [1/sr] at the nodes."""
        raise NotImplementedError

    def _looked_up(self) -> dict[str, Fixed]:
        """f at the nodes with the circles closed, flat, and the nodes of uneven axes."""
        fixed = super()._looked_up()
        del fixed["stored"]
        uneven = {
            f"nodes_{k}": Fixed(axis.closed(nodes))
            for k, (axis, nodes) in enumerate(zip(self.layout, self.axes.values(), strict=True))
            if axis.spacing == "uneven"
        }
        return {**fixed, "values": Roomy(lambda: self._flat(self.brdf(), self.width)), **uneven}

    def _flat(self, values: np.ndarray, width: int) -> np.ndarray:
        """Values at the nodes, `width` of each, circles closed, flat, with one entry more: kernels gather pairs."""
        grid, sizes = tuple(map(len, self.axes.values())), tuple(axis.size for axis in self.layout)
        flat = np.empty(math.prod(sizes) * width + 1)
        flat[-1] = 0.0
        closed = flat[:-1].reshape(*sizes, width)
        closed[tuple(map(slice, grid))] = values.reshape(*grid, width)
        for k, (size, nodes) in enumerate(zip(sizes, grid, strict=True)):
            if size > nodes:
                along = np.moveaxis(closed, k, 0)
                along[-1] = along[0]
        return flat

    def formula(self, wi: Direction, wo: Direction) -> Any:
        corners, beyond = self.corners(wi, wo)
        value = self._combined(corners)
        if self.outside == "hold":
            return value
        return ops.where(beyond, math.nan if self.outside == "missing" else 0.0, value)

    def corners(self, wi: Direction, wo: Direction) -> tuple[Slices, Any]:
        """The nodes around a pair with their weights, those without data too; and whether it is beyond the grid.

        Of bound materials. A node's number counts the grid with its circles closed: `layout[k].size` along axis k.
        """
        corners: list[tuple[Any, Any]] = [(0, 1.0)]
        beyond: Any = False
        for k, angle in enumerate(self.system.angles(wi, wo, len(self.layout) == 4)):
            axis = self.layout[k]
            if self.outside != "hold" and axis.has_ends:
                beyond = beyond | axis.is_beyond(angle)
            around = axis.around(angle, self.__dict__.get(f"nodes_{k}"))
            if self.interpolation == "nearest":
                around = nearest(around)
            corners = [(at * axis.size + i, v * u) for at, v in corners for i, u in around]
        return corners, beyond

    def _combined(self, corners: Slices) -> Any:
        channel = ops.to_index(self.channel)
        values = [(ops.take(self.values, at * self.width + channel), weight) for at, weight in corners]
        if len(values) == 1:
            return values[0][0]
        if self.holes:
            return _mean_of_known(values)
        total = values[0][0] * values[0][1]
        for value, weight in values[1:]:
            total = total + weight * value
        return total


def _mean_of_known(values: Slices) -> Any:
    """The weighted mean of the values that are no NaN; NaN where these have next to no weight."""
    total: Any = 0.0
    known: Any = 0.0
    for value, weight in values:
        there = value == value
        weight = ops.where(there, weight, 0.0)
        total, known = total + weight * ops.where(there, value, 0.0), known + weight
    enough = known > LEAST_KNOWN
    return ops.where(enough, total / ops.where(enough, known, 1.0), math.nan)
