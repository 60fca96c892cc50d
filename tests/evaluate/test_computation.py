"""Computations over composites: against NumPy, by formulas of their own, compiled and as they stand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.arrays import Fixed, ops
from gonio.arrays.kinds import COUNT, SCALAR, SQUARE, TOTAL, VALUE, VECTOR
from gonio.compile import plans, store
from gonio.errors import ArrayTypeError, NotFoundError, ParameterError, ShapeError, TraceError
from gonio.evaluate import planning
from gonio.evaluate.computation import Computation, composite
from gonio.formula.direction import Direction

RNG = np.random.default_rng(17)
PIXELS, POINTS = RNG.uniform(0.1, 0.9, (7, 1, 3)), RNG.uniform(0.1, 0.9, (1, 45, 2))
TABLE = RNG.uniform(0.5, 2.0, 8)


def light(scene, mean, pixel, point):
    """Something of each kind: parameters of parts, of the composite, tables, both inputs, and the merged channels."""
    place = ops.to_index(point[0] * 8.0)
    x = scene.inner.parts[1].rho * pixel[0] * point[1] + scene.gain * ops.take(scene.table, place)
    seen = pixel[1] > point[0]
    value = ops.where(seen, x * ops.sqrt(pixel[2]), 0.0)
    return value, value, 1.0 * seen, mean.gain * point[0]


def scene_of(rho, gain):
    return composite(inner=[gn.Lambertian(0.1), gn.Lambertian(rho)], gain=gain, table=Fixed(TABLE))


def by_numpy(rho, gain, pixels=PIXELS, points=POINTS):
    """The value (P, S, C), whether it is seen (P, S), and the fourth result."""
    rho, gain = np.atleast_1d(rho), np.atleast_1d(gain)
    p, q = pixels[:, 0], points[0]
    entry = TABLE[(q[:, 0] * 8.0).astype(int)]
    x = rho * (p[:, 0, None] * q[:, 1])[..., None] + gain * entry[:, None]
    seen = p[:, 1, None] > q[:, 0]
    return np.where(seen[..., None], x * np.sqrt(p[:, 2, None, None]), 0.0), seen, gain.mean() * q[:, 0]


SUMS = Computation(light, {"pixel": 3, "point": 2}, {"light": TOTAL, "square": SQUARE, "seen": COUNT, "weight": COUNT})


@pytest.mark.parametrize("channels", [0, 1, 3, 8, 9, 31])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_sums(evaluation, channels, dtype):
    rho, gain = (np.linspace(0.1, 0.9, channels), np.linspace(1.0, 2.0, channels)) if channels else (0.3, 1.5)
    pixels, points = PIXELS.astype(dtype), POINTS.astype(dtype)
    found = SUMS(scene_of(rho, gain), pixel=pixels, point=points)
    value, seen, weight = by_numpy(rho, gain, pixels.astype(float), points.astype(float))
    element = (channels,) if channels else ()
    near = {"rtol": 1e-5 if dtype == "float32" else 1e-12}
    np.testing.assert_allclose(found["light"], value.sum(1).reshape(7, *element), **near)
    np.testing.assert_allclose(found["square"], value.sum(1).reshape(7, *element) ** 2, **near)
    np.testing.assert_array_equal(found["seen"], seen.sum(1))
    np.testing.assert_allclose(found["weight"], np.full(7, weight.sum()), **near)
    assert all(x.dtype == np.float64 for x in found.values())


@pytest.mark.parametrize("channels", [0, 3])
def test_results_of_each_element(evaluation, channels):
    def kernel(scene, mean, w, scale):
        turned = Direction(*w)
        return scene.gain * scale[0] * turned.x, scale[0] + turned.y, (turned.y, turned.z, scale[0])

    each = Computation(kernel, {"w": 3, "scale": 1}, {"a": VALUE, "b": SCALAR, "c": VECTOR})
    gain = np.linspace(1.0, 2.0, channels) if channels else 1.5
    w, scale = RNG.normal(size=(5, 1, 3)), RNG.normal(size=(4, 1))
    found = each(composite(gain=gain), w=w, scale=scale)
    x, y, z = np.moveaxis(np.broadcast_to(w, (5, 4, 3)), -1, 0)
    s = np.broadcast_to(scale[:, 0], (5, 4))
    want = (s * x)[..., None] * gain if channels else s * x * gain
    np.testing.assert_allclose(found["a"], want, rtol=1e-12)
    np.testing.assert_allclose(found["b"], s + y, rtol=1e-12)
    np.testing.assert_allclose(found["c"], np.stack([y, z, s], -1), rtol=1e-12)


@pytest.mark.parametrize("channels", [0, 3, 20])
def test_passes_add_up(evaluation, channels):
    """Totals of passes, squares of the totals of each, and the standard error of the mean pass that follows."""
    gain = np.linspace(1.0, 2.0, channels) if channels else 1.5
    scene, element = scene_of(0.3, gain), (channels,) if channels else ()
    shapes = {"light": (7, *element), "square": (7, *element), "seen": (7,), "weight": (7,)}
    sums = {name: np.full(shape, 10.0) for name, shape in shapes.items()}
    each = []
    for n in range(4):
        points = np.random.default_rng(n).uniform(0.1, 0.9, (1, 40 + n, 2))
        SUMS.add(sums, scene, pixel=PIXELS, point=points)
        each.append(by_numpy(0.3, gain, points=points)[0].sum(1).reshape(7, *element))
    total, square = sums["light"] - 10.0, sums["square"] - 10.0
    np.testing.assert_allclose(total, np.sum(each, 0), rtol=1e-12)
    np.testing.assert_allclose(square, np.sum(np.square(each), 0), rtol=1e-12)
    error = np.sqrt((square / 4 - (total / 4) ** 2) / 3)
    np.testing.assert_allclose(error, np.std(each, 0, ddof=1) / 2.0, rtol=1e-6)


def test_many_rows_are_shared_out():
    """Threads, pieces and rows of any length change nothing."""
    scene = scene_of([0.2, 0.4, 0.6], 1.5)
    pixels, points = RNG.uniform(0.1, 0.9, (20_000, 1, 3)), RNG.uniform(0.1, 0.9, (1, 100, 2))
    found = SUMS(scene, pixel=pixels, point=points)
    sums = {name: np.zeros(x.shape) for name, x in found.items()}
    before = gn.engine.threads()
    for start in range(0, 100, 25):
        gn.engine.threads(1 + start % 2)
        SUMS.add(sums, scene, pixel=pixels, point=points[:, start : start + 25])
    gn.engine.threads(before)
    for name in ("light", "seen", "weight"):
        np.testing.assert_allclose(sums[name], found[name], rtol=1e-12)


@pytest.mark.parametrize("channels", [0, 3, 12])
def test_derivatives(evaluation, channels):
    """Of the totals, by one number and by that of each channel, against what is linear in both."""
    rho = np.linspace(0.1, 0.9, channels) if channels else 0.3
    found, (by_gain, by_rho) = SUMS.derivatives(scene_of(rho, 1.5), ["gain", "inner.1.rho"], pixel=PIXELS, point=POINTS)
    element = (channels,) if channels else ()
    value = by_numpy(rho, 1.5)[0].sum(1).reshape(7, *element)
    np.testing.assert_allclose(found["light"], value, rtol=1e-12)
    zero = 0.0 * np.asarray(rho)
    np.testing.assert_allclose(by_gain, by_numpy(zero, 1.0)[0].sum(1).reshape(7, *element), rtol=1e-12)
    np.testing.assert_allclose(by_rho, by_numpy(zero + 1.0, 0.0)[0].sum(1).reshape(7, *element), rtol=1e-12)
    assert found["seen"].shape == (7,)


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
def test_new_numbers_and_sizes_compile_nothing(monkeypatch):
    SUMS(scene_of([0.1, 0.2, 0.3], 1.0), pixel=PIXELS, point=POINTS)
    monkeypatch.setattr(store, "_compiled", None)
    for n in range(30, 40):
        other = composite(inner=[gn.Lambertian(0.5), gn.Lambertian(RNG.random(3))], gain=n, table=Fixed(RNG.random(20)))
        SUMS(other, pixel=PIXELS[:5], point=RNG.random((1, n, 2)))


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
def test_a_graph_is_hashed_once_for_all_lengths(monkeypatch):
    scene = scene_of([0.1, 0.2, 0.3], 1.0)
    SUMS(scene, pixel=PIXELS, point=POINTS)
    monkeypatch.setattr("gonio.trace.graph.hashlib", None)
    for n in range(60, 70):
        SUMS(scene, pixel=PIXELS, point=RNG.random((1, n, 2)))


def test_names_belong_to_the_structure():
    """Composites whose values have the same classes under other names are not alike."""
    kernel = Computation(lambda scene, mean, x: (scene.a * x[0] - scene.b,), {"x": 1}, {"y": VALUE})
    x = np.ones((3, 1))
    assert kernel(composite(a=5.0, b=2.0), x=x)["y"].tolist() == [3.0] * 3
    assert kernel(composite(b=5.0, a=2.0), x=x)["y"].tolist() == [-3.0] * 3
    assert kernel(composite(a=5.0, b=2.0).replace(b=1.0), x=x)["y"].tolist() == [4.0] * 3


def test_libraries():
    """PyTorch and JAX: the same numbers, and derivatives of sums by parameters and inputs."""
    value, seen, _ = by_numpy([0.2, 0.4, 0.6], 1.5)
    torch = pytest.importorskip("torch")
    gain = torch.tensor(1.5, dtype=torch.float64, requires_grad=True)
    found = SUMS(scene_of([0.2, 0.4, 0.6], gain), pixel=torch.tensor(PIXELS), point=torch.tensor(POINTS))
    np.testing.assert_allclose(found["light"].detach(), value.sum(1), rtol=1e-12)
    np.testing.assert_allclose(found["square"].detach(), value.sum(1) ** 2, rtol=1e-12)
    np.testing.assert_array_equal(found["seen"], seen.sum(1))
    found["light"].sum().backward()
    np.testing.assert_allclose(gain.grad, by_numpy(np.zeros(3), 1.0)[0].sum(), rtol=1e-12)


@pytest.mark.parametrize("kind", ["llvm"])
def test_dr_jit(kind):
    pytest.importorskip("drjit")
    tensor = pytest.importorskip(f"drjit.{kind}").TensorXf64
    value, seen, _ = by_numpy([0.2, 0.4, 0.6], 1.5)
    try:
        found = SUMS(scene_of([0.2, 0.4, 0.6], 1.5), pixel=tensor(PIXELS), point=tensor(POINTS))
    except Exception as error:
        if "LLVM" in str(error):
            pytest.skip(f"Dr.Jit finds no LLVM: {error}")
        raise
    np.testing.assert_allclose(found["light"].numpy(), value.sum(1), rtol=1e-12)
    np.testing.assert_array_equal(found["seen"].numpy(), seen.sum(1))


def test_refusals():
    scene, arrays = scene_of(0.3, 1.5), {"pixel": PIXELS, "point": POINTS}
    good = {name: np.zeros(7) for name in SUMS.results}
    with pytest.raises(NotFoundError, match="got the inputs pixel; expected pixel, point"):
        SUMS(scene, pixel=PIXELS)
    with pytest.raises(NotFoundError, match="no array for seen"):
        SUMS.add({k: v for k, v in good.items() if k != "seen"}, scene, **arrays)
    for wrong, what in (
        (np.zeros(7, np.float32), "float32 array"),
        (np.zeros(14)[::2], "in one piece"),
        ([0.0] * 7, "list"),
        (np.broadcast_to(0.0, 7), "may be written"),
    ):
        with pytest.raises(ArrayTypeError, match=what):
            SUMS.add({**good, "light": wrong}, scene, **arrays)
    for _ in range(2):  # also where the plan is known
        with pytest.raises(ShapeError, match=r"has shape \(8,\), expected \(7,\)"):
            SUMS.add({**good, "light": np.zeros(8)}, scene, **arrays)
        SUMS.add(good, scene, **arrays)
    each = Computation(lambda scene, mean, x: (x[0],), {"x": 1}, {"y": VALUE})
    with pytest.raises(ParameterError, match="y is stored for each element"):
        each.add({"y": np.zeros(3)}, composite(), x=np.ones((3, 1)))
    with pytest.raises(NotFoundError, match="no parameter"):
        SUMS.derivatives(scene, ["nothing"], **arrays)
    counted = Computation(lambda scene, mean, x: (x[0],), {"x": 1}, {"y": COUNT})
    with pytest.raises(ParameterError, match="first result is of kind count"):
        counted.derivatives(composite(a=1.0), ["a"], x=np.ones((3, 1)))
    branching = Computation(lambda scene, mean, x: (1.0 if x[0] > 0 else scene.a,), {"x": 1}, {"y": TOTAL})
    with pytest.raises(TraceError, match="decides on a value"):
        branching.derivatives(composite(a=1.0), ["a"], x=np.ones((3, 1)))


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
@pytest.mark.parametrize(
    ("count", "dtype", "channels"),
    thinned(
        product([1, 2, 7, 15, 31, 32], ["float32", "float64"], [0, 3, 12]),
        [
            *((1, "float64", 0), (2, "float32", 12), (7, "float64", 3), (15, "float32", 3), (31, "float64", 12)),
            *((7, "float32", 0), (32, "float32", 3), (32, "float64", 0)),
        ],
    ),
)
def test_short_sums(count, dtype, channels):
    """Sums over few points of many pixels, which lie in the lanes; in one axis or several; added up or not."""
    rho = np.linspace(0.1, 0.9, channels) if channels else 0.3
    pixels, points = RNG.uniform(0.1, 0.9, (5003, 1, 3)).astype(dtype), RNG.random((1, count, 2)).astype(dtype)
    value, seen, weight = by_numpy(rho, 1.5, pixels.astype(float), points.astype(float))
    element, near = (channels,) if channels else (), {"rtol": 2e-5 if dtype == "float32" else 1e-12}
    total = value.sum(1).reshape(-1, *element)
    scene = scene_of(rho, 1.5)
    found = SUMS(scene, pixel=pixels, point=points)
    sums = {name: np.ones(x.shape) for name, x in found.items()}
    SUMS.add(sums, scene_of(rho, 1.5), pixel=pixels, point=points)
    for got, shift in ((found, 0.0), (sums, 1.0)):
        np.testing.assert_allclose(got["light"] - shift, total, **near, atol=1e-12)
        np.testing.assert_allclose(got["square"] - shift, total**2, **near, atol=1e-12)
        np.testing.assert_array_equal(got["seen"] - shift, seen.sum(1))
        np.testing.assert_allclose(got["weight"] - shift, np.full(5003, weight.sum()), **near)
    apart = pixels[:4992].reshape(2, 2496, 1, 3)[:, ::2]  # two axes that are not one
    again = SUMS(scene, pixel=apart, point=points)
    for name, x in again.items():
        np.testing.assert_allclose(x, found[name][:4992].reshape(2, 2496, *x.shape[2:])[:, ::2], rtol=1e-12)


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
def test_short_sums_in_threads(monkeypatch):
    """Threads share out the pixels, never the points, whose terms are added to the same memory."""
    pixels, points = (RNG.uniform(0.1, 0.9, n).astype("float32") for n in ((300_000, 1, 3), (1, 7, 2)))
    scene, before = scene_of([0.1, 0.2, 0.3], 1.5), gn.engine.threads()
    gn.engine.threads(2)
    monkeypatch.setattr(plans, "PIECES", 3)  # to which the 7 points, short for all lanes, would be parts enough
    together, grains = plans.together, []
    monkeypatch.setattr(plans, "_crew", lambda work: gn.engine.threads())
    monkeypatch.setattr(plans, "together", lambda *args: grains.append(args[-1]) or together(*args))
    several = [SUMS(scene, pixel=pixels, point=points) for _ in range(3)]
    gn.engine.threads(1)
    one = SUMS(scene, pixel=pixels, point=points)
    gn.engine.threads(before)
    assert grains and min(grains) > 0  # parts of the inner axis
    for found in several:
        for name, x in found.items():
            np.testing.assert_array_equal(x, one[name])
    value, *_ = by_numpy([0.1, 0.2, 0.3], 1.5, pixels[::1000], points)
    np.testing.assert_allclose(one["light"][::1000], value.sum(1), rtol=2e-5)


@pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")
def test_short_sums_with_maps():
    """A parameter for each pixel: (P, 1, C), with the axes of the batch."""
    gain, pixels = RNG.uniform(1.0, 2.0, (600, 1, 3)), RNG.uniform(0.1, 0.9, (600, 1, 3))
    points = RNG.random((1, 9, 2))
    found = SUMS(scene_of(0.3, gain), pixel=pixels, point=points)["light"]
    for k in range(0, 600, 100):
        value, *_ = by_numpy(np.full(3, 0.3), gain[k, 0], pixels[k : k + 1], points)
        np.testing.assert_allclose(found[k], value[0].sum(0), rtol=1e-12)
