"""Formats of laboratories: BiRD, OpenMATERIAL, NIST's tables and Zernike modes, BRF tables, spectra, MCD43A1."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import switch_off
from seeds import BRF_TABLE, SEEDS, ZERNIKE, mcd43, mcd43_tile, mueller_table, small_rows

import gonio as gn
from gonio.errors import DependencyError, FormatError, ParameterError
from gonio.formats import bird_json, formats, xarray_netcdf, zernike
from gonio.formats import mcd43 as mcd43_module

REAL = Path(__file__).resolve().parents[2] / "shared" / "data"
NAMES = ("BiRD", "OpenMATERIAL", "NIST Mueller", "Zernike", "BRF table", "reflectance spectrum", "MCD43A1")
DEGREES = math.pi / 180.0


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    """No kernels: compiling one for every table takes longer than all else here."""
    switch_off(monkeypatch)


def real(name):
    if not (REAL / name).exists():
        pytest.skip(f"no file {REAL / name}")
    return REAL / name


def loaded(content, tmp_path):
    (tmp_path / "file").write_bytes(content if isinstance(content, bytes) else content.encode())
    return gn.load(tmp_path / "file")


def at(m, theta_i, phi_i, theta_o, phi_o):
    return m.f_angles(theta_i * DEGREES, phi_i * DEGREES, theta_o * DEGREES, phi_o * DEGREES)


@pytest.mark.parametrize("name", NAMES)
def test_files_are_recognised(name):
    content = SEEDS[name]()
    claiming = [m.NAME for m in formats() if m.matches(content[:4096], len(content))]
    assert claiming[0] == ("netCDF" if name == "MCD43A1" else name)


# Zernike: NIST's expansion, and the measurements that it was fitted to.


def test_one_mode_is_a_lambertian_surface(tmp_path):
    m = loaded("1, 1, 0, 0, 0, 0, 0, 0.5\n", tmp_path)
    np.testing.assert_allclose(at(m, 10.0, 0.0, 70.0, 30.0), 0.5 / (2.0 * math.pi), rtol=1e-14)
    assert m.channel_names is None


def test_a_mode_by_hand():
    theta_i, theta_o, phi = 0.7, 1.1, 2.0
    i, o = math.sqrt(2.0) * math.sin(0.35), math.sqrt(2.0) * math.sin(0.55)  # rho
    r31, r11 = lambda r: 3.0 * r**3 - 2.0 * r, lambda r: r
    expected = math.sqrt(4.0 * 2.0) / (2.0 * math.pi) * (r31(i) * r11(o) + r11(i) * r31(o)) * math.cos(phi)
    m = zernike.Zernike([[1, 1, 3, 1, 1, 1, 0, 1.0]])
    assert m.f_angles(theta_i, 0.3, theta_o, 0.3 + phi) == pytest.approx(expected, rel=1e-13)


def test_coefficients_may_depend_on_wavelength(tmp_path):
    text = "1 1 0 0 0 0 0 0.5\n1 1 0 0 0 0 3 2.0\n"
    m = loaded(text, tmp_path)
    assert m.channel_names == (532.0,)
    np.testing.assert_allclose(at(m, 0.0, 0.0, 0.0, 0.0), [(0.5 + 2.0 * 0.532**3) / (2.0 * math.pi)])
    m = zernike.read(tmp_path / "file", wavelengths=[400, 1000])
    np.testing.assert_allclose(at(m, 0.0, 0.0, 0.0, 0.0), np.array([0.5 + 2.0 * 0.4**3, 2.5]) / (2.0 * math.pi))
    assert m.mueller([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).shape == (2, 4, 4)


def test_the_ptfe_table_agrees_with_its_published_expansion():
    """The published coefficients are the unweighted least-squares fit to the published rows, with its residual."""
    table, model = gn.load(real("nist_ptfe/PTFE.data.532.csv")), gn.load(real("nist_ptfe/PTFE.532.coeff.csv"))
    measured = table.table[:, 5]
    wi, wo = (gn.direction(*np.radians(table.table[:, k : k + 2]).T) for k in (1, 3))
    off = model.f(wi, wo) - measured
    rms = math.sqrt(np.mean(off**2))
    assert rms == pytest.approx(0.0029930541, rel=1e-6)  # [1/sr]
    assert math.sqrt(np.mean((off / measured) ** 2)) < 0.0093
    modes = model.rows[(model.rows[:, 0] == 1) & (model.rows[:, 1] == 1)]
    basis = np.stack([zernike.Zernike([[*mode[:7], 1.0]]).f(wi, wo) for mode in modes], axis=1)
    fitted, squares, rank, _ = np.linalg.lstsq(basis, measured)
    assert rank == len(modes) == 40
    np.testing.assert_allclose(fitted, modes[:, 7], atol=1e-11)
    assert math.sqrt(squares[0] / len(measured)) == pytest.approx(rms, rel=1e-9)


def test_the_ptfe_table_agrees_with_its_published_mueller_matrix():
    table, model = gn.load(real("nist_ptfe/PTFE.data.532.csv")), gn.load(real("nist_ptfe/PTFE.532.coeff.csv"))
    wi, wo = (gn.direction(table.rows[:, k], table.rows[:, k + 1]) for k in (0, 2))
    expected, found = table.mueller, model.mueller(wi, wo)
    np.testing.assert_allclose(found[:, 0, 0], model.f(wi, wo), rtol=1e-12)
    off = found / found[:, :1, :1] - expected / expected[:, :1, :1]
    rms = np.sqrt(np.mean(off**2, axis=0))
    assert rms.max() < 0.011
    signal = np.sqrt(np.mean((expected / expected[:, :1, :1]) ** 2, axis=0))
    assert (rms < signal).all()
    assert (rms[1:3, 1:3] < 0.25 * signal[1:3, 1:3]).all()
    swapped = np.swapaxes(model.mueller(wo, wi), -1, -2) * np.outer([1, 1, -1, 1], [1, 1, -1, 1])
    np.testing.assert_allclose(found, swapped, atol=1e-15)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("1, 1, 30, 0, 0, 0, 0, 1", "orders n and m from 0 to 24"),
        ("1, 1, 2, 1, 0, 0, 0, 1", "both even or both odd"),
        ("1, 1, 2, 2, 2, 0, 0, 1", "k = l"),
        ("1, 1, 2, 2, 0.5, 0.5, 0, 1", "whole numbers"),
        ("1, 1, 2, 2, 0, 0, 0, nan", "finite coefficient"),
        ("1, 1, 2, 2, 0, 0, 0", "line 6: got"),
        ("3, 2, 0, 0, 0, 0, 0, 1", "1 <= i <= j <= 4"),
    ],
)
def test_modes_that_are_none(row, words, tmp_path):
    with pytest.raises(FormatError, match=words):
        loaded(ZERNIKE + row.encode(), tmp_path)


def test_an_expansion_without_f(tmp_path):
    with pytest.raises(FormatError, match="which is f"):
        loaded("2, 2, 0, 0, 0, 0, 0, 1.0\n", tmp_path)


# NIST's Mueller tables.


def test_mueller_rows(tmp_path):
    m = loaded(mueller_table(), tmp_path)
    assert isinstance(m, gn.Scattered)
    assert m.channel_names == (532.0,)
    np.testing.assert_array_equal(m.stored, [[0.265], [0.25], [0.32]])
    np.testing.assert_allclose(np.degrees(m.rows[1]), [75.0, 180.0, 10.0, 20.0])
    assert m.mueller.shape == (3, 4, 4)
    np.testing.assert_allclose(m.mueller[0, 0, :3], 0.265 * np.array([1.0, 0.01, 0.02]))
    assert m.mueller[2, 3, 2] == pytest.approx(0.14 * 0.32)


def test_wavelengths_of_mueller_rows_are_channels(tmp_path):
    lines = mueller_table().decode().splitlines()
    again = [line.replace("0.532", "0.633", 1).replace("2.65E-01", "0.27") for line in lines[1:3]]
    m = loaded("\r\n".join([*lines, *again]), tmp_path)
    assert m.channel_names == (532.0, 633.0)
    np.testing.assert_array_equal(m.stored, [[0.265, 0.27], [0.25, 0.25], [0.32, np.nan]])
    assert m.mueller.shape == (3, 2, 4, 4)


def test_the_real_mueller_table():
    m = gn.load(real("nist_ptfe/PTFE.data.532.csv"))
    assert m.stored.shape == (1824, 1)
    assert m.residual.rms < 0.006
    f = m.f_angles(math.radians(75.0), math.pi, *np.radians([60.0, 0.0]))  # forward, where PTFE is brightest
    assert f > 1.5 * m.f_angles(math.radians(75.0), math.pi, *np.radians([60.0, 180.0]))


def test_damaged_mueller_tables(tmp_path):
    text = mueller_table().decode()
    for change, words in (
        (lambda t: t.replace("0.25,", "abc,"), "line 3: got 'abc'"),
        (lambda t: t.replace("-75,", "-95,"), "theta_i is -95 degrees"),
        (lambda t: t.splitlines()[0], "no rows"),
        (lambda t: t.replace("0.532,-75", "-1,-75"), "wavelength"),
        (lambda t: t.replace("2.65E-01", "nan").replace(",0.25,", ",nan,").replace(",0.32,", ",nan,"), "no value"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(change(text), tmp_path)


# Tables of reflectance factors.


def test_brf_table(tmp_path):
    m = loaded(BRF_TABLE.replace(b"\n", b"\r\n"), tmp_path)
    assert m.quantity == "reflectance factor"
    assert m.channel_names == (450.5, 633.0)
    assert m.about["text"] == ["BRF Values", "a panel"]
    np.testing.assert_allclose(at(m, 45.0, 0.0, 45.0, 180.0), np.array([1.06, 1.08]) / math.pi, rtol=1e-9)


def test_the_real_brf_table():
    m = gn.load(real("ua_rsg/spectralon7_vis_brf.txt"))
    assert m.stored.shape == (19, 11)
    assert m.stored[1, 0] == 1.05215
    ptfe = gn.load(real("nist_ptfe/PTFE.532.coeff.csv"))
    green = m.channel_names.index(537.85)
    rows = {tuple(np.round(np.degrees(r)).astype(int)): v[green] for r, v in zip(m.rows, m.stored, strict=True)}
    forward = rows[45, 0, 45, 180] / rows[45, 0, 0, 0]
    assert forward == pytest.approx(at(ptfe, 45, 0, 45, 180) / at(ptfe, 45, 0, 0, 0), abs=0.01)
    assert abs(forward - at(ptfe, 45, 0, 45, 0) / at(ptfe, 45, 0, 0, 0)) > 0.05


def test_damaged_brf_tables(tmp_path):
    for old, new, words in (
        (b"633nm", b"400nm", "rising wavelengths"),
        (b"633nm", b"red", "a wavelength like"),
        (b"1.06\n 45", b"1.06\t1\n 45", "line 5"),
        (b" 12.000", b" 91.000", "theta_i is 91 degrees"),
        (b" 12.000", b"    nan", "theta_i is nan degrees"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(BRF_TABLE.replace(old, new), tmp_path)


# Spectra.


def test_spectrum(tmp_path):
    m = loaded("nm R u\n# panel 4\n400\t0.5\t0.01\n500,0.75,0.02\n", tmp_path)
    assert m.channel_names == (400.0, 500.0)
    np.testing.assert_allclose(at(m, 20.0, 0.0, 70.0, 40.0), np.array([0.5, 0.75]) / math.pi)
    np.testing.assert_array_equal(m.uncertainty, [0.01, 0.02])
    assert "Lambertian" in m.about["assumption"]
    assert loaded("400 0.5\n500 0.6\n", tmp_path).uncertainty is None
    assert loaded(",\n400 0.5\n500 0.6\n", tmp_path).channel_names == (400.0, 500.0)
    for text, words in (
        ("400 50\n500 60\n", "percentages"),
        ("400 0.5\n500 -0.1\n", "expected 0 to 1"),
        ("".join(f"{300 + k} 0.5\n" for k in range(600)) + "x", "line 601"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(text, tmp_path)


def test_the_real_spectrum():
    m = gn.load(real("grit/Spectralon_Num4.txt"))
    assert len(m.channel_names) == 2151
    assert (m.channel_names[0], m.rho[0], m.uncertainty[0]) == (350.0, 0.9878, 0.0053)


# BiRD.


def bird(**columns):
    unit = {"theta_i": "deg", "phi_i": "deg", "theta_r": "deg", "phi_r": "deg", "BRDF": "sr^-1", "uBRDF": "1/sr"}
    data = {k: v if isinstance(v, dict) else {"unit": unit[k], "values": v} for k, v in columns.items()}
    return json.dumps({"metadata": {"type": "BRDF", "id": "here"}, "data": data})


PAIRS = {"theta_i": [0, 0], "phi_i": [0, 0], "theta_r": [10, 20], "phi_r": [60, 60]}


def test_bird_example(tmp_path):
    """The values of the project's example.brdf (BiRD_view, MIT): 550 to 850 nm, s and p by turns."""
    values = [0.254, 0.263, 0.267, 0.273, 0.281, 0.295, 0.296, 0.301]
    states = [[1, 1, 0, 0], [1, -1, 0, 0]] * 4
    text = bird(
        **{name: [float(v[0])] * 8 for name, v in PAIRS.items()},
        BRDF=values,
        wavelength_i={"unit": "nm", "values": np.repeat([550, 650, 750, 850], 2).tolist()},
        polarization_i={"notation": "inStokes", "values": states},
    )
    m = loaded(text, tmp_path)
    assert m.channel_names == (550.0, 650.0, 750.0, 850.0)
    np.testing.assert_allclose(m.stored.reshape(-1), [0.2585, 0.27, 0.288, 0.2985])
    assert m.about["polarization_i"] == "mean of s and p"
    s = bird_json.read(tmp_path / "file", polarization="s")
    np.testing.assert_array_equal(s.stored.reshape(-1), values[::2])
    np.testing.assert_allclose(at(s, 0.0, 0.0, 10.0, 60.0), values[::2])
    with pytest.raises(ParameterError, match="holds p, s"):
        bird_json.read(tmp_path / "file", polarization="u")


def test_bird_units_and_uncertainties(tmp_path):
    half = {"unit": "rad", "values": [0.0, 0.5]}
    base = {**PAIRS, "theta_r": half, "BRDF": [0.2, 0.4]}
    m = loaded(bird(**base, uBRDF={"unit": "%", "values": [1.0, 2.0]}), tmp_path)
    np.testing.assert_allclose(m.uncertainty.reshape(-1), [0.002, 0.008])
    assert m.channel_names is None
    assert m.f_angles(0.0, 0.0, 0.5, math.pi / 3.0) == pytest.approx(0.4)
    one = {"unit": "1/sr", "values": [0.2, 0.4], "uncertainty": {"value": 0.01, "unit": "sr^-1"}}
    m = loaded(bird(**{**base, "BRDF": one}), tmp_path)
    np.testing.assert_array_equal(m.uncertainty.reshape(-1), 0.01)
    m = loaded(bird(**base, wavelength_i={"unit": "μm", "values": [0.55, 0.55]}), tmp_path)
    assert m.channel_names == pytest.approx((550.0,))


def test_bird_rows_of_the_earlier_layout(tmp_path):
    names = (("theta_i", "°"), ("phi_i", "°"), ("theta_r", "°"), ("phi_r", "°"), ("BRDF", "sr-1"), ("uBRDF", "sr-1"))
    variables = [{"name": n, "type": "number", "unit": u} for n, u in names]
    rows = [[0, 0, 10, 60, 0.2, 0.01], [0, 0, 20, 60, 0.3, 0.02]]
    text = json.dumps({"metadata": {"type": "BRDF"}, "data": {"variables": variables, "values": rows}})
    m = loaded(text, tmp_path)
    np.testing.assert_array_equal(m.stored.reshape(-1), [0.2, 0.3])
    np.testing.assert_array_equal(m.uncertainty.reshape(-1), [0.01, 0.02])
    with pytest.raises(FormatError, match="row 2"):
        loaded(text.replace(", 0.02]", "]"), tmp_path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"BRDF": [0.1]}, "same number"),
        ({"BRDF": [0.1, "x"]}, "'x' among numbers"),
        ({"BRDF": [0.1, True]}, "True among numbers"),
        ({"BRDF": [0.1, [1.0]]}, "one length"),
        ({"BRDF": {"unit": "W", "values": [0.1, 0.2]}}, "unit 'W', expected one of 1/sr"),
        ({"theta_r": [10, 100]}, "theta_o is 100 degrees"),
        ({"theta_r": {"unit": "deg"}}, "'values' is missing"),
        ({"theta_r": 3}, "values"),
        ({"polarization_i": {"values": ["s", 4]}}, "Stokes"),
        ({"polarization_i": {"values": ["s", "p"]}}, "different pairs"),
        ({"uBRDF": {"unit": "1/sr", "values": None}}, "'values' is None"),
        ({"BRDF": {"unit": "1/sr", "values": [0.1, 0.2], "uncertainty": {"value": 1, "unit": "K"}}}, "uncertainty"),
    ],
)
def test_damaged_bird_files(change, words, tmp_path):
    with pytest.raises(gn.Error, match=words):
        loaded(bird(**{**PAIRS, "BRDF": [0.1, 0.2], **change}), tmp_path)


def test_json_that_is_none(tmp_path):
    text = bird(**PAIRS, BRDF=[0.1, 0.2])
    for content, words in (
        (text[:-5], "line 1: not JSON, or cut short"),
        (text.replace("0.1", "9" * 5000), "not JSON that can be read"),
        (text.replace("[0.1", "[" * 100000 + "0.1"), "not JSON"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(content, tmp_path)


# OpenMATERIAL.


def material(rows, **more):
    held = {"metadata": {"name": "asphalt", "openMaterial3dVersion": "1.1.0"}}
    return json.dumps({**held, "brdf": {"wavelengths": [9.05e-07], "lookupTable": rows, **more}})


def test_open_material(tmp_path):
    rows = [[9.05e-07, 0.5, 0.0, 0.0, 0.1], [9.05e-07, 0.5, 0.7, 0.0, 0.2], [9.05e-07, 0.5, 0.7, math.pi, 0.4]]
    solid = [{"wavelength": 9.05e-07, "solidAngle": 0.01}]
    m = loaded(material(rows, receiverSolidAngles=solid), tmp_path)
    assert m.channel_names == (905.0,)
    assert m.about["receiverSolidAngles"] == solid
    np.testing.assert_allclose(m.f_angles(0.5, 1.0, 0.7, 1.0 + math.pi), [0.4])
    np.testing.assert_allclose(m.f_angles(0.5, 1.0, 0.7, 1.0), [0.2])
    m = loaded(material([*rows[:2], [*rows[2][:4], None]]), tmp_path)
    assert np.isnan(m.stored).sum() == 1
    for row, words in (
        ([9.05e-07, 2.0, 0.0, 0.0, 0.1], "theta_i is 114.592"),
        ([9.05e-07, 0.1, None, 0.0, 0.1], "row 4"),
        ([0.0, 0.1, 0.1, 0.0, 0.1], "row 4"),
        ([9.05e-07, 0.1, 0.1, 0.1], "row 4"),
        ([9.05e-07, 0.1, "a", 0.1, 0.1], "'a' among numbers"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(material([*rows, row]), tmp_path)
    with pytest.raises(FormatError, match="lookupTable"):
        loaded(json.dumps({"metadata": {"openMaterial3dVersion": "1"}, "optical": {}}), tmp_path)


def test_many_wavelengths_without_pairs_in_common(tmp_path):
    rows = [[1e-7 + 1e-10 * k, 0.5, 1e-3 * k, 0.0, 0.1] for k in range(1000)]
    with pytest.raises(FormatError, match="about the same pairs"):
        loaded(material(rows), tmp_path)


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
    m = loaded(SEEDS[name](), tmp_path)
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
    m = loaded(TURNED, tmp_path)
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


def test_open_material_refuses_what_it_cannot_hold(tmp_path):
    with pytest.raises(ParameterError, match="anisotropic"):
        gn.save(gn.Ward(0.1, 0.1, 0.3), tmp_path / "m.xompt", wavelengths=[500])
    m = gn.Gridded("angles", {"theta_i": [0.0, 1.0], "theta_o": [0.5], "phi": [0.0]}, [[[0.1]], [[-0.1]]])
    with pytest.raises(ParameterError, match="not negative"):
        gn.save(m, tmp_path / "m.xompt", wavelengths=[500])
    assert not (tmp_path / "m.xompt").exists()


# MCD43A1.


def test_mcd43(tmp_path):
    m = loaded(mcd43(), tmp_path)
    assert (m.time, m.channel_names) == (1, ("Band1", "vis"))
    assert not m.valid[0].any()
    expected = gn.RossLi(f_iso=[0.101, 0.102], f_vol=[0.051, 0.051], f_geo=[0.021, 0.021])
    np.testing.assert_allclose(at(m, 40.0, 0.0, 20.0, 100.0), at(expected, 40.0, 0.0, 20.0, 100.0), rtol=1e-12)
    np.testing.assert_allclose(m.on(2).f_iso, [0.102, 0.103])
    assert np.isnan(at(m.on(0), 40.0, 0.0, 20.0, 100.0)).all()
    assert m.about["quality"] == {"Band1": 0, "vis": 0}
    assert xarray_netcdf.read(tmp_path / "file", time=2).time == 2
    with pytest.raises(ParameterError, match="holds 3 days"):
        xarray_netcdf.read(tmp_path / "file", time=3)


def test_mcd43_bands_have_wavelengths_and_pixels_are_a_map(tmp_path):
    m = loaded(mcd43(("Band1", "Band4"), pixels=2), tmp_path)
    assert m.channel_names == (645.0, 555.0)
    assert m.f_iso.shape == (2, 2, 2)
    assert at(m, 40.0, 0.0, 20.0, 100.0).shape == (2, 2, 2)


@pytest.mark.parametrize("scales", [False, True])
def test_mcd43_converted_by_h4toh5(tmp_path, scales):
    """Its groups are those of HDF-EOS, and not all of its files have netCDF's dimensions."""
    import h5py

    with h5py.File(tmp_path / "file", "w") as file:
        group = file.create_group("MOD_Grid_BRDF/Data Fields")
        for k, band in enumerate(("Band1", "Band4")):
            weights = np.full((2, 2, 3), 100 + k, "i2")
            held = group.create_dataset(f"BRDF_Albedo_Parameters_{band}", data=weights)
            held.attrs.update({"scale_factor": [0.001], "add_offset": [0.0], "_FillValue": np.array([32767], "i2")})
            for axis, name in enumerate(("YDim", "XDim", "Num_Parameters") if scales else ()):
                if name not in group:
                    group.create_dataset(name, data=np.arange(held.shape[axis], dtype="f8")).make_scale(name)
                held.dims[axis].attach_scale(group[name])
    m = gn.load(tmp_path / "file")
    assert m.channel_names == (645.0, 555.0)
    np.testing.assert_allclose(m.f_iso, np.broadcast_to([0.1, 0.101], (2, 2, 2)))


def test_tiles_of_mcd43(tmp_path):
    pytest.importorskip("pyhdf", reason="HDF4 is read with pyhdf: pip install pyhdf")
    m = loaded(mcd43_tile(), tmp_path)
    assert m.channel_names == (645.0, 555.0) and m.f_iso.shape == (3, 2, 2)
    assert m.about["CoreMetadata.0"] == "GROUP = INVENTORYMETADATA"
    assert m.about["quality"]["Band4"] == [[1, 1]] * 3
    y, x = np.mgrid[:3, :2]
    expected = 0.1 + 0.001 * (y + x)[..., None] + [0.0, 0.01]
    expected[0, 0] = np.nan
    np.testing.assert_allclose(m.f_iso, expected, rtol=1e-12)
    np.testing.assert_allclose(m.f_vol[1:], 0.05)
    np.testing.assert_allclose(m.f_geo[1:], 0.02)
    one = gn.load(tmp_path / "file", rows=(2, 3), columns=(1, 2))
    assert one.f_iso.tolist() == pytest.approx([0.103, 0.113])
    np.testing.assert_allclose(at(one, 40.0, 0.0, 20.0, 100.0), at(m, 40.0, 0.0, 20.0, 100.0)[2, 1], rtol=1e-12)
    row = gn.load(tmp_path / "file", rows=(1, 2))
    np.testing.assert_allclose(row.f_iso, expected[1:2], rtol=1e-12)


@pytest.mark.parametrize(
    "options", [{"rows": (2, 5)}, {"columns": (0, 0)}, {"rows": (5, 1)}, {"rows": (0, 1), "columns": (2, 1)}]
)
def test_pixels_that_a_tile_lacks(tmp_path, options):
    pytest.importorskip("pyhdf", reason="HDF4 is read with pyhdf: pip install pyhdf")
    loaded(mcd43_tile(), tmp_path)
    with pytest.raises(ParameterError, match=r"holds 3 rows and 2 columns of pixels; got rows="):
        gn.load(tmp_path / "file", **options)
    with pytest.raises(ParameterError, match=r"rows=1: expected 2 whole numbers from 0"):
        gn.load(tmp_path / "file", rows=1)


def test_large_tiles_ask_which_pixels(tmp_path, monkeypatch):
    pytest.importorskip("pyhdf", reason="HDF4 is read with pyhdf: pip install pyhdf")
    monkeypatch.setattr(mcd43_module, "MOST", 40)
    (tmp_path / "file").write_bytes(mcd43_tile())
    with pytest.raises(ParameterError, match=r"holds 3 rows and 2 columns of pixels, 0 MB of weights; say which"):
        gn.load(tmp_path / "file")
    with pytest.raises(ParameterError, match="say which"):
        gn.load(tmp_path / "file", rows=(0, 3))
    assert gn.load(tmp_path / "file", rows=(0, 1)).f_iso.shape == (1, 2, 2)
    assert gn.load(tmp_path / "file", rows=(0, 3), columns=(0, 2)).f_iso.shape == (3, 2, 2)


def test_damaged_tiles(tmp_path):
    pytest.importorskip("pyhdf", reason="HDF4 is read with pyhdf: pip install pyhdf")
    data = mcd43_tile()
    with pytest.raises(FormatError, match=r"HDF4 file that is damaged or cut short"):
        loaded(data[: len(data) // 2], tmp_path)
    with pytest.raises(FormatError, match=r"HDF4 without BRDF_Albedo_Parameters_\*"):
        loaded(data.replace(b"BRDF_Albedo_P", b"BRDF_albedo_p"), tmp_path)
    with pytest.raises(FormatError, match=r"expected \(\[time,\] y, x, 3\)"):
        loaded(mcd43_tile(flat=True), tmp_path)
    with pytest.raises(FormatError, match=r"has attributes .*'scale_factor': 'a'.*expected numbers"):
        loaded(mcd43_tile(scale_factor="a"), tmp_path)
    with pytest.raises(FormatError, match="scale_factor"):
        loaded(mcd43_tile(scale_factor=1.0), tmp_path)


def test_tiles_without_pyhdf(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyhdf", None)
    with pytest.raises(DependencyError, match=r"pip install 'gonio\[hdf4\]'.*AppEEARS.*h4tonccf_nc4 .*h4toh5 "):
        loaded(b"\x0e\x03\x13\x01" + bytes(100), tmp_path)


def test_damaged_mcd43(tmp_path):
    with pytest.raises(FormatError, match="scale_factor"):
        loaded(mcd43(scale_factor=1.0), tmp_path)
    (tmp_path / "file").write_bytes(SEEDS["netCDF"]())
    with pytest.raises(FormatError, match="which alone have days"):
        xarray_netcdf.read(tmp_path / "file", time=2)


def test_the_real_mcd43():
    m = gn.load(real("modis/mcd43a1_one_pixel.nc4"))
    assert m.weights.shape == (365, 1, 1, 3, 10)
    np.testing.assert_allclose([m.f_iso[0], m.f_vol[0], m.f_geo[0]], [0.089, 0.0, 0.022], atol=1e-7)
    assert np.isnan(m.weights).mean() == pytest.approx((9 * 25 + 63) / 3650)
    theta = math.radians(30.0)  # black-sky albedo by the product's polynomials (Lucht et al. 2000)
    vol = -0.007574 - 0.070987 * theta**2 + 0.307588 * theta**3
    geo = -1.284909 - 0.166314 * theta**2 + 0.041840 * theta**3
    expected = m.f_iso + vol * m.f_vol + geo * m.f_geo
    np.testing.assert_allclose(gn.albedo(m, gn.direction(theta, 0.0)), expected, atol=2e-3)
