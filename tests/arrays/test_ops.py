"""Every operation that formulas are made of, on every array library: values, derivatives, special values, dtypes.

A formula is given components and `ops`, and nothing else: what it computes is a graph of the operations below
(`test_formulas_are_made_of_these_operations` traces every structure of every model). A library that computes each
operation and its derivative as mathematics does therefore computes every formula, and the chain rule is the library's
own. What is left is how materials, channels, maps, tables and random numbers reach the components and come back:
`test_laws.py` runs it on the materials of `PLUMBING` on every library, and on every model where that is cheap
(PyTorch). Every model on every library is `pytest -m full`.
"""

from __future__ import annotations

import math
import operator
import zlib
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import pytest
from libraries import KINDS, DrJitTensor, Library, Uncompiled, opened
from materials import draws
from scipy.special import erfinv

from gonio.arrays import Fixed, ops
from gonio.base import kernels
from gonio.evaluate import tracing
from gonio.evaluate.interpret import evaluate
from gonio.formula import tree
from gonio.formula.table_warp import bracket
from gonio.trace.derive import gradient
from gonio.trace.graph import COMPARISONS, LOGIC, Graph

UNITS = {"float32": 2.0**-24, "float64": 2.0**-53}
each_dtype = pytest.mark.parametrize("dtype", UNITS)
INF, NAN = math.inf, math.nan


SINGLE = [kind for kind in KINDS if kind not in (Uncompiled, DrJitTensor)]
"""Arrays of one component, which is what formulas see: Dr.Jit's tensors are taken apart into its arrays."""


@pytest.fixture(params=SINGLE, ids=lambda kind: kind.name, scope="module")
def library(request: pytest.FixtureRequest) -> Library:
    return opened(request.param)


class Row(NamedTuple):
    """An operation: `true` is its value for numbers, `slopes` its derivatives by each argument (None: it has none).

    `at` are the numbers that it is tried on, an array for each argument, where it is smooth; `special` are arguments
    with what is expected of them exactly.
    """

    call: Callable[..., Any]
    true: Callable[..., Any]
    at: tuple[np.ndarray, ...]
    slopes: tuple[Callable[..., Any] | None, ...]
    special: tuple[tuple[tuple[float, ...], float], ...] = ()


def spread(*numbers: float, low: float = -4.0, high: float = 4.0) -> np.ndarray:
    """60 numbers: the given ones, and random ones between two, the same for the same arguments."""
    rng = np.random.default_rng(zlib.crc32(repr((numbers, low, high)).encode()))
    return np.concatenate([numbers, rng.uniform(low, high, 60 - len(numbers))])


def logarithmic(low: float, high: float) -> np.ndarray:
    return np.exp(spread(low=math.log(low), high=math.log(high)))


A, B, P = spread(0.75, -3.5), spread(-1.25, 2.0), logarithmic(1e-6, 1e6)
TURNS = np.concatenate([0.35 * A[::2], np.geomspace(1e-6, 1.5, 30)])
SIGN = np.where(np.arange(60) % 2, 1.0, -1.0)


def unary(call: Any, true: Any, at: np.ndarray, slope: Any, *special: tuple[float, float]) -> Row:
    return Row(call, true, (at,), (slope,), tuple(((x,), y) for x, y in special))


def binary(call: Any, at: tuple[np.ndarray, np.ndarray], by_a: Any, by_b: Any, *special: Any, true: Any = None) -> Row:
    return Row(call, true or call, at, (by_a, by_b), special)


def comparison(compare: Callable[[Any, Any], Any], of_nan: bool) -> Row:
    """A choice by a comparison, which of NaN says `of_nan`."""
    return binary(
        lambda a, b: ops.where(compare(a, b), a, b),
        (np.rint(A), np.rint(B)),
        lambda a, b: float(compare(a, b)),
        lambda a, b: float(not compare(a, b)),
        ((NAN, 1.0), NAN if of_nan else 1.0),
        ((1.0, NAN), 1.0 if of_nan else NAN),
        true=lambda a, b: a if compare(a, b) else b,
    )


def zero(*args: float) -> float:
    return 0.0


ROWS = {
    "sqrt": unary(
        ops.sqrt, math.sqrt, P, lambda x: 0.5 / math.sqrt(x), (0.0, 0.0), (INF, INF), (-1.0, NAN), (NAN, NAN)
    ),
    "exp": unary(ops.exp, math.exp, spread(low=-20), math.exp, (0.0, 1.0), (-INF, 0.0), (INF, INF), (NAN, NAN)),
    "log": unary(ops.log, math.log, P, lambda x: 1.0 / x, (1.0, 0.0), (0.0, -INF), (INF, INF), (-1.0, NAN), (NAN, NAN)),
    "sin": unary(ops.sin, math.sin, 2.0 * A, math.cos, (0.0, 0.0), (INF, NAN), (NAN, NAN)),
    "cos": unary(ops.cos, math.cos, 2.0 * A, lambda x: -math.sin(x), (0.0, 1.0), (INF, NAN), (NAN, NAN)),
    "tan": unary(ops.tan, math.tan, TURNS, lambda x: 1.0 + math.tan(x) ** 2, (0.0, 0.0), (NAN, NAN)),
    "sin_turn": unary(
        *(ops.sin_turn, lambda x: math.sin(2.0 * math.pi * x), 0.05 * A),
        *(lambda x: 2.0 * math.pi * math.cos(2.0 * math.pi * x), (0.0, 0.0), (INF, NAN), (NAN, NAN)),
    ),
    "cos_turn": unary(
        *(ops.cos_turn, lambda x: math.cos(2.0 * math.pi * x), 0.05 * A),
        *(lambda x: -2.0 * math.pi * math.sin(2.0 * math.pi * x), (0.0, 1.0), (INF, NAN), (NAN, NAN)),
    ),
    "arccos": unary(
        *(ops.arccos, math.acos, 0.24 * A, lambda x: -1.0 / math.sqrt(1.0 - x * x)),
        *((1.0, 0.0), (1.001, NAN), (NAN, NAN)),
    ),
    "erf": unary(
        *(ops.erf, math.erf, 0.7 * A, lambda x: 2.0 / math.sqrt(math.pi) * math.exp(-x * x)),
        *((0.0, 0.0), (INF, 1.0), (-INF, -1.0), (NAN, NAN)),
    ),
    "erfinv": unary(
        *(ops.erfinv, erfinv, 0.24 * A, lambda x: 0.5 * math.sqrt(math.pi) * math.exp(erfinv(x) ** 2)),
        *((0.0, 0.0), (1.0, INF), (-1.0, -INF), (NAN, NAN)),
    ),
    "ierfc": unary(
        *(ops.ierfc, lambda x: math.exp(-x * x) / math.sqrt(math.pi) - x * math.erfc(x), np.abs(0.25 * A)),
        *(lambda x: -math.erfc(x), (30.0, 0.0), (INF, 0.0), (NAN, NAN)),
    ),
    "absolute": unary(ops.absolute, abs, A, lambda x: math.copysign(1.0, x), (-0.0, 0.0), (-INF, INF), (NAN, NAN)),
    "floor": unary(ops.floor, math.floor, A, zero, (-0.5, -1.0), (2.0, 2.0), (-2.0, -2.0), (NAN, NAN)),
    "stop": unary(ops.stop_gradient, lambda x: x, A, zero, (INF, INF), (NAN, NAN)),
    "neg": unary(operator.neg, operator.neg, A, lambda x: -1.0, (INF, -INF), (NAN, NAN)),
    "square": unary(ops.square, lambda x: x * x, A, lambda x: 2.0 * x, (-INF, INF), (NAN, NAN)),
    "add": binary(operator.add, (A, B), lambda a, b: 1.0, lambda a, b: 1.0, ((INF, -INF), NAN)),
    "sub": binary(operator.sub, (A, B), lambda a, b: 1.0, lambda a, b: -1.0, ((INF, INF), NAN)),
    "mul": binary(operator.mul, (A, B), lambda a, b: b, lambda a, b: a, ((INF, 0.0), NAN)),
    "div": binary(
        *(operator.truediv, (A, 0.01 + np.abs(B)), lambda a, b: 1.0 / b, lambda a, b: -a / b**2),
        *(((1.0, 0.0), INF), ((0.0, 0.0), NAN), ((1.0, INF), 0.0)),
    ),
    "power": binary(
        *(ops.power, (logarithmic(1e-2, 1e2), 1.5 * B)),
        *(lambda a, b: b * a ** (b - 1.0), lambda a, b: a**b * math.log(a)),
        *(((0.0, 0.0), 1.0), ((0.0, 2.0), 0.0), ((1.0, 1e30), 1.0), ((0.5, INF), 0.0), ((NAN, 2.0), NAN)),
        true=operator.pow,
    ),
    "arctan2": binary(
        *(ops.arctan2, (A, B), lambda y, x: x / (x * x + y * y), lambda y, x: -y / (x * x + y * y)),
        *(((0.0, 1.0), 0.0), ((1.0, 0.0), 0.5 * math.pi), ((-1.0, 0.0), -0.5 * math.pi), ((NAN, 1.0), NAN)),
        true=math.atan2,
    ),
    "minimum": binary(
        *(ops.minimum, (A, B), lambda a, b: float(a < b), lambda a, b: float(b < a)),
        *(((1.0, 1.0), 1.0), ((-INF, 1.0), -INF), ((INF, 1.0), 1.0)),
        true=min,
    ),
    "maximum": binary(
        *(ops.maximum, (A, B), lambda a, b: float(a > b), lambda a, b: float(b > a)),
        *(((1.0, 1.0), 1.0), ((-INF, 1.0), 1.0), ((INF, 1.0), INF)),
        true=max,
    ),
    "clip": Row(
        ops.clip,
        lambda x, low, high: min(max(x, low), high),
        (A, np.full(60, -1.0), np.full(60, 2.0)),
        (lambda x, low, high: float(low < x < high), lambda x, low, high: float(x < low), None),
    ),
    "select": Row(
        lambda x, a, b: ops.where(x > 0.0, a, b),
        lambda x, a, b: a if x > 0.0 else b,
        (SIGN, A, B),
        (zero, lambda x, a, b: float(x > 0.0), lambda x, a, b: float(x <= 0.0)),
        (((1.0, 2.0, NAN), 2.0), ((-1.0, INF, 3.0), 3.0), ((NAN, 1.0, 2.0), 2.0)),
    ),
    **{name: comparison(getattr(operator, name), name == "ne") for name in COMPARISONS},
    **{
        name: binary(
            lambda a, b, logic=logic: ops.where(logic(a > 0.0, b > 0.0), a + 10.0, 0.0 * b),
            (SIGN, np.roll(SIGN, 1) * np.resize([1.0, 1.0, -1.0], 60)),
            lambda a, b, logic=logic: float(logic(a > 0.0, b > 0.0)),
            zero,
            true=lambda a, b, logic=logic: a + 10.0 if logic(a > 0.0, b > 0.0) else 0.0,
        )
        for name, logic in {"and": operator.and_, "or": operator.or_}.items()
    },
    "xor": unary(  # formulas have it as "not"
        lambda x: ops.where(~(x > 0.0), x, 0.0 * x), lambda x: min(x, 0.0), A, lambda x: float(x < 0.0)
    ),
}
ENTRIES = Fixed(np.array([0.5, 2.0, -1.0, 8.0, 3.0]))
"""What "take" takes from."""
WORDS = {"bit_and", "shift_left", "shift_right", "wrapped_sum", "wrapped_product", "unit"}
OTHERS = {"take", "to_index", "to_real", "load", "constant", *WORDS}
"""Operations with tests of their own (tests/arrays/test_words.py), and the leaves of graphs."""
DR_JIT = {("power", (0.0, 0.0)), ("erf", (NAN,)), ("arctan2", (NAN, 1.0)), ("ne", (NAN, 1.0)), ("ne", (1.0, NAN))}
"""Where Dr.Jit differs: 0^0 is NaN (it takes logarithms), erf and angle of NaN are numbers, and it is not unequal. No
formula asks for the first, and kernels restore the NaN of directions."""


def test_every_operation_is_tried():
    functions = {name for name, f in vars(ops).items() if getattr(f, "__code__", None) is ops.sqrt.__code__}
    called = {"where": "select", "stop_gradient": "stop"}
    assert {called.get(name, name) for name in functions} <= ROWS.keys() | OTHERS, "an operation without a row in ROWS"
    of_graphs = ops.OPERATIONS.keys() - {"state", "loop", "result", "rays", "shl", "lshr"}
    assert of_graphs <= ROWS.keys() | OTHERS, "an operation of graphs without a row"


@pytest.mark.parametrize("some", [draws(1, every=9), pytest.param(draws(), marks=pytest.mark.full)], ids=["few", "all"])
def test_formulas_are_made_of_these_operations(some):
    """Structures of every model, in all that is computed of it, also in derivatives by everything."""
    seen = set()
    for draw in some:
        m = draw.material(*draw.layouts)
        channels = next((np.shape(v)[-1] for v in tree.leaves(m) if np.ndim(v)), None)
        leaves = tuple(range(sum(1 for _ in tree.leaves(m))))
        for task in (
            tracing.Task(kernels.value, ("value",), (3, 3)),
            tracing.Task(kernels.pdf, ("scalar",), (3, 3)),
            tracing.Task(kernels.sample, ("vector", "value", "scalar", "scalar"), (3, 2)),
            kernels.DELTA_REFLECTANCE,
            tracing.Task(kernels.value, ("value",), (3, 3), (leaves, (0, 1))),
        ):
            trace = tracing.traced(task, m, channels)
            seen.update(trace.graph.operations)
    assert seen <= ROWS.keys() | OTHERS


def numbers(row: Row, dtype: str) -> list[np.ndarray]:
    return [x.astype(dtype) for x in row.at]


def expected(function: Callable[..., float], arrays: list[np.ndarray]) -> np.ndarray:
    """A function of numbers, element by element, in double precision."""
    return np.array([float(function(*map(float, x))) for x in zip(*arrays, strict=True)])


def allowed(row: Row, arrays: list[np.ndarray], dtype: str) -> np.ndarray:
    """Sixteen roundings of the value and of the arguments."""
    total = np.abs(expected(row.true, arrays))
    for x, slope in zip(arrays, row.slopes, strict=True):
        total += 0.0 if slope is None else np.abs(expected(slope, arrays) * x)
    return 16.0 * UNITS[dtype] * total


@pytest.mark.few_by_jax("float64")
@pytest.mark.parametrize("name", ROWS)
@each_dtype
def test_operation(library, name, dtype):
    values(library, name, dtype)
    special_values(library, name, dtype)
    by_argument(library, name, dtype)


def values(own: Library, name: str, dtype: str) -> None:
    """Also where one argument is a number, as formulas have them."""
    row = ROWS[name]
    arrays = numbers(row, dtype)
    given = [own.array(x, dtype) for x in arrays]
    found = row.call(*given)
    assert own.dtype(found) == dtype
    want = expected(row.true, arrays)
    assert (np.abs(own.numpy(found) - want) <= allowed(row, arrays, dtype)).all()
    if len(arrays) < 2:
        return
    for k in range(len(arrays)):
        if name in ("select", *COMPARISONS, *LOGIC) and k == 0:
            continue  # a condition of numbers is Python's
        number = float(arrays[k][0])
        one = [np.full_like(x, number) if i == k else x for i, x in enumerate(arrays)]
        found = row.call(*(number if i == k else x for i, x in enumerate(given)))
        assert own.dtype(found) == dtype
        assert (np.abs(own.numpy(found) - expected(row.true, one)) <= allowed(row, one, dtype)).all()


def special_values(own: Library, name: str, dtype: str) -> None:
    for given, want in ROWS[name].special:
        if own.name == "drjit-array" and (name, given) in DR_JIT:
            continue
        with np.errstate(all="ignore"):
            found = own.numpy(ROWS[name].call(*(own.array(np.full(3, x), dtype) for x in given)))
        np.testing.assert_array_equal(found, np.full(3, want, dtype), err_msg=f"{name}{given}")


def derivatives(own: Library, call: Callable[..., Any], arrays: list[np.ndarray], dtype: str) -> list[np.ndarray]:
    """Of the sum of what is called, by each argument: as the library says."""
    if own.name == "torch":
        module = own.module
        leaves = [module.tensor(x, requires_grad=True) for x in arrays]
        total = call(*leaves).sum()
        if not total.requires_grad:
            return [np.zeros_like(x) for x in arrays]
        found = module.autograd.grad(total, leaves, allow_unused=True)
        return [np.zeros_like(x) if g is None else g.numpy() for g, x in zip(found, arrays, strict=True)]
    if own.name == "jax":
        by_all = own.module.grad(lambda *args: call(*args).sum(), tuple(range(len(arrays))))
        return [np.asarray(g) for g in by_all(*(own.array(x, dtype) for x in arrays))]
    drjit = import_module("drjit")
    leaves = [own.array(x, dtype) for x in arrays]
    drjit.enable_grad(*leaves)
    result = call(*leaves)
    if drjit.grad_enabled(result):
        drjit.backward(result)
    return [drjit.grad(x).numpy() for x in leaves]


def by_rules(name: str, arrays: list[np.ndarray], dtype: str) -> list[np.ndarray]:
    """The same by the rules of `trace/derive.py`, of a graph with this one operation."""
    graph = Graph()
    loads = [graph.load(k, 0) for k in range(len(arrays))]
    found = gradient(graph, graph.apply(name, *loads), loads)
    results = evaluate(graph, found, lambda k, _: arrays[k], [], dtype)
    return [np.broadcast_to(x, arrays[0].shape) for x in results]


def by_argument(own: Library, name: str, dtype: str) -> None:
    """Derivatives."""
    row = ROWS[name]
    arrays = numbers(row, dtype)
    if type(own) is not Library:
        found = derivatives(own, row.call, arrays, dtype)
    elif name in ("stop", "floor") or (name in ops.OPERATIONS and ops.OPERATIONS[name].derivative and name != "select"):
        found = by_rules(name, arrays, dtype)
    else:
        return  # choices have no rule for one node, and are tested in `test_engine.py`
    for g, slope in zip(found, row.slopes, strict=True):
        if slope is not None:
            want = expected(slope, arrays)
            np.testing.assert_allclose(g, want, rtol=400.0 * UNITS[dtype] + 1e-12, atol=1e-30, err_msg=name)


@pytest.mark.few_by_jax("float64")
@each_dtype
def test_take_and_to_index(library, dtype):
    places = np.array([0.0, 4.0, 2.9, 3.0, 0.999, 1.0, NAN, INF])
    whole = np.array([0, 4, 2, 3, 0, 1, 0, 0])
    like = library.array(np.zeros((len(places), 3)), dtype)
    x = library.array(places, dtype)
    lib = ops.library(like)
    index = ops.to_index(x)
    found = ops.take(lib.fixed(ENTRIES, like), index)
    assert library.dtype(found) == dtype
    np.testing.assert_array_equal(library.numpy(found), ENTRIES.numbers[whole])
    np.testing.assert_array_equal(library.numpy(lib.entries(ENTRIES, index, like)), ENTRIES.numbers[whole])
    np.testing.assert_array_equal(library.numpy(ops.take(lib.fixed(ENTRIES, like), index + 0)), ENTRIES.numbers[whole])
    reals = library.numpy(library.array(np.zeros(8), dtype) + 1.0 * index)[:6]  # an index beside reals is one
    np.testing.assert_array_equal(reals, whole[:6])


@pytest.mark.few_by_jax("float64")
@each_dtype
@pytest.mark.parametrize("count", [2, 6, 40])
def test_brackets(library, dtype, count):
    """The nodes around x by a library's own search, or comparing: linear interpolation is NumPy's."""
    nodes = np.cumsum(np.random.default_rng(count).uniform(0.1, 1.0, count)).astype(dtype)
    x = np.concatenate([np.linspace(-1.0, nodes[-1] + 1.0, 31), nodes]).astype(dtype)
    like = library.array(np.zeros((len(x), 3)), dtype)
    around = bracket(ops.library(like).fixed(Fixed(nodes), like), count, library.array(x, dtype))
    table = ops.library(like).fixed(Fixed(nodes**2), like)
    found = sum(weight * ops.take(table, place) for place, weight in around)
    np.testing.assert_allclose(library.numpy(found), np.interp(x, nodes, nodes**2), rtol=50.0 * UNITS[dtype])
