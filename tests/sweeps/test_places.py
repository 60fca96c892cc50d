"""Light is the same wherever a scene is, however it is turned, and of whatever size it is: for everything public that
takes places, under lights of all classes.

A function is in this sweep by its argument's name, a light by its class. Pictures are a part of the cells by default,
chosen by their names; all with `full`. A failure ends with three lines of Python that repeat it.
"""

from __future__ import annotations

from itertools import chain, product
from typing import Any

import numpy as np
import pytest
from directed import Refused
from lit import made
from placed import CALLS, LEFT_OUT, MOTIONS, ONLY, Placed, placed
from sweeps import grouped, one_in, one_of

import gonio as gn

QUICK = {
    **dict.fromkeys(("irradiance", "reconstruction.photometric_stereo", "reconstruction.texel_data"), 2),
    "reflected_radiance": 1,
}
"""Calls that are no pictures: by default shifted under one light in so many, turned under a fifth of these."""


def cells() -> list[Any]:
    """A call, how its world is moved, a light."""
    lights = {call: [*made()] if "lit(a)" in text else ["ConstantLight"] for call, text in CALLS.items()}

    def default(call: str, motion: str, light: str) -> bool:
        if call in QUICK or len(lights[call]) == 1:
            return one_in(QUICK.get(call, 1) * (1 if motion == "shifted" else 5), call, motion, light)
        return light == one_of(lights[call], call, motion)

    of_calls = (product([call], ONLY.get(call, ("shifted", "turned")), lights[call]) for call in CALLS)
    return grouped(chain.from_iterable(of_calls), default)


def test_every_function_that_takes_places_is_in_the_sweep():
    known = {*(name.partition(" ")[0] for name in CALLS), *LEFT_OUT}
    assert placed() == known, (
        "these take places and are not in the sweep, or are gone: write how they are called into CALLS of "
        "tests/tools/placed.py, or the reason into LEFT_OUT"
    )
    assert {*MOTIONS} >= {motion for several in ONLY.values() for motion in several}


@pytest.mark.slow_because("lights of all classes")
@pytest.mark.parametrize("cells", cells())
def test_light_is_the_same_in_a_world_that_is_moved(cells):
    for call, motion, light in cells:
        moved = Placed(call, motion, light)
        here, there = moved.results()
        if isinstance(here, Refused) or isinstance(there, Refused):
            assert here == there, f"{moved.lines()}\none of the two is refused: {here}; {there}"
            continue
        drawn = motion == "turned" and (light == "EnvironmentLight" or (call not in QUICK and _is_sky(light)))
        for x, y in zip(there, here, strict=True):
            if drawn:  # at points whose azimuths are those of the world
                np.testing.assert_allclose(x.mean(), y.mean(), rtol=0.15, err_msg=moved.lines())
            else:
                atol = 1e-4 * max(np.nanmax(np.abs(y), initial=0.0), 1e-300)
                np.testing.assert_allclose(x, y, rtol=0.0, atol=atol, err_msg=moved.lines())


def _is_sky(name: str) -> bool:
    """Whether the light of a class comes from all around, and is at no place."""
    x = eval(made()[name], {"gn": gn})
    return not x.is_delta and (not x.is_formula() or x.moved((1.0, 0.0, 0.0)) == x)
