"""Conversion, provenance, options, and what every writer has to do: new formats enter by being there."""

import functools
import json
import math
import os
import re

import numpy as np
import pytest
from libraries import thinned
from seeds import SEEDS

import gonio as gn
from gonio import files
from gonio.base.angles import lattice_pairs
from gonio.base.reradiation import exchanges
from gonio.cli.convert import conversion_as_text
from gonio.cli.info import facts_as_text
from gonio.conversion import comparison, conversion
from gonio.errors import Error, FluorescenceWarning, ParameterError
from gonio.facts.format_table import format_table
from gonio.facts.material import facts
from gonio.formats import formats, load, merl, rgl, save, writer
from gonio.formats._options import of_texts
from gonio.formats.merl import MERL
from gonio.pictures.colour import RELATIVE_XYZ, XYZ, rgb_of
from gonio.tables.gridded import Gridded

WRITERS = {m.NAME: m for m in formats() if hasattr(m, "write") and m.write.__annotations__["m"] == "Reflectance"}
OWN = {m.NAME: m for m in formats() if hasattr(m, "write") and m.NAME not in WRITERS}
NEEDED = {"pab-opto": {"incident": (0.5, 0.0)}}
"""Options without which a format cannot be written."""
COARSE = {"WINDOW XML": 0.1, "BRF table": 0.1, "OpenMATERIAL": 0.1}
"""Mean errors of formats whose cells or rows are wide; 0.05 of others."""
pytestmark = pytest.mark.usefixtures("one_probe")
each_writer = pytest.mark.parametrize("module", WRITERS.values(), ids=WRITERS)
LARGE = {"CSAIL", "SCATFUN"}  # of a million values, whatever is written
ELSEWHERE = {"ASTM", "BiRD", "MERL", "netCDF", "RGL", "WINDOW XML", "Zarr", "Zemax"}
"""Formats whose files `test_round_trips.py` compares with materials."""

UP = np.array([0.0, 0.0, 1.0])
GRAY = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5))
RGB = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5))
GREEN = gn.material("gold", wavelengths=[550.0]).replace({"distribution.alpha": 0.4})


TABLE, STEP = {"resolution": (4, 4, 6)}, {"step": 30.0}
SMALL = {
    **dict.fromkeys(("ALTA", "ASTM", "CSV", "netCDF", "SSDD", "Zarr"), TABLE),
    **dict.fromkeys(("LightTools", "Speos", "Zemax"), STEP),
    "CSAIL": {"resolution": (4, 4, 6, 1)},
    "KAIST": {"resolution": (5, 5, 5)},
    "RGL": {"resolution": 8, "theta_i": 3},
    "SCATFUN": {"nodes": 8},
}
"""Options of files whose content does not matter."""


def held_by(module, path, how=gn.convert, **options):
    """What of the test's materials the format holds, written to `path`: color, else gray, else one wavelength."""
    for m in (RGB, GRAY, GREEN):
        try:
            return m, how(m, path, module.NAME, **NEEDED.get(module.NAME, {}), **options)
        except ParameterError as error:
            refused = error
    raise refused


@pytest.fixture
def few_albedos(monkeypatch):
    """Where a report's albedos do not matter, few are compared, roughly."""
    monkeypatch.setattr(comparison, "ALONG", 3)
    monkeypatch.setattr(comparison, "TOLERANCES", (1e-2, 1e-2))


@pytest.fixture(params=["f", pytest.param("albedo", marks=pytest.mark.full)])
def compared(request, few_albedos, monkeypatch):
    """Reports compare f alone, which takes a third of the time, or albedos as well."""
    if request.param == "f":
        compare_no_albedos(monkeypatch)


def compare_no_albedos(monkeypatch):
    monkeypatch.setattr(comparison, "_albedo_change", lambda *_: (0.0, (0.0, 0.0)))


def content(path):
    """The bytes of a file, or of the files in a folder."""
    files_of = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    return {p.relative_to(path): p.read_bytes() for p in files_of}


def in_rgb(m, f):
    return f @ rgb_of(m.channel_names) if m.channel_names in (XYZ, RELATIVE_XYZ) else f


# Every format that can be written.


@pytest.mark.parametrize(
    "module",
    [pytest.param(m, marks=pytest.mark.full if name in LARGE | ELSEWHERE else ()) for name, m in WRITERS.items()],
    ids=WRITERS,
)
@pytest.mark.usefixtures("compared")
def test_a_material_survives_the_round_trip(module, tmp_path):
    path = tmp_path / f"a{module.SUFFIXES[0]}"
    m, report = held_by(module, path)
    again = load(path)
    assert report.error is not None and report.format == module.NAME
    wi, wo = lattice_pairs(500, 0.3)
    if module.NAME in NEEDED:
        wi = np.broadcast_to(gn.direction(*NEEDED[module.NAME]["incident"]), wi.shape)  # a file holds one
    else:
        assert report.error.mean < COARSE.get(module.NAME, 0.05), report.error
    true, found = np.broadcast_arrays(*(in_rgb(x, x.f(wi, wo).reshape(500, -1)) for x in (m, again)))
    known = np.isfinite(found)
    off = np.abs(found - true)[known] / np.abs(true[known])
    assert known.mean() > 0.9
    assert off.mean() <= 2.0 * report.error.mean + 1e-9 and off.max() <= 1.5 * report.error.largest + 1e-9
    # What was read is written again without loss.
    save(again, tmp_path / f"b{module.SUFFIXES[0]}", module.NAME)
    twice = load(tmp_path / f"b{module.SUFFIXES[0]}")
    np.testing.assert_array_equal(twice.f(wi, wo), again.f(wi, wo))


@each_writer
def test_an_interrupted_write_leaves_the_old_file(module, tmp_path, monkeypatch):
    path = tmp_path / f"a{module.SUFFIXES[0]}"
    small = SMALL.get(module.NAME, {})
    m, _ = held_by(module, path, save, **small)
    before = content(path)

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "replace", full)  # all is written, but not yet in place
    monkeypatch.setattr(files, "_exchanged", full)
    with pytest.raises(OSError, match="No space left"):
        save(m, path, module.NAME, **NEEDED.get(module.NAME, {}), **small)
    assert content(path) == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@each_writer
def test_what_the_format_cannot_hold_is_an_error(module, tmp_path):
    path = tmp_path / f"a{module.SUFFIXES[0]}"
    maps = gn.Lambertian(np.full((2, 2, 3), 0.5))
    for m in (maps, gn.IdealSpecular(0.5) + gn.Lambertian([0.1, 0.2, 0.3, 0.4])):
        try:
            save(m, path, module.NAME)
        except Error as error:
            assert str(error)
            assert not path.exists()
        else:
            assert load(path) == m  # it can hold them


@pytest.mark.parametrize("module", OWN.values(), ids=OWN)
def test_formats_of_one_kind_refuse_others(module, tmp_path):
    with pytest.raises(ParameterError, match="expected a"):
        save(GRAY, tmp_path / "a", module.NAME)
    assert not (tmp_path / "a").exists()


@each_writer
def test_unknown_options_are_named(module, tmp_path):
    with pytest.raises(ParameterError, match=f"colour='red': no option to write {module.NAME} files"):
        save(GRAY, tmp_path / "a", module.NAME, colour="red")
    assert not (tmp_path / "a").exists()


# Names of formats.


def test_formats_are_named_in_any_case_or_by_their_own_suffix():
    assert writer("a.binary") is merl and writer("a", "merl") is merl and writer("a", ".BINARY") is merl
    assert writer("a.bsdf", "rgl") is rgl
    with pytest.raises(ParameterError, match=r"'\.bsdf' .* give format= \(on the command line --format\) .*'RGL'"):
        writer("a.bsdf")
    with pytest.raises(ParameterError, match=r"format='bsdf': expected one of .*'RGL'"):
        writer("a", "bsdf")
    with pytest.raises(ParameterError, match=r"'\.xyz' does not say which format.*'MERL' \(\.binary\)"):
        writer("a.xyz")


def test_options_of_the_command_line_are_read():
    texts = ["resolution=64", "theta-i=9", "phi_i=none"]
    assert of_texts(rgl, "write", texts) == {"resolution": 64, "theta_i": 9, "phi_i": None}
    with pytest.raises(ParameterError, match="expected name=value"):
        of_texts(rgl, "write", ["resolution"])
    with pytest.raises(ParameterError, match="resolution is given twice"):
        of_texts(rgl, "write", ["resolution=8", "resolution=9"])
    with pytest.raises(ParameterError, match="--option 'phi_d=18_0': expected 180 or 360"):
        of_texts(merl, "write", ["phi_d=18_0"])
    with pytest.raises(ParameterError, match="no option to write MERL files; expected one of phi_d"):
        of_texts(merl, "write", ["resolution=3,4"])


# Provenance.


def test_provenance_is_that_of_the_bytes_that_were_read(tmp_path):
    path = tmp_path / "flat.binary"
    save(gn.Lambertian(0.5), path)
    m = load(path)
    assert m.provenance == {
        "file": "flat.binary",
        "bytes": 34_992_012,
        "sha256": m.provenance["sha256"],
        "format": "MERL",
        "gonio": gn.__version__,
    }
    assert len(m.provenance["sha256"]) == 64
    assert json.loads(m.data.attrs["provenance"]) == m.provenance
    assert m.replace(interpolation="nearest").provenance == m.provenance
    assert MERL(m.raw).provenance == {} and "provenance" not in MERL(m.raw).data.attrs


def test_the_digest_is_sha256(tmp_path):
    """Of "abc": FIPS 180-2, appendix B.1."""
    from gonio.base import provenance

    path = tmp_path / "abc"
    path.write_bytes(b"abc")
    m = MERL(np.ones((3, 90, 90, 180)))
    m = provenance.noted(m, provenance.of_file(path, "none", {"side": "front", "basis": (1, 2)}))
    assert m.provenance["sha256"] == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert m.provenance["options"] == {"side": "front", "basis": "(1, 2)"}


def test_provenance_is_a_chain(tmp_path):
    save(GRAY, tmp_path / "a.bsdf", "RGL", resolution=8, theta_i=3)
    first = load(tmp_path / "a.bsdf")
    save(first, tmp_path / "b.bsdf", "RGL", resolution=6, theta_i=3)
    second = load(tmp_path / "b.bsdf").provenance
    assert second["converted_from"]["sha256"] == first.provenance["sha256"]
    assert gn.expression(second["converted_from"]["converted_from"]["material"]) == GRAY


def test_unknown_options_of_readers_are_named(tmp_path):
    save(GRAY, tmp_path / "a.json")
    with pytest.raises(ParameterError, match="side='front': no option to read gonio JSON files; expected none"):
        load(tmp_path / "a.json", side="front")


# Reports.


def densest_albedo_change(m, made, step, last=80.0):
    w = gn.direction(np.radians(np.arange(0.0, last + 0.1, step)), 0.3)
    before, after = (gn.albedo(x, w).reshape(len(w), -1) for x in (m, made))
    return np.abs(after - before).max()


@pytest.mark.parametrize("step", thinned([1.25, 0.5], [1.25]))
def test_the_report_says_what_was_measured(step, tmp_path, monkeypatch):
    report = gn.convert(RGB, tmp_path / "a.bsdf", "RGL", resolution=16, theta_i=7)
    wi, wo = lattice_pairs(comparison.PAIRS)
    off = np.abs(report.made.f(wi, wo) / RGB.f(wi, wo) - 1.0)
    assert report.error.mean == pytest.approx(off.mean())
    assert off.max() <= report.error.largest < 1.5 * off.max()
    assert report.error.high == pytest.approx(np.quantile(off, 0.99))
    theta_i, theta_o, phi = report.error.at
    again = np.abs(report.made.f_angles(theta_i, 0.0, theta_o, phi) / RGB.f_angles(theta_i, 0.0, theta_o, phi) - 1.0)
    assert again.max() == pytest.approx(report.error.largest, rel=1e-6)
    assert report.error.albedo == pytest.approx(densest_albedo_change(RGB, report.made, step), rel=0.05)
    assert list(report.lost) == ["formula", "mueller"] and report.gained == {}
    compare_no_albedos(monkeypatch)
    finer = gn.convert(RGB, tmp_path / "a.bsdf", "RGL", resolution=32, theta_i=13)
    assert finer.error.mean < 0.5 * report.error.mean
    held = json.loads(json.dumps(report.to_json()))
    assert held["error"]["mean"] == report.error.mean and "made" not in held


def test_what_a_model_loses_in_its_own_format_is_nothing(tmp_path):
    report = gn.convert(RGB, tmp_path / "a.json")
    assert report.error[:4] == (0.0, 0.0, 0.0, 0.0) and report.lost == {} and report.made == RGB
    assert "none" in conversion_as_text(report) and "nothing else" in conversion_as_text(report)


@pytest.mark.usefixtures("few_albedos")
def test_losses_are_listed(tmp_path):
    theta, phi = np.radians([0.0, 30.0, 60.0]), np.radians([0.0, 90.0, 180.0, 270.0])
    values = np.full((3, 3, 4), 0.2)
    values[1, 1] = np.nan
    m = Gridded(
        "angles",
        {"theta_i": theta, "theta_o": theta, "phi": phi},
        values,
        uncertainty=0.01 * values,
        outside="missing",
        about={"operator": "A. Person"},
    )
    report = gn.convert(m, tmp_path / "a.bsdf", "RGL", resolution=8, theta_i=4)
    assert set(report.lost) == {"holes", "uncertainty", "metadata"}
    assert report.lost["metadata"] == "operator" and set(report.gained) == {"channels"}
    assert report.error.mean < 0.2
    assert "one became 3" in conversion_as_text(report) and "operator" in str(report)


def grid(step, last=85.0, m=GRAY):
    theta, phi = np.radians(np.arange(0.0, last + 0.1, step)), np.radians(np.arange(0.0, 360.0, 2.0 * step))
    at = np.meshgrid(theta, theta, phi, indexing="ij")
    axes = {"theta_i": theta, "theta_o": theta, "phi": phi}
    return gn.Gridded("angles", axes, m.f_angles(at[0], 0.0, at[1], at[2]))


@pytest.mark.parametrize(("step", "pairs"), thinned([(1.25, 1 << 16), (0.5, 1 << 18)], [(1.25, 1 << 16)]))
def test_changes_are_found_between_the_nodes(step, pairs, tmp_path):
    """At the incidences of old probes, every 20 degrees, the file's nodes are the source's."""
    m, path = grid(7.5, 82.5), tmp_path / "a.bsdf"
    error = gn.convert(m, path, "Zemax").error
    true = densest_albedo_change(m, gn.load(path), step, 82.5)
    assert 0.8 * true < error.albedo < 1.05 * true
    wi, wo = lattice_pairs(pairs)
    off = np.abs(gn.load(path).f(wi, wo) / m.f(wi, wo) - 1.0)
    assert np.nanmax(off) <= 1.2 * error.largest
    assert math.degrees(error.albedo_at[0]) <= 82.5 + 1e-9


@pytest.mark.parametrize("format", ["RGL", "Zemax", "LightTools", "Integra", "ASTM", "CSV"])
def test_a_measurement_keeps_its_incidences(format, tmp_path):
    theta = np.radians([0.0, 8.0, 23.0, 45.0])
    axes = {"theta_i": theta, "radial": np.radians([0.0, 5.0, 40.0, 100.0]), "azimuth": np.radians([0.0, 90.0, 180.0])}
    about_the_mirror = gn.Gridded("specular", axes, np.full((4, 4, 3), 0.2), mirrored=True)
    gn.save(about_the_mirror, tmp_path / "a", format)
    nodes = load(tmp_path / "a").axes["theta_i"]
    assert len(nodes) == len(theta) or format == "RGL"  # which has others beside them
    np.testing.assert_allclose(np.abs(np.subtract.outer(nodes, theta)).min(axis=0), 0.0, atol=1e-6)


@pytest.mark.usefixtures("few_albedos")
@pytest.mark.parametrize("count", thinned([12, 31], [12]))
def test_files_without_names_of_channels_are_compared_in_order(count, tmp_path):
    """ALTA keeps none: of many wavelengths nothing but their names is lost."""
    m = gn.material("gold", wavelengths=[*np.linspace(400.0, 700.0, count)]).replace({"distribution.alpha": 0.4})
    report = gn.convert(m, tmp_path / "a.alta", "ALTA", resolution=(9, 9, 18))
    assert report.error.mean < 0.05 and set(report.lost) == {"formula", "channels", "mueller"}
    unnamed = gn.convert(gn.Lambertian(np.linspace(0.1, 0.9, count)), tmp_path / "a.csv")
    assert unnamed.error.mean < 1e-12 and set(unnamed.lost) == {"formula"}


@pytest.mark.parametrize(
    "format", thinned(["CSV", "ASTM", "BiRD", "ALTA", "netCDF", "SSDD"], ["CSV", "ASTM", "netCDF"])
)
@pytest.mark.usefixtures("few_albedos")
@pytest.mark.parametrize("count", thinned([12, 300], [12]))
def test_what_no_angle_changes_takes_few_nodes(format, count, tmp_path):
    class Spectrum(gn.Lambertian):
        channel_names = tuple(np.linspace(350.0, 2500.0, count).tolist())

    report = gn.convert(Spectrum(np.linspace(0.1, 0.9, count)), tmp_path / "a", format)
    assert report.made.valid.size <= count * (2 * 2 * 36 if format == "netCDF" else 2**3)  # as some pairs are below
    assert report.error.largest < 1e-9 and report.error.albedo < 1e-3


def test_holes_that_open_are_reported(tmp_path):
    report = gn.convert(gn.Lambertian(0.5), tmp_path / "a.binary")
    assert "data" in report.lost and "have none now" in report.lost["data"]
    assert "beyond the file's nodes" in report.lost["data"]


def test_holes_of_negative_values_have_a_cause_and_a_cure(tmp_path, monkeypatch):
    compare_no_albedos(monkeypatch)
    f = np.where(np.random.default_rng(1).random((18, 18, 36)) < 0.03, -0.1, 0.03)
    m = grid(5.0).with_brdf(f)
    lost = gn.convert(m, tmp_path / "a.binary").lost["data"]
    assert re.search(r"; (2\.\d|3(\.\d)?) % of the values are negative", lost) and "remove_negatives(m)" in lost
    mended = gn.convert(gn.repair.remove_negatives(m), tmp_path / "a.binary").lost["data"]
    assert "negative" not in mended and "beyond the file's nodes" in mended


@pytest.mark.parametrize(
    ("before", "after", "pairs"),
    [
        (None, None, ([0], [0])),
        (None, ("R", "G", "B"), ([0], [0, 1, 2])),
        (("R", "G", "B"), ("B", "R"), ([0, 2], [1, 0])),
        ((450.0, 550.0), (550.0000001, 650.0), ([1], [0])),
        (("X", "Y", "Z"), ("a", "b", "c"), None),
    ],
)
def test_channels_are_compared_by_name(before, after, pairs):
    assert conversion._common(before, after) == pairs


def test_a_changed_file_is_seen():
    """The comparison sees one channel that is a hundredth brighter, and where nothing can be compared."""
    changed = gn.Lambertian([0.5, 0.505, 0.5])
    error = comparison.resampling_error(gn.Lambertian([0.5, 0.5, 0.5]), changed)
    assert error.largest == pytest.approx(0.01) and error.albedo == pytest.approx(0.005, rel=1e-3)
    assert error.mean == pytest.approx(0.01 / 3.0)
    empty = Gridded(
        "angles",
        {"theta_i": [0.1], "theta_o": [0.1], "phi": [0.0]},
        np.full((1, 1, 1), np.nan),
    )
    assert math.isnan(comparison.resampling_error(gn.Lambertian(0.5), empty).mean)


# What people see.


def test_facts_of_a_table():
    theta, phi = np.radians([0.0, 30.0, 80.0]), np.radians(np.arange(0.0, 360.0, 45.0))
    values = 0.2 + 0.1 * np.sin(phi) * np.sin(theta)[:, None] * np.sin(theta)[:, None, None]
    values = np.repeat(values[..., None], 2, axis=-1)
    values[0, 0, 0] = [np.nan, -1.0]
    m = Gridded(
        "angles",
        {"theta_i": theta, "theta_o": theta, "phi": phi},
        values,
        quantity="brdf * cos(theta_o)",
        uncertainty=np.abs(0.05 * values),
        channels=(450.0, 550.0),
        about={"operator": "A. Person"},
    )
    found = facts("sample", m)
    assert found["axes"]["theta_o"] == {"nodes": 3, "low": 0.0, "high": pytest.approx(80.0), "step": None}
    assert found["axes"]["phi"]["step"] == pytest.approx(45.0)
    assert found["missing"] == pytest.approx(1 / 144) and found["negative"] == pytest.approx(1 / 143)
    assert found["uncertainty"]["median"] == pytest.approx(0.05)
    assert found["symmetry"]["isotropic"]["high"] == 0.0 and found["symmetry"]["plane-symmetric"]["high"] > 0.1
    assert found["channel_names"] == [450.0, 550.0]
    text = facts_as_text(found)
    for words in ("polar angles and azimuths", "3 nodes from 0° to 80°, uneven", "8 nodes from 0° to 315°, every 45°",
                  "brdf * cos(theta_o)", "A. Person", "5 % of the value", "450, 550 nm"):  # fmt: skip
        assert words in text, words
    json.dumps(found)


def test_facts_of_files_that_keep_their_numbers_in_other_shapes(tmp_path):
    for name, negative in (("MCD43A1", None), ("SCATFUN", None), ("WINDOW XML tree", 0.0)):
        (tmp_path / "file").write_bytes(SEEDS[name]())
        found = facts("file", load(tmp_path / "file"), computed=False)
        assert found["negative"] == negative and ("negative" in facts_as_text(found)) == (negative is not None)
    tree = load(tmp_path / "file")
    below = tree.replace(values=-tree.values)
    assert facts("file", below, computed=False)["negative"] == pytest.approx((tree.values > 0.0).mean())


def test_facts_of_a_file(tmp_path):
    save(GRAY, tmp_path / "a.bsdf", "RGL", resolution=16, theta_i=7)
    m = load(tmp_path / "a.bsdf")
    found = facts("a.bsdf", m)
    assert found["format"] == "RGL" and found["axes"]["theta_i"]["nodes"] == 7
    assert found["symmetry"]["isotropic"]["high"] == 0.0
    assert 0.0 < found["symmetry"]["reciprocal"]["median"] < 0.05
    text = facts_as_text(found)
    assert m.provenance["sha256"] in text and f"{GRAY!r}, by gonio" in text


def test_the_table_of_formats():
    rows = {row.name: row for row in format_table()}
    assert set(rows) == {module.NAME for module in formats()}
    assert rows["RGL"].sampled and rows["MERL"].sampled and rows["gonio JSON"].sampled is None
    assert list(rows["RGL"].write_options) == ["resolution", "theta_i", "phi_i"]
    for row in rows.values():
        assert row.description and row.oracle and all(s.startswith(".") for s in row.suffixes), row.name


def test_own_suffixes_belong_to_one_format():
    """Otherwise `save` could not tell, and has to be told: SHARED_SUFFIX = True in all of them but one."""
    own = [s for row in format_table() if row.written and not row.shared_suffix for s in row.suffixes]
    assert len(own) == len(set(own))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "ALONG", 3)
        patch.setattr(comparison, "TOLERANCES", (1e-2, 1e-2))
        return gn.convert(GRAY, tmp_path_factory.mktemp("written") / "a.bsdf", "RGL", resolution=8, theta_i=3)


@pytest.mark.skipif(os.name == "nt", reason="needs a terminal of a known width")
@pytest.mark.parametrize("width", [80, 120])
def test_tables_fit_the_terminal(width, monkeypatch, written):
    from gonio.cli import formats, tables

    monkeypatch.setattr(tables, "_width", lambda: width)
    shown = [facts_as_text(facts("a.bsdf", written.made)), conversion_as_text(written)]
    shown.append(formats.formats_as_text(format_table()))
    for line in "\n".join(shown).splitlines():
        assert len(line.replace("\x1b[1m", "").replace("\x1b[0m", "")) <= width + 4, line  # a digest is not cut


INK = gn.Donaldson([[0.2, 0.0], [0.5, 0.6]], wavelengths=[450.0, 550.0])
LOST = r"50% of what arrives at 450 nm, 38% of all that leaves"


@pytest.mark.parametrize("module", [m for m in formats() if hasattr(m, "write")], ids=lambda module: module.NAME)
def test_every_format_says_whether_it_holds_re_radiation(module, tmp_path, monkeypatch):
    """Those that hold it give it back; saving in others, which write nothing here, says how much light is lost."""
    path = tmp_path / f"ink{module.SUFFIXES[0]}"
    if getattr(module, "FLUORESCES", False):
        save(INK, path, module.NAME)
        np.testing.assert_allclose(load(path).reradiation(UP, UP), INK.reradiation(UP, UP), rtol=1e-6)
        return
    monkeypatch.setattr(module, "write", functools.wraps(module.write)(lambda m, path, **options: None))
    with pytest.warns(FluorescenceWarning, match=f"holds no light that leaves at another wavelength.*{LOST}") as said:
        save(INK, path, module.NAME)
    assert len(said) == 1


def test_conversion_reports_how_much_re_radiation_is_lost(tmp_path, few_albedos):
    report = gn.convert(INK, tmp_path / "ink.nc", resolution=(4, 4, 6))
    assert re.match(LOST, report.lost["re-radiation"]) and not report.made.fluoresces
    assert "re-radiation" not in gn.convert(INK, tmp_path / "ink.json").lost


@pytest.mark.full
@each_writer
def test_what_is_written_has_no_re_radiation_and_the_report_says_so(module, tmp_path, few_albedos):
    matrix = np.array([[0.2, 0.0, 0.0], [0.45, 0.6, 0.0], [0.1, 0.15, 0.7]])
    for m in (INK, gn.Donaldson(matrix, wavelengths=[450.0, 550.0, 650.0]), gn.Donaldson(matrix)):
        try:
            options = NEEDED.get(module.NAME, {}) | SMALL.get(module.NAME, {})
            report = gn.convert(m, tmp_path / f"ink{module.SUFFIXES[0]}", module.NAME, **options)
        except ParameterError:
            continue
        assert exchanges(report.made) != ("re-radiation" in report.lost)
        return
    pytest.skip("holds one channel")


@pytest.mark.parametrize("call", [gn.tables.tabulate, gn.tables.to_dataset])
def test_tables_of_f_alone_say_so(call):
    with pytest.warns(FluorescenceWarning, match="gn.save") as said:
        call(INK, resolution=(4, 4, 6))
    assert len(said) == 1
