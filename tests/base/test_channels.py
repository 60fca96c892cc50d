"""`Reflectance.channels`: what the parameters and tables say is what f has."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from materials import draws
from sweeps import each_draw

import gonio as gn
from gonio.base.channel_names import places
from gonio.errors import MeaningWarning, NotFoundError, ParameterError
from gonio.formula import tree
from gonio.formula.json_form import from_json

UP = np.array([0.0, 0.0, 1.0])


def channels_of_f(m: gn.Reflectance) -> int | None:
    """The length of the last axis of f, where a batch of one has one more axis than directions have."""
    maps = max((np.ndim(v) - 1 for v in tree.leaves(m)), default=0)
    values = m.f(UP, UP)
    return values.shape[-1] if values.ndim > max(maps, 0) else None


@each_draw(draws(1, every=100))
@pytest.mark.usefixtures("uncompiled")
def test_channels_of_models_are_those_of_f(draw):
    for count in (None, 3):
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
    gray, colour = gn.tables.tabulate(gn.Lambertian(0.5)), gn.tables.tabulate(gn.Lambertian([0.1, 0.2, 0.3]))
    assert gray.channels is channels_of_f(gray) is None
    assert colour.channels == channels_of_f(colour) == 3


def test_channels_that_do_not_agree_are_refused():
    with pytest.raises(gn.Error, match="channels"):
        (gn.Lambertian([0.1, 0.2]) + gn.Lambertian([0.1, 0.2, 0.3])).channels  # noqa: B018  (raises)


# Names.

FIELD = {"f_iso": [0.05, 0.3], "f_vol": [0.02, 0.16], "f_geo": [0.01, 0.03]}
NAMED = gn.RossLi(**FIELD).with_channels(["red", "nir"])


def test_names_of_channels_stay_with_what_is_made_of_a_material():
    for m in (NAMED, 0.5 * NAMED, NAMED + gn.Lambertian(0.1), gn.Coated(NAMED), NAMED.replace(f_vol=0.1)):
        assert m.channel_names == ("red", "nir")
    assert NAMED.with_channels(None).channel_names is None
    assert NAMED.replace(f_iso=[0.1, 0.2, 0.3], f_vol=0.1, f_geo=0.0).channel_names is None


def test_names_of_sums_and_products_whose_parts_have_none():
    parts = gn.Lambertian(0.1) + gn.Lambertian([0.1, 0.2])
    for m in (parts.with_channels([645, 858.5]), (0.5 * parts).with_channels(np.array([645.0, 858.5]))):
        for made in (m, 2.0 * m, m + gn.Lambertian(0.1), from_json(m.to_json()), pickle.loads(pickle.dumps(m))):
            assert made.channel_names == (645.0, 858.5)


def test_names_that_do_not_fit():
    with pytest.raises(ParameterError, match=r"\['a'\]\): got 1, expected 2, one for each channel"):
        NAMED.with_channels(["a"])
    with pytest.raises(ParameterError, match="different names"):
        NAMED.with_channels(["a", "a"])
    for names in ("ab", 5, ["a", 1.0], [-1.0, 2.0], [math.nan, 1.0], [True, False], ["", "a"]):
        with pytest.raises(ParameterError, match="expected"):
            NAMED.with_channels(names)
    with pytest.raises(ParameterError, match="no channel axis"):
        gn.Lambertian(0.5).with_channels(["a"])
    with pytest.warns(MeaningWarning, match="in micrometres"):
        NAMED.with_channels([0.645, 0.8585])
    with pytest.raises(gn.Error, match="expected 2, one for each"):
        from_json(NAMED.to_json() | {"channel_names": ["a"]})


def test_places_of_channels_by_name_and_by_wavelength():
    assert places(NAMED, ["nir", "red"]) == [1, 0]
    assert places(NAMED.with_channels([645, 858.5]), [860, 645.0]) == [1, 0]
    assert places(gn.Lambertian([0.1, 0.2]), [1, 0]) == [1, 0]
    for m, wanted in ((NAMED, "Nir"), (NAMED, 860), (NAMED.with_channels([645, 858.5]), 700), (NAMED, 1)):
        with pytest.raises(NotFoundError, match="no such channel"):
            places(m, [wanted])
