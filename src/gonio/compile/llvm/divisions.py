"""Fewer divisions, the slowest operations of a formula: several in a row become one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial, reduce

from ...trace.graph import Graph

TOGETHER = {"float32": 3, "float64": 4}
"""Divisors multiplied together at most: few in float32, whose products of small numbers must not vanish."""

_Fraction = tuple[list[int], list[int]]


def fewer_divisions(graph: Graph, outputs: Sequence[int], dtype: str) -> tuple[Graph, list[int]]:
    """An equal graph and its outputs, in which a/x*b/y has become a b/(x y); it rounds a little less."""
    return _Rewriting(graph, outputs, TOGETHER[dtype]).result()


class _Rewriting:
    def __init__(self, graph: Graph, outputs: Sequence[int], together: int):
        self.graph, self.outputs, self.together = graph, outputs, together
        self.new = Graph()
        self.order = graph.reachable(outputs)
        self.uses = Counter(source for node in self.order for source in graph.inputs(node)) + Counter(outputs)
        self.plain: dict[int, int] = {}
        self.fractions: dict[int, _Fraction] = {}  # nodes that nothing but a product or quotient uses

    def result(self) -> tuple[Graph, list[int]]:
        inner = self.inner()
        for node in self.order:
            if self.is_factor(node):
                fraction = self.fraction(node)
                if node in inner:
                    self.fractions[node] = fraction
                else:
                    self.plain[node] = self.divided(fraction)
            else:
                self.plain[node] = self.copied(node)
        return self.new, [self.plain[node] for node in self.outputs]

    def is_factor(self, node: int) -> bool:
        """Whether a node is a product or a quotient; one by a root is not, for reciprocal roots are quick."""
        graph = self.graph
        if graph.operations[node] == "div":
            return graph.operations[graph.arguments[node][1]] != "sqrt"
        return graph.operations[node] == "mul" and graph.kinds[node] == "real"

    def inner(self) -> set[int]:
        """Factors used once, by another factor, as a numerator."""
        inner: set[int] = set()
        for node in self.order:
            if self.is_factor(node):
                sources = self.graph.arguments[node]
                numerators = sources[:1] if self.graph.operations[node] == "div" else sources
                inner.update(n for n in numerators if self.uses[n] == 1 and self.is_factor(n))
        return inner

    def fraction(self, node: int) -> _Fraction:
        """The factors above and below the line."""
        a, b = self.graph.arguments[node]
        above, below = self.parts(a)
        if self.graph.operations[node] == "div":
            return above, [*below, self.plain[b]]
        more = self.parts(b)
        return above + more[0], below + more[1]

    def parts(self, node: int) -> _Fraction:
        if node in self.fractions:
            return self.fractions[node]
        return ([] if self.graph.value(node) == 1.0 else [self.plain[node]]), []

    def divided(self, fraction: _Fraction) -> int:
        above, below = fraction
        result = self.product(above)
        for start in range(0, len(below), self.together):
            result = self.new.apply("div", result, self.product(below[start : start + self.together]))
        return result

    def product(self, factors: Sequence[int]) -> int:
        return reduce(partial(self.new.apply, "mul"), factors) if factors else self.new.constant(1.0)

    def copied(self, node: int) -> int:
        operation, arguments = self.graph.operations[node], self.graph.arguments[node]
        if operation == "constant":
            return self.new.constant(arguments[0], self.graph.kinds[node])
        if operation == "load":
            return self.new.load(*arguments)
        if operation == "take":
            return self.new.take(arguments[0], self.plain[arguments[1]])
        return self.new.apply(operation, *(self.plain[a] for a in arguments))
