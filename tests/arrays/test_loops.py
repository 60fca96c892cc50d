"""`ops.loop` on every array library and compiled, against Python's own loops over single numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from libraries import KINDS, DrJitTensor, Library, Uncompiled, opened

from gonio.arrays import Fixed, ops
from gonio.arrays.kinds import SCALAR, TOTAL, VALUE
from gonio.errors import ShapeError, TraceError
from gonio.evaluate import batch
from gonio.evaluate.computation import Computation, composite
from gonio.evaluate.interpret import evaluate
from gonio.evaluate.tracing import traced
from gonio.trace.derive import gradient
from gonio.trace.graph import Graph
from gonio.trace.symbol import Symbol, Symbols

SINGLE = [kind for kind in KINDS if kind not in (Uncompiled, DrJitTensor)]
X = np.concatenate([[0.0, 0.5, 1.0, 1e4, np.nan], np.random.default_rng(5).uniform(0.0, 300.0, 200)])
TABLE = np.array([3.0, 7.0, 1.0, 5.0, 2.0])


@pytest.fixture(params=SINGLE, ids=lambda kind: kind.name, scope="module")
def own(request: pytest.FixtureRequest) -> Library:
    return opened(request.param)


def walk(x, limit):
    """States of every kind: halves x until it is at most the limit; steps, the sum, whether it was ever above 100."""

    def step(y, n, total, high):
        high = high | (y > 100.0)
        total = total + y
        return 0.5 * y > limit, 0.5 * y, n + 1, total, high

    return ops.loop(step, x, 0, 0.0, False)


def walked(x, limit):
    y, n, total, high = x, 0, 0.0, False
    while True:
        high = high or y > 100.0
        total += y
        y, n = 0.5 * y, n + 1
        if not y > limit:
            return y, n, total, high


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_each_element_takes_its_own_steps(own, dtype):
    y, n, total, high = walk(own.array(X, dtype), 1.5)
    want = np.array([walked(float(x), 1.5) for x in X.astype(dtype)]).T
    assert own.dtype(y) == own.dtype(total) == dtype
    np.testing.assert_array_equal(own.numpy(y), want[0])
    np.testing.assert_array_equal(own.numpy(n), want[1])
    np.testing.assert_allclose(own.numpy(total), want[2], rtol=1e-6 if dtype == "float32" else 1e-14)
    np.testing.assert_array_equal(own.numpy(high), want[3])


def looped(scene, mean, x):
    y, n, total, high = walk(x[0], scene.limit)
    return 1.0 * n, total + ops.where(high, 1000.0, 0.0), ops.where(n > 3, y, -1.0)


LOOPED = Computation(looped, {"x": 1}, {"n": VALUE, "total": VALUE, "y": VALUE})


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("channels", [0, 3, 12])
def test_in_kernels(evaluation, dtype, channels):
    """Also where each channel takes steps of its own, and where the last vector is not full."""
    limits = np.linspace(0.5, 20.0, channels) if channels else 1.5
    found = LOOPED(composite(limit=limits), x=X.astype(dtype)[:, None])
    for c, limit in enumerate(np.atleast_1d(limits)):
        if dtype == "float32":
            limit = np.float32(limit)
        y, n, total, high = np.array([walked(float(x), float(limit)) for x in X.astype(dtype)]).T
        near = {"rtol": 1e-5 if dtype == "float32" else 1e-12}
        got = {name: x[:, c] if channels else x for name, x in found.items()}
        np.testing.assert_array_equal(got["n"], n)
        np.testing.assert_allclose(got["total"], total + 1000.0 * high, **near)
        np.testing.assert_array_equal(got["y"], np.where(n > 3, y, -1.0))


def nested(scene, mean, x):
    """For k = 1, 2, ... while k < x: the sum of the entries number (k + j) mod 5 for j while j^2 < k; twice as two
    loops whose steps are alike, of which the second begins where the first ends."""

    def entry(i):
        return ops.take(scene.table, ops.to_index(i - 5.0 * ops.floor(i / 5.0)))

    def outer(k, total):
        def inner(j, part):
            return (j + 1.0) * (j + 1.0) < k, j + 1.0, part + entry(k + j)

        _, part = ops.loop(inner, 0.0 * k, 0.0)
        return k + 1.0 < x[0], k + 1.0, total + part * entry(k)

    k, total = ops.loop(outer, 1.0 + 0.0 * x[0], 0.0)
    more, again = ops.loop(outer, k - 2.0, 0.0)
    return total, again, k + more, entry(x[0]) * total


def nested_alone(x):
    def entry(i):
        return TABLE[int(i % 5)]

    def walk(k):
        total = 0.0
        while True:
            j, part = 0, 0.0
            while True:
                part += entry(k + j)
                j += 1
                if not j * j < k:
                    break
            total += part * entry(k)
            k += 1
            if not k < x:
                return k, total

    k, total = walk(1)
    more, again = walk(k - 2)
    return total, again, k + more, entry(x) * total


NESTED = Computation(nested, {"x": 1}, dict.fromkeys("abcd", SCALAR))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_loops_in_loops(evaluation, dtype):
    x = np.random.default_rng(3).integers(1, 40, 300).astype(dtype)
    found = NESTED(composite(table=Fixed(TABLE)), x=x[:, None])
    for got, want in zip(found.values(), np.array([nested_alone(int(n)) for n in x]).T, strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-5 if dtype == "float32" else 1e-12)


def test_loops_in_loops_on_every_library(own):
    x = np.random.default_rng(3).integers(1, 30, 20).astype("float64")
    like = own.array(x)
    scene = type("Scene", (), {"table": ops.library(like).fixed(Fixed(TABLE), own.array(np.zeros((3, 3))))})
    for got, want in zip(nested(scene, scene, (like,)), np.array([nested_alone(int(n)) for n in x]).T, strict=True):
        np.testing.assert_allclose(own.numpy(got), want, rtol=1e-12)


def test_totals_of_loops(evaluation):
    """Summed over the inner axis, with rows whose length no vector divides."""
    sums = Computation(lambda s, m, x, y: (walk(x[0] + y[0], s.limit)[2],), {"x": 1, "y": 1}, {"sum": TOTAL})
    x, y = (
        np.random.default_rng(1).uniform(0.0, 50.0, (9, 1, 1)),
        np.random.default_rng(2).uniform(0.0, 50.0, (1, 37, 1)),
    )
    found = sums(composite(limit=1.5), x=x, y=y)["sum"]
    want = [sum(walked(float(a + b), 1.5)[2] for b in y[0, :, 0]) for a in x[:, 0, 0]]
    np.testing.assert_allclose(found, want, rtol=1e-12)


def test_equal_loops_are_one():
    """The loops of all channels, where no channel matters to them."""
    task = batch.Task(lambda m, mean, x: (m.gain * walk(x[0], 1.5)[0],), (VALUE,), (1,))
    graph = traced(task, composite(gain=np.ones(3)), 3).graph
    assert graph.operations.count("loop") == 1
    both = batch.Task(lambda m, mean, x: (walk(x[0], 1.5)[0] + walk(x[0], 1.6)[0],), (VALUE,), (1,))
    assert traced(both, composite(), None).graph.operations.count("loop") == 2


def test_a_loop_that_a_mask_keeps_from_running_forever(evaluation):
    """Where a result is masked, the replacement of its argument is not needed, but by the loop, which must end."""

    def kernel(scene, mean, x):
        bad = x[0] <= 0.0
        safe = ops.where(bad, 1.0, x[0])
        (y,) = ops.loop(lambda y: (y + safe < 10.0, y + safe), 0.0 * safe)
        return (ops.where(bad, 0.0, y * safe),)

    x = np.array([[-1.0], [3.0], [0.0], [4.0]])
    found = Computation(kernel, {"x": 1}, {"y": SCALAR})(composite(), x=x)["y"]
    np.testing.assert_allclose(found, [0.0, 36.0, 0.0, 48.0])


def test_no_derivative_passes_a_loop():
    graph = Graph()
    x = Symbol(graph, graph.load(0, 0))
    y, _, total, _ = walk(x, 1.5)
    (slope,) = gradient(graph, (x * y + total).node, [x.node])
    (got,) = evaluate(graph, [slope], lambda k, c: X[1:4], [], np.dtype(float))
    np.testing.assert_array_equal(got, [walked(x, 1.5)[0] for x in X[1:4]])


def test_no_derivative_passes_a_loop_of_libraries():
    values = [0.5, 100.0]
    want = [walked(x, 1.5)[0] for x in values]
    jax = pytest.importorskip("jax")

    def function(x):
        y, _, total, _ = walk(x, 1.5)
        return (x * y + total).sum()

    for grad in (jax.grad(function), jax.jit(jax.grad(function))):
        np.testing.assert_allclose(grad(jax.numpy.array(values)), want)

    def captured(x):
        (y,) = ops.loop(lambda y: (y * x < 50.0, y + x), jax.numpy.zeros(2))
        return (x * y).sum()

    plain = [next(n * x for n in range(1, 300) if not (n - 1) * x * x < 50.0) for x in values]
    np.testing.assert_allclose(jax.jit(jax.grad(captured))(jax.numpy.array(values)), plain)
    torch = pytest.importorskip("torch")
    x = torch.tensor(values, dtype=torch.float64, requires_grad=True)
    function(x).backward()
    np.testing.assert_allclose(x.grad, want)


def test_loops_are_readable():
    graph = Graph()
    x = Symbol(graph, graph.load(0, 0))
    from gonio.trace.show import show

    text = show(graph, {"y": walk(x, 1.5)[2].node}, {(0, 0): "x"}, [])
    assert "loop(start=(x, 0, 0.0, False), step=(t1, state0_1 + 1, state0_2 + state0_0, " in text
    assert text.endswith("y = t2[2]")


def test_refusals():
    loop = Symbols().function("loop")
    graph = Graph()
    x = Symbol(graph, graph.load(0, 0))
    with pytest.raises(TraceError, match="all plain numbers; expected one that is computed"):
        loop(lambda y: (x > y, y + x), 0.0)
    with pytest.raises(TraceError, match="of 2 states gives 1"):
        loop(lambda y, n: (x > y, y), x, 0)
    with pytest.raises(TraceError, match="by a number whether to go on"):
        loop(lambda y: (y, y), x)
    with pytest.raises(TraceError, match="state 1 of a loop is of kind index before a step, and real after it"):
        loop(lambda y, n: (y > 0.0, y, n + 0.5), x, 0)
    with pytest.raises(ShapeError, match="of 2 states gives 1"):
        ops.loop(lambda y, n: (y > 1.0, y), np.zeros(3), 0)
    kept = []

    def leaking(m, mean, x):
        def step(y):
            kept.append(y + 1.0)
            return y > 1.0, 0.5 * y

        ops.loop(step, x[0])
        return (kept[-1],)

    with pytest.raises(TraceError, match="keeps a number of a step of a loop"):
        traced(batch.Task(leaking, (SCALAR,), (1,)), composite(), None)
    assert graph.depth == 0
    assert not math.isnan(walked(math.nan, 1.0)[1])
