"""`Reflectance.channels`: what the parameters and tables say is what f has."""

from __future__ import annotations

import numpy as np
import pytest
from materials import draws

import gonio as gn

UP = np.array([0.0, 0.0, 1.0])


def channels_of_f(m: gn.Reflectance) -> int | None:
    """The length of the last axis of f, where a batch of one has one more axis than directions have."""
    maps = max((np.ndim(v) - 1 for v in m.leaves()), default=0)
    values = m.f(UP, UP)
    return values.shape[-1] if values.ndim > max(maps, 0) else None


@pytest.mark.parametrize("draw", draws(1, every=100), ids=str)
@pytest.mark.parametrize("count", [None, 3])
@pytest.mark.usefixtures("uncompiled")
def test_channels_of_models_are_those_of_f(draw, count):
    m = draw.material(count)
    assert m.channels == channels_of_f(m)


def test_channels_of_wrappers_sums_and_maps():
    wood = gn.Lambertian(np.full((5, 4, 3), 0.5))
    assert gn.Lambertian(0.5).channels is None
    assert gn.Lambertian([0.5]).channels == 1
    assert wood.channels == channels_of_f(wood) == 3
    assert gn.Lambertian(np.full((5, 4, 1), 0.5)).channels == 1
    assert gn.Coated(wood).channels == 3
    assert (gn.Lambertian([0.5]) + gn.Lambertian([0.1, 0.2])).channels == 2
    assert (np.array([0.1, 0.2, 0.3, 0.4]) * gn.Lambertian(0.5)).channels == 4


def test_channels_of_tables_are_those_of_f():
    gray, colour = gn.tabulate(gn.Lambertian(0.5)), gn.tabulate(gn.Lambertian([0.1, 0.2, 0.3]))
    assert gray.channels is channels_of_f(gray) is None
    assert colour.channels == channels_of_f(colour) == 3


def test_channels_that_do_not_agree_are_refused():
    with pytest.raises(gn.Error, match="channels"):
        (gn.Lambertian([0.1, 0.2]) + gn.Lambertian([0.1, 0.2, 0.3])).channels  # noqa: B018
