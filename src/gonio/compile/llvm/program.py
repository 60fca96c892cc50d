"""Programs: the graph that a kernel computes, and the layout in memory of the arrays that it reads and writes."""

from __future__ import annotations

from typing import NamedTuple

from ...trace.graph import Graph

SAME, ROW, PACKED, PLANES, STRIDED = "same", "row", "packed", "planes", "strided"
"""Layouts of an array: one vector for the whole batch, one for each step of the outer axis, or along the inner axis
vectors side by side, components side by side, or any other strides."""

EACH, ONCE, TOTAL, SQUARED, ADDED = "each", "once", "total", "square", "added"
"""Uses of an output: stored for every element, stored for every step of the outer axis, summed over the inner, the
square of such a sum, or added for every element to a double in memory, which has no outermost axis."""

SUMS = (TOTAL, SQUARED)


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
    single: bool = False  # one vector at a time, for an inner axis that is short
    adds: bool = False  # sums are added to what is in memory

    def digest(self) -> str:
        """A name for this program."""
        nodes = [node for output in self.outputs for node in output.nodes]
        uses = [(len(o.nodes), o.use) for o in self.outputs]
        facts = (uses, self.arrays, self.tables, self.dtype, self.single, self.adds)
        return self.graph.digest(nodes, *facts)

    def words(self) -> int:
        """Length of the block of arguments [64-bit words], without its last word."""
        return 4 * len(self.arrays) + 2 * self.tables + 2 * len(self.outputs) + 1
