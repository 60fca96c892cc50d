"""The pointwise laws of every model: on every array library, both precisions, and random parameters."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from models import MODELS, Draw, at_bounds, breaks, draws, pairs

import gonio as gn
from gonio import batch, geometry

CHANNELS = (None, 3)
ALL = pytest.mark.parametrize("draw", draws(), ids=str)
SOME = pytest.mark.parametrize("draw", draws(2, every=3), ids=str)
FLOAT32, FLOAT64 = 2.0**-24, 2.0**-52  # roundings; the latter so that 1 + FLOAT64 is not 1
DTYPES = {"float32": FLOAT32, "float64": FLOAT64}
each_dtype = pytest.mark.parametrize("dtype", DTYPES)


def rounded(m: Any, dtype: str) -> Any:
    """The material with the parameters that it has in this precision, as float64."""
    return m.each(lambda v: np.asarray(v, dtype).astype(float) if np.ndim(v) else float(np.asarray(v, dtype)))


def unavoidable(m: Any, wi: np.ndarray, wo: np.ndarray, unit: float) -> np.ndarray:
    """How much f changes when directions and parameters move by one rounding `unit`, relative.

    A model of the form cos^n is allowed a rounding of the cosine, which it multiplies by n.
    """
    f = m.f(wi, wo)
    rng = np.random.default_rng(0)
    moved = [(m, wi * (1 + unit * signs(rng, wi)), wo * (1 + unit * signs(rng, wo))) for _ in range(8)]
    for (path, p), s in itertools.product(m.parameters.items(), (-unit, unit)):
        moved.append((m.replace({path: np.clip(np.multiply(p.value, 1 + s), p.low, p.high)}), wi, wo))
    change = np.max([np.abs(n.f(a, b) - f) for n, a, b in moved], axis=0)
    exponent = max([float(np.max(p.value)) for path, p in m.parameters.items() if path.endswith("n")], default=0.0)
    return change + (1.0 + exponent) * unit * np.abs(f)


def smallest(f: np.ndarray, unit: float) -> float:
    """Below this, values of a lobe of this height are made of numbers that libraries may flush to 0."""
    return (1e-36 if unit == FLOAT32 else 1e-300) * (1.0 + float(np.abs(f).max()))


def signs(rng: np.random.Generator, like: np.ndarray) -> np.ndarray:
    return rng.choice([-1.0, 1.0], like.shape)


def close(got: np.ndarray, want: np.ndarray, allowed: Any) -> None:
    """|got - want| <= allowed, with the worst place in the message."""
    assert got.shape == want.shape
    assert np.isfinite(got).all()
    excess = np.abs(got - want) / np.maximum(allowed, 1e-300)
    at = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess[at] <= 1.0, f"at {at}: got {got[at]!r}, want {want[at]!r}, {excess[at]:.3g} times what is allowed"


# NumPy: every structure of every model.


@ALL
@each_dtype
def test_finite_and_not_negative(draw, dtype):
    for channels in CHANNELS:
        m = draw.material(channels)
        wi, wo = (w.astype(dtype) for w in pairs())
        f, pdf = m.f(wi, wo), m.pdf(wi, wo)
        assert f.dtype == pdf.dtype == dtype
        assert np.isfinite(f).all()
        assert np.isfinite(pdf).all()
        assert f.min() >= 0.0
        assert pdf.min() >= 0.0


@pytest.mark.parametrize("model", MODELS, ids=lambda c: c.__name__)
@each_dtype
def test_finite_and_not_negative_at_the_bounds(model, dtype):
    wi, wo = (w.astype(dtype) for w in pairs())
    for m in at_bounds(model):
        f, pdf = m.f(wi, wo), m.pdf(wi, wo)
        assert np.isfinite(f).all(), m
        assert np.isfinite(pdf).all(), m
        assert f.min() >= 0.0, m
        assert pdf.min() >= 0.0, m


@ALL
def test_reciprocal(draw):
    wi, wo = pairs()
    for channels in CHANNELS:
        m = draw.material(channels)
        if "reciprocity" in breaks(m):
            continue  # test_declared_laws_are_broken demands the breach
        f = m.f(wi, wo)
        np.testing.assert_allclose(m.f(wo, wi), f, rtol=1e-12)
        wi32, wo32 = wi.astype("float32"), wo.astype("float32")
        f32 = m.f(wi32, wo32)
        allowed = 16.0 * unavoidable(rounded(m, "float32"), wi32.astype(float), wo32.astype(float), FLOAT32)
        close(m.f(wo32, wi32), f32, allowed + smallest(f, FLOAT32))


@ALL
def test_float32_against_float64(draw):
    wi, wo = (w.astype("float32") for w in pairs())
    for channels in CHANNELS:
        m = rounded(draw.material(channels), "float32")
        wi64, wo64 = wi.astype(float), wo.astype(float)
        f = m.f(wi64, wo64)
        close(m.f(wi, wo), f, 8.0 * unavoidable(m, wi64, wo64, FLOAT32) + smallest(f, FLOAT32))


@ALL
def test_rgb_is_three_materials(draw):
    wi, wo = pairs()
    m = draw.material(3)
    f = m.f(wi, wo)
    if f.ndim == 1:
        return  # no parameter drew a channel axis
    for c in range(3):
        one = m.each(lambda v, c=c: float(v[min(c, len(v) - 1)]) if np.ndim(v) else v)
        np.testing.assert_allclose(f[:, c], one.f(wi, wo), rtol=1e-13)


@ALL
def test_isotropic_where_nothing_says_otherwise(draw):
    m = draw.material()
    if any(path.endswith("alpha_y") for path in m.parameters):
        return
    wi, wo = pairs()
    turn = np.array([[np.cos(1.1), np.sin(1.1), 0.0], [-np.sin(1.1), np.cos(1.1), 0.0], [0.0, 0.0, 1.0]])
    turned = (wi @ turn, wo @ turn)
    f = m.f(wi, wo)
    close(m.f(*turned), f, 64.0 * unavoidable(m, wi, wo, FLOAT64) + 1e-300)


@SOME
def test_blocks_change_nothing(draw, monkeypatch):
    wi, wo = (np.tile(w, (5, 3, 1)).reshape(5, -1, 3) for w in pairs())
    u = np.random.default_rng(2).random((*wo.shape[:-1], 2))
    for channels in CHANNELS:
        m = draw.material(channels)
        whole = (m.f(wi, wo), m.pdf(wi, wo), *m.sample(wo, u))
        with monkeypatch.context() as patch:
            patch.setattr(batch, "BLOCK", 1024)
            assert wi[..., 0].size > 3 * 1024
            blocks = (m.f(wi, wo), m.pdf(wi, wo), *m.sample(wo, u))
        for a, b in zip(whole, blocks, strict=True):
            assert a.dtype == b.dtype
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-15)


# Every library.


@SOME
@each_dtype
def test_libraries_agree(library, draw, dtype):
    unit = DTYPES[dtype]
    wi, wo = (w.astype(dtype) for w in pairs())
    for channels in CHANNELS:
        m = rounded(draw.material(channels), dtype)
        wi64, wo64 = wi.astype(float), wo.astype(float)
        a, b = library.array(wi, dtype), library.array(wo, dtype)
        f, pdf = m.f(a, b), m.pdf(a, b)
        assert library.dtype(f) == library.dtype(pdf) == dtype
        want = m.f(wi64, wo64)
        close(library.numpy(f), want, 64.0 * unavoidable(m, wi64, wo64, unit) + smallest(want, unit))
        np.testing.assert_allclose(library.numpy(pdf), m.pdf(wi64, wo64), rtol=1e5 * unit, atol=1e-30)
