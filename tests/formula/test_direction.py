"""Directions as vectors: their operators in every array library, what they refuse, and where the horizon is."""

from __future__ import annotations

import math
import operator

import numpy as np
import pytest

from gonio.formula.direction import (
    HORIZON,
    NORMAL,
    Direction,
    cross,
    dot,
    length,
    normalize,
    raised,
    reflect,
    served,
)
from gonio.trace.graph import Graph
from gonio.trace.symbol import Symbol

A, B = Direction(1.0, -2.0, 3.0), Direction(0.5, 4.0, -8.0)


def numbers(w: Direction) -> list[float]:
    assert type(w) is Direction
    return [float(x) for x in w]


def test_operators_are_those_of_vectors():
    assert numbers(A + B) == [1.5, 2.0, -5.0]
    assert numbers(A - B) == [0.5, -6.0, 11.0]
    assert numbers(-A) == [-1.0, 2.0, -3.0]
    assert numbers(2 * A) == numbers(A * 2) == [2.0, -4.0, 6.0]
    assert numbers(A / 4) == [0.25, -0.5, 0.75]
    assert dot(A, B) == -31.5
    assert numbers(cross(A, B)) == [4.0, 9.5, 5.0]
    assert numbers(reflect(Direction(0.6, 0.0, 0.8), NORMAL)) == pytest.approx([-0.6, 0.0, 0.8])
    assert dot(normalize(B), normalize(B)) == pytest.approx(1.0)
    assert length(B) == pytest.approx(math.sqrt(80.25))


def test_components_unpack_in_order():
    x, y, z = A
    assert (x, y, z) == (A.x, A.y, A.z) == (1.0, -2.0, 3.0)


REFUSED = {
    "a * b": lambda: A * B,
    "a / b": lambda: A / B,
    "a == b": lambda: A == B,
    "a != b": lambda: A != B,
    "a == 1": lambda: A == 1.0,
    "bool": lambda: bool(A),
    "hash": lambda: hash(A),
    "a + 1": lambda: A + 1.0,
    "1 + a": lambda: 1.0 + A,
    "a - 1": lambda: A - 1.0,
    "1 - a": lambda: 1.0 - A,
    "1 / a": lambda: 1.0 / A,
    "a + tuple": lambda: operator.add(A, (1.0, 2.0, 3.0)),
    "tuple + a": lambda: operator.add((1.0, 2.0, 3.0), A),
    "array + a": lambda: np.ones(3) + A,
    "a + array": lambda: A + np.ones(3),
    "float64 + a": lambda: np.float64(1.0) + A,
    "array == a": lambda: np.ones(3) == A,
    "sum": lambda: sum([A, B]),
}


@pytest.mark.parametrize("wrong", REFUSED.values(), ids=REFUSED)
def test_what_vectors_have_not_is_refused(wrong):
    with pytest.raises(TypeError):
        wrong()


def test_a_product_of_directions_says_what_to_write():
    with pytest.raises(TypeError, match=r"dot\(a, b\)"):
        A * B


@pytest.mark.parametrize("s", [np.float64(2.0), np.float32(2.0), np.int64(2), np.array(2.0)], ids=type)
def test_scalars_of_numpy_scale_from_either_side(s):
    assert numbers(s * A) == numbers(A * s) == [2.0, -4.0, 6.0]
    assert numbers(A / s) == [0.5, -1.0, 1.5]


def of_library(name: str, values: list[float]):
    if name == "numpy":
        return np.array(values)
    if name == "torch":
        torch = pytest.importorskip("torch")
        return torch.tensor(values, dtype=torch.float64)
    if name == "jax":
        return pytest.importorskip("jax.numpy").array(values)
    return pytest.importorskip("drjit.llvm").Float64(values)


@pytest.mark.parametrize("name", ["numpy", "torch", "jax", "drjit"])
def test_arrays_of_every_library_scale_each_component(name):
    s, x, y, z = (of_library(name, v) for v in ([2.0, 3.0], [1.0, 2.0], [-1.0, 0.5], [4.0, 8.0]))
    w = Direction(x, y, z)
    expected = [[2.0, 6.0], [-2.0, 1.5], [8.0, 24.0]]
    # Dr.Jit's arrays raise an error of their own where the other operand is none of theirs.
    for product in [w * s] if name == "drjit" else [w * s, s * w]:
        assert type(product) is Direction
        assert np.array_equal([np.asarray(c) for c in product], expected)
    assert np.array_equal([np.asarray(c) for c in (w * s) / s], [np.asarray(c) for c in w])
    assert np.array_equal(np.asarray((w + w - -w).y), 3.0 * np.asarray(y))


def test_symbols_on_the_left_scale_and_stay_symbols():
    graph = Graph()
    s, x = (Symbol(graph, graph.load(k, 0)) for k in (0, 1))
    w = s * Direction(x, 2.0 * x, 1.0)
    assert type(w) is Direction
    assert [type(c) for c in w] == [Symbol] * 3
    assert w.x.node == (s * x).node
    assert w.z.node == s.node  # s * 1
    for wrong in (operator.add, operator.sub, operator.truediv):
        with pytest.raises(TypeError):
            wrong(s, w)


# The horizon.


def test_below_the_horizon_the_normal_stands_in_for_both():
    z = np.array([0.5, HORIZON, 2.0 * HORIZON, -0.5, 0.5, np.nan])
    wi = Direction(0.1 + 0.0 * z, 0.2 + 0.0 * z, z)
    wo = Direction(0.3, 0.4, np.where(np.arange(6) == 4, -0.1, 0.6))
    below, wi_up, wo_up = served(wi, wo)
    assert below.tolist() == [False, True, False, True, True, False]  # NaN is not below, so that it stays
    assert wi_up.x[below].tolist() == [0.0] * 3
    assert wo_up.z.tolist() == [0.6, 1.0, 0.6, 1.0, 1.0, 0.6]
    assert wi_up.z[[0, 2]].tolist() == [0.5, 2.0 * HORIZON]
    assert np.isnan(wi_up.z[5])


def test_raised_takes_nan_for_below():
    up, w = raised(Direction(np.full(4, 0.1), np.full(4, 0.2), np.array([0.5, HORIZON, -0.5, np.nan])))
    assert up.tolist() == [True, False, False, False]
    assert w.z.tolist() == [0.5, 1.0, 1.0, 1.0]
    assert w.x.tolist() == [0.1, 0.0, 0.0, 0.0]
