"""Zernike modes: by hand, NIST's expansion of PTFE against its table and matrix, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from format_cases import at, loaded
from places import real
from seeds import ZERNIKE

import gonio as gn
from gonio.errors import FormatError
from gonio.formats import zernike
from gonio.polarization import to_frames

# Zernike: NIST's expansion, and the measurements that it was fitted to.


pytestmark = pytest.mark.usefixtures("uncompiled")  # a kernel for every table takes longer than all else


def test_one_mode_is_a_lambertian_surface(tmp_path):
    m = loaded(tmp_path, "1, 1, 0, 0, 0, 0, 0, 0.5\n")
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
    m = loaded(tmp_path, text)
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
    expected, found = table.matrices, to_frames(model.mueller(wi, wo), wi, wo, "xyxy")
    np.testing.assert_allclose(found[:, 0, 0], model.f(wi, wo), rtol=1e-12)
    off = found / found[:, :1, :1] - expected / expected[:, :1, :1]
    rms = np.sqrt(np.mean(off**2, axis=0))
    assert rms.max() < 0.011
    signal = np.sqrt(np.mean((expected / expected[:, :1, :1]) ** 2, axis=0))
    assert (rms < signal).all()
    assert (rms[1:3, 1:3] < 0.25 * signal[1:3, 1:3]).all()
    swapped = np.swapaxes(to_frames(model.mueller(wo, wi), wo, wi, "xyxy"), -1, -2) * np.outer(
        [1, 1, -1, 1], [1, 1, -1, 1]
    )
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
        loaded(tmp_path, ZERNIKE + row.encode())


def test_an_expansion_without_f(tmp_path):
    with pytest.raises(FormatError, match="which is f"):
        loaded(tmp_path, "2, 2, 0, 0, 0, 0, 0, 1.0\n")
