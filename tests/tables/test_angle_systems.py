"""The systems of angles, discovered from the one table of them: what takes the name of one takes that of each."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import gonio as gn
from gonio.base.angles import direction
from gonio.cli.commands import cli
from gonio.cli.info import facts_as_text
from gonio.conversion import comparison
from gonio.errors import ParameterError
from gonio.formula.direction import Direction
from gonio.numerics.lattice import lattice
from gonio.repair import _cells
from gonio.tables.angle_systems import ANGLES, AZIMUTHS, SYSTEMS

ISOTROPIC = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.5), gn.Dielectric(1.5))
BRUSHED = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.4, 0.6), gn.Dielectric(1.5))
MATERIALS = {3: ISOTROPIC, 4: BRUSHED}
NODES = {3: (9, 9, 12), 4: (6, 6, 8, 8)}

pytestmark = pytest.mark.usefixtures("one_probe")
every = pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS)
both = pytest.mark.parametrize("count", [3, 4], ids=["isotropic", "oriented"])
CASES = {f"{count}-{name}": (system, count) for name, system in SYSTEMS.items() for count in (3, 4)}
each_once = pytest.mark.parametrize(
    ("system", "count"),
    [
        pytest.param(*case, id=name, marks=() if k % 4 in (0, 3) else pytest.mark.full)
        for k, (name, case) in enumerate(CASES.items())
    ],
)
"""By default every other system isotropic, the others oriented."""


@pytest.fixture(autouse=True)
def rough_albedos(monkeypatch):
    """Albedos do not matter here: those of records and reports are computed roughly."""
    monkeypatch.setattr(_cells, "ALBEDO_TOLERANCE", 0.1)
    monkeypatch.setattr(comparison, "ALONG", 3)
    monkeypatch.setattr(comparison, "TOLERANCES", (0.1, 0.1))


def pairs(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    u = lattice(count, 4)
    return direction(0.2 + 1.2 * u[:, 0], 6.28 * u[:, 1]), direction(0.2 + 1.2 * u[:, 2], 6.28 * u[:, 3])


def table(system, count: int) -> gn.Gridded:
    """Numbers of no symmetry, at nodes that turning by 45 degrees maps onto themselves."""
    axes = system.nodes(NODES[count])
    nodes = np.meshgrid(*axes.values(), indexing="ij")
    f = 0.3 + sum(0.02 * (k + 1) * np.cos(x + 0.1 * k) for k, x in enumerate(nodes))
    return gn.Gridded(system.name, axes, f)


@every
@both
def test_what_is_said_of_a_system_fits_together(system, count):
    names = system.axes(count == 4)
    assert len(names) == count and set(names) <= set(ANGLES)
    assert set(system.turned) <= set(AZIMUTHS)
    for offered in (system.coarse, system.fine, system.tabulated or system.fine):
        assert [*system.nodes(offered[count == 4])] == [*names]
    wi, wo = pairs()
    found = system.angles(Direction(*wi.T), Direction(*wo.T), count == 4)
    again = system.pairs(*found)
    if count == 4:
        assert np.allclose(again, (wi, wo), atol=1e-12)
    assert np.allclose(np.sum(again[0] * again[1], -1), np.sum(wi * wo, -1), atol=1e-12)


@every
def test_a_turn_moves_pairs_along_the_turned_axes_only(system):
    wi, wo = pairs()
    c, s = np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    before, after = (
        system.angles(Direction(*a.T), Direction(*b.T), True) for a, b in ((wi, wo), (wi @ turn, wo @ turn))
    )
    for name, x, y in zip(system.oriented, before, after, strict=True):
        moved = np.angle(np.exp(1j * (y - x)))
        assert np.allclose(moved, 0.3 if name in system.turned else 0.0, atol=1e-9), name


@every
@both
def test_exchanging_wi_and_wo_does_to_the_angles_what_is_said(system, count):
    names = system.axes(count == 4)
    if not system.exchange.keys() >= set(names):
        return
    wi, wo = (Direction(*w.T) for w in pairs())
    before, after = (dict(zip(names, system.angles(*x, count == 4), strict=True)) for x in ((wi, wo), (wo, wi)))
    for name, x in before.items():
        other, sign, shift = system.exchange[name]
        assert np.allclose(np.exp(1j * after[other]), np.exp(1j * (sign * x + shift)), atol=1e-9), name


@each_once
def test_to_dataset_and_back(system, count):
    ds = gn.tables.to_dataset(MATERIALS[count], system.name, NODES[count])
    assert ds.attrs["parameterization"] == system.name
    assert all(ds[name].attrs["long_name"] == ANGLES[name].meaning for name in system.axes(count == 4))
    m = gn.tables.from_dataset(ds)
    assert np.array_equal(m.stored, ds["values"].values, equal_nan=True)
    wi, wo = m.directions()
    up = (wi[..., 2] > 1e-3) & (wo[..., 2] > 1e-3)
    assert np.allclose(m.stored[up], MATERIALS[count].f(wi[up], wo[up]), rtol=1e-9)
    assert gn.tables.to_dataset(MATERIALS[count], system.name)["values"].shape == system.coarse[count == 4]


@each_once
def test_resample(system, count):
    m = gn.repair.resample(MATERIALS[count], system.name, resolution=NODES[count])
    assert m.parameterization == system.name and tuple(m.axes) == system.axes(count == 4)
    assert m.repairs[-1].figures["error_rms"] < 0.2
    other = gn.repair.resample(table(system, count), system.name, axes=m.axes)
    wi, wo = m.directions()
    up = (wi[..., 2] > 1e-3) & (wo[..., 2] > 1e-3)
    assert np.allclose(other.stored[up], table(system, count).f(wi[up], wo[up]))


@each_once
@pytest.mark.parametrize("kind", ["reciprocity", "plane", "isotropy"])
def test_symmetrize(system, count, kind):
    m = gn.repair.symmetrize(table(system, count), kind)
    wi, wo = pairs()
    mirror = np.array([1.0, -1.0, 1.0])
    turned = {"reciprocity": (wo, wi), "plane": (wi * mirror, wo * mirror), "isotropy": (wi, wo)}[kind]
    if m.repairs[-1].figures["on_grid"]:
        assert np.allclose(m.f(*turned), m.f(wi, wo), rtol=1e-9)
    exact = kind != "reciprocity" or system.exchange.keys() >= set(system.axes(count == 4))
    assert bool(m.repairs[-1].figures["on_grid"]) == exact


@each_once
def test_on_the_command_line(system, count, tmp_path):
    source, path = tmp_path / "x.json", tmp_path / "x.nc"
    gn.save(MATERIALS[count], source)
    asked = ["--option", f"parameterization={system.name}", "--resolution", ",".join(map(str, NODES[count]))]
    done = CliRunner().invoke(cli, ["convert", str(source), str(path), *asked])
    assert done.exit_code == 0, done.output
    said = json.loads(CliRunner().invoke(cli, ["info", str(path), "--json"]).output)
    assert tuple(said["axes"]) == system.axes(count == 4)
    assert system.title in " ".join(facts_as_text(said).split())


@each_once
@pytest.mark.parametrize("suffix", [".nc", ".zarr", ".csv"])
def test_files_that_hold_tables_hold_each(system, count, suffix, tmp_path):
    m = table(system, count)
    gn.save(m, tmp_path / f"x{suffix}")
    again = gn.load(tmp_path / f"x{suffix}")
    assert tuple(again.axes) == tuple(m.axes)
    assert np.allclose(again.stored, m.stored, rtol=1e-15)
    assert np.allclose(again.f(*pairs()), m.f(*pairs()), rtol=1e-12)
    if suffix == ".nc":
        gn.save(MATERIALS[count], tmp_path / "y.nc", parameterization=system.name, resolution=NODES[count])
        assert gn.load(tmp_path / "y.nc").parameterization == system.name


@each_once
def test_ssdd_which_has_three_systems_holds_each(system, count, tmp_path):
    """A relative table's nodes are those of a grid of both azimuths, too, if its steps are the same."""
    m = gn.repair.resample(MATERIALS[count], system.name, resolution=NODES[count])
    gn.save(m, tmp_path / "x.ssdd")
    again = gn.load(tmp_path / "x.ssdd")
    wi, wo = m.directions()
    up = (wi[..., 2] > 1e-3) & (wo[..., 2] > 1e-3)
    assert np.allclose(again.f(wi[up], wo[up]), m.f(wi[up], wo[up]), rtol=1e-9)


@every
def test_tabulate_offers_those_that_say_so(system):
    if system.tabulated is None:
        offered = " or ".join(repr(s.name) for s in SYSTEMS.values() if s.tabulated)
        with pytest.raises(ParameterError, match=f"'{system.name}': expected {offered}"):
            gn.tables.tabulate(ISOTROPIC, system.name)
    else:
        assert gn.tables.tabulate(ISOTROPIC, system.name, resolution=(8, 8, 12)).parameterization == system.name


@pytest.mark.parametrize(
    "call", [gn.tables.to_dataset, gn.repair.resample, gn.tables.tabulate], ids=lambda c: c.__name__
)
def test_another_name_is_refused_with_those_there_are(call):
    with pytest.raises(ParameterError, match=", ".join(map(repr, SYSTEMS))):
        call(ISOTROPIC, "elliptic")
