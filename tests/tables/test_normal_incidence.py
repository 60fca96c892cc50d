"""Tables at the poles of their angles: where a direction has no azimuth the other's counts, and totals come out."""

import math

import numpy as np
import optical_files as files
import pytest
from click.testing import CliRunner
from libraries import thinned
from places import real

import gonio as gn
from gonio.cli.commands import cli
from gonio.facts.material import facts
from gonio.tables.angle_systems import SYSTEMS

CIRCLE = np.radians(np.arange(0.0, 360.0, 15.0))
THETA = np.radians(np.arange(0.0, 91.0, 15.0))


def wavy(system: str) -> gn.Gridded:
    """A table of an isotropic material whose values vary around the normal at every node: between 0.05 and 0.15."""
    axes = {name: CIRCLE if name in SYSTEMS[system].isotropic[2:] else THETA for name in SYSTEMS[system].isotropic}
    values = 0.1 + 0.05 * np.sin(CIRCLE + 0.4) * np.ones((len(THETA), len(THETA), 1))
    return gn.Gridded(system, axes, values)


@pytest.mark.parametrize("system", [name for name in SYSTEMS if "theta_i" in SYSTEMS[name].isotropic])
def test_at_normal_incidence_the_nodes_give_what_they_hold(system):
    m = wavy(system)
    wi, wo = m.directions()
    up = (wo[0, ..., 2] > 0.01) & (wo[0, ..., 2] < 1.0) & (np.arange(len(THETA)) > 0)[:, None]
    assert m.f(wi[0], wo[0])[up] == pytest.approx(m.stored[0][up], rel=1e-12)


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("tolerance", thinned([1e-5, 1e-6], [1e-5]))
def test_at_normal_incidence_light_goes_to_all_azimuths(system, tolerance):
    """The integral is the one beside the normal."""
    m = wavy(system)
    at, beside = gn.albedo(m, gn.direction(np.array([[0.0], [1e-6]]), [0.0, 1.2]), tolerance=tolerance)
    assert at == pytest.approx(beside, rel=1e-4)


def test_along_the_normal_light_is_seen_from_all_azimuths():
    """Exchanged: wo along the normal, wi all around."""
    m = wavy("angles")
    wi = gn.direction(0.7, CIRCLE)
    assert m.f(wi, [0.0, 0.0, 1.0]) == pytest.approx(m.f(gn.direction(0.7, 0.0), gn.direction(1e-9, -CIRCLE)), rel=1e-6)
    assert np.ptp(m.f(wi, [0.0, 0.0, 1.0])) > 0.09


def test_reciprocal_tables_stay_so_at_the_normal():
    values = wavy("angles").stored
    m = gn.Gridded("angles", wavy("angles").axes, 0.5 * (values + np.roll(values[:, :, ::-1], 1, axis=2)))
    wo = gn.direction(0.7, CIRCLE + 0.1)
    assert m.f([0.0, 0.0, 1.0], wo) == pytest.approx(m.f(wo, [0.0, 0.0, 1.0]), rel=1e-12)


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("wo", [gn.direction(0.6, 2.0), gn.direction(0.0, 0.0)])
def test_derivatives_at_the_poles_are_finite(system, wo):
    torch = pytest.importorskip("torch")
    m = wavy(system)
    for pair in ((gn.direction(0.0, 0.0), wo), (wo, gn.direction(0.0, 0.0))):
        wi, wo = (torch.tensor(np.array(w), dtype=torch.float64, requires_grad=True) for w in pair)
        m.f(wi, wo).sum().backward()
        assert torch.isfinite(wi.grad).all() and torch.isfinite(wo.grad).all()


def speos(shares: list[float]) -> str:
    """A file whose values at normal incidence vary with the azimuth by a factor of 6."""
    theta, phi = np.arange(0, 91, 5), np.arange(0, 361, 10)
    tables = ""
    for share in shares:
        tables += f"{share}\n{len(theta)}\t{len(phi)}\n\t" + "\t".join(map(str, phi)) + "\n"
        for t in theta:
            row = 1.0 + math.sin(math.radians(t)) * 0.7 * np.cos(np.radians(2 * phi))
            tables += "\t".join(map(repr, [int(t), *row.tolist()])) + "\n"
    head = "OPTIS - brdf surface file v8.0\n0\na comment\n3\nabc\n1\t0\n1\n"
    return f"{head}{len(shares)}\t1\n" + "\t".join(str(30 * k) for k in range(len(shares))) + f"\n550\n{tables}"


def test_the_shares_of_a_speos_file_are_what_its_values_reflect(tmp_path):
    (tmp_path / "a.brdf").write_text(speos([2.3, 30.0, 60.0]))
    m = gn.load(tmp_path / "a.brdf")
    rho = gn.albedo(m, gn.direction(np.radians([0.0, 30.0, 60.0]), 0.0), tolerance=1e-6)
    assert rho[:, 0] == pytest.approx([0.023, 0.3, 0.6], rel=5e-3)


def test_info_says_that_a_stated_total_is_that_of_the_values(tmp_path):
    (tmp_path / "a.brdf").write_text(speos([2.3, 30.0]))
    totals = facts("a.brdf", gn.load(tmp_path / "a.brdf"))["stated_totals"]
    assert totals["theta_i"] == [0.0, 30.0] and totals["stated"] == [[0.023], [0.3]]
    said = CliRunner().invoke(cli, ["info", str(tmp_path / "a.brdf")]).output
    assert "stated total" in said and "that of the values, to 0." in said and "not that" not in said


def test_info_says_where_a_stated_total_and_the_values_disagree(tmp_path):
    text = files.zemax()
    (tmp_path / "a.bsdf").write_text(text)
    m = gn.load(tmp_path / "a.bsdf")
    totals = facts("a.bsdf", m)["stated_totals"]
    assert totals["stated"] == m.about["TIS"].transpose(1, 2, 0).reshape(-1, 1).tolist()
    at = gn.direction(np.radians(totals["theta_i"]), np.radians(totals["phi_i"]))
    assert np.ravel(totals["integral"]) == pytest.approx(np.ravel(gn.albedo(m, at, tolerance=1e-5)), abs=1e-3)
    off = np.ravel(totals["integral"]) / np.ravel(totals["stated"]) - 1.0
    worst = np.abs(off).argmax()
    said = " ".join(CliRunner().invoke(cli, ["info", str(tmp_path / "a.bsdf")]).output.split())
    assert f"not that of the values: at {totals['theta_i'][worst]:g}° the file says" in said
    assert f"({100.0 * off[worst]:+.2g} %)" in said


@pytest.mark.parametrize("name", ["Zemax", "LightTools", "Speos"])
def test_totals_that_are_written_are_those_of_the_values(tmp_path, name):
    glossy = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
    gn.save(glossy, tmp_path / "a.brdf", name, step=2.5)
    totals = facts("a.brdf", gn.load(tmp_path / "a.brdf"))["stated_totals"]
    before = gn.albedo(glossy, gn.direction(np.radians(totals["theta_i"]), 0.0))
    assert np.ravel(totals["stated"]) == pytest.approx(before, rel=2e-2)
    assert np.ravel(totals["integral"]) == pytest.approx(np.ravel(totals["stated"]), rel=2e-2)


def test_a_real_scan_at_normal_incidence_is_read_at_all_azimuths():
    """An RT-300S's export for Speos: its values are raw readings below 0."""
    m = gn.load(real("ua_loft/formats/test_speos.rtd"))
    at, beside = (gn.albedo(m, gn.direction(theta, 0.0), tolerance=1e-5) for theta in (0.0, 1e-5))
    assert at == pytest.approx(beside, rel=1e-4)
