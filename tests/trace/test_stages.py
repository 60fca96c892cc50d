"""Graphs in two stages: together they are what the graph was, and the second holds nothing that the first can."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gonio.arrays import ops
from gonio.evaluate.interpret import evaluate
from gonio.trace.graph import INDEX, Graph
from gonio.trace.stages import stages
from gonio.trace.symbol import Symbol, TableSymbol

TABLE = np.linspace(1.0, 2.0, 50)

FORMULAS: dict[str, Callable[..., Any]] = {
    # x, y of the batch, c of the channel, s a number alone, t a table
    "product": lambda x, y, c, s, t: ops.exp(x * y + s) * c,
    "choice": lambda x, y, c, s, t: ops.where(x < y * s, c, c * y),
    "lookup": lambda x, y, c, s, t: ops.take(t, ops.to_index(40.0 * x)) * c + ops.take(t, ops.to_index(20.0 * c + y)),
    "place": lambda x, y, c, s, t: ops.take(t, ops.to_index(9.0 * x) * 3 + ops.to_index(2.0 * c)) + y,
    "channels alone": lambda x, y, c, s, t: ops.sqrt(c) + s,
    "batch alone": lambda x, y, c, s, t: x * y - s,
    "nothing": lambda x, y, c, s, t: 0.0 * s + 2.0,
}


@pytest.mark.parametrize("name", FORMULAS)
def test_two_stages(name: str) -> None:
    graph = Graph()
    x, y = (Symbol(graph, graph.load(0, k)) for k in (0, 1))
    c, s = (Symbol(graph, graph.load(k, 0)) for k in (1, 2))
    output = FORMULAS[name](x, y, c, s, TableSymbol(graph, 0)).node
    two = stages(graph, [output], 1, [1], [0])
    assert stages(graph, [output], 1, [1], [0]) is two
    rng = np.random.default_rng(4)
    arrays = [rng.uniform(0.1, 1.0, (2, 200, 1)), rng.uniform(0.1, 1.0, (1, 1, 7)), np.full((1, 1, 1), 0.7)]

    def values(graph: Graph, nodes: list[int], arrays: list[np.ndarray]) -> list[np.ndarray]:
        return evaluate(graph, nodes, lambda k, i: arrays[k][i], [TABLE], np.dtype(float))

    (whole,) = values(graph, [output], arrays)
    first = values(graph, list(two.first), arrays)
    between = [np.broadcast_to(np.asarray(v, dtype=float), (200, 1))[None] for v in first]
    (staged,) = values(two.second, list(two.outputs), [arrays[0], *between, *arrays[1:]])
    np.testing.assert_array_equal(np.broadcast_to(staged, (200, 7)), np.broadcast_to(whole, (200, 7)))
    assert all(graph.kinds[n] != INDEX for n in two.first)
    for node in graph.reachable(two.first):
        assert graph.operations[node] != "load" or graph.arguments[node][0] != 1
