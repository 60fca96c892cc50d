"""Files of refractiveindex.info: tables and formulas, as YAML's own reader has them; damage is said."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import FormatError, MeaningWarning, NotFoundError, ParameterError

HEAD = """# this file is part of refractiveindex.info database

REFERENCES: |
    A. Author. Title: "a: b"
    <a href="https://doi.org/10.0/0">DATA: not these</a>
COMMENTS: |
    Room temperature
DATA:
"""
NK = """  - type: tabulated nk
    data: |
        0.4 1.5 0.1
        0.55 1.25 1e-1

        0.7 1.1 0.3
CONDITIONS:
    temperature: 293
"""
FORMULA_AND_K = """  - type: formula 1
    wavelength_range: 0.3 0.9
    coefficients: 0 0.6961663 0.0684043
  # of another author
  - type: tabulated k
    data: |
        0.35 0.1
        0.8 0.3
"""


@pytest.fixture
def written(tmp_path):
    def write(text, head=HEAD):
        path = tmp_path / "A.yml"
        path.write_text(head + text, encoding="utf-8")
        return path

    return write


def test_a_table(written):
    n, k = gn.spectra.refractive_index(written(NK))
    assert n == gn.Spectrum([400.0, 550.0, 700.0], [1.5, 1.25, 1.1])
    assert k == gn.Spectrum([400.0, 550.0, 700.0], [0.1, 0.1, 0.3])
    assert gn.spectra.refractive_index(str(written(NK)), 550.0) == (1.25, 0.1)


def test_a_formula_beside_a_table(written):
    n, k = gn.spectra.refractive_index(written(FORMULA_AND_K))
    assert n == gn.Dispersion(1, [0, 0.6961663, 0.0684043], [300.0, 900.0])
    assert k.at(575.0) == pytest.approx(0.2)
    m = gn.Microfacet(gn.GGX(0.1), gn.Conductor(n, k)).at([400.0, 500.0])
    assert m.wavelengths.tolist() == [400.0, 500.0]
    with pytest.raises(gn.Error, match="350 to 800 nm"):
        gn.spectra.refractive_index(written(FORMULA_AND_K), 320.0)


def test_a_transparent_substance_has_no_k(written):
    n, k = gn.spectra.refractive_index(written("  - type: tabulated n\n    data: |\n      0.4 1.5\n      0.7 1.4\n"))
    assert n.at(550.0) == pytest.approx(1.45) and k.at(550.0) == 0.0


@pytest.mark.parametrize("text", [NK, FORMULA_AND_K])
def test_blocks_are_those_of_yaml(written, text):
    yaml = pytest.importorskip("yaml")
    from gonio.catalogue.index_file import _blocks

    path = written(text)
    expected = yaml.safe_load(path.read_text())["DATA"]
    found = [block for _, block in _blocks("", path.read_text().splitlines())]
    assert [block.keys() for block in found] == [block.keys() for block in expected]
    for block, other in zip(found, expected, strict=True):
        for key, value in block.items():
            assert value.split() == str(other[key]).split()


def test_wavelengths_that_stand_twice(written):
    with pytest.warns(MeaningWarning, match="1 wavelengths stand twice"):
        n, _ = gn.spectra.refractive_index(
            written("  - type: tabulated n\n    data: |\n      0.4 1\n      0.4 2\n      0.5 3\n")
        )
    assert n.values.tolist() == [1.0, 3.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no refractive index n"),
        ("  - type: tabulated k\n    data: |\n      0.4 1\n      0.5 1\n", "no refractive index n"),
        ("  - type: tabulated nk\n    data: |\n      0.4 1\n", "rows of 3 numbers"),
        ("  - type: tabulated n\n    data: |\n      0.4 x\n", "expected numbers"),
        ("  - type: tabulated n\n    data: |\n      400 1.5\n      nan 1.4\n", "expected a wavelength"),
        ("  - type: tabulated n\n    data: |\n      -4 1.5\n      1 1.4\n", "expected a wavelength"),
        ("  - type: tabulated n\n    data: |\n      4 1.5\n      5 inf\n", "finite numbers"),
        ("  - type: formula 10\n    coefficients: 0\n", "formula 1 to 9"),
        ("  - type: formula 1\n    coefficients: 0 1\n", "two wavelengths"),
        ("  - type: !!python/object/apply:os.system [ls]\n", r"!!python|expected tabulated"),
        ("  - {type: tabulated n}\n", "key: value"),
        ("  - type\n", "key: value"),
        ("  - type: tabulated n\n    type: tabulated n\n", "once in a block"),
        (NK.partition("CONDITIONS")[0] * 2, "n once more"),
    ],
)
def test_damage(written, text, message):
    with pytest.raises(FormatError, match=message):
        gn.spectra.refractive_index(written(text))


def test_files_that_are_none(written, tmp_path):
    with pytest.raises(FormatError, match="no line 'DATA:'"):
        gn.spectra.refractive_index(written("nothing", head=""))
    with pytest.raises(NotFoundError, match="No such file"):
        gn.spectra.refractive_index(tmp_path / "B.yml")
    (tmp_path / "C.yml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FormatError, match="UTF-8"):
        gn.spectra.refractive_index(tmp_path / "C.yml")
    with pytest.raises(NotFoundError, match=r"path of a \.yml file"):
        gn.spectra.refractive_index("unobtainium")


def test_built_in_substances_have_spectra():
    n, k = gn.spectra.refractive_index("gold")
    assert np.array_equal(n.at([450.0, 632.8]), gn.spectra.refractive_index("Au", [450.0, 632.8])[0])
    assert gn.Conductor(n, k).at(550.0) == gn.Conductor(*gn.spectra.refractive_index("gold", 550.0))


def test_the_unit_of_a_file_is_known(written):
    """Soft X rays are not asked about, and a wavelength may be alone, without or with k."""
    n, k = gn.spectra.refractive_index(
        written("  - type: tabulated nk\n    data: |\n      0.0101 0.99 0.01\n      0.0123 0.98 0.02\n")
    )
    assert n.wavelengths.tolist() == [10.1, 12.3] and k.at(10.1) == 0.01
    path = written("  - type: tabulated n\n    data: |\n      0.5876 1.4985\n")
    assert gn.spectra.refractive_index(path, 587.6) == (1.4985, 0.0)
    n, k = gn.spectra.refractive_index(path)
    assert gn.Conductor(n, k).at(587.6).eta == 1.4985
    with pytest.raises(ParameterError, match="nothing is extrapolated"):
        n.at(588.0)


def test_load_says_what_reads_such_a_file(written):
    with pytest.raises(FormatError, match=r"a table of refractive indices; write gn\.Conductor"):
        gn.load(written(NK))
