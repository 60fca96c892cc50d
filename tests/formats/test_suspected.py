"""Marks of missing values, and measurements that reflect more than arrives, are told where a file is read."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import gonio as gn
from gonio.base.quantities import mark_of_missing
from gonio.errors import FormatError, MeaningWarning

SCAN = range(-60, 61, 10)
MARKS = (32767, 65535, 999, 9999, 99.99, 1e30, -1, -9)


def lines(mark: float) -> str:
    return "\n".join(f"30,{v},{mark if abs(v + 30) < 12 else 0.2}" for v in SCAN)


@pytest.mark.parametrize("mark", MARKS)
def test_a_table_with_a_number_that_repeats_and_stands_apart_is_asked_about(mark, tmp_path):
    path = tmp_path / "f.csv"
    path.write_text("theta_i,theta_o,brdf\n" + lines(mark))
    with pytest.raises(FormatError, match=re.escape(f"line 4: {mark:g} in the column 'brdf', in 3 rows")):
        gn.load(path)
    m = gn.load(path, missing=mark)
    assert np.isnan(m.values).sum() >= 3
    assert m.rough_albedo() < 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeaningWarning)  # tested above
        assert mark in gn.load(path, missing="").values


@pytest.mark.parametrize("mark", MARKS)
def test_rows_of_other_formats_warn_of_it(mark, tmp_path):
    path = tmp_path / "f.astm"
    rows = (f"0.5,0,{abs(v) / 60},{3.14159 * (v > 0)},{mark if abs(v + 30) < 12 else 0.2}" for v in SCAN)
    path.write_text("VARS theta_i,phi_i,theta_s,phi_s,Y\n" + "\n".join(rows))
    with pytest.warns(MeaningWarning, match="decades apart from all others"):
        gn.load(path)


def test_what_is_measured_is_no_mark():
    """A peak along the normal that every azimuth has, one value that is large, noise, zeros, and steady growth."""
    places = np.random.default_rng(0).normal(size=(40, 3))
    one_place = np.zeros((40, 3))
    peak = np.full(40, 0.1)
    peak[:9] = 1e4
    assert mark_of_missing(peak, lambda: one_place) is None
    assert mark_of_missing(peak, lambda: places) == 1e4
    single = np.full(40, 0.1)
    single[3] = 1e4
    noise = np.round(np.random.default_rng(1).normal(0.0, 0.001, 40), 3)
    for values in (single, noise, np.zeros(40), np.full(40, 0.3), np.repeat(np.logspace(-3, 3, 10), 4)):
        assert mark_of_missing(values, lambda: places) is None
    assert mark_of_missing(np.full(40, np.nan), lambda: places) is None


def test_an_albedo_far_above_one_is_told_where_a_file_is_read(tmp_path):
    bright = gn.tables.tabulate(gn.Lambertian(0.5), "angles", resolution=(9, 9, 12))
    for scale, told in ((1.0, False), (100.0, True)):
        path = tmp_path / f"{scale}.csv"
        gn.save(bright.with_brdf(scale * bright.brdf()), path)
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always", MeaningWarning)
            gn.load(path)
        assert any("times the light that arrives" in str(w.message) for w in found) is told


def test_a_rough_albedo_is_near_to_the_albedo():
    for m in (gn.Lambertian(0.5), gn.OrenNayar(0.8, 0.5), gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.9))):
        table = gn.tables.tabulate(m, "angles", resolution=(31, 31, 36))
        wi = gn.direction(np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0]), 0.0)
        assert table.rough_albedo() == pytest.approx(float(np.max(gn.albedo(table, wi))), rel=0.05)
