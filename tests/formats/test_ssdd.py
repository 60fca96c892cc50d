"""SSDD: the specification's example, the order of its table, binary files, round trips, damage."""

import math

import numpy as np
import pytest
from format_cases import f, grid, loaded, random_pairs
from sweeps import every
from text_files import SSDD, ssdd_binary

import gonio as gn
from gonio.formats import ssdd

# SSDD


DEGREES = math.pi / 180.0


def test_ssdd_lambertian_of_the_specification(tmp_path):
    text = (  # doc/SsddFileFormatSpecification.md of libbsdf, version 0.2: its first example
        "VERSION 0.2\n\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE spherical_coordinate_system\n"
        "PARAM0_LIST 0\nPARAM2_LIST 0\nPARAM3_LIST 0\nDATA ascii\n0.3183\n"
    )
    m = loaded(tmp_path, text)
    assert f(m, 0.3, 1.0, 0.8, 2.0) == pytest.approx(0.3183)


def test_ssdd_order_of_the_table(tmp_path):
    m = loaded(tmp_path, SSDD)
    assert m.about["NAME"] == "graues Gerät"
    assert m.about["SOFTWARE"] == "by hand"
    assert m.periods == {"phi_d": math.pi}
    # PARAM0 (theta_h) runs fastest, then PARAM2 (theta_d), then PARAM3 (phi_d)
    np.testing.assert_allclose(m.stored[1, 0, 0], [4, 5, 6])
    np.testing.assert_allclose(m.stored[0, 1, 0], [7, 8, 9])
    np.testing.assert_allclose(m.stored[0, 0, 1], [19, 20, 21])
    (other,) = m.about["other_blocks"]
    assert other["entries"]["DATA_TYPE"] == "specular_transmittance"
    np.testing.assert_allclose(other["table"].ravel(), [0.05, 0.06])


def test_ssdd_binary_and_specular_azimuth(tmp_path):
    m = loaded(tmp_path, ssdd_binary())
    assert m.channel_names == (450.0, 550.5)
    # index = 2 (channels) * (p0 + 2 * (p2 + 3 * p3)): theta_i = 45, radial = 30, phi = 0 is towards the normal
    number = 2 * (1 + 2 * (1 + 3 * 0))
    np.testing.assert_allclose(f(m, 45 * DEGREES, 0.0, 15 * DEGREES, math.pi), [0.125 * number, 0.125 * (number + 1)])
    number = 2 * (1 + 2 * (1 + 3 * 2))  # phi = 180: towards the horizon
    np.testing.assert_allclose(f(m, 45 * DEGREES, 0.0, 75 * DEGREES, math.pi), [0.125 * number, 0.125 * (number + 1)])
    # phi = 90: libbsdf's direction is (.., +1, ..) for light at phi_i = 0
    side = np.array([0.0, math.sin(30 * DEGREES), 0.0]) + math.cos(30 * DEGREES) * gn.direction(45 * DEGREES, math.pi)
    number = 2 * (1 + 2 * (1 + 3 * 1))
    np.testing.assert_allclose(m.f(gn.direction(45 * DEGREES, 0.0), side)[0], 0.125 * number)
    assert len(m.about["other_blocks"]) == 1


@pytest.mark.filterwarnings("ignore:.*times the light")  # numbers that tell rows apart, no light
def test_ssdd_grids_about_other_directions_become_rows(tmp_path):
    text = (
        "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE specular_coordinate_system\n"
        "PARAM0_LIST 0 45\nPARAM2_LIST 0 10\nPARAM3_LIST 0 180\nPARAM4_LIST 0 -5\nDATA ascii\n1 \n2\n3\n4\n5\n6\n7\n8\n"
    )
    m = loaded(tmp_path, text)
    where = (np.abs(m.rows[:, 0] - 45 * DEGREES) < 1e-9) & (np.abs(m.rows[:, 2] - 30 * DEGREES) < 1e-9)
    assert m.stored[where].tolist() == [4.0]  # 40 - 10 degrees: radial 10, phi 0


@pytest.mark.parametrize("kind", ["angles", "specular", "half_difference"])
@every(
    binary=[False, True],
    channels=[None, ("R", "G", "B"), ("X", "Y", "Z"), (400.0, 500.5)],
    counts=[((3, 4, 5), False), ((3, 4, 5), True), ((3, 4, 5, 2), False)],
)
def test_ssdd_round_trip(tmp_path, binary, channels, kind, counts):
    counts, mirrored = counts
    m = grid(kind, counts, channels, mirrored)
    ssdd.write(m, tmp_path / "a", binary=binary)
    again = gn.load(tmp_path / "a")
    stored = m.stored.astype(np.float32) if binary else m.stored
    assert sorted(again.stored.ravel()) == sorted(stored.ravel())
    if kind != "specular":
        assert binary or again == m
    elif channels is None and not binary:
        np.testing.assert_allclose(again.f(*random_pairs()), m.f(*random_pairs()), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("DATA_TYPE brdf", "DATA_TYPE specular_reflectance", "expected a brdf or a btdf"),
        ("DATA_TYPE brdf", "DATA_TYPE other", "got 'DATA_TYPE other"),
        ("half_difference", "distorted", "PARAM_TYPE"),
        ("rgb", "cmyk", "COLOR_MODEL cmyk"),
        ("rgb", "spectrum", "without WAVELENGTH_LIST"),
        ("PARAM2_LIST 0 45 90\n", "", "without PARAM2_LIST"),
        ("PARAM2_LIST 0 45 90", "PARAM2_LIST 0 45 45", "line 9: .*rising"),
        ("PARAM2_LIST 0 45 90", "PARAM2_LIST 0 45 91", "theta_d runs from"),
        ("16 17 18", "16 17", "line 19: .*expected 3 numbers"),
        ("DATA ascii\n0.05\n0.06\n", "DATA ascii\n0.05\n", "cut short"),
        ("DATA ascii\n# PARAM3: 0", "DATA hex", "expected DATA ascii or DATA binary"),
        ("COLOR_MODEL rgb", "COLOR_MODEL rgb\nCOLOR_MODEL rgb", "each entry of a block once"),
        ("bilateral_symmetry rec", "rotation rec", "REDUCTION_TYPE"),
    ],
)
def test_damaged_ssdd(tmp_path, old, new, says):
    assert old in SSDD
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, SSDD.replace(old, new))


def test_promised_tables_are_not_allocated(tmp_path):
    many = " ".join(map(str, np.linspace(0, 90, 3000)))
    lists = "".join(f"PARAM{k}_LIST {many}\n" for k in (0, 1, 2, 3))
    head = "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL rgb\nPARAM_TYPE spherical_coordinate_system\n"
    for kind in ("ascii", "binary"):
        with pytest.raises(gn.errors.FormatError, match="cut short"):
            loaded(tmp_path, f"{head}{lists}DATA {kind}\n1 2 3\n")


def test_ssdd_refuses_what_it_cannot_say(tmp_path):
    with pytest.raises(gn.errors.ParameterError, match="has channels"):
        ssdd.write(grid("angles", (2, 2, 2), ("a", "b")), tmp_path / "a")
    with pytest.raises(gn.errors.ParameterError, match="period"):
        ssdd.write(grid("angles", (2, 2, 2), periods={"phi": math.pi}, mirrored=False), tmp_path / "a")


def test_ssdd_of_rows_in_no_grid_and_of_a_metal(tmp_path):
    """What `gn.tables.tabulate` makes of a material, and the grid that rows in no grid are looked up in."""
    theta = np.linspace(0.1, 0.9, 20)
    for rows in (
        gn.Scattered(theta, 0.0, theta[::-1], np.linspace(0.0, 3.0, 20), 0.1 + theta),
        gn.Scattered(theta, np.linspace(0.0, 6.0, 20), 0.3, 0.0, np.stack([theta] * 3, -1), channels="RGB"),
        gn.Scattered(0.3, 0.0, [0.2], 0.0, [0.5]),
    ):
        gn.save(rows, tmp_path / "rows.ssdd")
        again = gn.load(tmp_path / "rows.ssdd")
        np.testing.assert_allclose(again.f_angles(0.3, 0.0, 0.2, 1.0), rows.f_angles(0.3, 0.0, 0.2, 1.0), rtol=1e-14)
    brass = gn.tables.tabulate(gn.material("brass"), resolution=(5, 4, 6))
    gn.save(brass, tmp_path / "brass.ssdd")
    np.testing.assert_array_equal(gn.load(tmp_path / "brass.ssdd").stored, brass.stored)
