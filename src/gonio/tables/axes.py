"""The axes of a grid of angles: checks of their nodes, and the position of an angle among them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..errors import ParameterError, TooLargeError
from ..formula.table_warp import Slices, bracket
from ..machine.memory import physical
from .angle_systems import ANGLES, AZIMUTHS, AngleSystem, NodeCounts, angle_system

INSIDE = 1e-6
"""Angles up to this [rad] beyond the outermost nodes count as between them."""

PAIR = 128
"""Bytes that an evaluation takes at least for a pair of directions, its angles, and f."""


def counts(resolution: Any, lengths: Sequence[int], least: int, expected: str) -> tuple[int, ...]:
    """The numbers of nodes along each axis that a caller asks for.

    `lengths`: how many numbers may be given; `least`: of each; `expected`: their meaning, for messages. Raises
    ParameterError for anything else, and TooLargeError where their product is more than this machine has memory for.
    """
    numbers = list(resolution) if isinstance(resolution, (tuple, list, np.ndarray)) else []
    whole = all(isinstance(n, (int, np.integer)) and not isinstance(n, bool) for n in numbers)
    if not whole or len(numbers) not in lengths or min(numbers) < least:
        many = " or ".join(map(str, lengths))
        example = ",".join(["18"] * lengths[0])
        raise ParameterError(
            f"resolution={resolution!r:.60}: expected {many} whole numbers from {least}: {expected}; such as {example}"
        )
    sizes = tuple(map(int, numbers))
    fits(math.prod(sizes), f"resolution={sizes!r:.60}")
    return sizes


def fits(pairs: float, asked: str) -> None:
    """Raises TooLargeError if f at this number of pairs of directions needs more memory than this machine has."""
    if pairs * PAIR > physical():
        raise TooLargeError(
            f"{asked}: {pairs:.3g} pairs of directions take {pairs * PAIR / 1e9:.3g} GB and this machine has "
            f"{physical() / 1e9:.3g} GB of memory; ask for fewer"
        )


def nodes_of(
    system: AngleSystem, oriented: bool, resolution: Any, usual: NodeCounts, periods: Mapping[str, float] | None = None
) -> dict[str, np.ndarray]:
    """Nodes of a system's axes, `resolution` along each, or `usual` if that is None. Raises what `counts` does."""
    names = system.axes(oriented)
    if resolution is None:
        resolution = usual.oriented if oriented else usual.isotropic
    return system.nodes(counts(resolution, (len(names),), 2, f"nodes of {', '.join(names)}"), periods or {})


def between(position: Any, count: int) -> Slices:
    """The two nodes around a position, among `count` nodes 0, 1, ..., with linear weights."""
    position = ops.clip(position, 0.0, count - 1.0)
    start = ops.minimum(ops.floor(position), count - 2.0)
    i, w = ops.to_index(start), position - start
    return ((i, 1.0 - w), (i + 1, w))


class Axis(NamedTuple):
    """An axis, for formulas that look up the position of an angle among its nodes.

    spacing   "even", "even in square root", or "uneven": searched
    start     first node of an even axis (its square root), and `step`, the distance between nodes
    size      number of nodes, with the one that closes the circle
    period    of azimuths, else 0
    """

    spacing: str
    start: float
    step: float
    size: int
    period: float
    mirrored: bool
    first: float
    last: float

    def around(self, angle: Any, nodes: Any) -> Slices:
        """The nodes around an angle with linear weights; beyond the outermost nodes these have all the weight.

        `nodes`: of an uneven axis, as `closed` returns them.
        """
        if self.size == 1:
            return ((0, 1.0),)
        if self.period:
            angle = angle - (0.0 if self.mirrored else self.start)
            angle = angle - self.period * ops.floor(angle * (1.0 / self.period))
            if self.mirrored:
                angle = ops.minimum(angle, self.period - angle) - self.start
        elif self.spacing == "even in square root":
            angle = ops.sqrt(ops.maximum(angle, 1e-12)) - self.start  # the floor keeps the derivative finite at 0
        elif self.spacing == "even":
            angle = angle - self.start
        if self.spacing == "uneven":
            return bracket(nodes, self.size, angle)
        return between(angle * (1.0 / self.step), self.size)

    @property
    def has_ends(self) -> bool:
        """Whether angles can be beyond the outermost nodes: not azimuths, nor where one node stands for all angles."""
        return not self.period and self.size > 1

    def is_beyond(self, angle: Any) -> Any:
        """Whether an angle is beyond the outermost nodes."""
        return (angle < self.first - INSIDE) | (angle > self.last + INSIDE)

    def apart(self, angle: np.ndarray, other: Any) -> np.ndarray:
        """The distance [rad] of two angles, the shorter way round a circle; of mirrored azimuths that of the images."""
        if not self.period:
            return np.abs(angle - other)
        off = np.mod(angle - other, self.period)
        off = np.minimum(off, self.period - off)
        return np.minimum(off, self._replace(mirrored=False).apart(-angle, other)) if self.mirrored else off

    def closed(self, nodes: np.ndarray) -> np.ndarray:
        """Nodes to search: those of a circle count from the first, which is repeated at the end to close it."""
        if not self.period:
            return nodes
        return np.append(nodes, nodes[0] + self.period)[: self.size] - nodes[0]


def nearest(around: Slices) -> Slices:
    """The nearer of two neighbouring nodes, with all the weight."""
    if len(around) == 1:
        return around
    (i, _), (_, w) = around
    return ((i + ops.to_index(ops.floor(w + 0.5)), 1.0),)


def laid_out(
    name: str, axes: Mapping[str, np.ndarray], mirrored: bool, periods: Mapping[str, float]
) -> tuple[tuple[Axis, ...], dict[str, float]]:
    """The axes of a grid of an angle system, and the periods [rad] of its azimuths.

    Raises ParameterError where the nodes do not fit the system, a period, or each other.
    """
    _check(name, axes, mirrored)
    around = {axis: float(periods.get(axis, 2.0 * math.pi)) for axis in axes if axis in AZIMUTHS}
    if unknown := set(periods) - set(around):
        raise ParameterError(f"periods={dict(periods)!r}: {unknown} are no azimuths; expected {list(around)}")
    layout = (_axis(n, x, around.get(n, 0.0), mirrored and k == 2) for k, (n, x) in enumerate(axes.items()))
    return tuple(layout), around


def _check(name: str, axes: Mapping[str, np.ndarray], mirrored: bool) -> None:
    """Raises ParameterError where the axes do not fit the system."""
    system = angle_system(name)
    if tuple(axes) not in (system.isotropic, system.oriented):
        listed = " or ".join(", ".join(names) for names in (system.isotropic, system.oriented))
        raise ParameterError(f"axes: got {', '.join(axes)}, expected for {name!r}: {listed}, in this order")
    if mirrored and len(axes) == 4:
        raise ParameterError("mirrored=True: expected three axes; a plane of symmetry says nothing of four")
    for axis, nodes in axes.items():
        highest = ANGLES[axis].highest
        low, high = (-4.0 * math.pi, 4.0 * math.pi) if highest is None else (0.0, highest)
        if not len(nodes) or not np.isfinite(nodes).all() or not (np.diff(nodes) > 0.0).all():
            shown = np.array2string(nodes, threshold=6, edgeitems=3, precision=4)
            raise ParameterError(f"axes: {axis} is {shown}, expected increasing, finite nodes [rad]")
        if nodes[0] < low - INSIDE or nodes[-1] > high + INSIDE:
            raise ParameterError(
                f"axes: {axis} runs from {nodes[0]:g} to {nodes[-1]:g}, expected {low:g} to {high:g} rad; "
                f"convert degrees with numpy.radians"
            )


def _axis(name: str, nodes: np.ndarray, period: float, mirrored: bool) -> Axis:
    closed = nodes
    if period and len(nodes) > 1:
        span = nodes[-1] - nodes[0]
        if mirrored and not -INSIDE <= nodes[0] <= nodes[-1] <= 0.5 * period + INSIDE:
            raise ParameterError(
                f"axes: {name} runs from {nodes[0]:g} to {nodes[-1]:g}, expected 0 to {0.5 * period:g} rad, "
                f"because the other half is mirrored"
            )
        if span > period + INSIDE:
            raise ParameterError(f"axes: {name} covers {span:g} rad, expected at most its period, {period:g}")
        if not mirrored and span < period - INSIDE:
            closed = np.append(nodes, nodes[0] + period)
    spacing, start, step = "uneven", float(nodes[0]), 1.0
    if len(closed) > 1:
        for evenness, x in (("even", closed), ("even in square root", np.sqrt(np.maximum(closed, 0.0)))):
            even = np.linspace(x[0], x[-1], len(x))
            if np.abs(x - even).max() <= 1e-10 * (x[-1] - x[0]) and not (period and evenness != "even"):
                spacing, start, step = evenness, float(x[0]), float(x[-1] - x[0]) / (len(x) - 1)
                break
    return Axis(spacing, start, step, len(closed), period, mirrored, float(nodes[0]), float(nodes[-1]))
