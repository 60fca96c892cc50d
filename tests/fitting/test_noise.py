"""The noise that residuals tell: right where it is known, and a number for residuals of any size."""

from __future__ import annotations

import numpy as np
import pytest

from gonio.fitting.noise import noise


def variances(slopes, residuals, parts):
    likely = noise(slopes, residuals, parts)
    return likely.weights @ likely.variances


@pytest.mark.parametrize("kind", range(3))
def test_the_variance_of_the_noise_is_found(kind):
    random = np.random.default_rng(kind)
    slopes = random.standard_normal((4000, 3))
    f = np.exp(random.uniform(-4.0, 2.0, 4000))
    parts = np.stack([np.ones_like(f), f, f * f], axis=1)
    parts /= parts.max(axis=0)
    found = variances(slopes, np.sqrt(parts[:, kind]) * random.standard_normal(4000), parts)
    assert np.sqrt(np.mean((found / parts[:, kind] - 1.0) ** 2)) < 0.1  # ENOUGH values: 3 % of one share


def test_bright_rows_do_not_lend_their_noise_to_faint_ones():
    """Least squares of few bright rows spreads their noise; the expected squares of residuals know that."""
    random, ratio = np.random.default_rng(5), []
    slopes = np.ones((60, 1)) * np.where(np.arange(60) < 2, 100.0, 1.0)[:, None]
    parts = np.stack([np.ones(60), slopes[:, 0] ** 2], axis=1) / [1.0, 1e4]
    for _ in range(200):
        found = variances(slopes, np.sqrt(parts[:, 1]) * random.standard_normal(60), parts)
        ratio.append(found[-1] / parts[-1, 1])
    assert 0.8 < np.median(ratio) < 1.2


def test_residuals_of_any_size():
    random = np.random.default_rng(0)
    for _ in range(200):
        rows, count = random.integers(1, 60), random.integers(1, 5)
        slopes = random.standard_normal((rows, count)) * 10.0 ** random.uniform(-8.0, 8.0)
        parts = random.random((rows, 5)) ** random.integers(1, 8) * (random.random(5) > 0.2)
        residuals = random.standard_normal(rows) * 10.0 ** random.uniform(-100.0, 50.0)
        found = variances(slopes, residuals * random.integers(0, 2), parts)
        assert np.isfinite(found).all() and (found >= 0.0).all()
