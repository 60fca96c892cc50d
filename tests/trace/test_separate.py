"""Graphs as sums of products: each sum is what the graph was, and what is no sum of products is said to be none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gonio.arrays import ops
from gonio.evaluate.interpret import evaluate
from gonio.trace.graph import Graph
from gonio.trace.separate import separated
from gonio.trace.symbol import Symbol

Formula = Callable[..., Any]

SUMS: dict[str, tuple[int, Formula]] = {
    "polynomial": (3, lambda a, b, x, y: (a * x + b) * y + 2.0 * a - x / 3.0 - a * 0.5),
    "quotient": (2, lambda a, b, x, y: (a * x - b) / (b * ops.sqrt(y))),
    "functions": (2, lambda a, b, x, y: ops.exp(a + b) * ops.sin(x * y) + ops.absolute(a * (x - 0.5))),
    "equal factors": (1, lambda a, b, x, y: a * x + a * y - (a * 2.0) * 0.0 - a),
    "choice by the second": (2, lambda a, b, x, y: ops.where(x < y, a * x, b * y)),
    "choice by the first": (2, lambda a, b, x, y: ops.where(a < b, a * x, b * y)),
    "of the first alone": (1, lambda a, b, x, y: a * b + 1.0),
    "of the second alone": (1, lambda a, b, x, y: x * y),
}
OTHERS: dict[str, Formula] = {
    "root": lambda a, b, x, y: ops.sqrt(a * x),
    "power": lambda a, b, x, y: ops.power(x, a),
    "divisor that is a sum": lambda a, b, x, y: y / (a + x),
    "choice by both": lambda a, b, x, y: ops.where(a < x, a, b),
    "too many products": lambda a, b, x, y: sum(
        ops.power(a, k) * ops.power(x, k) for k in (i + 0.5 for i in range(40))
    ),
}


def traced(formula: Formula) -> tuple[Graph, int]:
    graph = Graph()
    a, b, x, y = (Symbol(graph, graph.load(array, c)) for array in (1, 0) for c in (0, 1))
    return graph, formula(a, b, x, y).node


@pytest.mark.parametrize("name", SUMS)
def test_a_sum_of_products(name: str) -> None:
    least, formula = SUMS[name]
    graph, output = traced(formula)
    pairs = separated(graph, output, {1}, {0})
    assert pairs is not None
    arrays = np.random.default_rng(3).uniform(0.1, 1.0, (2, 2, 50))
    nodes = [output, *(node for pair in pairs for node in pair)]
    whole, *parts = evaluate(graph, nodes, lambda k, c: arrays[k, c], [], np.dtype(float))
    np.testing.assert_allclose(sum(a * g for a, g in zip(parts[::2], parts[1::2], strict=True)), whole, rtol=1e-13)
    assert least <= len(pairs) <= least + 2
    for k, side in enumerate(zip(*pairs, strict=True)):  # each side reads one array alone
        read = [graph.arguments[n][0] for n in graph.reachable(side) if graph.operations[n] == "load"]
        assert set(read) <= {1 - k}


@pytest.mark.parametrize("name", OTHERS)
def test_no_sum_of_products(name: str) -> None:
    graph, output = traced(OTHERS[name])
    assert separated(graph, output, {1}, {0}) is None
