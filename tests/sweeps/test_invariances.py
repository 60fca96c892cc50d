"""What must not change a result, or changes it in a known way: for everything that takes a material and directions, of
gonio.base, gonio.integrals, gonio.remote_sensing, gonio.repair and whatever else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import product

import house
import numpy as np
import pytest
from directed import COUNT, SWEPT, TOLERANCE, Call, Refused, directed, lines, named, run
from materials import COMPILED
from sweeps import grouped

import gonio as gn
from gonio.base.calls import breaches

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

BACK = {"incident": "collected", "source": "detector", "wi": "wo"} | {f"{x}_i": f"{x}_o" for x in ("theta", "phi")}
BACK |= {"theta_s": "theta_v"}
BACK |= {there: here for here, there in BACK.items()}
"""Names of arguments that are exchanged where light goes the other way."""
FULL = pytest.mark.full
ONE_WAY = {
    "c_factor": "a ratio to what a viewer at the normal sees",
    "pdf": "a density of light for a viewer",
    "reflectance": "a share of what arrives: the factor goes both ways",
}
RECIPROCAL = {name.lower(): m for name, m in vars(house).items() if isinstance(m, gn.Reflectance)}
RECIPROCAL = {name: m for name, m in RECIPROCAL.items() if "reciprocity" not in breaches(m)}


def _exchanged(call: Call) -> Call:
    """The call with light and viewer in each other's place."""
    return call._replace(arguments={BACK.get(k, k): v for k, v in call.arguments.items()})


def _goes_both_ways(call: Call) -> bool:
    last = call.name.rpartition(".")[2]
    ends = BACK.keys() & directed()[call.name][1].keys()
    return len(ends) > 1 and all(BACK[k] in ends for k in ends) and last not in ONE_WAY and "sky" not in call.arguments


WAYS = [call for call in SWEPT if _goes_both_ways(call)]
FACTOR, APERTURE = (
    next(call for call in WAYS if call.name == x) for x in ("reflectance_factor", "repair.through_aperture")
)
CONES = ("gn.Cone([0.0, 0.6, 0.8], 0.05)", "gn.Cone([0.3, 0.0, 1.0], 0.1)")
WAYS += [FACTOR._replace(arguments=FACTOR.arguments | {"collected": CONES[0]})]
WAYS += [APERTURE._replace(arguments=APERTURE.arguments | {"source": "0.1"})]
TWO_CONES = FACTOR._replace(arguments=FACTOR.arguments | dict(zip(("incident", "collected"), CONES, strict=True)))

each_call = pytest.mark.parametrize("call", DIRECTED, ids=str)


def _pairs(
    call: Call, first: Callable, second: Callable, materials: Iterable[gn.Reflectance] = MATERIALS
) -> Iterator[tuple[np.ndarray, np.ndarray, float, str]]:
    """Results of two calls with each material, their size, and three lines of Python that print the latter."""
    for m in materials:
        a, b, told = first(m), second(m), lines(call, m, COUNT, 0)
        if isinstance(a, Refused) or isinstance(b, Refused):
            assert a == b, told
            continue
        for x, y in zip(a, b, strict=True):
            yield x, y, np.nanmax(np.abs(y), initial=1e-300), told


@each_call
def test_order_and_repetition_of_directions(call):
    at = np.array([4, 0, 0, 6, 2, 4])
    for x, y, size, told in _pairs(call, lambda m: run(call, m, at), lambda m: run(call, m, slice(None))):
        np.testing.assert_allclose(
            1.0 * x, 1.0 * y[at], rtol=0.0, atol=TOLERANCE if call.integral else 1e-12 * size, err_msg=told
        )


@each_call
def test_axes_of_a_batch(call):
    """(2, 3) directions are six."""
    for x, y, size, told in _pairs(
        call, lambda m: run(call, m, np.arange(6).reshape(2, 3)), lambda m: run(call, m, slice(6))
    ):
        assert x.shape == (2, 3, *y.shape[1:]), told
        atol = TOLERANCE if call.integral else 1e-12 * size
        np.testing.assert_allclose(1.0 * x.reshape(y.shape), 1.0 * y, rtol=0.0, atol=atol, err_msg=told)


@pytest.mark.parametrize("call", [call for call in DIRECTED if call.name.rpartition(".")[2] not in OF_SHARES], ids=str)
def test_scale_of_a_material(call):
    for x, y, size, told in _pairs(call, lambda m: run(call, 0.5 * m, slice(3)), lambda m: run(call, m, slice(3))):
        np.testing.assert_allclose(
            x, 0.5 * y, rtol=0.0, atol=TOLERANCE if call.integral else 1e-12 * size, err_msg=told
        )


@each_call
def test_single_precision(call):
    def in_single(m: gn.Reflectance) -> list[np.ndarray] | Refused:
        return run(call, m, slice(COUNT), np.float32)

    for x, y, size, told in _pairs(call, in_single, lambda m: run(call, m, slice(COUNT))):
        atol = 2 * TOLERANCE if call.integral else 1e-3 * size
        np.testing.assert_allclose(1.0 * x, 1.0 * y, rtol=0.0, atol=atol, err_msg=told)


@pytest.mark.parametrize("call", TURNED, ids=str)
def test_a_turn_about_the_normal(call):
    c, s = np.cos(1.1), np.sin(1.1)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    at = slice(1, COUNT)  # at the normal, where the first is, the axes of light stay

    def turned(m: gn.Reflectance) -> list[np.ndarray] | Refused:
        return run(call, m, at, lambda w: w @ turn.T)

    for x, y, size, told in _pairs(call, turned, lambda m: run(call, m, at), ISOTROPIC):
        np.testing.assert_allclose(x, y, rtol=0.0, atol=TOLERANCE if call.integral else 1e-9 * size, err_msg=told)


def _usual(call: Call, name: str) -> bool:
    """What is exchanged by default: integrals of few materials."""
    return call is not TWO_CONES and (not call.integral or name in ("paint", "brushed", "mirror"))


@pytest.mark.parametrize("cells", grouped(product([*WAYS, TWO_CONES], RECIPROCAL), _usual))
def test_exchange_of_light_and_viewer(cells):
    for call, name in cells:
        _hold_exchanged(call, RECIPROCAL[name])


@pytest.mark.full
@pytest.mark.parametrize("draw", COMPILED, ids=str)
def test_exchange_of_light_and_viewer_of_all_models(draw):
    m = draw.material()
    if "reciprocity" not in breaches(m):
        for call in WAYS:
            _hold_exchanged(call, m)


D = np.array([1.0, 1.0, -1.0, 1.0])


def _hold_exchanged(call: Call, m: gn.Reflectance) -> None:
    """Of the matrix of polarized light D M^T D, D = diag(1, 1, -1, 1), as handedness is seen from the other end."""
    if "phi" in call.arguments and not m.is_isotropic():  # an azimuth from the one to the other
        return
    back, at = _exchanged(call), slice(COUNT) if named(call) else ...
    there, here = run(back, m, at), run(call, m, at)
    told = f"{lines(call, m, COUNT, 0)}\nand exchanged {back.text('')}"
    if isinstance(there, Refused) or isinstance(here, Refused):
        assert there == here, told
        return
    largest = max(np.nanmax(np.abs(y), initial=1e-300) for y in here)
    for x, y in zip(there, here, strict=True):
        x = np.swapaxes(x, -1, -2) * np.outer(D, D) if call.name == "mueller" else x
        size = max(np.nanmax(np.abs(y), initial=0.0), 1e-4 * largest)  # derivatives by what hardly matters are rounded
        atol = TOLERANCE * max(1.0, y.max()) if call.integral else 1e-9 * size
        np.testing.assert_allclose(x, y, rtol=0.0, atol=atol, err_msg=told)
