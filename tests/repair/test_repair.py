"""Repairs: a model is tabulated, damaged in a known way, repaired, and held against what it was."""

import json
import math
import re

import numpy as np
import pytest
from house import PLASTIC
from libraries import thinned

import gonio as gn
from gonio.base.history import Repair
from gonio.base.provenance import formats_read
from gonio.cli.info import facts_as_text
from gonio.conversion import comparison
from gonio.facts.material import facts
from gonio.formats.merl import MERL, SCALE
from gonio.repair import _cells
from gonio.tables.angle_systems import angle_system
from gonio.tables.gridded import Gridded
from gonio.tables.scattered import Scattered

MODEL = PLASTIC
DEGREE = math.pi / 180.0


def table(m=MODEL, name="angles", axes=None, channels=None, **more):
    """f of a model at the nodes of a grid, as it is."""
    if axes is None:
        theta, phi = np.radians(np.linspace(0.0, 85.0, 18)), np.radians(np.arange(0.0, 360.0, 10.0))
        axes = {"theta_i": theta, "theta_o": theta, "phi": phi}
    wi, wo = angle_system(name).pairs(*np.meshgrid(*axes.values(), indexing="ij"))
    f = np.where((wi[..., 2] > 1e-6) & (wo[..., 2] > 1e-6), 1.0, np.nan)
    f = f[..., None] * m.f(wi, wo) if channels else f * m.f(wi, wo)
    return Gridded(name, axes, f, channels=channels, **more)


def changed(g, f, uncertainty=None):
    return g.with_brdf(f, uncertainty)


def noisy(g, level, seed=1):
    rng = np.random.default_rng(seed)
    f = g.brdf()
    return changed(g, f * (1.0 + level * rng.standard_normal(f.shape)), level * f)


@pytest.fixture
def rough_albedos(monkeypatch):
    """Where a record's albedos do not matter they are computed roughly."""
    monkeypatch.setattr(_cells, "ALBEDO_TOLERANCE", 0.1)


@pytest.fixture(scope="module")
def whole():
    return table()


# The record.


def test_every_repair_adds_to_the_history_and_leaves_the_original(whole):
    first = gn.repair.remove_negatives(changed(whole, whole.brdf() - 0.1))
    second = gn.repair.symmetrize(first, "reciprocity")
    assert whole.repairs == ()
    assert "repairs" not in whole.about
    assert [r.operation for r in first.repairs] == ["remove_negatives"]
    assert [r.operation for r in second.repairs] == ["remove_negatives", "symmetrize"]
    assert second.repairs[0] == first.repairs[0]
    assert second.repairs[1].parameters == {"kind": "reciprocity"}
    assert second.repairs[1].albedo_before == first.repairs[0].albedo_after
    kept = json.loads(json.dumps(second.about["repairs"], allow_nan=False))
    assert tuple(map(Repair.from_json, kept)) == second.repairs


@pytest.mark.usefixtures("one_probe", "rough_albedos")
def test_what_is_made_of_a_file_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "ALONG", 3)
    monkeypatch.setattr(comparison, "TOLERANCES", (1e-2, 1e-2))
    nodes = np.radians([0.0, 30.0, 60.0])
    gn.save(table(axes={"theta_i": nodes, "theta_o": nodes, "phi": 3.0 * nodes}), tmp_path / "a.nc")
    m = gn.load(tmp_path / "a.nc")
    assert m.provenance["file"] == "a.nc" and len(m.provenance["sha256"]) == 64
    scattered = gn.Scattered([0.1, 0.5, 0.9], 0.0, 0.3, [0.0, 1.0, 2.0], [1.0, 2.0, 3.0])
    scattered.__dict__["provenance"] = m.provenance
    repaired = gn.repair.symmetrize(gn.repair.fill_holes(m), "isotropy")
    assert [r.operation for r in repaired.repairs] == ["fill_holes", "symmetrize"]
    for made in (
        repaired,
        m.with_brdf(m.brdf()),
        scattered.with_brdf(scattered.brdf()),
        gn.repair.resample(m, "specular", resolution=(4, 5, 6)),
        gn.tables.tabulate(m, "angles", (5, 5, 8)),
    ):
        assert made.provenance == {"converted_from": m.provenance}
    assert scattered.replace(outside="missing").provenance == m.provenance
    merged = gn.repair.merge_scans([m, repaired])
    assert merged.provenance == {"converted_from": [m.provenance, m.provenance]}
    for made in (repaired, merged):
        assert m.provenance["sha256"] in facts_as_text(facts("made", made))
        assert "provenance" not in gn.convert(made, tmp_path / "b.nc").lost
        kept = gn.load(tmp_path / "b.nc").provenance["converted_from"]
        assert kept["converted_from"] == made.provenance["converted_from"] and kept["material"] == repr(made)
    lost = gn.convert(merged, tmp_path / "b.alta", "ALTA", resolution=(4, 4, 6)).lost["provenance"]
    name = f"a.nc, sha256 {m.provenance['sha256'][:12]}..."
    assert lost == f"that it was made of {name} and {name}"
    assert formats_read(merged.provenance) == ["netCDF", "netCDF"] and "rusinkiewicz1998" in gn.cite(merged)


def test_albedos_in_the_record_are_those_of_the_tables(whole):
    r = gn.repair.subtract_signature(whole, gn.Lambertian(0.05)).repairs[0]
    w = gn.direction(np.radians([0.0, 45.0, 75.0]), 0.0)
    np.testing.assert_allclose(r.albedo_before, gn.albedo(whole, w), atol=1e-3)
    np.testing.assert_allclose(np.subtract(r.albedo_before, r.albedo_after), 0.05, atol=1e-3)


def test_a_record_says_itself_in_one_line(whole):
    text = str(gn.repair.subtract_signature(whole, gn.Lambertian(0.05)).repairs[0])
    assert text.startswith("subtract_signature(signature='Lambertian(rho=0.05)', scale=1, ")
    assert "11664 cells (100.00%); f changed by 0.0159/sr, at most 0.0159/sr; albedo 0.33" in text
    assert "\n" not in text


def test_what_is_no_record_is_refused(whole):
    record = gn.repair.symmetrize(whole, "plane").repairs[0].to_json()
    nan = Repair.from_json({**record, "figures": {"x": None}})
    assert math.isnan(nan.figures["x"])
    for bad in ({}, {**record, "albedo_after": 3}, {**record, "figures": [1]}, "text", {**record, "albedo_after": "x"}):
        with pytest.raises(gn.errors.FormatError, match="no record of a repair"):
            Repair.from_json(bad)
    with pytest.raises(gn.errors.FormatError, match="no record of a repair"):
        _ = Gridded("angles", whole.axes, whole.stored, about={"repairs": 5}).repairs


def test_info_prints_the_history(whole):
    from gonio.cli.info import facts_as_text
    from gonio.facts.material import facts

    repaired = gn.repair.remove_negatives(changed(whole, whole.brdf() - 0.11))
    found = facts("memory", repaired)
    assert found["repairs"][0]["operation"] == "remove_negatives"
    assert "repairs" not in found["about"]
    assert re.search(r"repaired +remove_negatives\(floor=0\): ", facts_as_text(found))


def test_what_is_no_grid_is_refused_with_the_next_step():
    with pytest.raises(gn.errors.ParameterError, match=r"expected a measurement; gn.tables.tabulate"):
        gn.repair.fill_holes(gn.Lambertian(0.5))


@pytest.mark.usefixtures("uncompiled")
def test_channels_quantity_and_grid_are_kept():
    m = 0.5 * gn.Lambertian(np.array([0.1, 0.4]))
    theta = np.radians(np.linspace(0.0, 80.0, 9))
    axes = {"theta_i": theta, "theta_o": theta, "phi": np.radians(np.linspace(0.0, 180.0, 7))}
    f = table(m, axes=axes, channels=(450.0, 550.0)).stored.copy()
    f[3, 3, 2, 1] = np.nan
    g = Gridded("angles", axes, f * np.cos(theta)[:, None, None], quantity="brdf * cos(theta_o)",
                channels=(450.0, 550.0), mirrored=True, outside="missing")  # fmt: skip
    r = gn.repair.fill_holes(g)
    assert (r.quantity, r.channel_names, r.is_mirrored, r.outside) == (g.quantity, (450.0, 550.0), True, "missing")
    known = np.isfinite(f)
    assert np.array_equal(r.stored[known], g.stored[known])
    np.testing.assert_allclose(r.stored[~known], 0.2 / np.pi * np.cos(theta[3]))
    assert r.repairs[0].cells == r.repairs[0].filled == 1


# Holes.


@pytest.fixture(scope="module")
def holed(whole):
    f = whole.stored.copy()
    f[6:11, 10:15, 14:19] = np.nan
    return changed(whole, f, 0.01 * np.abs(f))


@pytest.mark.parametrize(("method", "rms", "largest"), [("neighbours", 0.06, 0.21), ("smooth", 0.04, 0.10)])
def test_filled_holes_are_near_the_truth(whole, holed, method, rms, largest):
    r = gn.repair.fill_holes(holed, method)
    known = np.isfinite(holed.stored)
    assert np.array_equal(r.stored[known], whole.stored[known])
    assert np.array_equal(r.uncertainty[known], holed.uncertainty[known])
    off = (r.stored - whole.stored)[~known]
    error = np.abs(off) / whole.stored[~known]
    assert 0.4 * rms < np.sqrt(np.mean(error**2)) < rms
    assert 0.4 * largest < error.max() < largest
    record = r.repairs[0]
    assert (record.cells, record.filled, record.largest) == (125, 125, 0.0)
    assert record.share == pytest.approx(125 / known.size)
    assert record.figures["deepest"] == 3
    assert 0.5 * rms < record.figures["rehearsal"] < 2.0 * rms
    # What the uncertainty promises: two of them hold at least nine errors in ten.
    assert np.mean(np.abs(off) < 2.0 * r.uncertainty[~known]) > 0.9
    assert np.all(r.uncertainty[~known] > 0.01 * r.stored[~known])
    assert abs(record.albedo_after[1] - gn.albedo(whole, gn.direction(math.pi / 4, 0.0))) < 2e-3
    assert record.albedo_before[1] < 0.33


def test_the_smooth_surface_is_exact_for_what_is_linear_along_every_axis():
    x, y, z = np.radians([0.0, 10.0, 15.0, 30.0, 40.0, 55.0]), np.radians([0.0, 20.0, 30.0, 60.0, 80.0]), np.zeros(1)
    f = 0.2 + 0.3 * x[:, None, None] - 0.1 * y[:, None] + 0.5 * x[:, None, None] * y[:, None] + z
    damaged = f.copy()
    damaged[2:4, 1:4] = np.nan
    damaged[5, 4] = np.nan
    g = Gridded("angles", {"theta_i": x, "theta_o": y, "phi": z}, damaged)
    r = gn.repair.fill_holes(g, "smooth")
    np.testing.assert_allclose(r.stored, f, rtol=1e-6)
    assert np.abs(gn.repair.fill_holes(g).stored - f).max() > 0.01
    assert r.repairs[0].figures["rehearsal"] < 1e-6


def test_circles_close_when_holes_are_filled(whole):
    f = np.ones(whole.stored.shape)
    f[9, 9] = np.arange(36.0)
    f[9, 9, 0] = np.nan
    r = gn.repair.fill_holes(changed(whole, f)).stored[9, 9, 0]
    assert r == pytest.approx((4 * 1.0 + 1.0 + 35.0) / 6.0)


@pytest.mark.usefixtures("rough_albedos")
def test_cells_below_the_horizon_are_filled_but_do_not_count():
    g = gn.repair.resample(MODEL, "half_difference", resolution=(20, 12, 18))
    empty = int(np.isnan(g.stored).sum())
    assert empty > 500
    r = gn.repair.fill_holes(g)
    assert not np.isnan(r.stored).any()
    assert r.repairs[-1].cells == 0
    smooth = gn.repair.fill_holes(g, "smooth")
    assert np.array_equal(smooth.stored, r.stored)


def test_what_cannot_be_filled(whole):
    with pytest.raises(gn.errors.ParameterError, match="no value in any cell"):
        gn.repair.fill_holes(changed(whole, np.full(whole.stored.shape, np.nan)))
    with pytest.raises(gn.errors.ParameterError, match="'neighbours', 'smooth'"):
        gn.repair.fill_holes(whole, "biharmonic")


def test_big_holes_are_solved_for_iteratively(monkeypatch, holed):
    direct = gn.repair.fill_holes(holed, "smooth").stored
    monkeypatch.setattr("gonio.repair.holes.DIRECT", 10)
    np.testing.assert_allclose(gn.repair.fill_holes(holed, "smooth").stored, direct, rtol=1e-4)


# Symmetries.


def reversed_pairs(f):
    """f(wo, wi) at the nodes of `whole`."""
    return f.transpose(1, 0, 2)[:, :, -np.arange(f.shape[2])]


def test_reciprocity_is_exact_on_a_symmetric_grid_and_asymmetry_is_reported(whole):
    g = noisy(whole, 0.02)
    r = gn.repair.symmetrize(g, "reciprocity")
    assert np.array_equal(r.stored, reversed_pairs(r.stored))
    figures = r.repairs[0].figures
    assert figures["on_grid"] == 1
    assert figures["asymmetry_rms"] == pytest.approx(0.02 * math.sqrt(2.0), rel=0.03)
    assert figures["chi2"] == pytest.approx(1.0, abs=0.05)
    off = np.abs(g.stored - reversed_pairs(g.stored)) / (0.5 * (g.stored + reversed_pairs(g.stored)))
    assert figures["asymmetry_median"] == pytest.approx(np.median(off), rel=0.01)
    assert figures["asymmetry_largest"] == pytest.approx(off.max(), rel=1e-9)
    # Pairs that are their own image keep their value and uncertainty; others have 1/sqrt(2) of it.
    own = reversed_pairs(np.arange(g.stored.size).reshape(g.stored.shape)) == np.arange(g.stored.size).reshape(
        g.stored.shape
    )
    assert own.sum() == 36
    assert np.array_equal(r.stored[own], g.stored[own])
    assert np.array_equal(r.uncertainty[own], g.uncertainty[own])
    expected = 0.5 * np.hypot(g.uncertainty, reversed_pairs(g.uncertainty))
    np.testing.assert_allclose(r.uncertainty[~own], expected[~own])
    assert np.sqrt(np.mean((r.stored / whole.stored - 1.0) ** 2)) == pytest.approx(0.02 / math.sqrt(2.0), rel=0.05)


def test_a_reciprocal_table_is_left_as_it_is(whole):
    for kind in ("reciprocity", "plane"):
        r = gn.repair.symmetrize(whole, kind)
        np.testing.assert_allclose(r.stored, whole.stored, rtol=1e-9)
        assert r.repairs[0].figures["asymmetry_largest"] < 1e-9


def test_a_missing_value_is_that_of_its_pair(whole):
    f = whole.stored.copy()
    f[2, 9, 4] = np.nan
    r = gn.repair.symmetrize(changed(whole, f, 0.1 * f), "reciprocity")
    assert r.stored[2, 9, 4] == f[9, 2, 32] == r.stored[9, 2, 32]
    assert r.uncertainty[2, 9, 4] == pytest.approx(0.1 * f[9, 2, 32])
    assert r.repairs[0].filled == 1


def test_reciprocity_by_interpolation_where_the_grid_has_no_symmetry():
    theta_i, theta_o = np.radians([0.0, 20.0, 40.0, 60.0]), np.radians(np.linspace(0.0, 80.0, 41))
    axes = {"theta_i": theta_i, "theta_o": theta_o, "phi": np.radians(np.arange(0.0, 360.0, 5.0))}
    f = table(gn.Lambertian(0.4), axes=axes).stored * (1.0 + 0.3 * np.sin(theta_i))[:, None, None]
    g = Gridded("angles", axes, f, outside="missing")
    r = gn.repair.symmetrize(g, "reciprocity")
    assert r.repairs[0].figures["on_grid"] == 0
    s_i, s_o = np.sin(theta_i)[:, None, None], np.sin(theta_o)[:, None]
    known = (s_o <= math.sin(math.radians(60.001))) & (s_i >= 0.0) & np.ones(f.shape, bool)
    expected = 0.4 / np.pi * (1.0 + 0.15 * (s_i + s_o)) + 0.0 * f
    np.testing.assert_allclose(r.stored[known], expected[known], rtol=4e-3)
    assert r.repairs[0].figures["asymmetry_largest"] == pytest.approx(0.23, abs=0.02)


@pytest.mark.usefixtures("rough_albedos")
@pytest.mark.parametrize("name", ["angles", "half_difference", "specular"])
def test_the_plane_of_anisotropic_tables(name):
    """f even about the plane at 20 degrees, plus an odd part: the average takes it away."""
    brushed = gn.Microfacet(gn.GGX(0.4, 0.2), gn.Constant(1.0))
    axes = {
        "angles": {"theta_i": [0.2, 0.7], "theta_o": [0.3, 0.9], "phi_i": 36, "phi_o": 36},
        "half_difference": {"theta_h": [0.1, 0.4], "theta_d": [0.2, 0.6], "phi_d": 18, "phi_h": 36},
        "specular": {"theta_i": [0.2, 0.5], "radial": [0.1, 0.4], "azimuth": 18, "phi_i": 36},
    }[name]
    axes = {n: 2.0 * np.pi * np.arange(x) / x if isinstance(x, int) else np.array(x) for n, x in axes.items()}
    plane = math.radians(20.0)
    wi, wo = angle_system(name).pairs(*np.meshgrid(*axes.values(), indexing="ij"))
    c, s = math.cos(plane), math.sin(plane)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    even = brushed.f(wi @ turn, wo @ turn)
    odd = 0.1 * ((wi + wo) @ turn)[..., 1]
    r = gn.repair.symmetrize(Gridded(name, axes, even + odd), "plane", plane)
    np.testing.assert_allclose(r.stored, even, rtol=1e-9, atol=1e-12)
    assert r.repairs[0].figures["on_grid"] == 1
    assert r.repairs[0].parameters == {"kind": "plane", "plane": plane}
    assert r.repairs[0].largest == pytest.approx(np.abs(odd).max())


@pytest.mark.usefixtures("rough_albedos")
@pytest.mark.parametrize("name", ["angles", "half_difference"])
def test_reciprocity_of_four_axes(name):
    axes = {
        "angles": {"theta_i": [0.2, 0.7], "theta_o": [0.2, 0.7], "phi_i": 12, "phi_o": 12},
        "half_difference": {"theta_h": [0.1, 0.4], "theta_d": [0.2, 0.6], "phi_d": 18, "phi_h": 12},
    }[name]
    axes = {n: 2.0 * np.pi * np.arange(x) / x if isinstance(x, int) else np.array(x) for n, x in axes.items()}
    wi, wo = angle_system(name).pairs(*np.meshgrid(*axes.values(), indexing="ij"))
    even, odd = 1.0 + wi[..., 0] * wo[..., 0], 0.3 * (wi[..., 1] - wo[..., 1])
    r = gn.repair.symmetrize(Gridded(name, axes, even + odd), "reciprocity")
    np.testing.assert_allclose(r.stored, even, rtol=1e-9)


@pytest.mark.usefixtures("rough_albedos", "uncompiled")
def test_isotropy_takes_the_mean_over_the_azimuth_of_the_light(whole):
    theta, phi = np.radians([5.0, 30.0, 60.0]), np.radians(np.arange(0.0, 360.0, 15.0))
    axes = {"theta_i": theta, "theta_o": theta, "phi_i": phi, "phi_o": phi}
    wi, wo = angle_system("angles").pairs(*np.meshgrid(*axes.values(), indexing="ij"))
    f = MODEL.f(wi, wo)
    stripes = 0.1 * np.cos(2.0 * phi)[:, None]
    r = gn.repair.symmetrize(Gridded("angles", axes, f * (1.0 + stripes), uncertainty=0.01 * f), "isotropy")
    assert list(r.axes) == ["theta_i", "theta_o", "phi"]
    expected = table(axes={"theta_i": theta, "theta_o": theta, "phi": phi}).stored
    np.testing.assert_allclose(r.stored, expected, rtol=1e-9)
    np.testing.assert_allclose(r.uncertainty, 0.01 * expected / math.sqrt(24.0), rtol=1e-9)
    figures = r.repairs[0].figures
    assert figures["on_grid"] == 1
    assert figures["asymmetry_rms"] == pytest.approx(0.1 / math.sqrt(2.0), rel=2e-2)
    assert figures["asymmetry_largest"] == pytest.approx(0.1, rel=6e-2)
    assert r.is_isotropic()


@pytest.mark.usefixtures("rough_albedos", "uncompiled")
def test_isotropy_of_other_grids():
    for name in ("half_difference", "specular"):
        four = angle_system(name).oriented
        names = list(four[:3])
        sizes = ([0.1, 0.3], [0.2, 0.5], np.arange(6) * np.pi / 3, np.arange(8) * np.pi / 4)
        axes = {n: np.array(x) for n, x in zip(four, sizes, strict=True)}
        f = table(MODEL, name, axes).stored * (1.0 + 0.2 * np.sin(axes[four[3]]))
        r = gn.repair.symmetrize(Gridded(name, axes, f), "isotropy")
        assert list(r.axes) == names
        np.testing.assert_allclose(r.stored, table(MODEL, name, {n: axes[n] for n in names}).stored, rtol=1e-9)
    again = gn.repair.symmetrize(r, "isotropy")
    assert np.array_equal(again.stored, r.stored)
    assert again.repairs[-1].cells == 0


@pytest.mark.usefixtures("rough_albedos", "uncompiled")
def test_isotropy_between_nodes():
    theta = np.radians([30.0, 60.0])
    phi_i, phi_o = np.radians([0.0, 100.0, 215.0]), np.radians(np.arange(0.0, 360.0, 2.0))
    g = table(axes={"theta_i": theta, "theta_o": theta, "phi_i": phi_i, "phi_o": phi_o})
    r = gn.repair.symmetrize(g, "isotropy")
    assert r.repairs[0].figures["on_grid"] == 0
    expected = table(axes={"theta_i": theta, "theta_o": theta, "phi": phi_o}).stored
    np.testing.assert_allclose(r.stored, expected, rtol=2e-3)


def test_unknown_symmetries(whole):
    with pytest.raises(gn.errors.ParameterError, match="'reciprocity', 'isotropy', 'plane'"):
        gn.repair.symmetrize(whole, "bilateral")


# Negative values.


def test_the_bias_of_removed_negatives_is_reported(whole):
    s = 0.01
    rng = np.random.default_rng(2)
    dark = changed(whole, s * rng.standard_normal(whole.stored.shape), np.full(whole.stored.shape, s))
    r = gn.repair.remove_negatives(dark)
    record = r.repairs[0]
    assert r.stored.min() == 0.0
    assert record.share == pytest.approx(0.5, abs=0.02)
    assert record.figures["lowest"] == dark.stored.min()
    assert record.largest == pytest.approx(-dark.stored.min())
    bias = np.subtract(record.albedo_after, record.albedo_before)[1:]
    np.testing.assert_allclose(bias, np.pi * s / math.sqrt(2.0 * np.pi), rtol=0.2)
    floor = gn.repair.remove_negatives(dark, "uncertainty")
    assert floor.stored.min() == s
    assert gn.repair.remove_negatives(dark, 0.002).stored.min() == 0.002
    assert np.array_equal(r.stored[dark.stored > 0.0], dark.stored[dark.stored > 0.0])


def test_floors_that_make_no_sense(whole):
    for floor, text in ((-1.0, "small positive"), (np.inf, "small positive"), ("noise", "'uncertainty'")):
        with pytest.raises(gn.errors.ParameterError, match=text):
            gn.repair.remove_negatives(whole, floor)
    with pytest.raises(gn.errors.ParameterError, match="give a number"):
        gn.repair.remove_negatives(whole, "uncertainty")


# Grazing.


def cut_off(m=MODEL, end=75.0, **more):
    theta = np.radians(np.arange(0.0, end + 1.0, 5.0))
    return table(m, axes={"theta_i": theta, "theta_o": theta, "phi": np.radians(np.arange(0.0, 360.0, 10.0))}, **more)


@pytest.mark.parametrize(
    ("method", "rms", "rehearsal"), [("hold", 0.06, 0.029), ("linear in cosine", 0.045, 0.008), ("model", 0.02, 0.011)]
)
def test_grazing_angles_are_near_the_truth(method, rms, rehearsal):
    g = cut_off()
    g = changed(g, g.brdf(), 0.001 * g.brdf())
    r = gn.repair.extrapolate_to_grazing(g, method)
    np.testing.assert_allclose(np.degrees(r.axes["theta_o"]), np.arange(0.0, 91.0, 5.0))
    assert np.array_equal(r.stored[:16, :16], g.stored)
    assert np.isfinite(r.stored).all()
    true = cut_off(end=85.0)
    new = r.stored[:18, :18] / true.stored - 1.0
    new[:16, :16] = 0.0
    found = np.sqrt(np.mean(new**2) * new.size / (new.size - 16 * 16 * 36))
    assert 0.5 * rms < found < rms
    record = r.repairs[0]
    assert record.figures["rehearsal"] == pytest.approx(rehearsal, rel=0.2)
    assert record.filled == record.cells == (18 * 18 - 16 * 16) * 36
    assert record.parameters["reach"] == pytest.approx([75.0 * DEGREE] * 2)
    assert np.all(r.uncertainty[16:18] > 0.005 * r.stored[16:18])


def test_the_line_in_the_cosine_is_exact_for_one():
    class Line(gn.Reflectance):
        def formula(self, wi, wo):
            return (0.2 + 0.1 * wi.z) * (0.5 - 0.3 * wo.z)

    r = gn.repair.extrapolate_to_grazing(cut_off(Line()), "linear in cosine")
    z = np.cos(r.axes["theta_i"])
    expected = (0.2 + 0.1 * z[:, None, None]) * (0.5 - 0.3 * z[:, None])
    np.testing.assert_allclose(r.stored, expected + 0.0 * r.stored, rtol=1e-9)
    assert r.repairs[0].figures["rehearsal"] < 2e-3  # between nodes


def test_the_model_is_exact_for_its_own_kind():
    lobe = gn.Lambertian(0.2) + 0.7 * gn.Microfacet(gn.GGX(0.35), gn.Schlick(0.06))
    r = gn.repair.extrapolate_to_grazing(cut_off(lobe), "model")
    figures = r.repairs[0].figures
    assert figures["alpha"] == pytest.approx(0.35, rel=1e-4)
    assert figures["f0"] == pytest.approx(0.06, rel=1e-3)
    assert figures["fit"] < 1e-6
    np.testing.assert_allclose(r.stored[:18, :18], cut_off(lobe, 85.0).stored, rtol=1e-4)


@pytest.mark.usefixtures("rough_albedos")
def test_within_reach_everything_is_replaced_beyond(whole):
    bad = whole.stored.copy()
    bad[15:], bad[:, 15:] = 77.0, 77.0
    r = gn.repair.extrapolate_to_grazing(changed(whole, bad), "hold", reach=math.radians(70.0))
    assert np.array_equal(r.stored[:15, :15], whole.stored[:15, :15])
    assert r.stored.max() < 10.0
    assert np.array_equal(r.stored[16, 3], r.stored[14, 3])
    sides = gn.repair.extrapolate_to_grazing(changed(whole, bad), "hold", reach=(math.radians(70.0), 1.3))
    assert sides.repairs[0].parameters["reach"] == pytest.approx([70.0 * DEGREE, 1.3])


@pytest.mark.usefixtures("rough_albedos")
def test_grazing_in_other_parameterizations():
    g = gn.repair.resample(MODEL, "half_difference", resolution=(30, 24, 36))
    wi, wo = g.directions()
    low = np.minimum(wi[..., 2], wo[..., 2]) < math.cos(math.radians(75.0))
    up = np.minimum(wi[..., 2], wo[..., 2]) > math.cos(math.radians(85.0))
    damaged = changed(g, np.where(low, np.nan, g.brdf()))
    r = gn.repair.extrapolate_to_grazing(damaged, "model", reach=math.radians(75.0))
    assert np.array_equal(r.stored[~low], g.stored[~low])
    off = (r.stored / g.stored - 1.0)[low & up]
    assert np.sqrt(np.mean(off**2)) < 0.2
    assert np.isfinite(off).all()


def test_grazing_needs_a_name_and_sensible_angles(whole):
    with pytest.raises(TypeError):
        gn.repair.extrapolate_to_grazing(whole)
    with pytest.raises(gn.errors.ParameterError, match="'hold', 'linear in cosine', 'model'"):
        gn.repair.extrapolate_to_grazing(whole, "quadratic")
    with pytest.raises(gn.errors.ParameterError, match="are these degrees"):
        gn.repair.extrapolate_to_grazing(whole, "hold", reach=75.0)


# Resampling.


@pytest.mark.parametrize(("name", "error"), [("half_difference", 2.5e-3), ("angles", 1e-2), ("specular", 4e-3)])
def test_resampled_models_report_their_error(name, error):
    r = gn.repair.resample(MODEL, name)
    figures = r.repairs[0].figures
    assert 0.3 * error < figures["error_rms"] < error
    rng = np.random.default_rng(3)
    w = gn.direction(np.arccos(0.1 + 0.9 * rng.random((2, 20000))), 2.0 * np.pi * rng.random((2, 20000)))
    off = r.f(w[0], w[1]) / MODEL.f(w[0], w[1]) - 1.0
    assert np.sqrt(np.mean(off**2)) == pytest.approx(figures["error_rms"], rel=0.15)
    assert figures["error_largest"] > 0.3 * np.abs(off).max()
    assert r.repairs[0].albedo_before is None
    np.testing.assert_allclose(
        r.repairs[0].albedo_after, gn.albedo(MODEL, gn.direction(np.radians([0, 45, 75]), 0.0)), atol=6e-3
    )


@pytest.mark.usefixtures("rough_albedos")
def test_resampling_finer_than_the_data_goes_there_and_back(whole):
    axes = {n: np.unique(np.concatenate([x, 0.5 * (x[1:] + x[:-1])])) for n, x in whole.axes.items()}
    g = changed(whole, whole.brdf(), 0.02 * whole.brdf())
    r = gn.repair.resample(g, "angles", axes=axes)
    figures = r.repairs[0].figures
    assert figures["back_largest"] < 1e-9
    assert figures["error_largest"] < 1e-6
    np.testing.assert_allclose(r.stored[::2, ::2, ::2], whole.stored, rtol=1e-9)
    np.testing.assert_allclose(r.uncertainty[::2, ::2, ::2], g.uncertainty, rtol=1e-6)
    coarse = gn.repair.resample(g, "angles", axes={n: x[::3] for n, x in whole.axes.items()})
    assert coarse.repairs[0].figures["back_rms"] > 0.05


@pytest.mark.usefixtures("rough_albedos")
def test_half_resolution_estimates_the_error():
    """A smooth f: the error of every second node is four times that of all."""
    smooth = gn.Microfacet(gn.GGX(0.9), gn.Constant(1.0))
    theta = np.radians(np.linspace(0.0, 80.0, 33))
    axes = {"theta_i": theta, "theta_o": theta, "phi": np.radians(np.arange(0.0, 360.0, 5.0))}
    figures = gn.repair.resample(smooth, "angles", axes=axes).repairs[0].figures
    finer = {n: np.sort(np.concatenate([x, x[:-1] + 0.5 * np.diff(x)])) for n, x in axes.items()}
    finer["phi"] = np.radians(np.arange(0.0, 360.0, 2.5))
    again = gn.repair.resample(smooth, "angles", axes=finer).repairs[0].figures
    assert figures["half_rms"] / again["half_rms"] == pytest.approx(4.0, rel=0.3)


@pytest.mark.usefixtures("uncompiled")
def test_resampled_channels_and_refusals():
    m = gn.Lambertian(np.array([0.1, 0.2, 0.3]))
    r = gn.repair.resample(m, "angles", resolution=(4, 4, 6))
    assert r.channel_names == ("R", "G", "B")
    np.testing.assert_allclose(r.f([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]), np.array([0.1, 0.2, 0.3]) / np.pi)
    for bad, text in (
        (lambda: gn.repair.resample(gn.IdealSpecular(1.0)), "perfect mirror"),
        (lambda: gn.repair.resample(m, "polar"), "expected one of"),
        (lambda: gn.repair.resample(m, "angles", resolution=(4, 4)), "3 whole numbers"),
        (lambda: gn.repair.resample(m, "angles", axes={}, resolution=(4, 4, 4)), "one of the two"),
        (lambda: gn.repair.resample(gn.Lambertian(np.full((2, 2, 1), 0.5))), "without maps"),
    ):
        with pytest.raises(gn.errors.ParameterError, match=text):
            bad()


@pytest.mark.usefixtures("uncompiled")
def test_resampled_half_circles_are_mirrored():
    theta = np.radians(np.arange(0.0, 90.0, 10.0))
    half = {"theta_i": theta, "theta_o": theta, "phi": np.radians(np.arange(0.0, 181.0, 20.0))}
    r = gn.repair.resample(MODEL, "angles", axes=half)
    assert r.is_mirrored
    wi, wo = gn.direction(0.6, 0.0), gn.direction(0.4, np.radians([40.0, 320.0, 200.0, 160.0]))
    f = np.asarray(r.f(wi, wo))
    np.testing.assert_allclose(f[[0, 2]], f[[1, 3]], rtol=1e-6)
    np.testing.assert_allclose(f, MODEL.f(wi, wo), rtol=0.2)
    leaning = gn.Rotated(gn.Microfacet(gn.GGX(0.1, 0.4)), 0.3)
    with pytest.raises(gn.errors.ParameterError, match="this one is not"):
        gn.repair.resample(leaning, "angles", axes=half)
    with pytest.raises(gn.errors.ParameterError, match="leaves out 270° of 360°"):
        gn.repair.resample(MODEL, "angles", axes=half | {"phi": np.radians(np.arange(0.0, 91.0, 10.0))})


# Scans.


def scan(theta_i, theta_o, phi, noise=0.0, seed=0, scale=1.0, m=MODEL):
    """A measurement along theta_o [degrees] in one half-plane."""
    axes = {"theta_i": np.radians([theta_i]), "theta_o": np.radians(theta_o), "phi": np.radians([phi])}
    f = scale * table(m, axes=axes).stored
    rng = np.random.default_rng(seed)
    more = {"uncertainty": noise * f} if noise else {}
    return Gridded("angles", axes, f * (1.0 + noise * rng.standard_normal(f.shape)), **more)


@pytest.mark.usefixtures("uncompiled")
def test_scans_become_one_grid():
    fine, coarse = np.arange(0.0, 81.0, 2.0), np.arange(0.0, 81.0, 4.0)
    scans = [scan(t, fine, 180.0) for t in (10.0, 40.0)] + [scan(t, coarse, 0.0) for t in (10.0, 40.0)]
    r = gn.repair.merge_scans(scans)
    np.testing.assert_allclose(np.degrees(r.axes["theta_i"]), [10.0, 40.0])
    np.testing.assert_allclose(np.degrees(r.axes["theta_o"]), fine)
    np.testing.assert_allclose(np.degrees(r.axes["phi"]), [0.0, 180.0], atol=1e-9)
    for i in range(2):
        np.testing.assert_allclose(r.stored[i, :, 1], scans[i].stored[0, :, 0], rtol=1e-12)
        np.testing.assert_allclose(r.stored[i, ::2, 0], scans[2 + i].stored[0, :, 0], rtol=1e-12)
        np.testing.assert_allclose(r.stored[i, 1::2, 0], 0.5 * (r.stored[i, :-2:2, 0] + r.stored[i, 2::2, 0]))
    record = r.repairs[0]
    assert record.figures == {"overlapping": 0, "scatter_rms": 0.0, "scatter_largest": 0.0}
    assert record.albedo_before is None
    assert record.share == 1.0
    assert r.uncertainty is None


def test_overlapping_scans_are_averaged_by_their_uncertainty():
    theta = np.arange(0.0, 81.0, 1.0)
    scans = [scan(30.0, theta[:61], 180.0, 0.01, 4), scan(30.0, theta[20:], 180.0, 0.03, 5)]
    r = gn.repair.merge_scans(scans)
    (a, ua), (b, ub) = (
        (np.append(np.full(k, np.nan), s.stored.ravel()), np.append(np.full(k, np.nan), s.uncertainty.ravel()))
        for k, s in zip((0, 20), scans, strict=True)
    )
    a, ua, b, ub = a[20:61], ua[20:61], b[20:61], ub[20:61]
    weights = 1.0 / ua**2 + 1.0 / ub**2
    np.testing.assert_allclose(r.stored[0, 20:61, 0], (a / ua**2 + b / ub**2) / weights, rtol=1e-12)
    np.testing.assert_allclose(r.uncertainty[0, 20:61, 0], 1.0 / np.sqrt(weights), rtol=1e-12)
    np.testing.assert_allclose(r.uncertainty[0, :20, 0], scans[0].uncertainty[0, :20, 0])
    figures = r.repairs[0].figures
    assert figures["overlapping"] == 41
    assert figures["chi2"] == pytest.approx(np.mean((a - b) ** 2 / (ua**2 + ub**2)), rel=1e-9)
    assert 0.6 < figures["chi2"] < 1.5
    off = gn.repair.merge_scans([scans[0], scan(30.0, theta[20:], 180.0, 0.01, 5, scale=1.1)])
    assert off.repairs[0].figures["chi2"] > 30.0
    assert off.repairs[0].figures["scatter_rms"] == pytest.approx(0.05, rel=0.15)


@pytest.mark.usefixtures("uncompiled")
def test_what_no_scan_has_seen_is_a_hole_and_the_normal_is_in_every_plane():
    theta = np.arange(0.0, 61.0, 10.0)
    r = gn.repair.merge_scans([scan(0.0, theta, 0.0), scan(30.0, theta[:4], 90.0), scan(30.0, theta[2:], 180.0)])
    np.testing.assert_allclose(np.degrees(r.axes["phi"]), [90.0, 180.0])
    f = np.isfinite(r.stored)
    assert f[0].all()  # light along the normal: every plane is the same
    assert f[1, :4, 0].all()
    assert not f[1, 4:, 0].any()
    assert not f[1, :2, 1].any()
    assert np.array_equal(r.stored[0, :, 0], r.stored[0, :, 1])


@pytest.mark.usefixtures("uncompiled")
def test_scattered_rows_are_scans_too():
    theta = np.radians(np.arange(-60.0, 61.0, 5.0))
    phi = np.where(theta < 0.0, 0.0, np.pi)
    f = MODEL.f_angles(0.5, 0.0, np.abs(theta), phi)
    rows = Scattered(
        np.full(25, 0.5), np.zeros(25), np.abs(theta), phi, f * np.cos(theta), quantity="brdf * cos(theta_o)"
    )
    r = gn.repair.merge_scans([rows])
    np.testing.assert_allclose(r.stored[0, :, 1], f[12:], rtol=1e-12)
    np.testing.assert_allclose(r.stored[0, :, 0], f[12::-1], rtol=1e-12)


@pytest.mark.usefixtures("rough_albedos")
def test_oriented_scans():
    axes = {"theta_i": [0.4], "theta_o": np.linspace(0.1, 1.2, 12), "phi_i": [0.3], "phi_o": [0.3 + np.pi]}
    brushed = gn.Microfacet(gn.GGX(0.4, 0.2))
    scans = [table(brushed, axes={**axes, "phi_i": [p], "phi_o": [p + np.pi]}) for p in (0.3, 1.3)]
    r = gn.repair.merge_scans(scans, oriented=True)
    assert r.stored.shape == (1, 12, 2, 2)
    for k, s in enumerate(scans):
        np.testing.assert_allclose(r.stored[0, :, k, k], s.stored[0, :, 0, 0])
    assert np.isnan(r.stored[0, :, 0, 1]).all()


@pytest.mark.usefixtures("uncompiled")
def test_scans_that_do_not_fit():
    colour = gn.repair.resample(gn.Lambertian(np.array([0.1, 0.2])), "angles", resolution=(2, 2, 2))
    theta = [0.0, 10.0, 20.0]
    for scans, text in (
        ([], "got no scans"),
        ([scan(0.0, theta, 0.0, 0.1), scan(0.0, theta, 0.0)], "expected all or none"),
        (
            [
                scan(0.0, theta, 0.0),
                colour,
            ],
            "channels differ",
        ),
        ([gn.Lambertian(0.5)], "each is a measurement"),
    ):
        with pytest.raises(gn.errors.ParameterError, match=text):
            gn.repair.merge_scans(scans)


# The instrument's signature.


def test_a_signature_is_taken_off_again(whole):
    stray = gn.Lambertian(0.01) + 0.02 * gn.Microfacet(gn.GGX(0.05))
    signature = table(stray)
    seen = changed(whole, whole.stored + 0.9 * signature.stored)
    r = gn.repair.subtract_signature(seen, signature, scale=0.9)
    np.testing.assert_allclose(r.stored, whole.stored, rtol=1e-7)
    record = r.repairs[0]
    share = 0.9 * signature.stored / seen.stored
    assert record.figures["largest_share"] == pytest.approx(share.max(), rel=1e-6)
    assert record.figures["negative"] == record.figures["without_signature"] == 0
    assert record.largest == pytest.approx(0.9 * signature.stored.max())
    assert record.mean == pytest.approx(0.9 * signature.stored.mean())
    assert r.uncertainty is None


def test_uncertainties_of_a_signature_add_in_quadrature(whole):
    g = changed(whole, whole.stored, 0.02 * whole.stored)
    s = table(gn.Lambertian(0.02))
    s = changed(s, s.stored, 0.1 * s.stored)
    r = gn.repair.subtract_signature(g, s, scale=0.5, scale_uncertainty=0.2)
    parts = (0.02 * whole.stored) ** 2 + (0.5 * 0.1 * s.stored) ** 2 + (0.2 * s.stored) ** 2
    np.testing.assert_allclose(r.uncertainty, np.sqrt(parts), rtol=1e-9)
    only = gn.repair.subtract_signature(whole, s)
    np.testing.assert_allclose(only.uncertainty, 0.1 * s.stored, rtol=1e-9)


@pytest.mark.parametrize(("policy", "left"), [("keep", -0.01), ("zero", 0.0), ("missing", np.nan)])
def test_less_than_nothing(whole, policy, left):
    g = changed(whole, np.full(whole.stored.shape, 0.01))
    r = gn.repair.subtract_signature(g, gn.Lambertian(0.02 * np.pi), negatives=policy)
    np.testing.assert_allclose(r.stored, left)
    assert r.repairs[0].figures["negative"] == 18 * 18 * 36
    assert r.repairs[0].parameters["negatives"] == policy


def test_signatures_that_do_not_reach_everywhere(whole):
    theta = np.radians([0.0, 20.0, 40.0])
    axes = {"theta_i": theta, "theta_o": theta, "phi": whole.axes["phi"]}
    small = table(gn.Lambertian(0.1), axes=axes, outside="missing")
    r = gn.repair.subtract_signature(whole, small)
    inside = whole.axes["theta_i"] <= theta[-1] + 1e-9
    assert np.isnan(r.stored[~inside]).all()
    assert np.isfinite(r.stored[inside][:, inside]).all()
    assert r.repairs[0].figures["without_signature"] == np.isnan(r.stored).sum()
    for bad, text in (
        ({"negatives": "clip"}, "'keep', 'zero', 'missing'"),
        ({"scale": math.nan}, "expected a number"),
        ({"signature": gn.Lambertian(np.array([0.1, 0.2]))}, "2 channels"),
    ):
        with pytest.raises(gn.errors.ParameterError, match=text):
            gn.repair.subtract_signature(whole, **{"signature": small, **bad})


# Apertures.


@pytest.mark.usefixtures("rough_albedos")
def test_a_lambertian_looks_the_same_through_every_aperture():
    white = table(gn.Lambertian(0.7))
    for detector, source in ((0.1, 0.0), (0.0, 0.05), (0.2, 0.1), ((0.02, 0.2), 0.1)):
        r = gn.repair.aperture_averaged(white, detector, source)
        np.testing.assert_allclose(r.stored, white.stored, rtol=1e-12)
        assert r.repairs[0].cells == 0
    grazing = gn.direction(np.radians(np.linspace(70.0, 89.9, 7)), 0.3)
    f = gn.repair.through_aperture(gn.Lambertian(0.7), grazing, grazing, 0.2, 0.1)
    np.testing.assert_allclose(f, 0.7 / np.pi, rtol=1e-12)


APERTURES = [(theta_o, source) for theta_o in (0.0, 40.0, 85.0) for source in (0.0, 3.0)]


@pytest.mark.parametrize(("theta_o", "source"), thinned(APERTURES, [(0.0, 3.0), (40.0, 0.0), (85.0, 0.0)]))
def test_round_apertures_are_the_cones_of_the_biconical_reflectance(theta_o, source):
    wi, wo = gn.direction(math.radians(30.0), 0.2), gn.direction(math.radians(theta_o), 0.2 + np.pi)
    lit, detector = gn.Cone(wi, math.radians(source)) if source else wi, 6.0
    cut = theta_o + detector > 90.0
    tolerance = 1e-4 if cut else 1e-6
    expected = gn.reflectance_factor(MODEL, lit, gn.Cone(wo, math.radians(detector)), tolerance=tolerance) / np.pi
    found = gn.repair.through_aperture(MODEL, wi, wo, math.radians(detector), math.radians(source))
    assert found == pytest.approx(expected, rel=5e-3 if cut else 1e-5)


def test_an_instrument_that_knows_no_horizon_reads_what_is_cut_off():
    half, white = math.radians(5.0), gn.Lambertian(1.0)
    wi = gn.direction(0.0, 0.0)
    for theta in np.radians([60.0, 84.0, 87.0, 89.0]):
        cone = gn.Cone(gn.direction(theta, 0.0), half)
        expected = cone.projected / (math.pi * math.sin(half) ** 2 * math.cos(theta)) / math.pi
        found = gn.repair.through_aperture(white, wi, gn.direction(theta, 0.0), half, horizon="full", rings=16)
        assert found == pytest.approx(expected, rel=2e-2)
        assert (expected * math.pi > 1.0 + 1e-6) == (math.degrees(theta) + 5.0 > 90.0)


class _Spot(gn.Reflectance):
    """A Gaussian lobe about the normal, sigma = 2 degrees."""

    def formula(self, wi, wo):
        from gonio.arrays import ops

        return ops.exp(-0.5 * (wo.x * wo.x + wo.y * wo.y) / math.radians(2.0) ** 2)


def test_a_narrow_lobe_gets_wider_by_what_the_aperture_is():
    """Variances add: that of a round aperture is half_angle^2/4 in each direction, of a rectangular one side^2/3."""
    sigma = math.radians(2.0)
    x = np.radians(np.arange(-14.0, 14.01, 0.4))
    X, Y = np.meshgrid(x, x, indexing="ij")
    wo = gn.direction(np.hypot(X, Y), np.arctan2(Y, X))
    for opening, added in (
        (math.radians(3.0), (math.radians(3.0) ** 2 / 4.0,) * 2),
        (0.0, (0.0, 0.0)),
    ):
        f = gn.repair.through_aperture(_Spot(), [0.0, 0.0, 1.0], wo, opening)
        for k, w in enumerate((X, Y)):
            assert (w**2 * f).sum() / f.sum() == pytest.approx(sigma**2 + added[k], rel=6e-3)
    half = math.radians(3.0)
    peak = gn.repair.through_aperture(_Spot(), [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], half)
    assert peak == pytest.approx((1.0 - math.exp(-0.5 * (half / sigma) ** 2)) * 2.0 * (sigma / half) ** 2, rel=1e-3)
    # A slit along theta broadens along theta: at azimuth 0 that is x.
    at = gn.direction(np.radians([4.0, 4.0]), np.array([0.0, 0.5 * np.pi]))
    slit = gn.repair.through_aperture(_Spot(), [0.0, 0.0, 1.0], at, (half, 1e-3))
    assert slit[0] == pytest.approx(slit[1], rel=1e-9)
    one = np.linspace(-half, half, 2001)
    expected = np.exp(-0.5 * ((np.radians(4.0) + one) / sigma) ** 2).mean()
    assert slit[0] == pytest.approx(expected, rel=1e-2)


def spot_table():
    theta = np.radians(np.arange(0.0, 16.0, 0.5))
    axes = {"theta_i": [0.0], "theta_o": theta, "phi": np.radians(np.arange(0.0, 360.0, 30.0))}
    return table(_Spot(), axes=axes)


@pytest.mark.usefixtures("rough_albedos")
@pytest.mark.parametrize(("method", "left"), [("van_cittert", 0.012), ("richardson_lucy", 0.0025)])
def test_apertures_are_taken_off_again(method, left):
    true = spot_table()
    half = math.radians(2.0)
    seen = gn.repair.aperture_averaged(true, half)
    assert seen.stored[0, 0, 0] == pytest.approx(0.79, abs=0.01)
    r = gn.repair.aperture_removed(seen, half, method=method)
    assert np.abs(seen.stored - true.stored).max() > 0.2
    assert 0.3 * left < np.abs(r.stored - true.stored).max() < left
    figures = r.repairs[-1].figures
    assert figures["steps"] == 10
    assert figures["residual"] < 0.05 * figures["residual_before"]
    again = gn.repair.aperture_averaged(r, half).stored - seen.stored
    rms = np.sqrt(np.mean(again**2) / np.mean(seen.stored**2))
    assert figures["residual"] == pytest.approx(rms, rel=1e-6)
    first = gn.repair.aperture_removed(seen, half, method=method, iterations=1)
    assert first.repairs[-1].figures["residual"] > figures["residual"]
    if method == "richardson_lucy":
        assert r.stored.min() >= 0.0


@pytest.mark.usefixtures("rough_albedos")
def test_sharpening_stops_at_the_noise_and_says_how_much_it_grew():
    true = spot_table()
    half = math.radians(2.0)
    seen = gn.repair.aperture_averaged(true, half)
    rng = np.random.default_rng(6)
    finds = []
    for _ in range(8):
        noise = 0.03 * rng.standard_normal(seen.stored.shape)
        g = changed(seen, seen.stored + noise, np.full(seen.stored.shape, 0.03))
        r = gn.repair.aperture_removed(g, half)
        finds.append(r.stored)
    figures = r.repairs[-1].figures
    assert 1 <= figures["steps"] <= 2
    assert figures["noise"] > 1.2
    assert np.sqrt(np.mean((r.stored - true.stored) ** 2)) < 0.9 * np.sqrt(np.mean((g.stored - true.stored) ** 2))
    # The uncertainty said of one is the scatter among repetitions.
    scatter = np.std(finds, axis=0, ddof=1).mean()
    assert r.uncertainty.mean() == pytest.approx(scatter, rel=0.2)
    none = gn.repair.aperture_removed(changed(seen, seen.stored, np.full(seen.stored.shape, 0.5)), half)
    assert none.repairs[-1].figures["steps"] == 0


@pytest.mark.usefixtures("rough_albedos")
def test_averages_over_apertures_with_holes():
    g = spot_table()
    f = g.stored.copy()
    f[0, 4:6] = np.nan
    r = gn.repair.aperture_averaged(changed(g, f), math.radians(2.0))
    assert np.array_equal(np.isnan(r.stored), np.isnan(f))
    assert r.stored[0, 3, 0] == pytest.approx(
        gn.repair.aperture_averaged(g, math.radians(2.0)).stored[0, 3, 0], rel=0.1
    )


def test_uncertainty_through_an_aperture_is_an_upper_bound():
    g = spot_table()
    g = changed(g, g.stored, 0.1 * g.stored)
    r = gn.repair.aperture_averaged(g, math.radians(2.0))
    np.testing.assert_allclose(r.uncertainty, 0.1 * r.stored, rtol=1e-9)


def test_apertures_that_make_no_sense(whole):
    for call, text in (
        (lambda: gn.repair.aperture_averaged(whole, 5.0), "are these degrees"),
        (lambda: gn.repair.aperture_averaged(whole, -0.1), "expected a half-angle"),
        (lambda: gn.repair.aperture_averaged(whole, (0.1, 0.1, 0.1)), "expected a number or \\(a number, a number\\)"),
        (lambda: gn.repair.aperture_averaged(whole, 0.1, horizon="cut"), "'visible', 'full'"),
        (lambda: gn.repair.aperture_averaged(whole, 0.1, rings=0), "1 to 64"),
        (lambda: gn.repair.aperture_removed(whole, 0.1, method="wiener"), "'van_cittert'"),
        (lambda: gn.repair.aperture_removed(whole, 0.1, iterations=0), "from 1"),
        (
            lambda: gn.repair.aperture_removed(changed(whole, -whole.stored), 0.1, method="richardson_lucy"),
            "some f are negative",
        ),
    ):
        with pytest.raises(gn.errors.ParameterError, match=text):
            call()


# Other measurements.


@pytest.mark.usefixtures("rough_albedos")
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.full)])
def test_merl_files_are_grids(whole):
    """The repair of a `whole` one takes 400 MB; else that of some rows of its grid."""
    rows = slice(None) if whole else slice(18, 26)
    raw = np.full((3, 90, 90, 180), 0.3)
    raw[:, 20:24, 30:34, 40:44] = -1.0
    raw[1] *= 1.0 + 0.1 * np.cos(np.radians(2.0 * np.arange(180) + 1.0))
    m = MERL(raw)
    grid = m.as_grid()
    some = {**grid.axes, "theta_h": grid.axes["theta_h"][rows]}
    r = gn.repair.fill_holes(m if whole else grid.with_table(grid.stored[rows], axes=some))
    assert r.parameterization == "half_difference"
    assert r.channel_names == ("R", "G", "B")
    assert r.periods == {"phi_d": pytest.approx(np.pi)}
    raw = raw[:, rows]
    holes = np.zeros(raw.shape[1:], bool)
    holes[(slice(20, 24) if whole else slice(2, 6)), 30:34, 40:44] = True
    for c, scale in enumerate(SCALE):
        filled, known = r.stored[..., c], raw[c] > 0.0
        assert np.array_equal(known, ~holes)
        assert np.array_equal(filled[known], scale * raw[c][known])
        beside = scale * raw[c, 0, 0, 39]
        np.testing.assert_allclose(filled[holes], beside, rtol=0.05)
    assert r.repairs[0].cells == r.repairs[0].filled == 64
    wi, wo = gn.direction(np.array([0.3, 0.9]), 0.1), gn.direction(np.array([0.8, 0.2]), 2.0)
    np.testing.assert_allclose(r.f(wi, wo), m.f(wi, wo), rtol=1e-6)


@pytest.mark.usefixtures("uncompiled")
def test_scattered_measurements_are_repaired_as_their_grid():
    rng = np.random.default_rng(7)
    theta_i, theta_o = np.repeat([0.2, 0.6, 1.0], 60), 1.3 * rng.random(180)
    phi_o = 2.0 * np.pi * rng.random(180)
    m = Scattered(theta_i, np.zeros(180), theta_o, phi_o, MODEL.f_angles(theta_i, 0.0, theta_o, phi_o) - 0.1)
    r = gn.repair.remove_negatives(m)
    assert type(r) is Gridded
    assert r.stored.shape == m.brdf().shape
    assert r.stored.min() == 0.0
