"""CSAIL: the bins of Disney's BRDF Explorer, mirrored halves, gaps, writing, damage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from binary_files import header, ngan
from format_cases import ANISOTROPIC, GRAY, claimed, directions, file_of

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import csail, load, save


def brdf_explorer(raw, wi, wo):
    """Bin of a pair, as BRDF Explorer finds it."""
    _, n_i, n_o, n_d, n_p = raw.shape
    phi_o, phi_i = math.atan2(-wo[1], -wo[0]), math.atan2(-wi[1], -wi[0])
    phi = (phi_o - phi_i) % (2 * math.pi)
    i, o = (int(math.acos(w[2]) * n * 2 / math.pi) for w, n in ((wi, n_i), (wo, n_o)))
    d, p = int(phi * n_d / (2 * math.pi)), int(phi_i % (2 * math.pi) * n_p / (2 * math.pi))
    return raw.reshape(3, -1)[:, p + n_p * (d + n_d * (o + n_o * i))]


def test_csail_bins_are_brdf_explorers(tmp_path):
    head, raw = ngan()
    path = file_of(tmp_path, head.tobytes() + raw.tobytes(), "random.dat")
    m = load(path)
    nearest = m.replace(interpolation="nearest")
    wi, wo = directions(300, 3), directions(300, 4)
    expected = [brdf_explorer(raw, a, b) for a, b in zip(wi, wo, strict=True)]
    np.testing.assert_allclose(nearest.f(wi, wo), expected, rtol=1e-6)
    # and linear between centres: half way between two phi
    at = np.radians([45.0 / 5, 30.0, 45.0 / 4, 30.0 + 22.5 + 22.5])  # theta_i 0, phi_i bin 3 about 30, theta_o 0
    found = m.f_angles(*at)
    np.testing.assert_allclose(found, raw[:, 0, 0, [0, 1], 3].mean(axis=1), rtol=1e-6)
    assert claimed(path) == ["CSAIL"]


def test_csail_half_is_mirrored():
    head, raw = ngan(half=1)
    m = csail.CSAIL(raw, head)
    theta_i, theta_o, phi_i, phi = np.radians([20.0, 50.0, 77.0, 33.0])
    np.testing.assert_allclose(
        m.f_angles(theta_i, phi_i, theta_o, phi_i + phi), m.f_angles(theta_i, phi_i, theta_o, phi_i - phi)
    )
    centre = np.radians([9.0, 30.0, 11.25, 30.0 + 11.25])  # first bins; phi has 8 in 180 degrees
    np.testing.assert_allclose(m.f_angles(*centre), raw[:, 0, 0, 0, 3], rtol=1e-6)


def test_csail_negative_is_no_data():
    head, raw = ngan(holes=0.3)
    m = csail.CSAIL(raw, head, scale=10.0)
    f = m.f(directions(2000, 3), directions(2000, 4))
    assert 0.0 < np.isnan(f).mean() < 0.05
    assert np.nanmin(f) >= 1.0
    assert m.valid.mean() == pytest.approx(0.7, abs=0.1)
    np.testing.assert_array_equal(np.isfinite(m.brdf()), m.valid)
    assert m != csail.CSAIL(raw, head)


def test_csail_writes(tmp_path):
    head, raw = ngan(holes=0.3)
    head[13] = 77  # reserved
    path, copy = file_of(tmp_path, head.tobytes() + raw.tobytes(), "random.dat"), tmp_path / "copy.dat"
    save(load(path), copy, format="CSAIL")
    assert copy.read_bytes() == path.read_bytes()
    save(ANISOTROPIC, copy, format="CSAIL", resolution=(6, 5, 12, 9))
    m = load(copy)
    wi, wo = m.directions()
    np.testing.assert_allclose(m.stored, ANISOTROPIC.f(wi, wo), rtol=1e-6)
    np.testing.assert_allclose(m.f(wi, wo), m.stored, rtol=1e-6)
    with pytest.raises(ParameterError, match="mirror"):
        save(gn.IdealSpecular(0.5), copy, format="CSAIL")
    with pytest.raises(ParameterError, match="resolution"):
        save(GRAY, copy, format="CSAIL", resolution=(0, 1, 1, 1))
    with pytest.raises(ParameterError, match="format"):
        save(GRAY, copy)


def test_csail_damage(tmp_path):
    head, raw = ngan()
    for damaged, why in (
        (header((5, 4, 8, 6), _6=0), "paramType is 0"),
        (header((5, 4, 8, 6), _7=1), "binType is 1"),
        (header((5, 4, 8, 6), _9=2), "half_data is 2"),
        (header((5, 4, 8, 6), _10=4), "channels is 4"),
        (header((5, 4, 8, -6)), "expected"),
        (header((2000, 2000, 2000, 2000)), "cut short"),
    ):
        with pytest.raises(FormatError, match=why):
            csail.read(file_of(tmp_path, damaged.tobytes() + raw.tobytes()))
    with pytest.raises(FormatError, match="cut short"):
        load(file_of(tmp_path, head.tobytes() + raw.tobytes()[:-4]))
    with pytest.raises(FormatError, match="cut short"):
        csail.read(file_of(tmp_path, head.tobytes()[:20]))
    with pytest.raises(ParameterError, match="scale"):
        csail.CSAIL(raw, head, scale=-1.0)
