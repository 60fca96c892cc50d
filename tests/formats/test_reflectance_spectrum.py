"""Spectra of reflectance: a made one and the real one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from format_cases import at, file_of
from places import real

import gonio as gn
from gonio.errors import FormatError, MeaningWarning, ParameterError

# Spectra.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def loaded(tmp_path, text, **options):
    return gn.load(file_of(tmp_path, text), **options)


def test_spectrum(tmp_path):
    m = loaded(tmp_path, "nm R u\n# panel 4\n400\t0.5\t0.01\n500,0.75,0.02\n")
    assert m.channel_names == (400.0, 500.0)
    np.testing.assert_allclose(at(m, 20.0, 0.0, 70.0, 40.0), np.array([0.5, 0.75]) / math.pi)
    np.testing.assert_array_equal(m.uncertainty, [0.01, 0.02])
    assert "Lambertian" in m.about["assumption"]
    for text in ("400 0.5\n500 0.6\n", ",\n400 0.5\n500 0.6\n", "# panel 4\n400 0.5\n500 0.6\n"):
        with pytest.warns(MeaningWarning, match=r"without names, taken for wavelength \[nm\] and reflectance"):
            m = loaded(tmp_path, text)
        assert m.channel_names == (400.0, 500.0) and m.uncertainty is None
        assert m == loaded(tmp_path, text, quantity="reflectance")
    for text, words in (
        ("400 50\n500 60\n", "if they are percentages say value_unit='%'"),
        ("400 0.5\n500 -0.1\n", "expected 0 to 1"),
        ("".join(f"{300 + k} 0.5\n" for k in range(600)) + "x", "line 601"),
    ):
        with pytest.raises(FormatError, match=words):
            loaded(tmp_path, text)


def test_the_real_spectrum():
    path = real("grit/Spectralon_Num4.txt")
    with pytest.raises(FormatError, match="three columns and no names"):
        gn.load(path)
    m = gn.load(path, columns=["wavelength", "reflectance", "u"])
    assert len(m.channel_names) == 2151
    assert (m.channel_names[0], m.rho[0], m.uncertainty[0]) == (350.0, 0.9878, 0.0053)


HEADERS = {
    "wavelength (nm),reflectance (%)": 0.01,
    "wavelength [nm],R [%]": 0.01,
    "Wavelength,%R": 0.01,
    "wl,Reflectance in percent": 0.01,
    "nm,%": 0.01,
    "# wavelength (nm),reflectance (%)": 0.01,
    "wavelength,reflectance\nnm,%": 0.01,
    "wavelength,Reflectance SCI": 1.0,
    "wavelength,Spectral reflectance": 1.0,
    "wavelength,8/h reflectance": 1.0,
    "lambda (nm),rho": 1.0,
    "# panel 4, Halon": 1.0,
}


@pytest.mark.parametrize("header", HEADERS)
def test_percent_stands_in_the_names(header, tmp_path):
    """Of a dark sample, whose percentages are below 1: its albedo was 100 times too high."""
    if header == "nm,%":
        header = "wavelength,reflectance\n\n" + header
    quantity = {} if "," in header and "panel" not in header else {"quantity": "reflectance"}
    m = loaded(tmp_path, header + "\n400,0.41\n500,0.42\n600,0.45\n", **quantity)
    unit = next(x for key, x in HEADERS.items() if header.endswith(key))
    np.testing.assert_allclose(m.rho, unit * np.array([0.41, 0.42, 0.45]), rtol=1e-12)


@pytest.mark.parametrize(
    ("header", "rows", "nm"),
    [
        ("wavenumber (cm-1),reflectance", [4000, 5000, 6250], [1600, 2000, 2500]),
        ("wavenumber [1/cm],reflectance", [6250, 5000, 4000], [1600, 2000, 2500]),
        ("Wavenumber,R", [6250, 5000, 4000], [1600, 2000, 2500]),
        ("wavelength (µm),reflectance", [0.4, 0.5, 2.5], [400, 500, 2500]),
        ("lambda [um],reflectance", [2.5, 0.5, 0.4], [400, 500, 2500]),
        ("energy (eV),reflectance", [1.0, 2.0, 4.0], [309.960496, 619.920992, 1239.841984]),
        ("wavelength (nm),reflectance", [700, 600, 500], [500, 600, 700]),
        ("", [700, 600, 500], [500, 600, 700]),
    ],
)
def test_units_and_order_of_wavelengths(header, rows, nm, tmp_path):
    options = {} if header else {"quantity": "reflectance"}
    m = loaded(tmp_path, f"{header}\n" + "".join(f"{x},{0.1 * k}\n" for k, x in enumerate(rows)), **options)
    np.testing.assert_allclose(m.channel_names, nm, rtol=1e-9)
    rising = header.startswith(("wavelength", "lambda")) or not header
    expected = [0.0, 0.1, 0.2] if (rows[0] < rows[-1]) == rising else [0.2, 0.1, 0.0]
    np.testing.assert_allclose(m.rho, expected, atol=1e-15)


NO_REFLECTANCES = (
    "transmittance", "T", "Absorbance", "A", "W/m2/nm", "Irradiance [W m-2 nm-1]", "intensity (a.u.)", "Radiance",
    "emissivity", "n", "k", "optical density", "x(lambda)", "relative power", "counts", "log(1/R)", "sensitivity",
)  # fmt: skip


@pytest.mark.parametrize("name", NO_REFLECTANCES)
def test_what_is_no_reflectance_is_refused(name, tmp_path):
    text = f"wavelength (nm),{name}\n400,.1\n500,.2\n600,.3\n"
    with pytest.raises(FormatError, match=r"no reflectance of a surface; gn\.Spectrum.*quantity='reflectance'"):
        loaded(tmp_path, text)
    assert loaded(tmp_path, text, quantity="reflectance").rho.tolist() == [0.1, 0.2, 0.3]
    assert loaded(tmp_path, text, columns=["wavelength", "reflectance"]).rho.tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("wavelength,R,T", "column 'T' is a transmittance; say what it is, or leave it out"),
        ("wavelength,reflectance,transmittance", "'transmittance' is a transmittance"),
        ("wavelength,SCI,SCE", "'SCI' and 'SCE' are reflectances: which is meant"),
        ("wavelength,R,R_back", "'R' and 'R_back' are reflectances"),
        ("wavelength,reflectance,sample B", "'sample B' is not known"),
        ("wavelength,reflectance,foo", "'foo' is not known"),
        ("", "three columns and no names"),
        ("# Spectralon", "three columns and no names"),
        ("reflectance of my panel", "three columns and no names"),
    ],
)
def test_a_third_column_is_asked_about(header, message, tmp_path):
    text = f"{header}\n400,.1,.5\n500,.2,.6\n600,.3,.65\n"
    with pytest.raises(FormatError, match=f"{message}.*columns=wavelength,reflectance,ignore"):
        loaded(tmp_path, text)
    m = loaded(tmp_path, text, columns=["wavelength", "reflectance", "ignore"])
    assert m.uncertainty is None and m.rho.tolist() == [0.1, 0.2, 0.3]
    second = loaded(tmp_path, text, columns=["wavelength", "ignore", "reflectance"])
    assert second.rho.tolist() == [0.5, 0.6, 0.65]


@pytest.mark.parametrize(
    ("third", "u", "options"),
    [
        ("u", [0.01, 0.02], {}),
        ("uncertainty", [0.01, 0.02], {}),
        ("std. dev.", [0.01, 0.02], {}),
        ("sigma", [0.01, 0.02], {}),
        ("+/-", [0.01, 0.02], {}),
        ("± R", [0.01, 0.02], {}),
        ("error of reflectance", [0.01, 0.02], {}),
        ("U(k=2)", [0.005, 0.01], {}),
        ("expanded uncertainty", [0.005, 0.01], {"coverage": 2.0}),
        ("uncertainty (%)", [0.00005, 0.00015], {}),
    ],
)
def test_uncertainties_are_named(third, u, options, tmp_path):
    text = f"wavelength,reflectance,{third}\n400,0.5,0.01\n500,0.75,0.02\n"
    np.testing.assert_allclose(loaded(tmp_path, text, **options).uncertainty, u, rtol=1e-12)
    if options:
        with pytest.raises(FormatError, match="by which factor k"):
            loaded(tmp_path, text)


def test_uncertainties_of_percentages(tmp_path):
    text = "wavelength,reflectance (%),u\n400,50,1\n500,75,2\n"
    np.testing.assert_allclose(loaded(tmp_path, text).uncertainty, [0.01, 0.02])
    text = text.replace(",u\n", ",u (%)\n")
    with pytest.raises(FormatError, match="uncertainty='relative' or uncertainty='absolute'"):
        loaded(tmp_path, text)
    np.testing.assert_allclose(loaded(tmp_path, text, uncertainty="relative").uncertainty, [0.005, 0.015])
    np.testing.assert_allclose(loaded(tmp_path, text, uncertainty="absolute").uncertainty, [0.01, 0.02])


def test_decimal_commas(tmp_path):
    """ "400;0,41" was a reflectance of 0 with an uncertainty of 41."""
    for between in (";", "\t", " "):
        for header in ("", f"wavelength[nm]{between}reflectance[%]\n"):
            m = loaded(
                tmp_path, header + f"400{between}0,41\n500{between}0,42\n600,5{between}0,45\n", quantity="reflectance"
            )
            assert m.channel_names == (400.0, 500.0, 600.5) and m.uncertainty is None
            np.testing.assert_allclose(m.rho, np.array([0.41, 0.42, 0.45]) * (0.01 if header else 1.0))


def test_what_was_understood_is_kept_and_written(tmp_path):
    m = loaded(tmp_path, "Sample: soot\nwavenumber (cm-1),reflectance (%),U(k=2)\n4000,2,.1\n5000,3,.1\n")
    assert m.about["understood"] == (
        "wavelengths in 1/cm, reflectance in percent, divided by 100, uncertainty, divided by k = 2"
    )
    np.testing.assert_allclose(m.uncertainty, [0.0005, 0.0005])
    gn.save(m, tmp_path / "again.txt", format="reflectance spectrum")
    again = gn.load(tmp_path / "again.txt")
    np.testing.assert_array_equal(again.rows, m.rows)
    assert again.about["text"] == ["Sample: soot"]


def test_wavelengths_without_a_unit(tmp_path):
    with pytest.raises(FormatError, match="say wavelength_unit='um'"):
        loaded(tmp_path, "wavelength,reflectance\n0.4,.1\n0.5,.2\n")
    m = loaded(tmp_path, "wavelength,reflectance\n0.4,.1\n0.5,.2\n", wavelength_unit="um")
    assert m.channel_names == (400.0, 500.0)
    with pytest.raises(ParameterError, match="leave the option out"):
        loaded(tmp_path, "wavelength (nm),reflectance\n400,.1\n500,.2\n", wavelength_unit="um")
    with pytest.raises(ParameterError, match="expected a word for each of the 2 columns"):
        loaded(tmp_path, "400,.1\n500,.2\n", columns=["wavelength", "ignore"])


def test_lamps_without_names_of_columns(tmp_path):
    for line in ("Spectrum of a tungsten lamp", "# illuminant A", "% transmission of filter 3"):
        with pytest.raises(FormatError, match="no reflectance of a surface"):
            loaded(tmp_path, f"{line}\n400,.1\n500,.2\n600,.3\n")
    with pytest.raises(FormatError, match="does not say what the columns are"):
        loaded(tmp_path, "Something else\n400,.1\n500,.2\n600,.3\n")
