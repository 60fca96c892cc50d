"""One by one as all at once: a call with many directions and channels gives what calls with one of each give.

Every public function and method that takes a material and directions is in this sweep by existing, of gonio.base,
gonio.integrals, gonio.remote_sensing, gonio.repair and whatever else. A failure ends with three lines of Python that
repeat it.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import house
import numpy as np
import pytest
from directed import (
    CALLS,
    COUNT,
    GIVEN,
    OF_ALL_CHANNELS,
    OF_ALL_DIRECTIONS,
    SWEPT,
    TOLERANCE,
    Call,
    Refused,
    directed,
    lines,
    named,
    run,
)
from materials import COMPILED

import gonio as gn
from gonio.base.reradiation import exchanges
from gonio.formula import tree

EXACT = 1e-12
HOUSE = {
    name.lower(): m for name, m in vars(house).items() if isinstance(m, gn.Reflectance) and m is not house.METAL
}  # GOLD is METAL, with channels


def test_every_function_of_a_material_and_directions_is_in_the_sweep():
    found = directed()
    for name, (owner, parameters) in found.items():
        needed = {k for k, p in parameters.items() if p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD}
        known = {"m", *GIVEN, *(k for more in CALLS.get(name, ()) for k in more)}
        assert name in OF_ALL_DIRECTIONS or needed <= known, (
            f"{owner}.{name} takes a material and directions, and the sweep does not know what to give for "
            f"{sorted(needed - known)}: write it into GIVEN (one for each direction) or CALLS (the same for all) of "
            f"tests/tools/directed.py, or, if its result is one for all directions, the reason into OF_ALL_DIRECTIONS"
        )
    assert {*CALLS, *OF_ALL_CHANNELS, *OF_ALL_DIRECTIONS} <= set(found), "these are gone, or take no directions"


def _channel(m: gn.Reflectance, c: int) -> gn.Reflectance:
    return tree.each(m, lambda x: x[..., c : c + 1] if np.ndim(x) and np.shape(x)[-1] > 1 else x)


def one_by_one(call: Call, m: gn.Reflectance, places: Iterable[int]) -> list[np.ndarray] | Refused:
    """The results for some of the directions, each by itself and each channel by itself."""
    places = places if named(call) else [...]
    split = m.channels is not None and not exchanges(m) and call.name not in OF_ALL_CHANNELS
    parts = [_channel(m, c) for c in range(m.channels)] if split else [m]
    rows = []
    for at in places:
        channels = [run(call, part, at) for part in parts]
        if refused := next((x for x in channels if isinstance(x, Refused)), None):
            return refused
        rows.append([np.concatenate(x) if split else x[0] for x in zip(*channels, strict=True)])
    return [np.stack(x) if named(call) else x[0] for x in zip(*rows, strict=True)]


def hold(call: Call, m: gn.Reflectance, expected: list[np.ndarray] | Refused, places: list[int], count: int) -> None:
    """Fails, with three lines that repeat it, where a call for the first directions does not give what is expected at
    those of the places that are among them."""
    at, number = (slice(count), sum(k < count for k in places)) if named(call) else (..., 0)
    found = run(call, m, at)
    if isinstance(found, Refused) or isinstance(expected, Refused):
        assert found == expected, f"{lines(call, m, count, 0)}\none of the two is refused: {found}; {expected}"
        return
    largest = max(_largest(y) for y in expected)
    for x, y in zip(found, expected, strict=True):
        shape = (count, *y.shape[1:]) if number else y.shape
        assert x.shape == shape, f"{lines(call, m, count, 0)}\nshape {x.shape}, expected {shape}"
        x, y = (1.0 * x[places[:number]], 1.0 * y[:number]) if number else (x, y)
        size = np.maximum(1.0, np.abs(y)) if call.integral else max(1e-300, _largest(y), 1e-4 * largest)
        off = np.where(np.isnan(x) | np.isnan(y), np.isnan(x) != np.isnan(y), np.abs(x - y) / size)
        if (off > (TOLERANCE if call.integral else EXACT)).any():
            worst = places[np.unravel_index(np.argmax(off), off.shape)[0]] if number else 0
            raise AssertionError(f"{lines(call, m, count, worst)}\n{x}\nexpected\n{y}")


def _largest(x: np.ndarray) -> float:
    return float(np.nanmax(np.abs(x), initial=0.0))


def weighed(m: gn.Reflectance, channels: int) -> gn.Reflectance:
    return np.array([0.2, 0.6, 0.7])[-channels:] * m


def swept(call: Call, m: gn.Reflectance, channels: int, places: Iterable[int]) -> int:
    """Holds a call to its parts for 1, C and 7 directions; how many cells these are."""
    m, places = weighed(m, channels), sorted({0, *places, channels - 1, COUNT - 1})
    expected = one_by_one(call, m, places)
    counts = sorted({1, channels, COUNT}) if named(call) else [COUNT]
    for count in counts:
        hold(call, m, expected, places, count)
    return len(counts)


@pytest.mark.parametrize("call", SWEPT, ids=str)
@pytest.mark.parametrize("m", HOUSE.values(), ids=HOUSE)
def test_one_by_one_of_house_materials(m, call):
    for channels in (1, 3) if m.channels is None else (3,):
        swept(call, m, channels, [])


@pytest.mark.full
@pytest.mark.parametrize("draw", COMPILED, ids=str)
def test_one_by_one_of_all_models(draw, capsys):
    cells = 0
    for call, channels in product(SWEPT, (1, 3)):
        cells += swept(call, draw.material(channels if draw.seed % 2 else None), channels, [])
    with capsys.disabled():
        print(f"\n{draw}: {cells} cells of {len(SWEPT)} calls", end=" ")
