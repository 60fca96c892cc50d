"""Of every model: code that runs fast, as users have it, gives the numbers of code that is made fast, as tests do."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from materials import COMPILED, Draw, pairs

from gonio.evaluate import planning

pytestmark = pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")


def numbers(draw: Draw, level: str, monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """f, pdf and samples, of kernels that are compiled anew."""
    monkeypatch.setenv("GONIO_OPTIMIZE", level)
    planning._PATTERNS.clear()
    m = copy.deepcopy(draw.material(*draw.layouts))
    wi, wo = pairs()
    sample = m.sample(wo, np.random.default_rng(5).random((len(wo), 2)))
    return [m.f(wi, wo), m.pdf(wi, wo), *sample]


@pytest.mark.parametrize("draw", [pytest.param(d, id=str(d), marks=pytest.mark.full) for d in COMPILED])
def test_fast_code_is_as_true(draw: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    for fast, quick in zip(numbers(draw, "", monkeypatch), numbers(draw, "off", monkeypatch), strict=True):
        if fast.dtype == bool:
            np.testing.assert_array_equal(fast, quick)
        else:
            np.testing.assert_allclose(fast, quick, rtol=1e-9, atol=1e-12 * np.abs(quick).max(initial=1e-300))
