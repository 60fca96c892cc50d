"""Every real file of ../shared/data: it loads, says what it is, is written and read back equal, and is checked."""

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner
from libraries import switch_off, thinned
from places import REAL, real

import gonio as gn
from gonio.base.calls import breaches
from gonio.cli.commands import cli
from gonio.errors import FormatError
from gonio.formats import formats

MANIFEST = REAL / "MANIFEST.tsv"
NOT_REFLECTANCES = ("env/", "fits/", "jsss_mwir/", "refractiveindex/", "nist_ptfe/README.txt")
"""Environment maps, tables of published parameters, radiances, optical constants, text."""
PICTURES = "fluo/"
"""A material for each pixel: test_bispectral_exr.py has what is said of them."""
CUT = "window_xml/2011-SA1-Small-"
"""Files with a few numbers of each matrix: test_window_xml_files.py has what is said of them."""
SEVERAL = ("positivity", "reciprocity", "pdf")
"""Laws that a file of more than 100 wavelengths is held to where `full` is left out, with `full` one of more than 1000:
the others take minutes. Where `full` is left out, one of more than 1000 is held to the last alone."""


def listed() -> dict[str, str]:
    """Name -> SHA-256 of the files of the list."""
    if not MANIFEST.exists():
        return {}
    with MANIFEST.open(encoding="utf-8") as file:
        return {row["file"]: row["sha256"] for row in csv.DictReader(file, delimiter="\t")}


DIGESTS = listed()
FILES = [name for name in DIGESTS if not name.startswith((*NOT_REFLECTANCES, PICTURES, CUT))] or ["(none)"]
each_file = pytest.mark.parametrize("name", FILES)
OPTIONS = {"grit/Spectralon_Num4.txt": {"columns": ["wavelength", "reflectance", "u"]}}
"""What must be said of files without a header."""
KINDS = {(Path(name).parent, Path(name).suffix): name for name in reversed(FILES)}
"""A file of each folder and ending."""
WRITERS = {module.NAME: module for module in formats() if hasattr(module, "write")}


@each_file
def test_it_loads_says_what_it_is_and_survives_its_own_format(name, tmp_path, monkeypatch):
    switch_off(monkeypatch)  # a kernel takes longer to compile than the few values of `info` to compute
    m = gn.load(real(name), **OPTIONS.get(name, {}))
    assert m.provenance["sha256"] == DIGESTS[name]
    options = [x for key, value in OPTIONS.get(name, {}).items() for x in ("-O", f"{key}={','.join(value)}")]
    said = CliRunner().invoke(cli, ["info", str(REAL / name), *options])
    assert said.exit_code == 0, said.output
    assert m.provenance["sha256"] in said.output and m.provenance["format"] in said.output
    if m.format == "MCD43A1" or (module := WRITERS.get(m.provenance["format"])) is None:
        return  # read only
    path = tmp_path / f"again{module.SUFFIXES[0]}"
    gn.save(m, path, module.NAME)
    again = gn.load(path)
    assert again == m and again.provenance["format"] == module.NAME
    assert again.channel_names == m.channel_names


@pytest.mark.parametrize("most", [pytest.param(1000, marks=pytest.mark.full), 100])
@pytest.mark.parametrize("name", thinned(FILES, KINDS.values()))
def test_the_laws_that_it_fails_are_those_that_measurements_may_fail(name, most, monkeypatch):
    """Reflection between two plates follows from the albedo; laws about gonio's own part hold: pdf, sampling, ..."""
    if Path(name).suffix == ".h5":
        switch_off(monkeypatch)  # a network is the one formula that takes longer to compile than the laws to try
    m = gn.load(real(name), **OPTIONS.get(name, {}))
    count = len(m.channel_names or ())
    laws = None if count <= most else SEVERAL if count <= 10 * most or most > 100 else SEVERAL[-1:]
    report = gn.check(m, laws=laws)
    failed = [law for law in report.laws if not law.passed]
    assert {law.name for law in failed} <= breaches(m).keys() | {"cavity"}, str(report)
    assert all(law.why for law in failed)


def test_other_files_are_refused_by_name():
    real("MANIFEST.tsv")
    for name in DIGESTS:
        if name.startswith(NOT_REFLECTANCES):
            with pytest.raises(FormatError, match="not a known format"):
                gn.load(REAL / name)
