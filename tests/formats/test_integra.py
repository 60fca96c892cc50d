"""Integra: its quantity, channels, cells, round trips, damage."""

import math

import numpy as np
import pytest
from format_cases import f, grid, loaded, random_pairs
from text_files import INTEGRA

import gonio as gn
from gonio.formats import integra
from gonio.tables.scattered import Scattered

# Integra


DEGREES = math.pi / 180.0


def test_integra_values_are_times_kbdf_over_pi(tmp_path):
    m = loaded(tmp_path, INTEGRA)
    mirror = (45 * DEGREES, 0.0, 45 * DEGREES, math.pi)
    assert f(m, *mirror) == pytest.approx(7 * 0.5 / math.pi)
    # phi = 0 of the file is towards the normal: 45 - 30 degrees; phi = 180 towards the horizon
    assert f(m, 45 * DEGREES, 0.0, 15 * DEGREES, math.pi) == pytest.approx(8 * 0.5 / math.pi)
    assert f(m, 45 * DEGREES, 0.0, 75 * DEGREES, math.pi) == pytest.approx(11 * 0.5 / math.pi)
    assert f(m, 45 * DEGREES, 1.0, 15 * DEGREES, math.pi + 1.0) == pytest.approx(8 * 0.5 / math.pi)
    m = loaded(tmp_path, INTEGRA.replace("Luminance", "Intensity"))
    assert f(m, 45 * DEGREES, 0.0, 75 * DEGREES, math.pi) == pytest.approx(11 * 0.5 / math.cos(75 * DEGREES))


def test_integra_relative_values_have_the_albedo_of_kbdf(tmp_path):
    nodes = " ".join(map(str, range(0, 181, 10)))
    flat = " ".join(["3"] * 19)
    text = (
        "TypeSym AxiSymmetrical TypeColorModel BW TypeData Luminance Relative sigma 3 0 30 60\n"
        f"theta 19 {nodes}\nbw kbdf 0.2 0.3 0.4 def\n{flat}\n{flat}\n{flat}\nenddef\n"
    )
    m = loaded(tmp_path, text, integra)
    for theta_i, albedo in ((0.0, 0.2), (30 * DEGREES, 0.3), (60 * DEGREES, 0.4)):
        assert f(m, theta_i, 0.0, 0.7, 2.0) == pytest.approx(albedo / math.pi, rel=2e-3)


def test_integra_channels_and_centres(tmp_path):
    three = "\n".join(f"{k} def {v} 2 3 4 5 6 7 8 9 10 11 12 enddef" for k, v in (("BLUE", 3), ("red", 1), ("gre", 2)))
    head = INTEGRA[: INTEGRA.index("bw\n")].replace("TypeColorModel BW", "TypeColorModel rgb")
    m = loaded(tmp_path, head + three)
    np.testing.assert_allclose(f(m, 0.0, 0.0, 0.0, 0.0), np.array([1, 2, 3]) / math.pi)
    turned = INTEGRA.replace("phi 2\n", "sigmaT\n0 50\nphi 2\n")
    m = loaded(tmp_path, turned)
    assert isinstance(m, Scattered)
    where = np.argmin(np.abs(m.rows[:, 0] - 45 * DEGREES) + np.abs(m.rows[:, 2] - 50 * DEGREES))
    np.testing.assert_allclose(m.rows[where, 2], 50 * DEGREES)
    assert m.stored[where] == pytest.approx(7 * 0.5 / math.pi)
    (tmp_path / "a.ddt").write_text(INTEGRA)
    assert gn.load(tmp_path / "a.ddt").f(gn.direction(0.0, 0.0), gn.direction(math.pi, 0.0)) > 0.0


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("sigma 2", "sigma 3", "line 8: .*angles of sigma"),
        (" 0 45\nphi", " 45 0\nphi", "rising angles"),
        ("theta 3", "theta 9999999999", "angles of theta"),
        ("7 11 12", "7 11", "values by psi"),
        ("7 11 12", "7 11 12 13", "line 21: got '13 numbers', expected 12 values"),
        ("Luminance", "Radiance", "line 5: got 'Radiance'"),
        ("BW", "RGB", "channels .*expected .*R"),
        ("bw\n", "red\n", "channels"),
        ("Absolute", "", "line 6: got 'sigma', expected one of absolute"),
        ("theta 3", "sigma 3", "each list once"),
    ],
)
def test_damaged_integra(tmp_path, old, new, says):
    assert old in INTEGRA
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, INTEGRA.replace(old, new), integra)


@pytest.mark.parametrize("channels", [None, ("R", "G", "B"), (400.0, 500.5)])
@pytest.mark.parametrize(("counts", "mirrored"), [((3, 4, 5), False), ((3, 4, 5), True), ((3, 4, 5, 2), False)])
@pytest.mark.parametrize("quantity", ["reflectance factor", "brdf * cos(theta_o)"])
def test_integra_round_trip(tmp_path, channels, counts, mirrored, quantity):
    m = grid("specular", counts, channels, mirrored, quantity=quantity)
    integra.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    assert sorted(again.stored.ravel()) == sorted(m.stored.ravel())
    if channels is None and len(counts) == 3:
        np.testing.assert_allclose(again.f(*random_pairs()), m.f(*random_pairs()), rtol=1e-9, atol=1e-12)
