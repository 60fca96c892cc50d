"""Laboratories' exports, as ugly as they come: each loads right, or is refused with a reason that names the cure.

The truth is a made-up surface, `TRUTH`, at 3 incidences and 9 viewers in and across the plane of incidence; every
export below is one way of writing it down.
"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from format_cases import at, file_of
from xlsx_files import workbook

import gonio as gn
from gonio.errors import FormatError, MeaningWarning, ParameterError

PAIRS = [(i, o, phi) for i in (0.0, 30.0, 60.0) for o in (0.0, 12.5, 25.0, 40.5, 70.0) for phi in (0.0, 90.0, 180.0)]
IN_PLANE = [(i, -o if phi else o, 0.0) for i, o, phi in PAIRS if phi != 90.0 and not (o == 0.0 and phi)]


def truth(theta_i, theta_o, phi):
    """f: matte, with a bump towards the mirror direction."""
    wi, wo = gn.direction(*np.radians([theta_i, 0.0])), gn.direction(*np.radians([theta_o, phi]))
    return 0.25 + 0.2 * math.exp(4.0 * (float(wo @ (wi * [-1.0, -1.0, 1.0])) - 1.0))


def table(
    names=("theta_i", "theta_o", "phi", "f"),
    separator=",",
    pairs=PAIRS,
    cells=None,
    above="",
    below="",
    decimal=".",
    end="",
    newline="\n",
):
    """An export: lines above, names, a row for each pair of `cells(theta_i, theta_o, phi, f)`, lines below."""
    cells = cells or (lambda i, o, phi, f: (i, o, phi, f))
    rows = [cells(i, o, phi, truth(i, o, phi)) for i, o, phi in pairs]
    lines = [names, *([x if isinstance(x, str) else f"{x:.10g}".replace(".", decimal) for x in row] for row in rows)]
    text = above + "".join(separator.join(line) + end + "\n" for line in lines) + below
    return text.replace("\n", newline)


def holds(m, uncertainty=None, factor=1.0):
    """Whether a measurement has the truth in it."""
    for i, o, phi in ((30.0, 25.0, 180.0), (60.0, 70.0, 180.0), (30.0, 40.5, 0.0)):
        np.testing.assert_allclose(at(m, i, 0.0, o, phi), factor * truth(i, o, phi), rtol=1e-9)
    if uncertainty is not None:
        np.testing.assert_allclose(m.uncertainty, uncertainty, rtol=1e-9)
    else:
        assert m.uncertainty is None
    return True


JUNK = """Goniospectrophotometer GSP-7, firmware 2.11
Operator;J. Doe
Date;11.03.2024 14:05
Sample;PTFE, sintered; 50 mm
Detector gain;1;2;3
"""


def with_u(u):
    return lambda i, o, phi, f: (i, o, phi, f, u(f) if callable(u) else u)


FIVE = ("theta_in (deg)", "theta_r (deg)", "dphi (deg)", "BRDF [1/sr]")

GOOD = {
    "junk above, semicolons, decimal commas, expanded uncertainty": (
        table((*FIVE, "U(k=2)"), ";", cells=with_u(0.004), above=JUNK + "\n\n", decimal=","),
        {},
        0.002,
    ),
    "a line of units, tabs, AOI": (
        table(("AOI", "theta_s", "phi", " BRDF"), "\t", above="Instrument\tX\n").replace(
            "BRDF\n", "BRDF\ndeg\tdeg\tdeg\t1/sr\n"
        ),
        {},
        None,
    ),
    "Greek letters and superscripts": (
        table(("θi [°]", "θr [°]", "Δφ [°]", "BRDF [sr⁻¹]", "u(BRDF) [sr⁻¹]"), cells=with_u(0.003)),
        {},
        0.003,
    ),
    "units behind a slash": (table(("theta_i / °", "theta_o / °", "phi / °", "f / sr-1"), ";"), {}, None),
    "zenith and azimuth of sun and viewer": (
        table(("SZA", "VZA", "SAA", "VAA", "BRDF"), cells=lambda i, o, phi, f: (i, o, 20.0, phi + 20.0, f)),
        {},
        None,
    ),
    "trailing delimiters and CRLF": (table(separator=";", end=";;", newline="\r\n"), {}, None),
    "columns that are not needed": (
        table(
            ("No.", "Time", "AOI", "theta_v", "phi", "Signal (V)", "BRDF", "Remarks"),
            cells=lambda i, o, phi, f: ("7", "14:05:02", i, o, phi, 0.1, f, "ok, all well".replace(",", "")),
        ),
        {},
        None,
    ),
    "quoted cells with commas": (
        table(
            ('"Theta_i"', '"Theta_o"', '"phi"', '"f"', '"comment"'), cells=lambda i, o, phi, f: (i, o, phi, f, '"a, b"')
        ),
        {},
        None,
    ),
    "radians in the names": (
        table(
            ("theta_i (rad)", "theta_o (rad)", "phi (rad)", "f"),
            cells=lambda i, o, phi, f: (*(f"{math.radians(x)!r}" for x in (i, o, phi)), f),
        ),
        {},
        None,
    ),
    "radians that an option states": (
        table(cells=lambda i, o, phi, f: (*(f"{math.radians(x)!r}" for x in (i, o, phi)), f)),
        {"angle_unit": "rad"},
        None,
    ),
    "reflectance factors in percent": (
        table(
            ("theta_i", "theta_o", "phi", "R [%]", "u [%]"),
            cells=lambda i, o, phi, f: (i, o, phi, 100 * math.pi * f, 1.5),
        ),
        {"uncertainty": "absolute"},
        0.015,
    ),
    "names in other words, all said": (
        table(("ein", "aus", "dreh", "wert", "unsicher", "T"), cells=lambda i, o, phi, f: (i, o, phi, f, 0.004, 21.0)),
        {
            "columns": {
                "theta_i": "ein",
                "theta_o": "aus",
                "phi": "dreh",
                "brdf": "wert",
                "u_f": "unsicher",
                "ignore": "T",
            },
            "coverage": 2,
        },
        0.002,
    ),
    "no names at all": (table().partition("\n")[2], {"columns": ["theta_i", "theta_o", "phi", "f"]}, None),
    "names behind a number sign": (table(("# theta_i", "theta_o", "phi", "f"), " "), {}, None),
    "columns two blanks apart": (table(("theta_i (deg)", "theta_o (deg)", "phi (deg)", "f (1/sr)"), "   "), {}, None),
    "azimuths from the mirror direction": (
        table(cells=lambda i, o, phi, f: (i, o, (phi + 180.0) % 360.0, f)),
        {"forward": 0},
        None,
    ),
    "signed angles in the plane": (
        table(("AOI", "theta_out", "BRDF"), pairs=IN_PLANE, cells=lambda i, o, phi, f: (i, o, f)),
        {},
        None,
    ),
    "signed angles, the mirror direction positive": (
        table(("AOI", "theta_out", "BRDF"), pairs=IN_PLANE, cells=lambda i, o, phi, f: (i, -o, f)),
        {"forward": 0},
        None,
    ),
    "missing cells of all kinds": (
        table(cells=lambda i, o, phi, f: (i, o, phi, {12.5: "n/a", 0.0: "-"}.get(o, f))),
        {},
        None,
    ),
    "a mark of missing values that is said": (
        table(cells=lambda i, o, phi, f: (i, o, phi, -999.0 if o == 12.5 else "sat" if o == 0.0 else f)),
        {"missing": "-999,sat"},
        None,
    ),
    "words below, and names again": (table(below="theta_i,theta_o,phi,f\n\nend of file\nchecksum ok\n"), {}, None),
    "relative uncertainty": (
        table((*FIVE, "rel. expanded uncertainty (k=2) [%]"), cells=with_u(4.0)),
        {},
        [0.02 * truth(*p) for p in PAIRS],
    ),
    "the quantity in a line above": (table(("AOI", "theta_r", "phi", "550 nm"), above="Quantity: BRDF\n"), {}, None),
    "names in line 13, as said": (table(above="1,2,3,4\n" * 12), {"skip": 12}, None),
    "DSF": (
        table(
            ("theta_i", "theta_o", "phi", "ccBSDF"),
            cells=lambda i, o, phi, f: (i, o, phi, f * math.cos(math.radians(o))),
        ),
        {},
        None,
    ),
}


@pytest.mark.parametrize("name", GOOD)
def test_ugly_exports_load(tmp_path, name):
    text, options, uncertainty = GOOD[name]
    m = gn.load(file_of(tmp_path, text, "export.csv"), **options)
    if isinstance(uncertainty, list):
        uncertainty = np.sort(uncertainty)
        assert np.allclose(np.sort(m.uncertainty.ravel()), uncertainty, rtol=1e-8)
        uncertainty = m.uncertainty
    assert holds(m, uncertainty)
    if "missing" in name:
        assert np.isnan(m.stored).sum() == 18


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path, encoding):
    text = table((*FIVE, "U(k=2)"), ";", cells=with_u(0.004), above="Prüfer;Müller\nProbe;weiß, 23 °C\n", decimal=",")
    assert holds(gn.load(file_of(tmp_path, text.encode(encoding))), 0.002)


def test_spectra_in_columns_with_their_uncertainties(tmp_path):
    names = ("AOI [deg]", "theta_r [deg]", "phi [deg]", "BRDF 450 nm", "U (k=2)", "BRDF 0.55 µm", "U (k=2)")
    m = gn.load(file_of(tmp_path, table(names, ";", cells=lambda i, o, phi, f: (i, o, phi, f, 0.002, f / 2, 0.006))))
    assert m.channel_names == (450.0, 550.0)
    np.testing.assert_allclose(at(m, 30.0, 0.0, 25.0, 180.0), np.array([1.0, 0.5]) * truth(30.0, 25.0, 180.0))
    np.testing.assert_allclose(m.uncertainty.reshape(-1, 2), [[0.001, 0.003]] * len(PAIRS))


def test_rows_of_one_wavelength_each(tmp_path):
    one = table(("AOI", "theta_r", "phi", "lambda (um)", "BRDF"), cells=lambda i, o, phi, f: (i, o, phi, 0.45, f))
    two = table(("AOI", "theta_r", "phi", "lambda (um)", "BRDF"), cells=lambda i, o, phi, f: (i, o, phi, 0.65, f))
    m = gn.load(file_of(tmp_path, one + two.partition("\n")[2]))
    assert m.channel_names == (450.0, 650.0)


def test_colours(tmp_path):
    names = ("AOI", "theta_r", "phi", "R", "G", "B")
    text = table(names, cells=lambda i, o, phi, f: (i, o, phi, f, f, f))
    with pytest.raises(
        FormatError, match=r"column 'R' can be brdf \(f\) or reflectance factor .* say quantity='brdf' or"
    ):
        gn.load(file_of(tmp_path, text))
    assert gn.load(file_of(tmp_path, text), quantity="brf").channel_names == ("R", "G", "B")


def test_a_workbook(tmp_path):
    rows = [["PTFE"], [], [None, "AOI [°]", "theta_r [°]", "dphi [°]", "BRDF [1/sr]", "U(k=2)", "Remarks"]]
    rows += [[None, i, o, phi, truth(i, o, phi), 0.004, "ok"] for i, o, phi in PAIRS]
    data = workbook({"Setup": [["Instrument", "GSP-7"]], "Data": rows})
    file_of(tmp_path, data, "a.xlsx")
    with pytest.raises(ParameterError, match=r"2 sheets, 'Setup', 'Data'; say which: sheet='Setup'"):
        gn.load(tmp_path / "a.xlsx")
    m = gn.load(tmp_path / "a.xlsx", sheet="Data")
    assert holds(m, 0.002) and m.provenance["options"] == {"sheet": "Data"}
    assert m == gn.load(tmp_path / "a.xlsx", sheet=2)
    for asked in ("data", 3):
        with pytest.raises(ParameterError, match="expected one of 'Setup', 'Data', or a number from 1 to 2"):
            gn.load(tmp_path / "a.xlsx", sheet=asked)
    with pytest.raises(FormatError, match="not a workbook that can be read"):
        gn.load(file_of(tmp_path, data[:3000], "b.xlsx"))


BLOCK = "AOI = {}\n" + table(pairs=[(30.0, 0.0, 0.0), (30.0, 40.5, 0.0)])

BAD = {
    "unknown names": (
        table(("ein", "aus", "phi", "wert")),
        {},
        r"line 1: column names 'ein', .*only 'phi' is known.*columns=",
    ),
    "one unknown name": (
        table(("theta_i", "theta_o", "drehung", "f")),
        {},
        r"column 'drehung' is not known.*\"ignore\"",
    ),
    "no names": (
        table().partition("\n")[2],
        {},
        r"begins with numbers in line 1.*columns=\[...\], a name for each of 4",
    ),
    "too few names said": (
        table().partition("\n")[2],
        {"columns": ["theta_i", "f"]},
        r"none of|got 4 numbers.*expected 2, one for each of columns=",
    ),
    "U without k": (
        table((*FIVE, "U"), cells=with_u(0.004)),
        {},
        r"column 'U': a standard uncertainty, or an expanded.*coverage=2",
    ),
    "uncertainty of unknown kind": (
        table((*FIVE, "Uncertainty"), cells=with_u(0.004)),
        {},
        "coverage=1 for a standard",
    ),
    "two coverage factors": (
        table((*FIVE, "U(k=2)"), cells=with_u(0.004)),
        {"coverage": 3},
        r"says k = 2; leave the option out",
    ),
    "R": (
        table(("theta_i", "theta_o", "phi", "R")),
        {},
        r"'R' can be reflectance factor .* or brdf .*quantity='reflectance factor'",
    ),
    "reflectance": (
        table(("theta_i", "theta_o", "phi", "Reflectance")),
        {},
        r"quantity='reflectance factor' or quantity='brdf'",
    ),
    "a wavelength without a quantity": (table(("theta_i", "theta_o", "phi", "550 nm")), {}, "say quantity='brdf' or"),
    "percent twice": (
        table(("theta_i", "theta_o", "phi", "R [%]", "u [%]"), cells=with_u(1.0)),
        {},
        "uncertainty='relative' or uncertainty='absolute'",
    ),
    "BRDF in percent": (table(("theta_i", "theta_o", "phi", "BRDF [%]")), {}, "'BRDF \\[%\\]' can be brdf"),
    "theta alone": (
        table(("theta", "AOI2", "phi", "f")),
        {},
        "column names 'theta', 'AOI2'|column 'theta' can be theta_i|not known",
    ),
    "a detector angle": (
        table(("theta_i", "Detector angle", "phi", "f")),
        {},
        r"can be theta_o \(angle from the normal\) or radial .*columns=\{'theta_o'",
    ),
    "phi_s alone": (
        table(("theta_i", "theta_s", "phi_s", "f")),
        {},
        r"'phi_s' has two readings.*forward=0 or forward=180",
    ),
    "one side, no azimuth": (
        table(("AOI", "theta_r", "f"), cells=lambda i, o, phi, f: (i, o, f)),
        {},
        "no column of an azimuth.*forward=180.*forward=0",
    ),
    "an incidence in the header only": (
        table(("theta_r", "phi", "BRDF"), above="Angle of incidence: 45 deg\n", cells=lambda i, o, phi, f: (o, phi, f)),
        {},
        r"states it: columns=\{\"theta_i\": 45\} \(-O columns.theta_i=45\)",
    ),
    "radians unsaid": (
        table(cells=lambda i, o, phi, f: (*(math.radians(x) for x in (i, o, phi)), f)),
        {},
        "radians, or degrees.*angle_unit='rad'",
    ),
    "micrometres unsaid": (
        table(("theta_i", "theta_o", "phi", "wavelength", "f"), cells=lambda i, o, phi, f: (i, o, phi, 0.55, f)),
        {},
        "wavelength_unit='um'",
    ),
    "decimal commas between commas": (
        table(decimal=","),
        {},
        r"line 2: got .*decimal commas between commas cannot be told apart: export with semicolons",
    ),
    "thousands": (
        table(separator=";", cells=lambda i, o, phi, f: (i, o, phi, f"{1 + round(9 * f)},125"))
        .replace("12.5", "12")
        .replace("40.5", "40"),
        {},
        r"is the comma the decimal sign, or does it part thousands\? say decimal=','",
    ),
    "points and commas": (
        table(separator=";", cells=lambda i, o, phi, f: (i, o, phi, f"{f:.4f}".replace(".", ","))),
        {},
        "beside '12.5'.*decimal=",
    ),
    "a unit in a cell": (
        table(cells=lambda i, o, phi, f: (f"{i:g}°", o, phi, f)),
        {},
        "line 2: got '0°' in the column 'theta_i'.*unit stands in",
    ),
    "an unknown word": (
        table(cells=lambda i, o, phi, f: (i, o, phi, "OVER" if o == 70 else f)),
        {},
        r"line 14: got 'OVER' in the column 'f'.*missing='OVER'",
    ),
    "a mark of missing values": (
        table(cells=lambda i, o, phi, f: (i, o, phi, -999 if o == 70 else f)),
        {},
        r"line 14: -999 in the column 'f', in 9 rows.*missing=-999",
    ),
    "several tables": (BLOCK.format(30) + BLOCK.format(45), {}, "line 5: .*several tables in one file"),
    "a cross table": (
        "theta_o\\theta_i,0,15,30\n0,0.31,0.31,0.3\n10,0.31,0.31,0.3\n",
        {},
        "columns are named by numbers.*one row for each pair",
    ),
    "wavelengths without a unit": (
        table(("theta_i", "theta_o", "phi", "450", "550"), cells=lambda i, o, phi, f: (i, o, phi, f, f)),
        {},
        "columns are named by numbers, theta_i, theta_o, phi, 450, 550; .* wavelengths need their unit, '450 nm'",
    ),
    "two incidences": (
        table(("AOI", "theta_i", "phi", "f")),
        {},
        r"column theta_i twice: column 'AOI' is theta_i too.*ignore",
    ),
    "two columns of values": (
        table(("theta_i", "theta_o", "BRDF", "f")),
        {},
        r"column f twice|one column or one per channel.*ignore",
    ),
    "counts only": (
        table(("theta_i", "theta_o", "phi", "Signal (V)")),
        {},
        "column names 'theta_i'.*an angle and a value at least",
    ),
    "a missing angle": (
        table(cells=lambda i, o, phi, f: (i, "" if o == 70 else o, phi, f)),
        {},
        "line 14, column 'theta_o': an angle is no number",
    ),
    "cut short": (table().rpartition(",")[0], {}, "line 46: got .* expected 4 numbers"),
    "a quotation mark left open": (
        table().replace("30,12.5", '"30,12.5', 1),
        {},
        r"line 20: got .*closed quotation marks",
    ),
    "words alone": ("dear diary\n", {"skip": 1}, "none of the first 400 lines behind the first 1 holds two numbers"),
    "a column that is not there": (
        table(),
        {"columns": {"theta_i": "AOI"}},
        "there is no such column.*line 1 names 'theta_i', 'theta_o'",
    ),
    "a meaning that is none": (
        table(),
        {"columns": {"theta_x": "theta_i"}},
        "columns: 'theta_x': expected one of theta_i",
    ),
    "options of text for a workbook": (table(), {"sheet": "Data"}, "sheet='Data': no option to read CSV files"),
    "conflicting units": (
        table(("theta_i (deg)", "theta_o (deg)", "phi (deg)", "f")),
        {"angle_unit": "rad"},
        "says deg; leave the option out",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_ugly_exports_are_refused_with_a_cure(tmp_path, name):
    text, options, says = BAD[name]
    with pytest.raises((FormatError, ParameterError)) as error:
        gn.load(file_of(tmp_path, text, "export.csv"), **options)
    assert re.search(says, str(error.value)), error.value


SUSPICIOUS = {
    "percent": (
        table(("theta_i", "theta_o", "phi", "BRF"), cells=lambda i, o, phi, f: (i, o, phi, 300 * f)),
        "percent.*value_unit='%'",
    ),
    "a reflectance factor": (
        table(cells=lambda i, o, phi, f: (i, o, phi, math.pi * f)),
        "as if a surface reflected .* of the light.*quantity='reflectance factor'",
    ),
    "relative uncertainties": (table((*FIVE, "u"), cells=with_u(2.0)), "uncertainty='relative'"),
    "a turned azimuth": (
        table(cells=lambda i, o, phi, f: (i, o, (phi + 180.0) % 360.0, f**4)),
        r"near the direction of the light.*forward=0",
    ),
}


@pytest.mark.parametrize("name", SUSPICIOUS)
@pytest.mark.filterwarnings("ignore:.*times the light")  # percent taken for shares, of which it warns too
def test_what_looks_wrong_is_said(tmp_path, name):
    text, says = SUSPICIOUS[name]
    with pytest.warns(MeaningWarning, match=says):
        gn.load(file_of(tmp_path, text, "export.csv"))


def test_one_incidence_that_the_reader_states(tmp_path):
    above = "Angle of incidence: 30 deg\n"
    text = table(("theta_r", "phi", "BRDF"), above=above, pairs=PAIRS[15:30], cells=lambda i, o, phi, f: (o, phi, f))
    m = gn.load(file_of(tmp_path, text), columns={"theta_i": 30})
    np.testing.assert_allclose(at(m, 30.0, 0.0, 25.0, 180.0), truth(30.0, 25.0, 180.0))
    assert m.about["columns"]["(said)"] == "theta_i: polar angle of the light, of all rows [deg]"


def test_a_spectrum_without_angles_is_no_table_of_directions(tmp_path):
    m = gn.load(file_of(tmp_path, "wavelength (nm);reflectance\n400;0.3\n500;0.3\n"))
    assert m.format == "reflectance spectrum"


def test_a_comma_is_what_is_said(tmp_path):
    path = file_of(tmp_path, "theta_i;theta_o;phi;dsf\n30;20;180;1,125\n30;40;180;2,125\n")
    with pytest.warns(MeaningWarning, match="percent"):
        assert gn.load(path, decimal=",").stored.ravel().tolist() == [1.125, 2.125]
        assert gn.load(path, decimal=".").stored.ravel().tolist() == [1125.0, 2125.0]


def test_what_was_understood_is_kept(tmp_path):
    text = table(
        (*FIVE, "Unc."), ";", cells=with_u(0.004), above=JUNK + "Uncertainties are expanded, coverage factor k = 2\n"
    )
    m = gn.load(file_of(tmp_path, text, "export.csv"))
    assert holds(m, 0.002)
    assert m.about["columns"]["theta_in (deg)"] == "theta_i: polar angle of the light [deg]"
    assert m.about["columns"]["Unc."] == "expanded uncertainty, k = 2: divided by 2 [1/sr]"
    assert m.about["text"][0].startswith("Goniospectrophotometer")
    assert "coverage factor is that of the line 'Uncertainties are" in m.about["understood"][0]


def test_a_long_header_is_read_past_what_is_looked_at_first(tmp_path):
    assert holds(gn.load(file_of(tmp_path, table(above="Lamp voltage log: steady, no drift\n" * 300))))
