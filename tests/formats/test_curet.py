"""CUReT: the angles of the instrument, its three kinds of files, damage."""

from __future__ import annotations

import numpy as np
import pytest
from binary_files import curet_table, lambertian_table
from format_cases import claimed, file_of

import gonio as gn
from gonio.errors import FormatError, NotFoundError, ParameterError
from gonio.formats import curet, load


def test_curet_directions_have_the_instruments_angles():
    theta_o, phi_o, theta_i, phi_i = curet.directions().T
    cosine = np.sum(gn.direction(theta_i, phi_i) * gn.direction(theta_o, phi_o), axis=-1)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) / 22.5
    np.testing.assert_allclose(angle, np.round(angle), atol=1e-5)
    counts = np.unique(np.round(angle), return_counts=True)[1]
    np.testing.assert_array_equal(counts, [55, 48, 39, 28, 19, 12, 4])
    assert np.max(theta_i) < np.pi / 2 > np.max(theta_o)


def test_curet_table(tmp_path):
    values = lambertian_table()
    theta_o, phi_o, theta_i, phi_i = curet.directions().T
    values[1] = 0.05 + 0.2 * np.cos(theta_i) + 0.1 * np.cos(theta_o) ** 2  # not the same for the exchanged pair
    path = file_of(tmp_path, curet_table(values), "abrdf.dat")
    m = curet.read(path, sample=2)
    assert m.about["sample"] == 2
    np.testing.assert_allclose(m.stored, values[1], atol=5e-4)
    # The rows, looked up: light comes first in f, and second in the table.
    inner = np.maximum(theta_i, theta_o) < 1.2
    found = m.f_angles(theta_i, phi_i, theta_o, phi_o)[inner]
    assert np.median(np.abs(found / values[1][inner] - 1.0)) < 0.05
    np.testing.assert_allclose(curet.read(path, sample=3).f_angles(0.5, 0.0, 0.3, 1.0), 0.15, rtol=1e-3)
    assert claimed(path) == ["CUReT"]
    one = file_of(tmp_path, curet_table(values[:1]), "one.dat")
    np.testing.assert_allclose(load(one).f_angles(0.5, 0.0, 0.3, 1.0), 0.05, rtol=1e-3)


def test_curet_colours(tmp_path):
    for k, name in enumerate(("rbrdf.dat", "gbrdf.dat", "bbrdf.dat")):
        file_of(tmp_path, curet_table(lambertian_table() * (k + 1)), name)
    m = curet.read(tmp_path / "gbrdf.dat", sample=1, rgb=True)
    assert m.channel_names == ("R", "G", "B")
    np.testing.assert_allclose(m.f_angles(0.5, 0.0, 0.3, 1.0), [0.05, 0.1, 0.15], rtol=1e-3)
    with pytest.raises(ParameterError, match="rbrdf"):
        curet.read(file_of(tmp_path, curet_table(lambertian_table()), "other.dat"), sample=1, rgb=True)


def test_curet_oren_nayar(tmp_path):
    path = file_of(tmp_path, b"1 0.5 0.3 0.8\r\n2 0.25 0.0 1.0\r\n3 1.5 0.1 1\r\n", "op.dat")
    assert curet.read(path, sample=1) == 0.8 * gn.OrenNayar(0.5, 0.3)
    assert curet.read(path, sample=1, kd=False) == gn.OrenNayar(0.5, 0.3)
    assert claimed(path) == ["CUReT"]
    with pytest.raises(FormatError, match=r"sample 3.*out of bounds"):
        curet.read(path, sample=3)


def test_curet_koenderink_modes(tmp_path):
    path = file_of(tmp_path, b"1 0.5 0 0 0 0\n", "kp2.dat")
    modes = [(0, 0, 0), (1, 1, 1), (2, 0, 0), (2, 2, 0), (2, 2, 2)]
    m = curet.read(path, modes=modes)
    np.testing.assert_allclose(m.f_angles(0.5, 0.0, 0.3, 1.0), m.f_angles(0.0, 0.0, 1.3, 1.0), rtol=1e-9)
    with pytest.raises(FormatError, match="5 Koenderink modes"):
        curet.read(path, modes=modes[:3])


def test_curet_damage(tmp_path):
    table = curet_table(lambertian_table())
    for data, error, why in (
        (table, NotFoundError, "expected one of 1, 2, 3"),
        (table.replace(b"0.050", b"x", 1), FormatError, "line 1"),
        (table[:-300], FormatError, "line 3"),
        (table.replace(b"\n2 ", b"\n1 "), FormatError, "twice"),
        (b"1 2 3", FormatError, "2 values"),
        (b"", FormatError, "empty"),
        (b"1 1 2 3 4 5\n", FormatError, "order was not found"),
    ):
        with pytest.raises(error, match=why):
            curet.read(file_of(tmp_path, data))
    assert claimed(file_of(tmp_path, b"1 2 3\n4 5 6\n")) == []
    assert claimed(file_of(tmp_path, b"1 0.5 0.5 0.5\n3 0.5 0.5 0.5\n")) == []
