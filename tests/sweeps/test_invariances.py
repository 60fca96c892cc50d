"""What must not change a result, or changes it in a known way: for everything that takes a material and directions, of
gonio.base, gonio.integrals, gonio.remote_sensing, gonio.repair and whatever else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import house
import numpy as np
import pytest
from directed import COUNT, SWEPT, TOLERANCE, Call, Refused, named, run
from sweeps import trying

import gonio as gn

MATERIALS = (house.PAINT, house.BRUSHED, house.LEAF, house.MIRROR)
ISOTROPIC = (house.PAINT, house.LEAF, house.MIRROR)
DIRECTED = [call for call in SWEPT if named(call)]
TURNED = [call for call in DIRECTED if set(named(call)) <= {"wi", "wo"} and not call.others]
OF_SHARES = {
    "pdf": "a density, of shares of lobes",
    "sample": "weights over densities",
    "c_factor": "a ratio of two reflectances",
    "absorptance": "what is left of 1",
    "fate": "what is left of 1",
    "jacobian": "derivatives by numbers of which some are scaled, too",
}
"""Calls whose results do not go with the material's weight."""

each_call = pytest.mark.parametrize("call", DIRECTED, ids=str)


def _pairs(
    call: Call, first: Callable, second: Callable, materials: Iterable[gn.Reflectance] = MATERIALS
) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Results of two calls with each material, and how much they may differ."""
    for m in materials:
        with trying(m=m):
            a, b = first(m), second(m)
            if isinstance(a, Refused) or isinstance(b, Refused):
                assert a == b
                continue
            for x, y in zip(a, b, strict=True):
                yield x, y, np.nanmax(np.abs(y), initial=1e-300)


@each_call
def test_order_and_repetition_of_directions(call):
    at = np.array([4, 0, 0, 6, 2, 4])
    for x, y, size in _pairs(call, lambda m: run(call, m, at), lambda m: run(call, m, slice(None))):
        np.testing.assert_allclose(1.0 * x, 1.0 * y[at], rtol=0.0, atol=TOLERANCE if call.integral else 1e-12 * size)


@each_call
def test_axes_of_a_batch(call):
    """(2, 3) directions are six."""
    for x, y, size in _pairs(
        call, lambda m: run(call, m, np.arange(6).reshape(2, 3)), lambda m: run(call, m, slice(6))
    ):
        assert x.shape == (2, 3, *y.shape[1:])
        atol = TOLERANCE if call.integral else 1e-12 * size
        np.testing.assert_allclose(1.0 * x.reshape(y.shape), 1.0 * y, rtol=0.0, atol=atol)


@pytest.mark.parametrize("call", [call for call in DIRECTED if call.name.rpartition(".")[2] not in OF_SHARES], ids=str)
def test_scale_of_a_material(call):
    for x, y, size in _pairs(call, lambda m: run(call, 0.5 * m, slice(3)), lambda m: run(call, m, slice(3))):
        np.testing.assert_allclose(x, 0.5 * y, rtol=0.0, atol=TOLERANCE if call.integral else 1e-12 * size)


@each_call
def test_single_precision(call):
    def in_single(m: gn.Reflectance) -> list[np.ndarray] | Refused:
        return run(call, m, slice(COUNT), np.float32)

    for x, y, size in _pairs(call, in_single, lambda m: run(call, m, slice(COUNT))):
        atol = 2 * TOLERANCE if call.integral else 1e-3 * size
        np.testing.assert_allclose(1.0 * x, 1.0 * y, rtol=0.0, atol=atol)


@pytest.mark.parametrize("call", TURNED, ids=str)
def test_a_turn_about_the_normal(call):
    c, s = np.cos(1.1), np.sin(1.1)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    at = slice(1, COUNT)  # at the normal, where the first is, the axes of light stay

    def turned(m: gn.Reflectance) -> list[np.ndarray] | Refused:
        return run(call, m, at, lambda w: w @ turn.T)

    for x, y, size in _pairs(call, turned, lambda m: run(call, m, at), ISOTROPIC):
        np.testing.assert_allclose(x, y, rtol=0.0, atol=TOLERANCE if call.integral else 1e-9 * size)
