"""Speos: shares and spectra, intensity, azimuths, transmission, damage."""

from __future__ import annotations

import math

import numpy as np
import optical_files as files
import pytest
from format_cases import at, file_of

import gonio as gn
from gonio.errors import FormatError
from gonio.formats import speos


def test_speos_tables_are_normalized_by_their_shares(tmp_path):
    m = gn.load(file_of(tmp_path, files.speos()))
    assert m.channel_names == (500.0, 600.0)
    assert (m.filed.comment, m.filed.description) == ("a comment", "two\nlines..")
    # Table k: number x cos(theta_o) is k at 0, (k.5 + k.25)/2 cos 60 = half of that at 60; with a linear course
    # between, integral of (a + b theta) sin(theta) = a (1 - cos t) + b (sin t - t cos t), times 2 pi.
    t = math.radians(60.0)
    for k, (theta_i, channel) in enumerate(((0, 0), (0, 1), (40, 0), (40, 1)), start=1):
        b = (0.5 * (k + 0.375) - k) / t
        share = 2.0 * math.pi * (k * (1.0 - math.cos(t)) + b * (math.sin(t) - t * math.cos(t)))
        scale = 0.1 * k / share
        assert at(m, theta_i, 0, 0, 0)[channel] == pytest.approx(k * scale, rel=1e-9)
        if theta_i == 0:
            continue  # no plane of incidence
        assert at(m, theta_i, 0, 60, 180)[channel] == pytest.approx((k + 0.5) * scale, rel=1e-9)  # phi 0: forward
        assert at(m, theta_i, 0, 60, 0)[channel] == pytest.approx((k + 0.25) * scale, rel=1e-9)


def test_speos_intensity_is_the_brdf_times_the_cosine(tmp_path):
    of_f, of_i = (gn.load(file_of(tmp_path, files.speos(flag), str(flag))) for flag in (1, 0))
    at_60 = [at(m, 40, 0, 60, 180)[0] / at(m, 40, 0, 0, 0)[0] for m in (of_f, of_i)]
    assert at_60 == pytest.approx([3.5 / 3.0, 7.0 / 3.0], rel=1e-8)


def test_speos_one_spectrum_scales_every_table(tmp_path):
    m = gn.load(file_of(tmp_path, files.SPEOS_ANISOTROPIC))
    assert m.channel_names == (400.0, 800.0)
    red = speos.read(tmp_path / "file", wavelengths=[500.0, 600.0])
    # Angle of the sample 0: light travels along x, so it comes from 180; forward is phi_o = 0.
    forward, left, back = (at(m, 20, 180, 60, phi) for phi in (0, 90, 180))
    assert left / forward == pytest.approx([1.5, 1.5]) and back / forward == pytest.approx([2.0, 2.0])
    assert forward[1] == pytest.approx(3.0 * forward[0])
    assert at(red, 20, 180, 60, 0) == pytest.approx([1.5 * forward[0], 2.0 * forward[0]])
    # Angle 90: the same, turned, with the same scale.
    turned = [at(m, 20, 270, 60, 90 + phi)[0] / forward[0] for phi in (0, 90, 180, 270)]
    assert turned == pytest.approx([3.0, 3.5, 4.0, 4.5])
    # The table lit at 0 reflects 10 %: mean of (2, 3, 4, 3) x cos 60 = 1.5 at 60, 1 at 0.
    t = math.radians(60.0)
    integral = 2.0 * math.pi * ((1.0 - math.cos(t)) + 0.5 / t * (math.sin(t) - t * math.cos(t)))
    assert forward[0] == pytest.approx(2.0 * 0.1 / integral, rel=1e-9)


def test_speos_azimuths_need_not_fit_the_angles_of_the_sample(tmp_path):
    m = gn.load(file_of(tmp_path, files.SPEOS_ANISOTROPIC.replace("0\t90\n1", "0\t60\n1")))
    fits = gn.load(file_of(tmp_path, files.SPEOS_ANISOTROPIC, "fits"))
    np.testing.assert_allclose(np.degrees(m.axes["phi_o"]), [0, 60, 90, 150, 180, 240, 270, 330])
    for phi in (0.0, 30.0, 100.0, 200.0, 359.0):
        assert at(m, 20, 180, 60, phi) == pytest.approx(at(fits, 20, 180, 60, phi))
        assert at(m, 20, 240, 60, 60 + phi) == pytest.approx(at(fits, 20, 270, 60, 90 + phi))


@pytest.mark.parametrize(
    ("text", "name"),
    [(files.speos(), "a.brdf"), (files.speos(0), "a.brdf"), (files.SPEOS_ANISOTROPIC, "a.anisotropicbsdf")],
)
def test_speos_is_written_as_it_was_read(tmp_path, text, name):
    m = gn.load(file_of(tmp_path, text))
    gn.save(m, tmp_path / name, "Speos")
    again = gn.load(tmp_path / name)
    assert again == m and again.filed[:5] == m.filed[:5]
    for a, b in zip(m.filed.parts["reflection"].tables, again.filed.parts["reflection"].tables, strict=True):
        np.testing.assert_array_equal(a.values, b.values)
        assert a.share == b.share or math.isnan(a.share)


def test_speos_keeps_transmission(tmp_path):
    text = files.speos()
    tables = text[text.index("10\n2\t2") :].replace("\n0\t", "\n120\t").replace("\n60\t", "\n180\t")
    both = text.replace("1\t0\n1\n", "1\t1\n1\n") + tables
    m = gn.load(file_of(tmp_path, both))
    gn.save(m, tmp_path / "b.brdf", "Speos")
    assert gn.load(tmp_path / "b.brdf").filed.parts["transmission"].tables[3].theta.tolist() == [120.0, 180.0]
    with pytest.raises(FormatError, match="transmission with theta from 0 degrees, expected 90 to 180"):
        gn.load(file_of(tmp_path, text.replace("1\t0\n1\n", "0\t1\n1\n")))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("v8.0\n0", "v8.0\n1", "binary"),
        ("v8.0", "v6.1", "version"),
        ("\n11\n", "\neleven\n", "characters"),
        ("\n11\n", "\n²3\n", "characters"),
        ("\n11\n", "\n" + "1" * 5000 + "\n", "characters"),
        ("v8.0", "v8.²", "version"),
        ("2\t2\n0\t40", "3\t2\n0\t40", "line"),
        ("60\t4.5\t4.25\n", "", "cut short"),
        ("0\t180\n0\t3", "0\t90\n0\t3", "different"),
        ("500\t600", "600\t500", "wavelengths"),
        ("60\t2.5\t2.25", "60\t2.5", "line"),
        ("2\t2\n\t0\t180", "2\t999999999\n\t0\t180", "line"),
    ],
)
def test_speos_damaged(tmp_path, old, new, words):
    text = files.speos()
    assert old in text
    with pytest.raises(FormatError, match=words):
        gn.load(file_of(tmp_path, text.replace(old, new, 1)))


def test_speos_spectra_do_not_multiply_memory(tmp_path):
    rows = "".join(f"{400 + k / 1000}\t{1 + k / 1000}\n" for k in range(5000))
    table = "".join(f"{t}\t" + "\t".join(["1"] * 72) + "\n" for t in range(90))
    tables = ("90 72\n\t" + "\t".join(str(5 * p) for p in range(72)) + "\n" + table) * 2
    start = files.SPEOS_ANISOTROPIC.partition("2\n400\t10")[0]
    path = file_of(tmp_path, f"{start}5000\n{rows}{tables}")
    with pytest.raises(FormatError, match="wavelengths="):
        gn.load(path)
    assert speos.read(path, wavelengths=[402.0]).stored.shape[-1] == 1
