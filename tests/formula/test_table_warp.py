"""Searches in tables, and the warp whose density is a table: against NumPy's search, for tables as bad as they come."""

from __future__ import annotations

import numpy as np
import pytest
from libraries import thinned
from sweeps import every

from gonio.formula.table_warp import ONE, MarginalWarp, _last, bilinear, both, bracket, tables

ROWS, COLUMNS = 9, 13


def steps(count: int) -> dict[str, np.ndarray]:
    """Increasing numbers from 0 to 1, few of them different."""
    even = np.linspace(0.0, 1.0, count)
    return {
        "even": even,
        "equal at the beginning": np.where(even < 0.5, 0.0, even),
        "equal at the end": np.minimum(2.0 * even, 1.0),
        "one step at the end": np.where(np.arange(count) < count - 1, 0.0, 1.0),
        "one step at the beginning": np.where(np.arange(count) > 0, 1.0, 0.0),
        "stairs": np.floor(4.0 * even) / 4.0,
    }


@every(name=steps(2), count=[2, 3, 4, 5, 8, 31, 32, 33, 100, 127, 128, 129])
def test_the_search_finds_what_numpy_finds(count, name):
    nodes = steps(count)[name]
    between = 0.5 * (nodes[1:] + nodes[:-1])
    wanted = np.concatenate([nodes, between, np.nextafter(nodes, -1.0), np.nextafter(nodes, 2.0), [-1.0, 2.0]])
    asked = set()

    def reached(k):
        asked.update(np.unique(k).tolist())
        return nodes[k]

    k, real, value = _last(count - 1, reached, wanted)
    np.testing.assert_array_equal(k, np.maximum(np.searchsorted(nodes[:-1], wanted) - 1, 0))
    np.testing.assert_array_equal(real, k)
    np.testing.assert_array_equal(value, nodes[k])
    assert asked <= set(range(1, count - 1))


def sets() -> dict[str, np.ndarray]:
    """Tables (2, 3, rows, columns)."""
    random = np.random.default_rng(5).random((2, 3, ROWS, COLUMNS))
    rows, columns = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    return {
        "random": random,
        "constant": np.ones_like(random),
        "empty rows": random * (rows % 3 != 0),
        "empty columns at both ends": random * ((columns > 3) & (columns < 9)),
        "one huge entry": random + 1e9 * ((rows == 4) & (columns == 7)),
        "one entry": random * ((rows == 2) & (columns == 12)) + 0.0,
        "other places in each table": random * (columns % 6 == np.arange(6).reshape(2, 3, 1, 1)),
    }


def warp_of(values: np.ndarray) -> MarginalWarp:
    cells, rows, conditional, marginal, _ = (t.reshape(-1) for t in tables(values))
    return MarginalWarp(cells, rows, conditional, marginal, values.shape[-2:], values.shape[0] * values.shape[1])


def at_the_places(n: int) -> tuple:
    """Tables to interpolate: at nodes, between them, and beyond."""
    random = np.random.default_rng(6)
    x, y = random.choice([0.0, 1.0, 2.0, -1.0, 3.0, 0.3, 1.7], (2, n))
    return both(bracket(np.array([0.0, 1.0]), 2, x), bracket(np.array([0.0, 1.0, 2.0]), 3, y), 3)


def interpolated(values: np.ndarray, at) -> np.ndarray:
    """The tables (n, rows, columns) that the lookups mean, each of integral 1 before they are mixed."""
    cells = 0.25 * (values[..., 1:, 1:] + values[..., :-1, 1:] + values[..., 1:, :-1] + values[..., :-1, :-1])
    flat = (values / cells.mean(axis=(-2, -1), keepdims=True)).reshape(-1, ROWS, COLUMNS)
    return sum(np.asarray(weight)[:, None, None] * flat[number] for number, weight in at)


@pytest.mark.parametrize("n", thinned([120, 400], [120]))
@pytest.mark.parametrize("name", sets())
def test_the_warp_is_that_of_the_interpolated_table(name, n):
    """Density, inverse and samples against distribution functions summed up here, table by table."""
    values = sets()[name]
    at, warp = at_the_places(n), warp_of(values)
    table = interpolated(values, at)
    u = np.random.default_rng(7).random((2, n))
    u[:, :40] = np.random.default_rng(8).choice([0.0, 1.0, 0.5, np.nextafter(1.0, 0.0)], (2, 40))
    x, y = warp.sample(at, *u)
    assert ((x >= 0.0) & (x <= 1.0) & (y >= 0.0) & (y <= 1.0)).all()
    for i in range(n):
        totals = np.trapezoid(table[i], dx=1.0 / (COLUMNS - 1), axis=1)
        assert _integral(totals, y[i]) == pytest.approx(u[1, i], abs=1e-12)
        row = np.array([np.interp(y[i], np.linspace(0.0, 1.0, ROWS), column) for column in table[i].T])
        whole = np.trapezoid(row, dx=1.0 / (COLUMNS - 1))
        assert _integral(row, x[i]) == pytest.approx(u[0, i] * whole, abs=1e-12 * max(whole, 1.0))
        density = np.interp(x[i], np.linspace(0.0, 1.0, COLUMNS), row)
        one = [(number[i : i + 1] if np.ndim(number) else number, weight[i : i + 1]) for number, weight in at]
        found = warp.eval(one, x[i : i + 1], y[i : i + 1])
        assert found == pytest.approx(density, rel=1e-9, abs=1e-9)
    sx, sy, density = warp.invert(at, x, y)
    np.testing.assert_allclose(sy, u[1], atol=1e-12)
    rows_with = density > 1e-6
    np.testing.assert_allclose(sx[rows_with], u[0, rows_with], atol=1e-9)
    np.testing.assert_array_equal(density, warp.eval(at, x, y))


def _integral(nodes: np.ndarray, end: float) -> float:
    """From 0 to `end` of what is linear between nodes over [0, 1]."""
    places = np.linspace(0.0, 1.0, len(nodes))
    inside = np.append(places[places < end], end)
    return float(np.trapezoid(np.interp(inside, places, nodes), inside))


def test_a_set_of_one_table():
    values = np.random.default_rng(1).random((1, 1, ROWS, COLUMNS))
    s = np.random.default_rng(2).random((2, 50))
    again = warp_of(values).invert(ONE, *warp_of(values).sample(ONE, *s))
    np.testing.assert_allclose(again[:2], s, atol=1e-12)


def test_one_column_stands_for_all():
    column = np.array([1.0, 4.0, 2.0])
    y, x = np.array([0.0, 0.25, 0.5, 1.0]), np.array([0.3, 0.9, 0.0, 1.0])
    np.testing.assert_allclose(bilinear(column, ONE, (3, 1), x, y), [1.0, 2.5, 4.0, 2.0])
    np.testing.assert_allclose(bilinear(np.repeat(column, 2), ONE, (3, 2), x, y), [1.0, 2.5, 4.0, 2.0])
