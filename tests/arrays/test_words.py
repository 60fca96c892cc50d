"""Whole numbers of 32 bits, on every array library and compiled: a hash is NumPy's, bit by bit."""

from __future__ import annotations

import numpy as np
import pytest
from libraries import KINDS, DrJitTensor, Library, Uncompiled, opened, switch_off

from gonio.arrays import Fixed, ops
from gonio.arrays.kinds import SCALAR
from gonio.errors import TraceError
from gonio.evaluate import batch
from gonio.evaluate.computation import Computation, composite
from gonio.evaluate.interpret import evaluate
from gonio.evaluate.tracing import traced
from gonio.trace.graph import INDEX, Graph
from gonio.trace.symbol import Symbol, Symbols

PLACES = np.concatenate([np.arange(500), [2**22 - 1, 2**24 - 1]]).astype(float)
WORDS = np.array([0, 1, 2, 0x7FFFFFFF, 0x80000000, 0x80000001, 0xFFFFFFFF, 0xDEADBEEF, 747796405], dtype=np.uint32)


def pcg(x):
    """The hash RXS-M-XS of O'Neill 2014, PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms."""
    x = ops.wrapped_sum(ops.wrapped_product(x, 747796405), 2891336453)
    moved = ops.shift_right(x, ops.wrapped_sum(ops.shift_right(x, 28), 4))
    x = ops.wrapped_product(ops.xor(moved, x), 277803737)
    return ops.xor(ops.shift_right(x, 22), x)


def pcg_of_numpy(x):
    x = x.astype(np.uint32) * np.uint32(747796405) + np.uint32(2891336453)
    x = ((x >> ((x >> np.uint32(28)) + np.uint32(4))) ^ x) * np.uint32(277803737)
    return (x >> np.uint32(22)) ^ x


def unit_of(x):
    return (x >> np.uint32(8)) * 2.0**-24


def kernel(scene, mean, x):
    """Three numbers of a chain of hashes, one of other operations, and an entry of a table at a place of a hash."""
    first = pcg(ops.to_index(x[0]))
    second = pcg(first)
    other = ops.bit_and(ops.shift_left(second, 7), 0xFFFF00F0)
    entry = ops.take(scene.table, ops.shift_right(second, 29))
    return ops.unit(first, x[0]), ops.unit(second, x[0]), ops.unit(other, x[0]), entry


TABLE = np.arange(8.0) ** 2
HASHES = Computation(kernel, {"x": 1}, {"first": SCALAR, "second": SCALAR, "other": SCALAR, "entry": SCALAR})
SINGLE = [kind for kind in KINDS if kind not in (Uncompiled, DrJitTensor)]


@pytest.fixture(params=SINGLE, ids=lambda kind: kind.name, scope="module")
def own(request: pytest.FixtureRequest) -> Library:
    return opened(request.param)


def wanted():
    first = pcg_of_numpy(PLACES)
    second = pcg_of_numpy(first)
    other = (second << np.uint32(7)) & np.uint32(0xFFFF00F0)
    return [unit_of(first), unit_of(second), unit_of(other), TABLE[second >> np.uint32(29)]]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_hash_on_every_library(own, dtype):
    x = own.array(PLACES, dtype)
    lib = ops.library(x)
    scene = type("Scene", (), {"table": lib.fixed(Fixed(TABLE), own.array(np.zeros((3, 3)), dtype))})
    for found, want in zip(kernel(scene, scene, (x,)), wanted(), strict=True):
        assert own.dtype(found) == dtype
        np.testing.assert_array_equal(own.numpy(found), want)


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_hash_in_a_kernel(compiled, dtype, monkeypatch):
    if not compiled:
        switch_off(monkeypatch)
    found = HASHES(composite(table=Fixed(TABLE)), x=PLACES.astype(dtype)[:, None])
    for got, want in zip(found.values(), wanted(), strict=True):
        np.testing.assert_array_equal(got, want)


@pytest.mark.parametrize("name", ["xor", "bit_and", "wrapped_sum", "wrapped_product"])
def test_pairs_of_words(own, name):
    """All pairs of some numbers, also where one is a plain number, and in the reference of graphs."""
    true = {"xor": np.bitwise_xor, "bit_and": np.bitwise_and, "wrapped_sum": np.add, "wrapped_product": np.multiply}
    function = getattr(ops, name)
    a, b = (x.reshape(-1) for x in np.meshgrid(WORDS, WORDS))
    want = unit_of(true[name](a, b))
    like = own.array(np.zeros(1), "float64")

    def words(x):  # from places that are exact in any dtype, and moved up
        high, low = (ops.to_index(own.array((x >> np.uint32(s)) & np.uint32(0xFFFF), "float64")) for s in (16, 0))
        return ops.wrapped_sum(ops.shift_left(high, 16), low)

    np.testing.assert_array_equal(own.numpy(ops.unit(function(words(a), words(b)), like)), want)
    for k in range(9):
        found = ops.unit(function(words(WORDS), int(WORDS[k])), like)
        np.testing.assert_array_equal(own.numpy(found), unit_of(true[name](WORDS, WORDS[k])))


def test_graphs_on_numpy():
    """What the reference of compiled kernels makes of it; constants are wrapped."""
    graph = Graph()
    x = Symbol(graph, graph.load(0, 0))
    function = Symbols().function
    h = pcg(function("to_index")(x))
    node = function("unit")(h, x).node
    (got,) = evaluate(graph, [node], lambda k, c: PLACES, [], np.dtype(float))
    np.testing.assert_array_equal(got, unit_of(pcg_of_numpy(PLACES)))
    assert graph.constant(0xFFFFFFFF, INDEX) == graph.constant(-1, INDEX)


def test_numbers_are_refused():
    for operation in (ops.xor, ops.shift_left, ops.wrapped_sum):
        with pytest.raises(TraceError, match="expected whole numbers"):
            task = batch.Task(lambda m, mean, x, operation=operation: (operation(x[0], 3),), (SCALAR,), (1,))
            traced(task, composite(), None)
