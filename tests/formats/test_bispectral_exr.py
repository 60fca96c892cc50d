"""Bispectral OpenEXR: names of channels, round trips, the published picture, damage."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from format_cases import claimed
from libraries import colour_science
from places import REAL

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import bispectral_exr

PUBLISHED = REAL / "fluo" / "BiSpectral.exr"
INK = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
FORMAT = bispectral_exr.NAME


def saved(tmp_path: Path, names: list[str], values: list[float]) -> Path:
    path = tmp_path / "made.exr"
    gn.scenes.Image(np.broadcast_to(np.array(values, "f4"), (2, 2, len(values))).copy(), channels=names).save(path)
    return path


@pytest.mark.parametrize(
    ("name", "nm"),
    [
        ("T.550,000000nm", (550.0, 550.0)),
        ("T.380,5nm.550,000000nm", (380.5, 550.0)),
        ("T.0,38um.5,5e-7m", (380.0, 550.0)),
        ("T.500,0THz.400THz", (599.584916, 749.481145)),
        ("S0.550,000000nm", None),
        ("T.550nm.380", None),
        ("R", None),
        ("T.,nm", None),
        ("T.0nm.550nm", None),
    ],
)
def test_names_of_channels(name, nm):
    assert bispectral_exr._wavelengths(name) == nm


def test_names_as_colour_science_reads_them():
    fichet = colour_science("colour.io.fichet2021")
    quantity = fichet.PATTERN_FICHET2021
    for name in ("T.380,000000nm.550,000000nm", "T.0,4um.5,5e-7m", "T.600,0THz.5,2e2nm"):
        found = re.fullmatch(rf"T\.*{quantity}\.*{quantity}", name)
        theirs = [
            fichet.match_groups_to_nm(found[k].replace(",", "."), found[k + 2] or "", found[k + 3]) for k in (1, 5)
        ]
        np.testing.assert_allclose(bispectral_exr._wavelengths(name), theirs, rtol=1e-8)


def test_round_trip(tmp_path):
    path = tmp_path / "ink.exr"
    gn.save(INK, path, format=FORMAT)
    again = gn.load(path)
    np.testing.assert_array_equal(again.matrix, INK.matrix.astype("f4"))
    np.testing.assert_array_equal(again.wavelengths, INK.wavelengths)
    assert claimed(path) == [FORMAT]
    whole = gn.Donaldson(INK.matrix * np.linspace(0.1, 1.0, 6).reshape(2, 3, 1, 1), wavelengths=[400.0, 550.0])
    gn.save(whole, path, format=FORMAT)
    np.testing.assert_array_equal(gn.load(path).matrix, whole.matrix.astype("f4"))
    np.testing.assert_array_equal(gn.load(path, pixel=(1, 2)).matrix, whole.matrix[1, 2].astype("f4"))
    np.testing.assert_allclose(gn.load(path, mean=True).matrix, whole.matrix.mean((0, 1)), rtol=1e-7)
    with pytest.raises(ParameterError, match="2 rows, 3 columns"):
        gn.load(path, pixel=(2, 0))


def test_a_diagonal_matrix_stays_one(tmp_path):
    path = tmp_path / "plain.exr"
    gn.save(gn.Donaldson(np.diag([0.25, 0.5]), wavelengths=[400.0, 550.0]), path, format=FORMAT)
    np.testing.assert_array_equal(gn.load(path).matrix, np.diag([0.25, 0.5]))


def test_missing_pairs_exchange_no_light_and_others_are_passed_over(tmp_path):
    names = ["R", "G", "B", "T.400,0nm", "T.550,0nm", "T.400,0nm.550,0nm"]
    m = gn.load(saved(tmp_path, names, [1.0, 1.0, 1.0, 0.25, 0.5, 0.75]))
    np.testing.assert_array_equal(m.matrix[0, 0], [[0.25, 0.0], [0.75, 0.5]])


def test_negative_numbers_are_refused_or_read_as_0(tmp_path):
    path = saved(tmp_path, ["T.400,0nm", "T.550,0nm", "T.400,0nm.550,0nm"], [0.25, 0.5, -0.125])
    with pytest.raises(FormatError, match="negative='zero'"):
        gn.load(path)
    np.testing.assert_array_equal(gn.load(path, negative="zero", mean=True).matrix, np.diag([0.25, 0.5]))
    path = saved(tmp_path, ["T.400,0nm", "T.550,0nm", "T.400,0nm.550,0nm"], [0.25, np.nan, 0.125])
    with pytest.raises(FormatError, match="NaN"):
        gn.load(path)


@pytest.mark.parametrize(
    ("m", "said"),
    [
        (gn.Lambertian([0.2, 0.3]), "diffuse"),
        (gn.Donaldson(INK.matrix, gn.Microfacet(), wavelengths=[400.0, 550.0]), "diffuse"),
        (gn.Donaldson(INK.matrix), "wavelengths are not known"),
    ],
    ids=["no matrix", "glossy", "no wavelengths"],
)
def test_what_it_cannot_hold(tmp_path, m, said):
    with pytest.raises(ParameterError, match=said):
        gn.save(m, tmp_path / "x.exr", format=FORMAT)


@pytest.mark.skipif(not PUBLISHED.exists(), reason="no ../shared/data: real files are not part of the repository")
def test_the_published_picture(tmp_path):
    m = gn.load(PUBLISHED)
    assert m.matrix.shape == (16, 16, 41, 41)
    np.testing.assert_array_equal(m.wavelengths, np.arange(380.0, 781.0, 10.0))
    assert not np.triu(m.matrix, 1).any()  # nothing leaves at shorter waves
    assert 0.94 < m.matrix.mean((0, 1)).sum(0).max() < 0.96  # per band: as densities 10 times as much would leave
    one = gn.load(PUBLISHED, pixel=(3, 4))
    assert gn.check(one, laws=["photons"]).passed
    gn.save(m, tmp_path / "again.exr", format=FORMAT)
    assert gn.load(tmp_path / "again.exr") == m
