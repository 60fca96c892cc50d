"""The engine: compiled kernels against their graphs on arrays, how arrays are read, what is cached, what is refused."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest
from graphs import random_graph, steady
from libraries import switch_off, thinned

import gonio as gn
from gonio.arrays import ops
from gonio.arrays.kinds import TOTAL
from gonio.compile import cache_folder, plans, store
from gonio.compile.llvm import codegen, machine
from gonio.compile.llvm.program import EACH
from gonio.compile.plans import Data, Result, carry_out, prepare
from gonio.compile.threads import share
from gonio.evaluate import batch, planning, tracing
from gonio.evaluate.interpret import evaluate
from gonio.evaluate.tracing import Task
from gonio.formula import tree
from gonio.formula.direction import Direction
from gonio.formula.fields import option, param, table
from gonio.trace.derive import gradient
from gonio.trace.graph import INDEX, Graph
from gonio.trace.passes import rewritten
from gonio.trace.symbol import Symbol

pytestmark = pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")

DTYPES = {"float32": 6e-8, "float64": 1.2e-16}
METAL = gn.Microfacet(gn.GGX(0.2, 0.4), gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3]))
GREY = gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.9))


def directions(n: int, dtype: str = "float64", seed: int = 0) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=(n, 3))
    w[:, 2] = np.abs(w[:, 2]) + 0.05
    return (w / np.linalg.norm(w, axis=1)[:, None]).astype(dtype)


WI, WO = directions(1000), directions(1000, seed=1)


def uncompiled(call):
    with pytest.MonkeyPatch.context() as patch:
        switch_off(patch)
        return call()


# Random graphs.


@pytest.mark.parametrize("seed", thinned(range(60), range(10)))
def test_random_graphs(seed, monkeypatch):
    """Compiled, they give what NumPy gives of the graph after its passes (which tests/trace/test_passes.py hold to the
    graph before them), wherever NumPy's own rounding does not decide."""
    monkeypatch.setattr(codegen, "INLINE", (codegen.INLINE, 0)[seed % 2])  # elementary functions in place, or called
    graph, nodes = random_graph(seed, loads=3, tables=2)
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(500, 3)) * rng.choice([0.1, 1.0, 10.0], size=(500, 1))
    x[:8] = [
        [0, 0, 0],
        [np.nan, 1, 1],
        [np.inf, 1, -1],
        [-np.inf, 0, 1],
        [1, 1, 1],
        [-0.0, 0, 2],
        [1e300, 1, 1],
        [1e-300, 1, 1],
    ]
    tables = [rng.normal(size=7), rng.normal(size=7)]
    results = [Result((node,), EACH, ()) for node in nodes]
    padded = [np.append(t, 0.0) for t in tables]
    plan = prepare(graph, results, Data([(x, 3)], 1, padded, (500,), x.dtype))
    graph, nodes = rewritten(graph, nodes, "float64")
    with np.errstate(all="ignore"):
        want = evaluate(graph, nodes, lambda a, c: x[:, c], tables, x.dtype)
        sure = steady(graph, nodes, x, tables, want)
    assert np.mean(sure) > 0.2
    for got, expected, ok in zip(carry_out(plan, [x]), want, sure, strict=True):
        expected = np.broadcast_to(expected, got.shape)[ok]
        if got.dtype == bool:
            np.testing.assert_array_equal(got[ok], expected)
        else:
            np.testing.assert_allclose(got[ok], expected, rtol=1e-7, atol=1e-280)


@pytest.mark.parametrize("dtype", DTYPES)
def test_masks_beside_numbers_are_1_or_0(dtype):
    def kernel(m, mean, x):
        above, large = x[0] > 0.5, x[0] > 0.75
        return 3.0 * above, above * 2, 0.5 - large, above * large, 1.0 * (above + large), x[0] * above + 4 * large

    x = (np.arange(37) / 32.0).astype(dtype)
    found = batch.run(Task(kernel, ("scalar",) * 6, (1,)), gn.Lambertian(0.5), (x[:, None],))
    above, large = x > 0.5, x > 0.75
    want = (3.0 * above, above * 2, 0.5 - large, above * large, 1.0 * (above | large), x * above + 4 * large)
    for got, expected in zip(found, want, strict=True):
        np.testing.assert_array_equal(got, expected)


class _Entries(gn.Reflectance):
    """The sum of the first entries of a table, each times a power of a cosine."""

    numbers = table("numbers")
    count = option("3", "100", doc="how many")

    def __init__(self, numbers, count="3"):
        self._set({"numbers": numbers, "count": count})

    def formula(self, wi, wo):
        total = 0.0 * wi.z
        for k in range(int(self.count)):
            total = total * wo.z + ops.take(self.numbers, k)
        return total


@pytest.mark.parametrize("count", [3, 100])
def test_entries_at_constant_places(count):
    """Few are read before the loops, many where they are used; those of a table that is too short, never."""
    numbers, wo = np.random.default_rng(count).uniform(size=count), gn.direction([0.1, 0.7], 0.0)
    found = _Entries(numbers, str(count)).f(wo, wo)
    np.testing.assert_allclose(found, np.polyval(numbers, wo[:, 2]), rtol=1e-14)
    with pytest.raises(IndexError):
        _Entries(numbers[:-1], str(count)).f(wo, wo)


@pytest.mark.parametrize("dtype", DTYPES)
def test_a_table_is_never_read_outside(dtype):
    """An index before the table or behind it reads some entry of it; alone, and together with its neighbour."""
    graph = Graph()
    index = graph.apply("to_index", graph.load(0, 0))
    nodes = [
        graph.take(0, index),
        graph.take(0, graph.apply("add", index, graph.constant(1, INDEX))),
        graph.take(1, index),
    ]
    table = np.arange(1.0, 8.0).astype(dtype)
    padded = np.append(table, table[:1] * 0)
    x = np.array([0, 3, 5, 6, 7, 8, 100, -1, -2, 2.0**28, -(2.0**28), 2.0**31 - 128, np.nan, np.inf], dtype)[:, None]
    plan = prepare(graph, [Result((n,), EACH, ()) for n in nodes], Data([(x, 1)], 1, [padded] * 2, (len(x),), x.dtype))
    entries = np.where(np.isfinite(x[:, 0]), x[:, 0], 0).astype(np.int64)
    for got, shift in zip(carry_out(plan, [x]), (0, 1, 0), strict=True):
        there = (entries >= 0) & (entries + shift < len(table))
        np.testing.assert_array_equal(got[there], table[(entries + shift)[there]])
        assert np.isin(got[~there], padded).all()


APART = {
    "three": (0, 1, 2),
    "six": (0, 1, 2, 3, 4, 5),
    "twelve": tuple(range(12)),
    "every other": (1, 3),
    "before": (-4, -3, -2, 0),
    "two runs": (0, 1, 2, 40, 42),
    "runs and ones": (0, 7, 20, 21, 22, 23, 24, 60),
    "the last one alone": (0, 1, 2, 3, 4, 30),
}


@pytest.mark.parametrize("name", APART)
@pytest.mark.parametrize("dtype", DTYPES)
def test_entries_that_lie_together(dtype, name):
    """Lookups at constant distances are the table's entries wherever all are in it; else they still are within it."""
    graph, offsets = Graph(), APART[name]
    index = graph.apply("to_index", graph.load(0, 0))
    nodes = [graph.take(0, graph.apply("add", index, graph.constant(k, INDEX))) for k in offsets]
    count, outside = 100, 777.0
    around = np.full(3 * count, outside, dtype)
    padded = around[count : 2 * count + 1]
    padded[:] = np.arange(1.0, count + 2.0)
    inside = np.arange(-min(*offsets, 0), count - max(offsets))
    wild = [-1.0, -5.0, count - 1.0, count, count + 3.0, 2.0**28, -(2.0**28), np.nan, np.inf, -np.inf]
    x = np.concatenate([inside, wild, np.arange(-70.0, 170.0)]).astype(dtype)[:, None]
    plan = prepare(graph, [Result((n,), EACH, ()) for n in nodes], Data([(x, 1)], 1, [padded], (len(x),), x.dtype))
    for got, offset in zip(carry_out(plan, [x]), offsets, strict=True):
        np.testing.assert_array_equal(got[: len(inside)], padded[inside + offset])
        assert (got != outside).all()


GUARDED = """
import ctypes, mmap, sys
import numpy as np
from gonio.compile.plans import Data, Result, carry_out, prepare
from gonio.compile.llvm.program import EACH
from gonio.trace.graph import INDEX, Graph

page = mmap.PAGESIZE
pages = mmap.mmap(-1, 2 * page)
address = ctypes.addressof(ctypes.c_char.from_buffer(pages))
assert ctypes.CDLL(None).mprotect(ctypes.c_void_p(address + page), ctypes.c_size_t(page), 0) == 0
for dtype in (np.float32, np.float64):
    padded = np.frombuffer(pages, dtype, 101, page - 101 * np.dtype(dtype).itemsize)
    x = np.concatenate([np.arange(-70.0, 170.0), [2.0**28, np.nan, np.inf]]).astype(dtype)[:, None]
    for offsets in eval(sys.argv[1]):
        graph = Graph()
        index = graph.apply("to_index", graph.load(0, 0))
        nodes = [graph.take(0, graph.apply("add", index, graph.constant(k, INDEX))) for k in offsets]
        plan = prepare(graph, [Result((n,), EACH, ()) for n in nodes], Data([(x, 1)], 1, [padded], (len(x),), x.dtype))
        carry_out(plan, [x])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="guards a page as Linux does")
def test_no_load_reaches_beyond_the_padding():
    """Of a table that ends where the memory of the process does, what is read for nothing too."""
    command = [sys.executable, "-c", GUARDED, repr([*APART.values(), (0,), (0, 1), (2, 3, 4), (0, 2)])]
    assert subprocess.run(command, capture_output=True).returncode == 0


def test_a_table_shorter_than_its_lookups_are_apart_is_not_compiled():
    """NumPy computes it: an error, or the entries that there are."""

    class Apart(gn.Reflectance):
        numbers = table("numbers")

        def __init__(self, numbers):
            self._set({"numbers": numbers})

        def formula(self, wi, wo):
            k = ops.to_index(wi.z * 2.0)
            return ops.take(self.numbers, k) + ops.take(self.numbers, k + 50)

    wo = gn.direction([0.1, 0.7], 0.0)
    assert Apart(np.arange(60.0)).f(wo, wo).tolist() == [52.0, 52.0]
    with pytest.raises(IndexError):
        Apart(np.arange(40.0)).f(wo, wo)


@pytest.mark.parametrize(
    ("dtype", "width"),
    thinned(product(DTYPES, [4, 8, 32, 64]), [("float32", 8), ("float64", 64)]),
)
def test_every_width_of_lookups(width, dtype, monkeypatch):
    grid = gn.repair.resample(METAL, resolution=(8, 6, 8, 8))
    wi, wo = WI[:300].astype(dtype), WO[:300].astype(dtype)
    want = grid.f(wi, wo)
    monkeypatch.setattr(store, "_width", lambda program: width)
    monkeypatch.setattr(store, "_versions", lambda: f"width {width}")
    monkeypatch.setenv("GONIO_CACHE", "off")
    np.testing.assert_allclose(grid.replace().f(wi, wo), want, rtol=1e-13 if dtype == "float64" else 1e-6)


@pytest.mark.parametrize("width", [4, 8, 16, 64])
def test_every_width_of_vectors(width, monkeypatch):
    """Narrower vectors than this processor's are what others have, and wider ones are split."""
    want = METAL.f(WI, WO)
    monkeypatch.setattr(store, "_width", lambda program: width)
    monkeypatch.setattr(store, "_versions", lambda: f"width {width}")
    monkeypatch.setenv("GONIO_CACHE", "off")
    m = METAL.replace()
    np.testing.assert_allclose(m.f(WI, WO), want, rtol=1e-13)
    np.testing.assert_allclose(m.f(WI[:3], WO[:3]), want[:3], rtol=1e-13)


# Derivatives.

SMOOTH = [
    lambda a, b: a + b,
    lambda a, b: a - 0.5 * b,
    lambda a, b: a * b,
    lambda a, b: a / (b * b + 1.0),
    lambda a, b: ops.sqrt(a * a + 0.1),
    lambda a, b: ops.exp(-a * a),
    lambda a, b: ops.log(a * a + 0.5),
    lambda a, b: ops.sin(a),
    lambda a, b: ops.cos(a * b),
    lambda a, b: ops.sin_turn(a),
    lambda a, b: ops.cos_turn(a * b),
    lambda a, b: ops.tan(ops.clip(a, -1.0, 1.0)),
    lambda a, b: ops.arctan2(a, b * b + 0.3),
    lambda a, b: ops.arccos(ops.sin(a) * 0.9),
    lambda a, b: ops.erf(a),
    lambda a, b: ops.erfinv(ops.sin(a) * 0.9),
    lambda a, b: ops.ierfc(a * a),
    lambda a, b: ops.power(a * a + 0.2, b),
    lambda a, b: ops.minimum(a, b),
    lambda a, b: ops.maximum(a, b * 0.5),
    lambda a, b: ops.where(a < b, a * a, b),
    lambda a, b: ops.absolute(a - b),
]


@pytest.mark.parametrize("seed", thinned(range(12), range(6)))
def test_gradients_of_random_graphs(seed):
    """Against central differences, where these are steady."""
    rng = np.random.default_rng(seed)
    graph = Graph()
    x, y, z = (Symbol(graph, graph.load(0, c)) for c in range(3))
    pool = [x, y, z, x * y, x + 2.0]
    for _ in range(25):
        a, b = (pool[int(rng.integers(len(pool)))] for _ in range(2))
        function = SMOOTH[int(rng.integers(len(SMOOTH)))]
        pool.append(function(a, b))
    out = pool[-1] + pool[-2] * pool[-3]
    inputs = [x.node, y.node, z.node]
    slopes = gradient(graph, out.node, inputs)
    points = rng.uniform(0.2, 0.9, (200, 3))

    def value(p):
        return np.broadcast_to(evaluate(graph, [out.node], lambda a, c: p[:, c], [], p.dtype)[0], len(p))

    with np.errstate(all="ignore"):
        got = evaluate(graph, slopes, lambda a, c: points[:, c], [], points.dtype)
        for c in range(3):

            def shifted(h, c=c):
                up, down = points.copy(), points.copy()
                up[:, c] += h
                down[:, c] -= h
                return (value(up) - value(down)) / (2 * h)

            coarse, fine = shifted(2e-5), shifted(1e-5)
            ok = np.abs(coarse - fine) < 1e-5 * (1.0 + np.abs(fine))
            exact = np.broadcast_to(got[c], len(points))
            np.testing.assert_allclose(exact[ok], fine[ok], rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("m", [GREY, METAL, 0.3 * METAL + gn.Lambertian([0.1, 0.2, 0.3]) + gn.Phong(0.5, 7.0)], ids=str)
def test_jacobian(m, evaluation):
    """Against central differences of f, by every parameter and both directions."""
    j = m.jacobian(WI, WO, by=[*m.parameters, "wi", "wo"])
    np.testing.assert_allclose(j.f, m.f(WI, WO), rtol=1e-13)
    for path, p in m.parameters.items():
        h = 1e-6
        up, down = (m.replace({path: np.asarray(p.value) + s * h}).f(WI, WO) for s in (1, -1))
        np.testing.assert_allclose(j.by[path], (up - down) / (2 * h), rtol=1e-5, atol=1e-8 * np.abs(up).max())
    for name, at in (("wi", 0), ("wo", 1)):
        for c in range(3):
            both = []
            for h in (1e-6, -1e-6):
                w = [WI.copy(), WO.copy()]
                w[at][:, c] += h
                both.append(m.f(*w))
            slope = (both[0] - both[1]) / 2e-6
            np.testing.assert_allclose(j.by[name][..., c], slope, rtol=1e-4, atol=1e-7 * np.abs(slope).max())


def test_jacobian_of_maps_and_many_channels(evaluation):
    rng = np.random.default_rng(3)
    for m in (
        gn.Microfacet(gn.GGX(rng.uniform(0.1, 0.9, (1000, 1))), 0.5),
        gn.Lambertian(rng.uniform(0.1, 0.9, (1000, 3))),
        gn.ModifiedPhong(rng.uniform(0.1, 0.9, 12), 5.0),
    ):
        j = m.jacobian(WI, WO)
        f = m.f(WI, WO)
        np.testing.assert_allclose(j.f, f, rtol=1e-13)
        path = next(iter(m.parameters))
        value = m.parameters[path].value
        slope = (m.replace({path: value + 1e-6}).f(WI, WO) - m.replace({path: value - 1e-6}).f(WI, WO)) / 2e-6
        assert j.by[path].shape == f.shape
        np.testing.assert_allclose(j.by[path], slope, rtol=1e-5, atol=1e-7)
    with pytest.raises(gn.errors.NotFoundError, match="expected one of"):
        GREY.jacobian(WI, WO, by=["roughness"])


# Arrays.


def layouts(w: np.ndarray) -> dict[str, np.ndarray]:
    """The same directions, lying differently in memory."""
    wide = np.zeros((len(w), 7), w.dtype)
    wide[:, 2:5] = w
    record = np.zeros(len(w), np.dtype([("id", "u1"), ("w", w.dtype, 3)]))
    record["w"] = w
    frozen = w.copy()
    frozen.flags.writeable = False
    return {
        "side by side": w.copy(),
        "planes": np.ascontiguousarray(w.T).T,
        "Fortran": np.asfortranarray(w),
        "padded": wide[:, 2:5],
        "every second": np.repeat(w, 2, axis=0)[::2],
        "backwards": w[::-1].copy()[::-1],
        "components backwards": w[:, ::-1].copy()[:, ::-1],
        "unaligned": record["w"],
        "read-only": frozen,
    }


@pytest.mark.parametrize(
    ("n", "dtype"),
    thinned(
        product([1, 5, 31, 32, 33, 100], DTYPES),
        [(1, "float64"), (5, "float32"), (31, "float32"), (32, "float64"), (33, "float32"), (100, "float64")],
    ),
)
def test_layouts(dtype, n):
    wi, wo = WI[:n].astype(dtype), WO[:n].astype(dtype)
    want, pdf = METAL.f(wi, wo), METAL.pdf(wi, wo)
    np.testing.assert_allclose(want, uncompiled(lambda: METAL.f(wi, wo)), rtol=300 * DTYPES[dtype])
    for name, a in layouts(wi).items():
        for other, b in layouts(wo).items():
            np.testing.assert_array_equal(METAL.f(a, b), want, err_msg=f"{name}, {other}")
        np.testing.assert_array_equal(METAL.pdf(a, wo), pdf, err_msg=name)


SHAPES = [
    ((3,), (3,)),
    ((3,), (5, 3)),
    ((7, 3), (3,)),
    ((4, 1, 3), (5, 3)),
    ((2, 3, 4, 3), (3, 1, 3)),
    ((1, 3), (6, 3)),
]
SHAPES += [
    ((2, 1, 4, 1, 3), (1, 3, 1, 5, 3)),
    ((1, 1, 3), (1, 3)),
    ((0, 3), (3,)),
    ((4, 0, 3), (1, 3)),
    ((40, 1, 3), (70, 3)),
]


@pytest.mark.parametrize(("a", "b"), SHAPES, ids=str)
def test_broadcasting(a, b):
    wi, wo = (directions(int(np.prod(s[:-1])), seed=i).reshape(s) for i, s in enumerate((a, b)))
    batch = np.broadcast_shapes(a[:-1], b[:-1])
    roughness = gn.Microfacet(gn.GGX(np.full((5, 1), 0.3)), 0.5) if batch[-1:] == (5,) else GREY
    for m in (GREY, METAL, gn.Lambertian(np.linspace(0, 1, 20)) + gn.Phong(), roughness):
        whole = [np.broadcast_to(w, (*batch, 3)).copy() for w in (wi, wo)]
        u = np.random.default_rng(0).random((*batch, 2))
        for got, want in (
            (m.f(wi, wo), uncompiled(lambda m=m, w=whole: m.f(*w))),
            (m.pdf(wi, wo), uncompiled(lambda m=m, w=whole: m.pdf(*w))),
            *zip(m.sample(whole[1], u), uncompiled(lambda m=m, w=whole, u=u: m.sample(w[1], u)), strict=True),
        ):
            assert np.shape(got) == np.shape(want)
            np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-12)


def test_many_channels_and_maps(evaluation):
    """More channels than are written out, and every kind of map, give what one material for each of them gives."""
    rho = np.random.default_rng(0).uniform(0.1, 0.9, (30, 11))
    n = np.random.default_rng(1).uniform(1.0, 40.0, (30, 1))
    m = gn.ModifiedPhong(rho, n)
    wi, wo = WI[:30], WO[:30]
    f, pdf = m.f(wi, wo), m.pdf(wi, wo)
    s = m.sample(wo, np.random.default_rng(2).random((30, 2)))
    assert f.shape == (30, 11)
    assert s.weight.shape == (30, 11)
    for i in range(30):
        for c in range(11):
            one = gn.ModifiedPhong(rho[i, c], n[i, 0])
            assert f[i, c] == pytest.approx(one.f(wi[i], wo[i]), rel=1e-12)
        assert pdf[i] == pytest.approx(one.pdf(wi[i], wo[i]), rel=1e-12)
    np.testing.assert_allclose(s.pdf, m.pdf(s.wi, wo), rtol=1e-9)


def each_alone(m: gn.Reflectance, channels: int) -> list[gn.Reflectance]:
    """The channels as materials of one."""

    def only(c: int) -> gn.Reflectance:
        return tree.each(m, lambda x: x[..., c : c + 1] if np.ndim(x) and x.shape[-1] > 1 else x)

    return [only(c) for c in range(channels)]


@pytest.mark.parametrize("channels", thinned([9, 31, 32, 401], [9, 32]))
def test_channels_in_two_stages_are_what_each_is_alone(channels):
    """In blocks of a large batch, for broadcast directions, for a single one; with NaN and below the horizon."""
    metal = gn.Conductor(np.linspace(0.2, 1.3, channels), np.linspace(3.9, 2.0, channels))
    m = gn.Microfacet(gn.GGX(0.3, 0.2), metal) + gn.Lambertian(np.linspace(0.1, 0.2, channels))
    wi, wo = directions(9001, seed=2), directions(9001, seed=3)
    wi[5, 2], wi[6, 1], wo[7] = -wi[5, 2], np.nan, [0.0, 0.0, -1.0]
    some = [0, 4, channels - 1]
    ones = [each_alone(m, channels)[c] for c in some]
    for a, b in ((wi, wo), (wi[:300, None], wo[:41]), (wi[:40], wo[100]), (wi[0], wo[0])):
        f = m.f(a, b)
        assert f.shape == (*np.broadcast_shapes(a.shape, b.shape)[:-1], channels)
        for c, one in zip(some, ones, strict=True):
            np.testing.assert_allclose(f[..., c], one.f(a, b)[..., 0], rtol=1e-13)
    out, padded = np.empty((9001, channels)), np.empty((9001, channels + 1))
    np.testing.assert_array_equal(m.f(wi, wo, out=out), m.f(wi, wo))
    np.testing.assert_array_equal(m.f(wi, wo, out=padded[:, 1:]), out)
    other = m.replace({"0.distribution.alpha_x": 0.25, "1.rho": np.linspace(0.3, 0.1, channels)})
    again = gn.Microfacet(gn.GGX(0.25, 0.2), metal) + gn.Lambertian(np.linspace(0.3, 0.1, channels))
    np.testing.assert_array_equal(other.f(wi, wo), again.f(wi, wo))
    other = m.replace({"0.fresnel.eta": metal.eta[::-1], "0.fresnel.k": metal.k + 0.5})  # what is of the channel alone
    for c in some:
        np.testing.assert_allclose(other.f(wi, wo)[:, c], each_alone(other, channels)[c].f(wi, wo)[:, 0], rtol=1e-13)


def test_maps_with_many_channels_in_two_stages():
    rng = np.random.default_rng(5)
    m = gn.Microfacet(gn.GGX(rng.uniform(0.1, 0.9, (3000, 1))), gn.Schlick(rng.uniform(0.1, 0.9, (1, 20))))
    wi, wo = directions(3000, seed=6), directions(3000, seed=7)
    f = m.f(wi, wo)
    for c in (0, 19):
        np.testing.assert_allclose(f[:, c], each_alone(m, 20)[c].f(wi, wo)[:, 0], rtol=1e-13)


def squares(m, mean, wi, wo):
    """A kernel whose results are all summed over the last axis of the batch."""
    f = m.formula(Direction(*wi), Direction(*wo))
    return wi[2] * f, f * f, wi[2] * wo[2]


SQUARES = Task(squares, (TOTAL,) * 3, (3, 3))


@pytest.mark.parametrize("channels", [3, 9, 31, 401])
@pytest.mark.parametrize("shape", [(50,), (700, 12), (2, 40, 64), (900, 64)])
def test_totals_of_any_number_of_channels(channels, shape):
    """Against the sum, channel by channel, of what each is alone; whichever axis is the outermost, in blocks or not."""
    metal = gn.Conductor(np.linspace(0.2, 1.3, channels), np.linspace(3.9, 2.0, channels))
    m, count = gn.Microfacet(gn.GGX(0.3), metal), int(np.prod(shape))
    wi = directions(count, seed=8).reshape(*shape, 3)
    wo = directions(shape[-1], seed=9)
    found = batch.run(SQUARES, m, (wi, wo))
    for total in found:
        assert total.shape == (*shape[:-1], channels)
        assert total.dtype == np.float64
    for c in (0, channels // 2, channels - 1):
        one = each_alone(m, channels)[c]
        f = one.f(wi, wo)[..., 0]
        cos_i, cos_o = wi[..., 2], wo[..., 2]
        for total, terms in zip(found, (cos_i * f, f * f, cos_i * cos_o), strict=True):
            np.testing.assert_allclose(total[..., c], terms.sum(axis=-1), rtol=1e-12)


@pytest.mark.parametrize("rows", [10, 80])
def test_totals_of_maps_with_many_channels(rows):
    rng = np.random.default_rng(10)
    m = gn.Microfacet(gn.GGX(rng.uniform(0.2, 0.9, (rows, 1, 1))), gn.Schlick(rng.uniform(0.1, 0.9, (rows, 1, 15))))
    wi, wo = directions(rows * 64, seed=8).reshape(rows, 64, 3), directions(64, seed=9)
    total = batch.run(SQUARES, m, (wi, wo))[1]
    for c in (0, 7, 14):
        f = each_alone(m, 15)[c].f(wi, wo)[..., 0]
        np.testing.assert_allclose(total[:, c], (f * f).sum(axis=-1), rtol=1e-12)


def test_blocks_and_threads_change_nothing():
    wi, wo = directions(200_001), directions(200_001, seed=1)
    before = gn.engine.threads()
    try:
        one = [gn.engine.threads(1), METAL.f(wi, wo), GREY.f(wi[:, None], wo[:3]), gn.albedo(GREY, wi[:200])][1:]
        several = [gn.engine.threads(5), METAL.f(wi, wo), GREY.f(wi[:, None], wo[:3]), gn.albedo(GREY, wi[:200])][1:]
    finally:
        gn.engine.threads(before)
    for a, b in zip(one, several, strict=True):
        np.testing.assert_array_equal(a, b)
    for bad in (0, -1, 2.0, True, "2"):
        with pytest.raises(gn.errors.ParameterError, match="whole number from 1"):
            gn.engine.threads(bad)


def test_out():
    want = METAL.f(WI, WO)
    for out in (np.empty((1000, 3)), np.empty((1000, 6))[:, ::2], np.empty((3, 1000)).T):
        assert METAL.f(WI, WO, out=out) is out
        np.testing.assert_array_equal(out, want)
    wi = WI.copy()
    np.testing.assert_array_equal(METAL.f(wi, WO, out=wi), want)  # written over what is read
    with pytest.raises(gn.errors.ShapeError, match="out: got"):
        METAL.f(WI, WO, out=np.empty((1000,)))
    with pytest.raises(gn.errors.ShapeError, match="float32"):
        METAL.f(WI, WO, out=np.empty((1000, 3), "float32"))
    frozen = np.empty((1000, 3))
    frozen.flags.writeable = False
    with pytest.raises(gn.errors.ArrayTypeError, match="read-only"):
        METAL.f(WI, WO, out=frozen)


def test_results_are_the_callers():
    """Memory is used again only when nobody holds a result, or a part of it, any more."""
    wi, wo = directions(100_000), directions(100_000, seed=1)
    first = GREY.f(wi, wo)
    kept, part = first.copy(), first[17:19]
    second = GREY.f(wo[::-1], wi)
    assert not np.shares_memory(first, second)
    del first
    for _ in range(3):
        GREY.f(wi * 0.5, wo)
    np.testing.assert_array_equal(part, kept[17:19])
    second[:] = -1.0
    np.testing.assert_array_equal(GREY.f(wi, wo), kept)


def test_too_large():
    wi = np.broadcast_to(WI[0], (1 << 21, 1, 3))
    with pytest.raises(gn.errors.TooLargeError, match="GB of memory; evaluate fewer"):
        GREY.f(wi, np.broadcast_to(WO[0], (1 << 21, 3)))


def test_bad_arrays():
    for wi, wo, error in (
        (WI, WO[:7], gn.errors.ShapeError),
        (WI[:, :2], WO, gn.errors.ShapeError),
        (np.float64(1.0), WO, gn.errors.ShapeError),
        (WI.astype("float32"), WO, gn.errors.ArrayTypeError),
        (WI.astype("float16"), WO.astype("float16"), gn.errors.ArrayTypeError),
        (WI.astype(">f8"), WO.astype(">f8"), gn.errors.ArrayTypeError),
        (WI.astype(complex), WO.astype(complex), gn.errors.ArrayTypeError),
        (WI.astype(object), WO, gn.errors.ArrayTypeError),
    ):
        for _ in range(2):
            with pytest.raises(error):
                GREY.f(wi, wo)


# Traces.


class _Branches(gn.Reflectance):
    """Decides on a value: it cannot be traced, but single directions can be evaluated."""

    rho = param(0.5, 0.0, 1.0, "albedo")

    def formula(self, wi: Direction, wo: Direction):
        return self.rho * (1.0 if np.max(wi.z) > 0.5 else 2.0)


def test_what_cannot_be_traced_runs_on_arrays():
    m = _Branches(0.5)
    assert m.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]) == 0.5
    with pytest.raises(gn.errors.TraceError, match="_Branches"):
        gn.engine.kernel(m)
    with pytest.raises(gn.errors.TraceError):
        m.jacobian(WI, WO)


def test_new_values_compile_nothing(monkeypatch):
    GREY.f(WI, WO)
    monkeypatch.setattr(store, "_compiled", lambda *_: pytest.fail("compiled anew"))
    monkeypatch.setattr(tracing, "_trace", lambda *_: pytest.fail("traced anew"))
    assert not np.allclose(GREY.replace({"distribution.alpha": 0.4}).f(WI, WO), GREY.f(WI, WO))
    assert not np.allclose(gn.Microfacet(gn.GGX(0.7), gn.Conductor(1.1, 2.0)).f(WI, WO), GREY.f(WI, WO))


def test_copies_have_plans_of_their_own():
    m = gn.Lambertian(0.5) + gn.Phong(0.5, 3.0)
    f = m.f(WI, WO)
    other = tree.with_values(m, {"0.rho": 0.25})
    np.testing.assert_allclose(f - other.f(WI, WO), 0.25 / np.pi, rtol=1e-9)
    assert (tree.each(m, lambda v: 0.0 * v).f(WI, WO) == 0.0).all()


def test_kernel_is_readable():
    k = gn.engine.kernel(gn.Lambertian([0.1, 0.2]))
    assert "f[1] = " in k.source
    assert "rho[0] * 0.3183" in str(k)
    assert k.inputs[-2:] == ("rho[0]", "rho[1]")
    assert "define void @kernel" in k.llvm
    assert "ret" in k.assembly
    assert "wi.z = " in gn.engine.kernel(METAL, "sample").source
    with pytest.raises(gn.errors.NotFoundError, match="expected one of"):
        gn.engine.kernel(METAL, "g")


# The cache of kernels.

SCRIPT = """
import numpy as np, gonio as gn
from gonio.compile import store
from gonio.compile.llvm import machine
w = np.array([[0.6, 0.0, 0.8]])
compiled = []
original = store._compiled
store._compiled = lambda *args: compiled.append(1) or original(*args)
print(repr(gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9)).f(w, w)[0]), len(compiled))
"""
DAMAGED = """
import sys
from pathlib import Path
from gonio.evaluate import planning
for path, damaged in zip(sys.argv[1::2], sys.argv[2::2]):
    path, damaged = Path(path), bytes.fromhex(damaged)
    whole = path.read_bytes()
    path.write_bytes(damaged)
    store._KNOWN.clear()
    planning._PATTERNS.clear()
    compiled.clear()
    f = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9)).f(w, w)[0]
    print(repr(f), len(compiled), path.read_bytes() == whole)
"""


def run_script(folder, warning: str = "", more: str = "", words: tuple[str, ...] = (), **environment) -> list[str]:
    env = {**os.environ, "GONIO_CACHE_DIR": str(folder), **environment}
    command = [sys.executable, "-c", SCRIPT + more, *words]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
    assert warning in done.stderr if warning else not done.stderr
    return done.stdout.split()


@pytest.mark.slow_because("the next process is what is tested")
def test_kernels_are_kept_on_disk(tmp_path):
    value, compiled = run_script(tmp_path / "new")
    assert compiled == "1"
    assert run_script(tmp_path / "new") == [value, "0"]
    record, code = sorted((tmp_path / "new" / cache_folder.FOLDER).iterdir(), key=lambda path: path.stat().st_size)
    whole = code.read_bytes()
    damages = (b"", whole[:20], whole[:-1], whole[:-9] + b"x" + whole[-8:], whole + b"x", b"x" * len(whole))
    cases = [(code, damaged, "1") for damaged in damages] + [(record, record.read_bytes()[:-1], "0")]
    words = tuple(word for file, damaged, _ in cases for word in (str(file), damaged.hex()))
    said = run_script(tmp_path / "new", more=DAMAGED, words=words)
    assert said[:2] == [value, "0"]
    assert said[2:] == [word for *_, compiled in cases for word in (value, compiled, "True")]
    assert {*code.parent.iterdir()} == {record, code}


@pytest.mark.slow_because("the next process is what is tested")
def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    value, compiled = run_script(tmp_path / "file", warning="cannot be made (Not a directory); set GONIO_CACHE_DIR")
    assert compiled == "1"
    assert run_script(tmp_path / "elsewhere")[0] == value
    assert float(value.partition("(")[2].rstrip(")")) == pytest.approx(
        float(run_script(tmp_path, GONIO_ENGINE="numpy")[0].partition("(")[2].rstrip(")")), rel=1e-12
    )


@pytest.mark.slow_because("the next process is what is tested")
@pytest.mark.parametrize("count", thinned([3, 6], [3]))
def test_processes_share_a_folder(count, tmp_path):
    with ThreadPoolExecutor(4) as pool:
        values = list(pool.map(lambda _: run_script(tmp_path)[0], range(count)))
    assert len(set(values)) == 1
    assert len(list((tmp_path / cache_folder.FOLDER).iterdir())) == 2  # a record and the code that it names


def test_llvms_own_loader_gives_the_same(monkeypatch):
    """Where objects are no ELF files, or refer to what is outside of them."""
    want = METAL.f(WI, WO)
    monkeypatch.setattr(store.elf, "flatten", lambda code: None)
    monkeypatch.setattr(store, "_versions", lambda: "by LLVM's loader")
    monkeypatch.setenv("GONIO_CACHE", "off")
    np.testing.assert_array_equal(METAL.replace().f(WI, WO), want)


def test_threads_compile_at_once(monkeypatch):
    monkeypatch.setattr(store, "_versions", lambda: "compiled by many threads")
    monkeypatch.setenv("GONIO_CACHE", "off")
    wi, wo = directions(50), directions(50, seed=1)
    want = [uncompiled(lambda n=n: gn.ModifiedPhong(np.full(n, 0.5), 3.0).f(wi, wo)) for n in range(1, 7)]

    def work(n):
        return gn.ModifiedPhong(np.full(n, 0.5), 3.0).f(wi, wo)

    with ThreadPoolExecutor(6) as pool:
        for got, expected in zip(pool.map(work, list(range(1, 7)) * 3), want * 3, strict=True):
            np.testing.assert_allclose(got, expected, rtol=1e-12)


def test_callers_share_the_threads(monkeypatch):
    """Many callers at once get their own results, and an error in a thread reaches its caller."""
    monkeypatch.setattr(plans, "PARALLEL", 100)
    monkeypatch.setattr(plans, "WAKING", 100)
    wi, wo = directions(20_000), directions(20_000, seed=1)
    materials = [gn.ModifiedPhong(0.5, float(n)) for n in range(1, 9)]
    want = [m.f(wi, wo) for m in materials]
    with ThreadPoolExecutor(8) as pool:
        for got, expected in zip(pool.map(lambda m: m.f(wi, wo), materials * 6), want * 6, strict=True):
            np.testing.assert_array_equal(got, expected)

    def fails(number):
        if number == 7:
            raise RuntimeError("from a thread")

    before = gn.engine.threads()
    try:
        for count in (1, 2, 5):
            gn.engine.threads(count)
            with pytest.raises(RuntimeError, match="from a thread"):
                share(fails, [(i,) for i in range(20)])
    finally:
        gn.engine.threads(before)
    assert gn.engine.threads() >= 1
    np.testing.assert_array_equal(materials[0].f(wi, wo), want[0])


def test_little_work_takes_one_vector_at_a_time(monkeypatch):
    """Where a caller says that it is little, on all threads that share it; the numbers are the same to the last bit."""
    programs, kernel = [], store.kernel
    monkeypatch.setattr(store, "kernel", lambda program: programs.append(program) or kernel(program))
    m, wi, wo = METAL.replace(alpha=0.3), WI[:777], WO[:777]
    whole = m.f(wi, wo)
    with tracing.at_most(len(wi)):
        np.testing.assert_array_equal(m.f(wi, wo), whole)
        share(lambda start: m.pdf(wi[start:], wo[start:]), [(1,), (2,)])
    with tracing.at_most(tracing.FEW + 1):
        m.pdf(wi, wo)
    assert [program.single for program in programs] == [False, True, True, True, False]


@pytest.mark.skipif(not machine.is_x86(), reason="these processors are x86's")
def test_levels_of_llvm_make_the_same_code(monkeypatch):
    """Byte by byte, so that the lower level is enough for these processors."""
    llvm, programs, kernel = machine._llvm(), [], store.kernel
    monkeypatch.setattr(store, "kernel", lambda program: programs.append(program) or kernel(program))
    GREY.f(WI[:555], WO[:555])
    GREY.sample(WO[:555], np.random.default_rng(1).random((555, 2)))
    assert len(programs) == 2
    target, wide = llvm.Target.from_default_triple(), {"skylake-avx512", "icelake-server", "sapphirerapids"}
    for name in sorted(machine.ALIKE):
        features = "+avx2,+fma" + ",+avx512f,+avx512dq,+avx512vl,+avx512bw,+avx512cd" * (name in wide)
        monkeypatch.setattr(machine, "lane_bits", lambda name=name: 512 if name in wide else 256)
        for text in map(store.source, programs):
            code = []
            for level in (1, 2):
                options = {"opt": level, "reloc": "pic", "codemodel": "small"}
                made = target.create_target_machine(cpu=name, features=features, **options)
                monkeypatch.setattr(machine, "_target_machine", lambda _, made=made: made)
                code.append(machine.to_object(text))
            assert code[0] == code[1], name
