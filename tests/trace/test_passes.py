"""The passes over graphs: what they give is what the formula gives, for every model; and each does what it is for."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from graphs import random_graph, steady
from libraries import thinned
from materials import COMPILED, OBEDIENT, Draw, draws, on_sphere, pairs
from sweeps import every

import gonio as gn
from gonio.arrays import ops
from gonio.arrays.kinds import SCALAR, VALUE, VECTOR
from gonio.base import kernels
from gonio.errors import ParameterError
from gonio.evaluate import blocks
from gonio.evaluate.call import Call
from gonio.evaluate.interpret import evaluate
from gonio.evaluate.tracing import Task, Trace, traced
from gonio.trace import passes
from gonio.trace.choices import fewer_choices
from gonio.trace.fractions import fewer_operations
from gonio.trace.graph import Graph
from gonio.trace.symbol import Symbol

TASKS = {
    "f": Task(kernels.value, (VALUE,), (3, 3)),
    "pdf": Task(kernels.pdf, (SCALAR,), (3, 3)),
    "sample": Task(kernels.sample, (VECTOR, VALUE, SCALAR, SCALAR), (3, 2)),
}
PASSES = {
    "fewer_choices": lambda graph, nodes, dtype: fewer_choices(graph, nodes),
    "fewer_operations": lambda graph, nodes, dtype: fewer_operations(graph, nodes, dtype, range(2, 1000)),
    "all": lambda graph, nodes, dtype: passes.rewritten(graph, nodes, dtype, range(2, 1000)),
}
LONG = {Draw(kind, 0) for kind in (gn.Microfacet, gn.RetroMicrofacet, gn.RoughDielectric)}
"""Graphs of thousands of nodes, those of ABC facets; for their models stand the draws 9."""
DRAWS = thinned(draws(1, every=3), {*COMPILED} - LONG)
"""Of every model at least one; a third of all with `full`."""
SHORT = [Draw(kind, 9) for kind in (gn.Microfacet, gn.RoughDielectric)]
FEW = thinned(draws(1, every=3), {*sorted(OBEDIENT - LONG, key=str)[::2], *SHORT})
"""Of a sixth of the models one; as many as above with `full`."""


def after(run: Any, trace: Trace, dtype: str) -> Trace:
    graph, nodes = run(trace.graph, [n for nodes in trace.results for n in nodes], dtype)
    rest = iter(nodes)
    return trace._replace(graph=graph, results=tuple(tuple(next(rest) for _ in nodes) for nodes in trace.results))


def values(trace: Trace, task: Task, m: gn.Reflectance, channels: int | None, *inputs: np.ndarray) -> list[np.ndarray]:
    call = Call(task, m, inputs, channels=channels, batch=inputs[0].shape[:-1])
    results = blocks.interpreted(trace, call, tuple(slice(0, n) for n in call.batch))
    return [np.broadcast_to(r, call.batch) for r in results]


def inputs_of(name: str) -> tuple[np.ndarray, np.ndarray]:
    wi, wo = pairs(1)
    return (wo, np.random.default_rng(5).random((len(wo), 2))) if name == "sample" else (wi, wo)


@pytest.mark.parametrize("draw", DRAWS, ids=str)
@pytest.mark.parametrize("run", thinned(PASSES, ["all"]))
def test_every_model_keeps_its_numbers(draw: Draw, run: str) -> None:
    """With each pass and without, in float64, to 1e-9 (below the horizon too, where numbers are masked)."""
    keeps_its_numbers(draw, "f", run)


@pytest.mark.parametrize("draw", FEW, ids=str)
@pytest.mark.parametrize("run", thinned(PASSES, ["all"]))
@every(name=["pdf", "sample"])
def test_samples_and_densities_keep_their_numbers(draw: Draw, name: str, run: str) -> None:
    keeps_its_numbers(draw, name, run)


def keeps_its_numbers(draw: Draw, name: str, run: str) -> None:
    channels = draw.layouts[0]
    m, task, inputs = draw.material(channels), TASKS[name], inputs_of(name)
    trace = traced(task, m, channels)
    written = values(trace, task, m, channels, *inputs)
    rewritten = values(after(PASSES[run], trace, "float64"), task, m, channels, *inputs)
    for a, b in zip(rewritten, written, strict=True):
        if b.dtype == bool:
            np.testing.assert_array_equal(a, b)
        else:
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12 * np.nanmax(np.abs(b), initial=1e-300))


@pytest.mark.parametrize("draw", FEW, ids=str)
def test_float32_is_as_true_as_before(draw: Draw) -> None:
    """No number is lost to a product that vanishes or overflows, and errors grow by no more than roundings of
    another order do (a quotient by a parameter is a product with its reciprocal)."""
    channels = draw.layouts[0]
    m, task = draw.material(channels), TASKS["f"]
    trace = traced(task, m, channels)
    cosines, azimuths = (x.ravel() for x in np.meshgrid([2e-6, 1e-5, 1e-4, 0.5], [0.0, 0.3, 3.0, np.pi]))
    grazing = on_sphere(np.arccos(cosines), azimuths)
    rows, columns = (x.ravel() for x in np.indices((len(grazing), len(grazing))))
    inputs = [np.concatenate(x) for x in zip(inputs_of("f"), (grazing[rows], grazing[columns]), strict=True)]
    short = [x.astype(np.float32) for x in inputs]
    truth = values(trace, task, m, channels, *(x.astype(np.float64) for x in short))
    written, rewritten = (values(t, task, m, channels, *short) for t in (trace, after(PASSES["all"], trace, "float32")))
    for exact, a, b in zip(truth, written, rewritten, strict=True):
        np.testing.assert_array_equal(np.isfinite(b), np.isfinite(a))
        errors = [np.abs(x - exact) / (np.abs(exact) + 1e-30) for x in (a, b)]
        ok = np.isfinite(a)
        assert np.quantile(errors[1][ok], 0.9) <= 2.5 * np.quantile(errors[0][ok], 0.9) + 3e-7
        assert np.max(errors[1][ok]) <= 3.0 * np.max(errors[0][ok]) + 2e-6


@pytest.mark.parametrize("seed", range(60))
def test_random_graphs_keep_their_numbers(seed: int) -> None:
    """Wherever NumPy's own rounding does not decide; what was no number may become one."""
    graph, nodes = random_graph(seed, loads=3, tables=2)
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(500, 3)) * rng.choice([0.1, 1.0, 10.0], size=(500, 1))
    tables = [rng.normal(size=7), rng.normal(size=7)]
    with np.errstate(all="ignore"):
        want = evaluate(graph, nodes, lambda a, c: x[:, c], tables, x.dtype)
        sure = steady(graph, nodes, x, tables, want)
        new, renamed = passes.rewritten(graph, nodes, "float64")
        got = evaluate(new, renamed, lambda a, c: x[:, c], tables, x.dtype)
    for a, b, ok in zip(got, want, sure, strict=True):
        a, b = np.broadcast_to(a, 500), np.broadcast_to(b, 500)
        ok = ok & np.isfinite(b)
        np.testing.assert_allclose(a[ok].astype(float), b[ok].astype(float), rtol=1e-7, atol=1e-280)


def rewritten(formula: Any, fixed: tuple[int, ...] = (1,)) -> Counter[str]:
    """The operations left of a formula of the components x, y, z of array 0 and the parameter a, array 1, that vary
    along the batch, and its values kept."""
    graph = Graph()
    x, y, z = (Symbol(graph, graph.load(0, c)) for c in range(3))
    a = Symbol(graph, graph.load(1, 0))
    node = formula(x, y, z, a).node
    new, (output,) = fewer_operations(graph, [node], "float32", fixed)
    v = np.random.default_rng(2).uniform(0.5, 1.5, (4, 20))
    before, after = (
        evaluate(g, [n], lambda k, c: v[3 * k + c], [], np.dtype(float))[0] for g, n in ((graph, node), (new, output))
    )
    np.testing.assert_allclose(after, before, rtol=1e-14)
    varies: set[int] = set()
    for n in new.reachable([output]):
        loads = new.operations[n] == "load"
        if (loads and new.arguments[n][0] not in fixed) or not varies.isdisjoint(new.inputs(n)):
            varies.add(n)
    return Counter(new.operations[n] for n in varies if new.operations[n] != "load")


def test_what_the_passes_are_for() -> None:
    # a common denominator, and one division where three stood
    assert rewritten(lambda x, y, z, a: (1.0 + x / y) / z / x)["div"] == 1
    # a common factor leaves a sum
    assert rewritten(lambda x, y, z, a: z * x + z * y) == {"add": 1, "mul": 1}
    # a root that is squared is none
    assert "sqrt" not in rewritten(lambda x, y, z, a: (x / ops.sqrt(y * y + z * z)) ** 2)
    # what stands above and below the line cancels, if it cannot be 0: 0/0 is NaN
    assert rewritten(lambda x, y, z, a: x * ops.exp(y) / (z * ops.exp(y))) == {"div": 1}
    assert rewritten(lambda x, y, z, a: x * y / (z * y)) == {"mul": 2, "div": 1}
    assert rewritten(lambda x, y, z, a: ops.where(y <= 1e-6, 0.0, x * y / (z * y))) == {"le": 1, "div": 1, "select": 1}
    # parameters are multiplied once
    assert rewritten(lambda x, y, z, a: 2.0 * a * x * a / (a + 1.0)) == {"mul": 1}
    # a difference of equals stays, for it is NaN where they are
    assert rewritten(lambda x, y, z, a: x - x) == {"sub": 1}
    # what may be infinite is brought into no other term
    assert rewritten(lambda x, y, z, a: (1.0 + x / ops.exp(y)) * z)["div"] == 1


def test_many_small_divisors_do_not_vanish() -> None:
    """Twelve numbers of 1e-4 above and below the line: their product is no float32, the quotient is one."""
    graph = Graph()
    parts = [Symbol(graph, graph.load(0, c)) for c in range(24)]
    value = parts[0]
    for k in range(1, 12):
        value = value * parts[2 * k + 1] / parts[2 * k]
    new, nodes = fewer_operations(graph, [value.node], "float32")
    small = np.full(3, 1e-4, np.float32)
    (got,) = evaluate(new, nodes, lambda k, c: small, [], np.dtype(np.float32))
    np.testing.assert_allclose(got, 1e-4, rtol=1e-5)


def test_what_only_a_guard_keeps_from_0_is_moved_into_no_other_term() -> None:
    """A cotangent of 1e12 seen along the normal: its powers are float32 numbers up to the third."""
    graph = Graph()
    x, z, u = (Symbol(graph, graph.load(0, c)) for c in range(3))
    cot = z / ops.sqrt(x * x + 1e-24)
    v = 1.0 / ops.sqrt(1.0 + cot * cot)
    value = u * (v * (2.0 + v * (3.0 + v)) + u * v * (1.0 - v))
    new, nodes = fewer_operations(graph, [value.node], "float32")
    (got,) = evaluate(new, nodes, lambda k, c: np.full(1, [0.0, 1.0, 0.5][c], np.float32), [], np.dtype(np.float32))
    np.testing.assert_allclose(got, 1.25e-12, rtol=1e-5)


@pytest.mark.parametrize("draw", FEW, ids=str)
def test_samples_seen_along_the_normal_in_float32(draw: Draw) -> None:
    channels = draw.layouts[0]
    m, task = draw.material(channels), TASKS["sample"]
    trace = traced(task, m, channels)
    wo = on_sphere(np.repeat([0.0, 1e-7, 1e-4], 40), np.zeros(120)).astype(np.float32)
    u = np.random.default_rng(8).random((len(wo), 2)).astype(np.float32)
    for x in values(after(PASSES["all"], trace, "float32"), task, m, channels, wo, u):
        assert np.isfinite(x).all()


def test_choices_under_a_mask_with_another_part() -> None:
    """A replacement where x is low is of no use to what is masked where x or y is low; it stays for all else."""
    graph = Graph()
    x, y = (Symbol(graph, graph.load(i, 0)) for i in (0, 1))
    low, other = x <= 0.0, y <= 0.0
    root = ops.sqrt(ops.where(low, 1.0, x))
    for masked, left in (
        (ops.where(low | other, 0.0, root), 1),
        (ops.where(other | (low | (y > 9.0)), 0.0, root), 1),
        (ops.where(low & other, 0.0, root), 2),
        (ops.where(other, 0.0, root), 2),
        (ops.where(low | other, root, 0.0), 2),
    ):
        made, nodes = fewer_choices(graph, [masked.node])
        assert sum(made.operations[n] == "select" for n in made.reachable(nodes)) == left


def test_conditions_and_choices_that_are_known() -> None:
    """True, False, and what the same condition has chosen already, cost no operation."""
    graph = Graph()
    x, y = (Symbol(graph, graph.load(i, 0)) for i in (0, 1))
    low, no, yes = x < 0.0, Symbol(graph, graph.constant(0, "mask")), Symbol(graph, graph.constant(1, "mask"))
    assert (low & yes).node == (low | no).node == (yes & low).node == low.node
    assert (low & no).node == (no & low).node == no.node
    assert (low | yes).node == (yes | low).node == yes.node
    once = ops.where(low, x, y)
    assert ops.where(low, x, ops.where(low, 1.0, y)).node == once.node
    assert ops.where(low, ops.where(low, x, 1.0), y).node == once.node
    assert ops.where(y < 0.0, x, ops.where(low, x, y)).node != once.node


def test_the_switch(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = Graph()
    node = graph.apply("div", graph.load(0, 0), graph.load(0, 0))
    monkeypatch.setenv("GONIO_PASSES", "off")
    assert passes.rewritten(graph, [node], "float32") == (graph, [node])
    monkeypatch.setenv("GONIO_PASSES", "no")
    with pytest.raises(ParameterError, match="GONIO_PASSES='no': expected off"):
        passes.wanted()
