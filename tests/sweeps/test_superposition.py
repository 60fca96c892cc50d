"""Twice the light is twice what is seen of it, and two lights together are the sum of each: for everything public that
takes lights, and lights of all classes.

A function is in this sweep by its argument's name, a light by its class. Pictures are a part of the cells by default,
chosen by their names; all with `full`. A failure ends with three lines of Python that repeat it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from itertools import product
from typing import Any

import numpy as np
import pytest
from directed import Refused
from lit import CALLS, LEFT_OUT, MATERIALS, RATIOS, Lit, lit, made, twice
from sweeps import grouped, one_in, one_of

import gonio as gn

NAMES = sorted(made())
QUICK = {
    **dict.fromkeys(("irradiance", "reconstruction.photometric_stereo", "reconstruction.texel_data"), 2),
    "reflected_radiance": 1,
}


def cells(functions: Iterable[str], part: dict[str, int], once: Collection[str]) -> list[Any]:
    """A function, a material, a light. By default `part`: one light in so many; `once`: one of all."""

    def default(f: str, m: str, x: str) -> bool:
        many = part.get(f, 0) * (1 if m == "paint" else 4)
        return one_in(many, f, x) if many else m == "paint" and f in once and x == one_of(NAMES, f)

    some = product(functions, MATERIALS, NAMES)
    return grouped((c for c in some if c[1] == "paint" or "(m, " in {**CALLS, **RATIOS}[c[0]]), default)


def hold(under: Lit, found: list[np.ndarray] | Refused, expected: list[np.ndarray], tolerance: float) -> None:
    assert not isinstance(found, Refused), f"{under.lines()}\none of these is refused: {found}"
    for x, y in zip(found, expected, strict=True):
        off = np.abs(1.0 * x - y).max() / max(np.abs(y).max(), 1e-300)
        assert off <= tolerance, f"{under.lines()}\n{off:.2g} off: {x}\nexpected\n{y}"


def test_every_function_that_takes_lights_is_in_the_sweep():
    known = {*CALLS, *RATIOS, *LEFT_OUT}
    assert lit() == known, (
        "these take lights and are not in the sweep, or are gone: write how they are called into CALLS (what goes with "
        "the light) or RATIOS (what stays) of tests/tools/lit.py, or the reason into LEFT_OUT"
    )


@pytest.mark.slow_because("lights of all classes")
@pytest.mark.parametrize("cells", cells({**CALLS, **RATIOS}, QUICK, {**CALLS, **RATIOS}))
def test_twice_the_light(cells):
    for function, m, name in cells:
        lamps = f"a = {made()[name]}; b = {twice(name)}"
        under = Lit(MATERIALS[m], lamps, {**CALLS, **RATIOS}[function], "(([a], 1.0), ([b], 2.0))")
        one, two = under.results()
        if isinstance(one, Refused):
            assert one == two, f"{under.lines()}\n{one}; {two}"
            continue
        hold(under, two, [(2.0 if function in CALLS else 1.0) * x for x in one], 1e-12)


@pytest.mark.slow_because("lights of all classes")
@pytest.mark.parametrize("cells", cells(CALLS, {"reflected_radiance": 2, "irradiance": 4}, {"render"}))
def test_two_lights_are_the_sum_of_each(cells):
    for function, m, name in cells:
        other = NAMES[NAMES.index(name) - 1]
        lamps = f"a = {made()[name]}; b = {made()[other]}"
        under = Lit(MATERIALS[m], lamps, CALLS[function], "(([a], 1.0), ([b], 1.0), ([a, b], 1.0))")
        a, b, both = under.results()
        if isinstance(a, Refused) or isinstance(b, Refused):
            assert isinstance(both, Refused), under.lines()
            continue
        drawn = "FunctionLight" in (name, other) and function in ("render", "scenes.write_turntable")  # own points
        tolerance = 0.5 if drawn else 1e-12 if a[0].dtype == np.float64 else 1e-6
        hold(under, both, [sum(_as(both, k, x) for x in (a[k], b[k])) for k in range(len(a))], tolerance)


def _as(both: Any, k: int, x: np.ndarray) -> np.ndarray:
    """With a channel axis where both lights together have one."""
    return x if isinstance(both, Refused) or x.ndim == both[k].ndim else x[..., None]


def test_twice_the_light_of_a_scene():
    floor, lamp = ([[0, 0, z], [1, 0, z], [1, 1, z], [0, 1, z]] for z in (0.0, 1.0))
    ink = gn.expression(MATERIALS["ink"])

    def light(*exitances: float) -> gn.results.Radiosity:
        faces = zip((floor, lamp[::-1]), exitances, strict=True)
        return gn.scenes.radiosity(gn.Scene([gn.scenes.Mesh((x, [[0, 1, 2, 3]]), ink, M) for x, M in faces]), 16)

    one, other, both, twofold = light(0.0, 1.0), light(3.0, 0.0), light(3.0, 1.0), light(0.0, 2.0)
    for name in ("radiosity", "irradiance"):
        np.testing.assert_allclose(getattr(twofold, name), 2.0 * getattr(one, name), rtol=1e-9)
        np.testing.assert_allclose(getattr(both, name), getattr(one, name) + getattr(other, name), rtol=1e-9)
