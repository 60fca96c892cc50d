"""Graphs in two stages: together they are what the graph was, and the second holds nothing that the first can, nor what
depends on the channel alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from libraries import thinned
from materials import OBEDIENT, Draw, draws, on_sphere, pairs

import gonio as gn
from gonio.arrays import Fixed, ops
from gonio.arrays.kinds import VALUE
from gonio.base import kernels
from gonio.evaluate.call import leaves_of, tables_of
from gonio.evaluate.interpret import evaluate
from gonio.evaluate.tracing import Task, traced
from gonio.trace import passes
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


@pytest.mark.parametrize("gathered", [True, False])
@pytest.mark.parametrize("name", FORMULAS)
def test_two_stages(name: str, gathered: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GONIO_PASSES", "" if gathered else "off")
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
    between = [np.broadcast_to(v, (1, 200, 1)).astype(float) for v in values(graph, list(two.first), arrays)]
    alone = [np.broadcast_to(v, (1, 1, 7)).astype(float) for v in values(graph, list(two.alone), arrays)]
    (staged,) = values(two.second, list(two.outputs), [arrays[0], *between, *alone, *arrays[1:]])
    a, b = (np.broadcast_to(v, (200, 7)) for v in (staged, whole))
    np.testing.assert_allclose(a, b, rtol=1e-14 if gathered else 0.0)
    assert all(graph.kinds[n] != INDEX for n in (*two.first, *two.alone))
    for nodes, array in ((two.first, 1), (two.alone, 0)):
        for node in graph.reachable(nodes):
            assert graph.operations[node] != "load" or graph.arguments[node][0] != array


def second(formula: Callable[..., Any]) -> tuple[int, int, list[str]]:
    """How many numbers come from the first stage and of the channel alone to the second, and what this computes."""
    graph = Graph()
    x, y = (Symbol(graph, graph.load(0, k)) for k in (0, 1))
    c = Symbol(graph, graph.load(1, 0))
    two = stages(graph, [formula(x, y, c).node], 1, [1], [0])
    operations = [two.second.operations[n] for n in two.second.reachable(two.outputs)]
    return len(two.first), len(two.alone), sorted({*operations} - {"load", "constant"})


def test_what_stages_are_for() -> None:
    # early factors of a product are one number, wherever they stand
    assert second(lambda x, y, c: ops.exp(x) * ops.sqrt(c + x) / (4.0 * ops.exp(y)) * 2.0) == (
        1,
        0,
        ["add", "mul", "sqrt"],
    )
    # what depends on the channel alone is one number of it
    assert second(lambda x, y, c: ops.exp(x) * (c * c - ops.exp(c))) == (1, 1, ["mul"])
    # what is simple to compute again from another number does not come through memory
    assert second(lambda x, y, c: ops.sqrt(ops.exp(x) + c) + ops.exp(x) * 3.0)[0] == 1


TASK = Task(kernels.value, (VALUE,), (3, 3))
CHANNELS = 12
LONG = {Draw(kind, 0) for kind in (gn.Microfacet, gn.RoughDielectric)}
FEW = thinned(draws(1, every=3), {draw._replace(seed=9) if draw in LONG else draw for draw in OBEDIENT})
"""Of a third of the models one, whose graph is not too large; of every model, and a third of all, with `full`."""


def values(m: gn.Reflectance, wi: np.ndarray, wo: np.ndarray, rewrite: bool) -> tuple[np.ndarray, np.ndarray]:
    """f of many channels by NumPy: at once, and in two stages."""
    trace, dtype = traced(TASK, m, 1), wi.dtype
    tables, first = tables_of(trace.looked_up, m, dtype), trace.inputs
    every = leaves_of(m, any(k >= first + len(leaves_of(m, False)) for k in trace.read))
    leaves = [np.asarray(x.numbers if isinstance(x, Fixed) else x, dtype) for x in every]
    arrays = [*(w.T[..., None] for w in (wi, wo)), *(x[None] for x in leaves)]
    (node,) = trace.results[0]

    def run(graph: Graph, nodes: Any, arrays: list[np.ndarray]) -> list[np.ndarray]:
        with np.errstate(all="ignore"):
            return evaluate(graph, nodes, lambda k, c: arrays[k][c], tables, dtype)

    within = [first + k for k, x in enumerate(leaves) if first + k in trace.read and x.shape[-1:] not in ((), (1,))]
    two = stages(trace.graph, [node], first, within, range(first))
    between = [np.asarray(v, dtype)[None] for v in run(trace.graph, [*two.first, *two.alone], arrays)]
    graph, nodes = two.second, list(two.outputs)
    if rewrite:
        fixed = [k for k in range(1000) if not first + len(two.first) <= k < first + len(between)]
        graph, nodes = passes.rewritten(graph, nodes, str(dtype), fixed)
    (whole,), (staged,) = (
        run(trace.graph, [node], arrays),
        run(graph, nodes, [*arrays[:first], *between, *arrays[first:]]),
    )
    shape = (len(wi), CHANNELS)
    return np.broadcast_to(whole, shape), np.broadcast_to(staged, shape)


@pytest.mark.parametrize("draw", FEW, ids=str)
def test_every_model_keeps_its_numbers(draw: Draw) -> None:
    """In float64, to 1e-9."""
    for rewrite in (False, True):
        whole, staged = values(draw.material(CHANNELS), *pairs(1), rewrite)
        np.testing.assert_allclose(staged, whole, rtol=1e-9, atol=1e-12 * np.nanmax(np.abs(whole), initial=1e-300))


@pytest.mark.parametrize("draw", FEW, ids=str)
def test_float32_is_as_true_as_before(draw: Draw) -> None:
    """No number is lost to a product that vanishes or overflows, and errors grow by no more than roundings of another
    order do."""
    cosines, azimuths = (x.ravel() for x in np.meshgrid([2e-6, 1e-5, 1e-4, 0.5], [0.0, 0.3, 3.0, np.pi]))
    grazing = on_sphere(np.arccos(cosines), azimuths)
    rows, columns = (x.ravel() for x in np.indices((len(grazing), len(grazing))))
    wi, wo = (np.concatenate(x) for x in zip(pairs(1), (grazing[rows], grazing[columns]), strict=True))
    short = [x.astype(np.float32) for x in (wi, wo)]
    m = draw.material(CHANNELS)
    exact, _ = values(m, *(x.astype(np.float64) for x in short), False)
    whole, staged = values(m, *short, False)
    np.testing.assert_array_equal(np.isfinite(staged), np.isfinite(whole))
    before, after = (np.abs(x - exact) / (np.abs(exact) + 1e-30) for x in (whole, staged))
    ok = np.isfinite(whole)
    assert np.quantile(after[ok], 0.9) <= 2.5 * np.quantile(before[ok], 0.9) + 3e-7
    assert np.max(after[ok]) <= 3.0 * np.max(before[ok]) + 2e-6
