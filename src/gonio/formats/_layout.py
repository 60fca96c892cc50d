"""The table of a file, said once: its angles, their order, zero and sense, which one walker reads and writes.

A format that is read and written has `LAYOUT`, a `Layout`, or `NO_LAYOUT`, in a line why none fits. Its text is read by
its own grammar, with messages that name the line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..errors import ParameterError
from ..tables.angle_systems import SYSTEMS, angle_system
from ..tables.rows import ROW_ANGLES
from ._reading import plain_text

HALVED = ("phi", "azimuth", "phi_d")
"""Azimuths that may cover half of a circle, of which the other half is the mirror image."""


class FileAxis(NamedTuple):
    """An angle of a file, of which gonio's is sign * angle + shift [degrees].

    name    of gonio's axis, or "channel"
    sign    -1 where the file's angle grows the other way round
    bounds  of the file's angle
    around  whether a file is written with azimuths from 0 to 360
    alone   the angle that stands for all in files of isotropic materials
    usual   (usual lists of angles) -> nodes of a written model: see `angle_tables.asked_or_usual`
    """

    name: str
    shift: float = 0.0
    sign: float = 1.0
    bounds: tuple[float, float] = (-math.inf, math.inf)
    around: bool = False
    alone: float = 0.0
    usual: Callable[[Any], list[float]] | None = None

    def of_file(self, angle: Any) -> Any:
        """gonio's angle of the file's [degrees]."""
        angle = -angle if self.sign < 0.0 else angle
        return self.shift + angle if self.shift else angle

    def read(self, nodes: np.ndarray, half: bool) -> tuple[np.ndarray, Any]:
        """gonio's nodes [degrees], rising, and the file's numbers of them; `half` a circle becomes 0 to 180."""
        x = self.of_file(nodes)
        if half and self.name in HALVED and (min(x[0], x[-1]) >= 180.0 or max(x[0], x[-1]) <= 0.0):
            x = (360.0 if x[-1] >= 180.0 else 0.0) - self.shift - self.sign * nodes
        order = slice(None, None, -1) if x[-1] < x[0] else slice(None)
        return x[order], order

    def written(self, nodes: np.ndarray, half: bool, decimals: int) -> tuple[np.ndarray, Any]:
        """The inverse: the file's nodes, and gonio's numbers of them."""
        mirrored = half and self.name in HALVED and (self.sign * (nodes - self.shift)).min() < 0.0
        order: Any = slice(None)
        if (self.sign < 0.0) != mirrored:
            order = slice(None, None, -1)
            nodes = (self.shift if self.sign < 0.0 else 360.0 - self.shift) - nodes[order]
        elif self.shift:
            nodes = nodes + self.shift if mirrored else nodes - self.shift
        nodes = np.round(nodes, decimals) if self.shift else nodes
        if self.around and (nodes[0] < 0.0 or nodes[-1] > 360.0):
            whence = np.arange(len(nodes))[order]
            nodes, first = np.unique(np.mod(nodes, 360.0), return_index=True)
            order = whence[first]
        return np.round(nodes, decimals) if self.shift else nodes, order


CHANNEL = FileAxis("channel")


class Layout(NamedTuple):
    """A table of a file: a grid, or rows with a column for each angle.

    system    of its angles, in `SYSTEMS`
    axes      the file's words -> its axes, outermost first, or its columns
    turned    those of `axes` that are others where the sample was turned
    decimals  of written angles [degrees] that have another zero than gonio's
    unit      of the angles of rows: "deg" or "rad"
    """

    system: str
    axes: Mapping[str, FileAxis]
    turned: Mapping[str, FileAxis] = MappingProxyType({})
    decimals: int = 9
    unit: str = "deg"

    def of(self, oriented: bool) -> dict[str, FileAxis]:
        """The file's axes of isotropic or of other materials, outermost first."""
        return {**self.axes, **self.turned} if oriented else dict(self.axes)

    def grid(self, oriented: bool) -> dict[str, FileAxis]:
        """Those that tables have, in their order."""
        by_name = {axis.name: (word, axis) for word, axis in self.of(oriented).items()}
        names = angle_system(self.system).axes(oriented)
        if not {*names} <= {*by_name}:
            symmetry = "anisotropic" if oriented else "isotropic"
            file_words = ", ".join(name for name in by_name if name != CHANNEL.name)
            raise ParameterError(
                f"{symmetry} tables have the angles {', '.join(names)}, and files of this format {file_words}; write "
                f"another material, or another format"
            )
        return dict(by_name[name] for name in names)

    def order(self, oriented: bool) -> list[int]:
        """The numbers of the file's axes as tables have them: `grid`, those that the file alone has, the channel."""
        axes, grid = self.of(oriented), self.grid(oriented)
        words = sorted(axes, key=lambda word: (axes[word].name == "channel", word not in grid))
        return [list(axes).index(word) for word in (*grid, *(word for word in words if word not in grid))]

    def table(self, values: np.ndarray, oriented: bool) -> np.ndarray:
        """Values (grid..., C, ...) of those with the file's axes."""
        order = self.order(oriented)
        return np.transpose(values, [*order, *range(len(order), values.ndim)])

    def read(
        self, angles: Mapping[str, Any], values: np.ndarray, half: bool = False, oriented: bool = False
    ) -> tuple[dict[str, np.ndarray], np.ndarray, bool]:
        """Axes [rad] of a `Gridded` with values (grid..., C), and whether it is mirrored.

        angles    of the file [degrees], by its words
        values    with the file's axes; of isotropic materials the first of those that tables have not
        half      whether azimuths cover half of a circle, of which a table of a turned sample gets both
        oriented  whether the sample was turned
        """
        values, grid, axes = self.table(values, oriented), self.grid(oriented), {}
        if values.ndim > len(grid) + 1:
            values = values[(slice(None),) * len(grid) + (0,)]
        for k, (word, axis) in enumerate(grid.items()):
            nodes: np.ndarray = np.asarray(angles[word], float)
            if half and oriented and axis.name in HALVED:
                nodes, values = whole(nodes, values, k)
            nodes, which = axis.read(nodes, half and not oriented)
            axes[axis.name], values = np.radians(nodes), values[(slice(None),) * k + (which,)]
        return axes, values, half and not oriented

    def nodes(self, angles: Mapping[str, Any], oriented: bool) -> dict[str, np.ndarray]:
        """Axes [rad] of a `Gridded`, of angles of the file [degrees] of the whole circle."""
        grid = self.grid(oriented)
        return {axis.name: np.radians(axis.read(np.asarray(angles[word]), False)[0]) for word, axis in grid.items()}

    def written(
        self, axes: Mapping[str, np.ndarray], values: np.ndarray, half: bool = False
    ) -> tuple[dict[str, list[float]], np.ndarray]:
        """The inverse: angles of the file [degrees], by its words, and values with its axes."""
        oriented = len(axes) == len(SYSTEMS[self.system].oriented)
        order, angles = self.order(oriented), dict[str, list[float]]()
        for k, (word, axis) in enumerate(self.grid(oriented).items()):
            nodes, which = axis.written(plain_text.degrees(axes[axis.name]), half, self.decimals)
            angles[word], values = nodes.tolist(), values[(slice(None),) * k + (which,)]
        if len(order) > values.ndim:
            values = values[..., None, :]
        alone = {word: [axis.alone] for word, axis in self.of(oriented).items() if axis.name != "channel"}
        angles = {word: angles.get(word, nodes) for word, nodes in alone.items()}
        return angles, np.transpose(values, np.argsort(order))

    def blocks(
        self, nodes: Mapping[str, np.ndarray], rows: int = 1
    ) -> Iterator[tuple[slice, tuple[np.ndarray, np.ndarray]]]:
        """wi and wo (grid..., 3) at nodes [rad] by gonio's names, in the file's order, of so many nodes of its
        outermost angle at a time; and which these are."""
        names = [axis.name for axis in self.axes.values() if axis.name in nodes]
        outermost, *others = (nodes[name] for name in names)
        system = SYSTEMS[self.system]
        for start in range(0, len(outermost), rows):
            part = slice(start, start + rows)
            grid = dict(zip(names, np.meshgrid(outermost[part], *others, indexing="ij"), strict=True))
            yield part, system.pairs(*(grid[name] for name in system.axes(len(names) == len(system.oriented))))

    def pairs(self, columns: np.ndarray) -> np.ndarray:
        """theta_i, phi_i, theta_o, phi_o [rad] (n, 4) of rows of the file's angles; 0 where there is no column."""
        names = [axis.name for axis in self.axes.values()]
        whole = [columns[:, names.index(name)] if name in names else np.zeros(len(columns)) for name in ROW_ANGLES]
        return np.radians(np.stack(whole, axis=1)) if self.unit == "deg" else np.stack(whole, axis=1)

    def columns(self, pairs: np.ndarray) -> np.ndarray:
        """The inverse: of degrees those with the fewest decimals."""
        columns = plain_text.degrees(pairs) if self.unit == "deg" else pairs
        return columns[:, [ROW_ANGLES.index(axis.name) for axis in self.axes.values()]]


def columns(*words: str, unit: str = "deg") -> Layout:
    """Rows whose columns are theta_i, phi_i, theta_o, phi_o, by the file's words."""
    return Layout("angles", dict(zip(words, map(FileAxis, ROW_ANGLES), strict=True)), unit=unit)


def whole(nodes: np.ndarray, values: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """A full circle of azimuths [degrees], and values, from one half and its mirror image."""
    other = np.flatnonzero((nodes > 0.0) & (nodes < 180.0))[::-1]
    return np.concatenate([nodes, 360.0 - nodes[other]]), values.take([*range(len(nodes)), *other], axis)
