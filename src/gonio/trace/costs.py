"""What operations cost, and which rewritings of a graph as fractions are worth a try."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from typing import NamedTuple

from ..arrays.ops import OPERATIONS
from .graph import REAL, Graph

COSTS = {name: row.cost for name, row in OPERATIONS.items() if row.cost is not None}
"""Costs of operations, in products."""
OTHER = 0.7
"""Cost of a comparison, a choice and the like."""


class Choice(NamedTuple):
    """Sums that get a common denominator, and products that are computed once for all that use them."""

    joined: frozenset[int]
    kept: frozenset[int]


class GraphFacts:
    """Facts about a graph before it is rewritten."""

    def __init__(self, graph: Graph, outputs: Sequence[int], fixed: Collection[int]):
        self.graph, self.outputs, self.fixed = graph, list(outputs), frozenset(fixed)
        self.order = graph.reachable(outputs)
        self.sources = {node: graph.inputs(node) for node in self.order}
        self.uses = Counter(source for inputs in self.sources.values() for source in inputs) + Counter(outputs)
        self.above_zero = self._above_zero()
        self.asked = frozenset().union(*self.above_zero.values())

    def _above_zero(self) -> dict[int, frozenset[int]]:
        """For each node the nodes that are above 0 wherever its value is taken: choices see to that."""
        taken = dict.fromkeys(self.outputs, frozenset[int]())
        for node in reversed(self.order):
            operation, inputs = self.graph.operations[node], self.sources[node]
            for i, source in enumerate(inputs):
                here = taken[node]
                if operation == "select" and i > 0:
                    here |= self._tested(inputs[0], i == 1)
                elif operation == "loop":  # its steps end whether or not its results are taken
                    here = frozenset()
                taken[source] = taken[source] & here if source in taken else here
        return taken

    def _tested(self, condition: int, truth: bool) -> frozenset[int]:
        """The nodes that are above 0 where a condition is true, or where it is false."""
        operation, inputs = self.graph.operations[condition], self.sources[condition]
        if operation == ("and" if truth else "or"):
            return self._tested(inputs[0], truth) | self._tested(inputs[1], truth)
        if operation == "xor" and self.graph.value(inputs[1]) == 1:
            return self._tested(inputs[0], not truth)
        if operation in (("gt", "ge") if truth else ("lt", "le")):
            bound = self.graph.value(inputs[1])
            if bound is not None and (bound > 0.0 or (bound == 0.0 and operation in ("gt", "le"))):
                return frozenset(inputs[:1])
        return frozenset()

    def choices(self) -> list[Choice]:
        """What to try: common denominators or none, and products that several others use apart or within these."""
        divided, soft = self._divided(), self._soft()
        sums = frozenset(n for n in divided & soft if self.graph.operations[n] in ("add", "sub"))
        shared = frozenset(n for n in self.order if self.uses[n] > 1 and self._is_product(n))
        none = frozenset[int]()
        return list(dict.fromkeys(Choice(joined, kept) for joined in (sums, none) for kept in (none, shared)))

    def _is_product(self, node: int) -> bool:
        return self.graph.kinds[node] == REAL and self.graph.operations[node] in ("mul", "div")

    def _divided(self) -> set[int]:
        """Nodes with a division among their products and sums."""
        divided: set[int] = set()
        for node in self.order:
            operation = self.graph.operations[node]
            of_divided = operation in ("add", "sub", "mul", "neg") and not divided.isdisjoint(self.sources[node])
            if operation == "div" or of_divided:
                divided.add(node)
        return divided

    def _soft(self) -> set[int]:
        """Nodes that only products, quotients and sums of such a kind use, where a divisor more is no division more."""
        soft = set(self.order).difference(self.outputs)
        for node in reversed(self.order):
            operation = self.graph.operations[node]
            if operation not in ("mul", "div", "neg") and not (operation in ("add", "sub") and node in soft):
                soft.difference_update(self.sources[node])
        return soft

    def cost(self, made: tuple[Graph, list[int]]) -> float:
        """The cost of what varies along the inner axis."""
        graph, outputs = made
        total, varies = 0.0, set[int]()
        for node in graph.reachable(outputs):
            operation, inputs = graph.operations[node], graph.inputs(node)
            if operation == "state" or (operation == "load" and graph.arguments[node][0] not in self.fixed):
                varies.add(node)
            elif not varies.isdisjoint(inputs):
                varies.add(node)
                by_fixed = operation == "div" and inputs[1] not in varies
                total += COSTS["mul"] if by_fixed else COSTS.get(operation, OTHER)
        return total
