"""Programs: the graph that a kernel computes, and the layout in memory of the arrays that it reads and writes."""

from __future__ import annotations

from typing import NamedTuple

from ...trace.graph import Graph

SAME, ROW, PACKED, PLANES, STRIDED = "same", "row", "packed", "planes", "strided"
"""Layouts of an array: one vector for the whole batch, one for each step of the outer axis, or along the inner axis
vectors side by side, components side by side, or any other strides."""

EACH, ONCE, TOTAL = "each", "once", "total"
"""Uses of an output: stored for every element, stored for every step of the outer axis, or summed over the inner."""


class Array(NamedTuple):
    """An input array: the length of its vectors and its layout."""

    width: int
    layout: str


class Output(NamedTuple):
    """An output: its nodes, side by side in memory, and its use."""

    nodes: tuple[int, ...]
    use: str


class Program(NamedTuple):
    """All that a kernel's machine code depends on, but the processor: graph, outputs, and layouts of its arrays."""

    graph: Graph
    outputs: tuple[Output, ...]
    arrays: tuple[Array, ...]
    tables: int
    dtype: str

    def digest(self) -> str:
        """A name for this program."""
        nodes = [node for output in self.outputs for node in output.nodes]
        facts = ([(len(o.nodes), o.use) for o in self.outputs], self.arrays, self.tables, self.dtype)
        return self.graph.digest(nodes, *facts)

    def words(self) -> int:
        """Length of the block of arguments [64-bit words], without its last word."""
        return 4 * len(self.arrays) + 2 * self.tables + 2 * len(self.outputs) + 1
