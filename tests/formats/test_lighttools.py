"""LightTools: where light comes from, mirrored halves, blocks of other sides, damage."""

from __future__ import annotations

import numpy as np
import optical_files as files
import pytest
from format_cases import at, file_of, pairs_off_grazing

import gonio as gn
from gonio.errors import FormatError
from gonio.formats import lighttools


def test_lighttools_light_comes_from_azimuth_90(tmp_path):
    m = gn.load(file_of(tmp_path, files.LIGHTTOOLS))
    assert m.channel_names == (550.0,)
    assert at(m, 40, 0, 45, 180) == pytest.approx(0.8)  # azimuth 270
    assert at(m, 40, 0, 45, 0) == pytest.approx(0.7)  # azimuth 90: back to the light
    assert at(m, 20, 10, 0, 0) == pytest.approx(0.3)  # between AOI 0 and 40
    with pytest.raises(FormatError, match="back"):
        lighttools.read(tmp_path / "file", side="back")


def test_lighttools_plane_symmetrical_files_hold_either_side(tmp_path):
    full = gn.load(file_of(tmp_path, files.LIGHTTOOLS))
    rows = files.LIGHTTOOLS.replace("Asymmetric", "PlaneSymmetrical").replace("ScatterAzimuth 4", "ScatterAzimuth 3")
    one = rows.replace("0 90 180 270", "90 180 270").replace("0.1 0.2\n0.1 0.3", "0.1 0.3").replace("0.5 0.6\n", "", 1)
    other = rows.replace("0 90 180 270", "-90 0 90").replace("0.01 0.02\n", "", 1)
    for old, new in (("0.1 0.2\n0.1 0.3\n0.1 0.2\n0.1 0.4", "0.1 0.4\n0.1 0.2\n0.1 0.3"),):
        other = other.replace(old, new)
    other = other.replace("0.5 0.6\n0.5 0.7\n0.5 0.6\n0.5 0.8", "0.5 0.8\n0.5 0.6\n0.5 0.7")
    wi, wo = pairs_off_grazing()
    for text in (one.replace("0.01 0.02\n", "", 1), other):
        m = gn.load(file_of(tmp_path, text))
        assert m.is_mirrored
        np.testing.assert_allclose(m.f(wi, wo), full.f(wi, wo), rtol=1e-12)
    with pytest.raises(FormatError, match="one side"):
        gn.load(file_of(tmp_path, rows.replace("0 90 180 270", "0 90 180")))


def test_lighttools_keeps_all_blocks(tmp_path):
    m = gn.load(file_of(tmp_path, files.LIGHTTOOLS))
    gn.save(m, tmp_path / "b.bsdf", "LightTools")
    again = gn.load(tmp_path / "b.bsdf")
    assert again == m and "BTDF" in (tmp_path / "b.bsdf").read_text()
    for a, b in zip(m.filed.blocks, again.filed.blocks, strict=True):
        assert a[:-1] == b[:-1]
        np.testing.assert_array_equal(a.values, b.values)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("0.1 0.3\n", "0.1\n", "values"),
        ("AOI 40", "AOI 0", "two tables"),
        ("AOI 40", "AOI 400", "AOI"),
        ("ScatterType BRDF", "ScatterType BSDF", "ScatterType"),
        ("0 45\n", "0 45 50\n", "ScatterRadial"),
        ("ScatterRadial 2\n0 45\n", "ScatterRadial 2 0 45 50\n", "2 angles, not 3"),
        ("DataBegin\n", "", "DataBegin"),
        ("0 90 180 270", "0 90 180 480", "covers"),
        ("Wavelength 550", "Wavelength 600", "one for each"),
        ("Front", "Inside", "Side"),
    ],
)
def test_lighttools_damaged(tmp_path, old, new, words):
    text = files.LIGHTTOOLS
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(file_of(tmp_path, text.replace(old, new, 1)))


def test_parts_that_differ_in_isotropy_share_their_azimuths(tmp_path):
    turned = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.2, 0.5), 0.5)
    m = gn.Sheet(gn.Lambertian(0.3), turned, gn.Lambertian(0.1), gn.Lambertian(0.1))
    gn.save(m, tmp_path / "a.bsdf", format="LightTools", step=30.0)
    back = gn.load(tmp_path / "a.bsdf", side="both")
    theta_i, theta_o, phi_i, phi_o = (x[1] for x in back.back.axes.values())
    np.testing.assert_allclose(
        back.back.f_angles(theta_i, phi_i, theta_o, phi_o), turned.f_angles(theta_i, phi_i, theta_o, phi_o)[None]
    )
