"""Formats of laboratories: what holds of several of them, writing without loss among it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from format_cases import at, loaded
from seeds import SEEDS, small_rows

import gonio as gn
from gonio.errors import ParameterError
from gonio.formats import formats

pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else

DEGREES = math.pi / 180.0

NAMES = ("BiRD", "OpenMATERIAL", "NIST Mueller", "Zernike", "BRF table", "reflectance spectrum", "MCD43A1")


@pytest.mark.parametrize("name", NAMES)
def test_files_are_recognized(name):
    content = SEEDS[name]()
    claiming = [m.NAME for m in formats() if m.matches(content[:4096], len(content))]
    assert claiming[0] == ("netCDF" if name == "MCD43A1" else name)


# Writing.


@pytest.mark.parametrize(("name", "suffix"), [("BiRD", ".brdf"), ("OpenMATERIAL", ".xompt"), ("BRF table", ".txt")])
def test_rows_are_written_without_loss(name, suffix, tmp_path):
    m = small_rows(quantity="reflectance factor" if name == "BRF table" else "brdf", uncertainty=0.01)
    path = tmp_path / f"m{suffix}"
    for _ in range(2):
        gn.save(m, path, format=name)
        again = gn.load(path)
        order = np.lexsort((again.rows[:, 0], again.stored[:, 0])), np.lexsort((m.rows[:, 0], m.stored[:, 0]))
        np.testing.assert_array_equal(again.stored[order[0]], m.stored[order[1]])
        np.testing.assert_array_equal(again.rows[order[0]], m.rows[order[1]])
        assert again.channel_names == m.channel_names
        if name == "BiRD":
            np.testing.assert_array_equal(again.uncertainty, m.uncertainty)
        first, m = path.read_bytes(), again
    gn.save(m, path, format=name)
    assert path.read_bytes() == first


@pytest.mark.parametrize("name", ["NIST Mueller", "Zernike", "reflectance spectrum"])
def test_what_was_read_is_written_without_loss(name, tmp_path):
    m = loaded(tmp_path, SEEDS[name]())
    gn.save(m, tmp_path / "again", format=name)
    assert gn.load(tmp_path / "again") == m
    with pytest.raises(ParameterError, match="expected a"):
        gn.save(gn.Lambertian(0.5), tmp_path / "again", format=name)


@pytest.mark.parametrize("name", ["BiRD", "OpenMATERIAL", "BRF table"])
def test_models_are_written_on_a_grid(name, tmp_path):
    m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5))
    gn.save(m, tmp_path / "m", format=name, wavelengths=[550.0])
    again = gn.load(tmp_path / "m")
    assert type(again) is gn.Gridded
    nodes = np.radians([80.0 / 9.0 * 4, 0.0, 80.0 / 9.0 * 7, 360.0 / 13.0 * 5])
    np.testing.assert_allclose(again.f_angles(*nodes), [m.f_angles(*nodes)], rtol=1e-12)
    with pytest.raises(ParameterError, match="perfect mirror"):
        gn.save(gn.IdealSpecular(0.9), tmp_path / "m", format=name)
    with pytest.raises(ParameterError, match="maps"):
        gn.save(gn.Lambertian(np.full((2, 2, 3), 0.5)), tmp_path / "m", format=name)
    with pytest.raises(ParameterError, match="give wavelengths"):
        gn.save(gn.Lambertian([0.1, 0.2, 0.3]), tmp_path / "m", format=name)


@pytest.mark.parametrize("name", ["BiRD", "BRF table"])
def test_anisotropic_models_are_written_with_their_orientation(name, tmp_path):
    m = gn.Ward(0.1, 0.4, 0.3)
    gn.save(m, tmp_path / "m", format=name, wavelengths=[550.0], resolution=(4, 4, 12))
    again = gn.load(tmp_path / "m")
    assert [len(x) for x in again.axes.values()] == [4, 4, 12, 12]
    for turn in (0.0, 90.0):
        np.testing.assert_allclose(
            at(again, 80.0 / 3.0, turn, 160.0 / 3.0, turn + 180.0), [at(m, 80.0 / 3.0, turn, 160.0 / 3.0, turn + 180.0)]
        )


TURNED = """src_z src_a view_z view_a 550nm
30 20 10 -160 0.1
30 20 10 20 0.2
30 20 10 200 0.3
30 20 40 -160 0.4
30 20 40 20 0.5
30 20 40 200 0.6
"""


@pytest.mark.parametrize(("name", "suffix"), [("BiRD", ".brdf"), ("BRF table", ".txt")])
def test_azimuths_are_kept_as_they_were_measured(name, suffix, tmp_path):
    """A whole turn with both its ends, from light of another azimuth than 0, is a grid, and written as it was."""
    m = loaded(tmp_path, TURNED)
    assert type(m) is gn.Gridded
    np.testing.assert_allclose(at(m, 30.0, 0.0, 40.0, 0.0), [0.5 / math.pi])
    gn.save(m, tmp_path / f"m{suffix}", format=name)
    again = gn.load(tmp_path / f"m{suffix}")
    assert again.about["phi_i"] == m.about["phi_i"] == 20.0 * DEGREES
    for axis in ("theta_o", "phi"):
        np.testing.assert_array_equal(again.axes[axis], m.axes[axis])


@pytest.mark.parametrize("name", ["BiRD", "OpenMATERIAL", "BRF table", "ASTM", "pab-opto", "ALTA"])
def test_measurements_without_a_number_are_not_written(name, tmp_path):
    axes = {"theta_i": [0.5], "theta_o": [0.5, 1.0], "phi": [0.0]}
    for quantity in ("brdf", "reflectance factor"):
        m = gn.Gridded("angles", axes, np.full((1, 2, 1), np.nan), quantity=quantity)
        with pytest.raises(ParameterError, match="has no values to write"):
            gn.save(m, tmp_path / "m", format=name)
    assert not (tmp_path / "m").exists()
