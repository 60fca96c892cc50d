"""Signs, and the ends of intervals: no negative f, density or weight, and no NaN, where rounding is all there is."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from libraries import switch_off, thinned
from materials import DISTRIBUTIONS, MODELS, at_corners, breaks, draws
from sweeps import every

import gonio as gn
from gonio.formula.direction import HORIZON, Direction, half_and_cosine
from gonio.laws import _probes

COUNT = 3000


def on_sphere(z: np.ndarray, phi: np.ndarray) -> np.ndarray:
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def opposite() -> tuple[np.ndarray, np.ndarray]:
    """Random pairs that all but graze, at opposite azimuths or nearly so; some back to where light comes from."""
    rng = np.random.default_rng(5)
    z, y = (10.0 ** rng.uniform(-5.9, -1.0, COUNT) for _ in range(2))
    y = np.where(rng.random(COUNT) < 0.3, z * (1.0 + 10.0 ** rng.uniform(-7.0, -1.0, COUNT)), y)
    phi = rng.uniform(-np.pi, np.pi, COUNT)
    turn = np.where(rng.random(COUNT) < 0.75, np.pi, 0.0)
    off = np.where(rng.random(COUNT) < 0.4, 0.0, 10.0 ** rng.uniform(-8.0, -0.5, COUNT))
    return on_sphere(z, phi), on_sphere(y, phi + turn + off)


WI, WO = opposite()
ENDS = np.array([0.0, 2.0**-24, 0.5, 1.0 - 2.0**-24, 1.0 - 2.0**-53, 1.0])
U = np.stack(np.meshgrid(ENDS, ENDS), -1).reshape(-1, 2)
PRECISIONS = {
    "float32": lambda w: w.astype("f4"),
    "rounded": lambda w: w.astype("f4").astype("f8"),
    "float64": lambda w: w,
}


def materials(model: type) -> Iterator[Any]:
    """A model at random parameters, and with all of them at bounds: there lobes are narrow."""
    for draw in draws(1, every=9):
        if draw.model is model:
            yield draw.material()
    yield from at_corners(model, 3)


def assert_positive(m: Any, wi: np.ndarray, wo: np.ndarray) -> None:
    f, pdf = m.f(wi, wo), m.pdf(wi, wo)
    assert np.isfinite(f).all(), m
    assert np.isfinite(pdf).all(), m
    assert pdf.min() >= 0.0, m
    assert "positivity" in breaks(m) or f.min() >= 0.0, m


@pytest.mark.parametrize("model", MODELS, ids=lambda c: c.__name__)
def test_nothing_is_negative_towards_grazing(model, monkeypatch):
    """f and pdf of every model, in every precision, of directions nearly opposite to each other. (D8)"""
    switch_off(monkeypatch)  # without compiling: of parameters at bounds each is a structure of its own
    for m in materials(model):
        for of in PRECISIONS.values():
            assert_positive(m, of(WI), of(WO))


GROOVED = [
    gn.CookTorrance(0.001),
    gn.TorranceSparrow(0.001),
    *(gn.Microfacet(kind(), masking="v_groove") for kind in DISTRIBUTIONS),
]


@pytest.mark.parametrize("m", GROOVED, ids=lambda m: repr(m)[:40])
def test_grooves_are_not_negative(m, evaluation):
    """V-grooves over every distribution of normals, compiled and not. (D8)"""
    for of in PRECISIONS.values():
        wi, wo = of(WI), of(WO)
        assert_positive(m, wi, wo)
        np.testing.assert_allclose(m.f(wo, wi), m.f(wi, wo), rtol=1e-3)


def test_weights_of_a_narrow_lobe_are_not_negative(evaluation):
    """CookTorrance at its narrowest, sampled in float32. (D8)"""
    u = np.random.default_rng(0).random((len(WO), 2)).astype("f4")
    s = gn.CookTorrance(m=0.001).sample(WO.astype("f4"), u)
    assert s.weight.min() >= 0.0
    assert s.pdf.min() >= 0.0


@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_half_vectors_have_an_exact_cosine(dtype):
    """wo . wm of `half_and_cosine` is that of exact arithmetic, where the sum of products has no digit right. (D8)"""
    z = 1e-4
    w = on_sphere(np.array([z, 3.0 * z]), np.array([0.3, 0.3 + np.pi])).astype(dtype).astype("f8")
    exact = [[float(x) for x in row] for row in w]
    total = sum((a + b) ** 2 for a, b in zip(*exact, strict=True)) ** 0.5
    _, cosine = half_and_cosine(*(Direction(*row.astype(dtype)) for row in w))
    assert float(cosine) == pytest.approx(0.5 * total, rel=1e-3 if dtype == "f4" else 1e-9)


class _Signless(gn.Reflectance):
    """Positive in exact arithmetic; its sign is lost where wi and wo are nearly opposite."""

    def formula(self, wi, wo):
        return 1e-9 / (1.0 + wi.x * wo.x + wi.y * wo.y + wi.z * wo.z)


class _Unsigned(gn.Reflectance):
    """The same, of its density."""

    def formula(self, wi, wo):
        return 0.1 + 0.0 * wi.z

    def density(self, wi, wo):
        return 1.0 / (1.0 + wi.x * wo.x + wi.y * wo.y + wi.z * wo.z)


class _Endless(gn.Reflectance):
    """Its sampling has no direction at the end of u0."""

    def formula(self, wi, wo):
        return 0.1 + 0.0 * wi.z

    def warp(self, wo, u0, u1):
        found = super().warp(wo, u0, u1)
        return type(found)(found.x / (u0 < 0.99999), found.y, found.z)


@pytest.mark.parametrize(("m", "law"), [(_Signless(), "positivity"), (_Unsigned(), "pdf"), (_Endless(), "sampling")])
def test_check_finds_lost_signs(m, law):
    """`gn.check` looks where signs are lost, in single precision too. (D8)"""
    assert not gn.check(m, laws=[law])[law].passed


@pytest.mark.parametrize("m", GROOVED[:4], ids=lambda m: repr(m)[:40])
def test_check_passes_grooves(m):
    """What was negative passes. (D8)"""
    assert gn.check(m, laws=["positivity", "pdf", "sampling"]).lawful


def test_check_tries_pairs_that_all_but_graze():
    """The pairs of `probes` are above the horizon, and nearly opposite, as float32. (D8)"""
    wi, wo = _probes.opposite_pairs()
    assert wi.dtype == wo.dtype == np.float32
    assert min(wi[:, 2].min(), wo[:, 2].min()) > HORIZON
    across = (wi[:, :2] * wo[:, :2]).sum(axis=-1)
    assert across.max() < -0.9
    assert np.median(across) < -0.99


@pytest.mark.parametrize("model", MODELS, ids=lambda c: c.__name__)
@every(dtype=["f4", "f8"])
def test_the_ends_of_u_are_sampled(model, dtype, monkeypatch):
    """u = 0 and u = 1, and what is next to them, give directions and weights. (D28)"""
    switch_off(monkeypatch)
    wo = gn.direction([0.0, 0.6, 1.5], [0.0, 1.0, 2.0])[:, None].astype(dtype)
    for m in materials(model):
        s = m.sample(wo, U.astype(dtype))
        for x in (s.wi, s.weight, s.pdf):
            assert np.isfinite(x).all(), m
        assert s.pdf.min() >= 0.0
        assert "positivity" in breaks(m) or s.weight.min() >= 0.0, m


@pytest.mark.parametrize(
    "m", [pytest.param(gn.SGD(), marks=pytest.mark.full), gn.TorranceSparrow()], ids=["SGD", "TorranceSparrow"]
)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_u_of_1_is_sampled_by_every_library(m, dtype, library):
    """1 is as the largest float32 below it, in both numbers, and so for arrays of all libraries. (D28)"""
    if library.name.startswith("drjit"):
        pytest.skip("LLVM, as Dr.Jit has it, cannot compile these models' `minimum` of parameters on every processor")
    wo, below = library.array([[0.3, 0.0, 0.954]] * 3, dtype), 1.0 - 6e-8
    sample = library.whole(m.sample)
    s = sample(wo, library.array([[1.0, 1.0], [0.3, 1.0], [1.0, 0.3]], dtype))
    t = sample(wo, library.array([[below, below], [0.3, below], [below, 0.3]], dtype))
    for a, b in zip(s[:3], t[:3], strict=True):
        np.testing.assert_allclose(library.numpy(a), library.numpy(b), rtol=2e-5, atol=1e-6)


def test_other_numbers_for_u_are_as_they_were(evaluation):
    """The largest float64 below 1 is not 1, and NaN stays NaN. (D28)"""
    wo, last = np.array([0.0, 0.0, 1.0]), 1.0 - 2.0**-53
    one, below = (gn.Lambertian(0.5).sample(wo, [0.5, u]).wi for u in (1.0 - 6e-8, last))
    assert below[2] < one[2]
    assert np.isnan(gn.Lambertian(0.5).sample(wo, [0.5, np.nan]).weight)


HUGE = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (8 << 30,) * 2)
import numpy as np, gonio as gn
def spread(x, *shape): return np.broadcast_to(np.asarray(x), (*shape, len(x)))
m = gn.Lambertian([0.1, 0.2, 0.3])
for a, b in (((1 << 31, 1), (1, 1 << 31)), ((1 << 58,), (1 << 58,)), ((1 << 21, 1, 1 << 21), (1, 1 << 20, 1))):
    wi, wo, u = spread([0.0, 0.0, 1.0], *a), spread([0.0, 0.6, 0.8], *b), spread([0.3, 0.4], *a)
    calls = {
        "f": lambda: m.f(wi, wo), "pdf": lambda: m.pdf(wi, wo), "sample": lambda: m.sample(wo, u),
        "jacobian": lambda: m.jacobian(wi, wo), "delta": lambda: gn.IdealSpecular().delta_reflectance(wi),
        "albedo": lambda: gn.albedo(m, wi), "map": lambda: gn.Lambertian(spread([0.5], *a)).f(wi, wo),
        "constant": lambda: gn.reflected_radiance(m, gn.ConstantLight(1.0), wi, normal=wo),
        "distant": lambda: gn.reflected_radiance(m, gn.DistantLight([0.0, 0.0, 1.0]), wi, normal=wo),
        "sampled": lambda: gn.reflected_radiance(m, gn.EnvironmentLight(np.ones((4, 8))), wi, normal=wo),
    }
    for name, call in calls.items():
        try:
            call()
            raise SystemExit(f"{name}: no error")
        except gn.errors.TooLargeError as error:
            assert "\\n" not in str(error) and len(str(error)) < 400, (name, str(error))
print("all refused")
"""


@pytest.mark.parametrize("engine", thinned(["", "numpy"], [""]))
def test_more_directions_than_memory_are_refused(engine):
    """2^58 and 2^62 directions, which broadcast arrays are quickly, are refused in our words. (D28)"""
    env = {**os.environ, "GONIO_ENGINE": engine, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    run = [sys.executable, "-c", HUGE]
    told = subprocess.run(run, capture_output=True, text=True, timeout=300, env=env, check=False)
    assert told.stdout.strip() == "all refused", told.stderr[-2000:]
