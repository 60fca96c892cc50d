"""`sample` and `pdf` of every model: densities are Jacobians, weights are f cos/pdf, sums choose as they say."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from models import Draw, draws, on_sphere, pairs

import gonio as gn

LOBES = [d for d in draws() if d.model not in (gn.IdealSpecular, gn.Sum)]
CHANNELS = (None, 3)
each_lobe = pytest.mark.parametrize("draw", LOBES, ids=str)

VIEWS = on_sphere(np.radians([0.0, 30.0, 60.0, 80.0, 89.0]), [0.0, 0.5, 2.0, -2.5, 1.0])


def grid(n: int, m: int | None = None) -> np.ndarray:
    """Midpoints (n m, 2) of a regular grid on the unit square."""
    a, b = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(m or n) + 0.5) / (m or n), indexing="ij")
    return np.stack([a.ravel(), b.ravel()], -1)


# One lobe: pdf |dw/du| = 1.


@cache
def jacobian(model: type, seed: int) -> Any:
    """(parameters, wo, u) -> wi, |dwi/du|, pdf of a material of this structure, compiled."""
    import jax

    m = Draw(model, seed).material()

    def evaluate(values: dict, wo: Any, u: Any) -> tuple:
        material = m.replace(values)
        w, along = [], []
        for axis in (0, 1):
            step = jax.numpy.zeros_like(u).at[:, axis].set(1.0)
            wi, moved = jax.jvp(lambda u: material.sample(wo, u).wi, (u,), (step,))
            w.append(wi)
            along.append(moved)
        area = jax.numpy.linalg.norm(jax.numpy.cross(*along), axis=-1)
        return w[0], area, material.pdf(w[0], wo)

    return jax.jit(evaluate)


STRUCTURES = {
    d.model if d.model is not gn.Microfacet else type(d.material().distribution): d for d in LOBES
}


@pytest.mark.parametrize("kind", STRUCTURES, ids=lambda c: c.__name__)
def test_pdf_is_the_jacobian(jax, kind):
    own = STRUCTURES[kind]
    evaluate = jacobian(own.model, own.seed)
    rng = np.random.default_rng(1)
    u = np.tile(0.002 + 0.996 * rng.random((24, 2)), (len(VIEWS), 1))
    wo = np.repeat(VIEWS, 24, axis=0)
    used = 0
    for draw in LOBES:
        m = draw.material()
        if kind not in (draw.model, type(getattr(m, "distribution", None))):
            continue
        values = {path: float(p.value) for path, p in own.material().parameters.items()}
        values.update({path: float(p.value) for path, p in m.parameters.items() if path in values})
        wi, area, pdf = (np.asarray(x) for x in evaluate(values, wo, u))
        up = pdf > 0.0
        used += up.sum()
        np.testing.assert_allclose(pdf[up] * area[up], 1.0, rtol=1e-6, err_msg=str(m))
    assert used > 100


# Weights.


@each_lobe
def test_weight_is_f_cos_over_pdf(draw):
    wo = pairs()[1]
    u = np.random.default_rng(5).random((len(wo), 2))
    for channels in CHANNELS:
        m = draw.material(channels)
        s = m.sample(wo, u)
        assert not s.delta.any()
        np.testing.assert_allclose(np.linalg.norm(s.wi, axis=-1), 1.0, rtol=1e-12)
        up = s.pdf > 0.0
        assert up.mean() > 0.3
        np.testing.assert_allclose(s.pdf, m.pdf(s.wi, wo), rtol=1e-9, atol=1e-300)
        f, cos = m.f(s.wi, wo)[up], s.wi[up, 2]
        expected = f * (cos / s.pdf[up] if f.ndim == 1 else (cos / s.pdf[up])[:, None])
        np.testing.assert_allclose(s.weight[up], expected, rtol=1e-9, atol=1e-300)
        np.testing.assert_array_equal(s.weight[~up], 0.0)
