"""Grids of angles: parameterizations, spacing of nodes, wrap-around, holes, what lies beyond; scattered rows."""

import math
import pickle

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.base.quantities import QUANTITIES, from_brdf, to_brdf
from gonio.errors import ParameterError
from gonio.formula.direction import Direction
from gonio.integrals.over_hemisphere import integrate
from gonio.numerics.lattice import lattice
from gonio.tables import interpolation
from gonio.tables.angle_systems import SYSTEMS
from gonio.tables.gridded import Gridded
from gonio.tables.interpolation import NEIGHBOURS, _by_radial_functions
from gonio.tables.scattered import Scattered, gridded_or_scattered

rng = np.random.default_rng(5)
EVEN = np.linspace(0.0, 0.5 * math.pi, 7)
UNEVEN = np.radians([0.0, 5.0, 20.0, 33.0, 51.0, 75.0, 88.0])
MANY = np.radians(np.sort(rng.uniform(1.0, 89.0, 25)))  # looked up by bisection
SQUARES = np.radians((np.arange(9) + 0.5) ** 2 / 9.0)
TURN = np.radians([0.0, 20.0, 90.0, 200.0, 300.0])
AXES = {
    ("angles", 3): [EVEN, UNEVEN, TURN],
    ("angles", 4): [UNEVEN, EVEN, TURN, np.radians(np.arange(0.0, 360.0, 45.0))],
    ("relative", 3): [EVEN, UNEVEN, TURN],
    ("relative", 4): [UNEVEN, EVEN, TURN, np.radians(np.arange(0.0, 360.0, 45.0))],
    ("half_difference", 3): [SQUARES, MANY, np.radians(np.arange(0.5, 180.0, 30.0))],
    ("half_difference", 4): [SQUARES, EVEN, TURN, TURN],
    ("specular", 3): [UNEVEN, np.radians([0.0, 10.0, 30.0, 90.0, 170.0]), TURN],
    ("specular", 4): [UNEVEN, np.radians([0.0, 10.0, 30.0, 90.0, 170.0]), TURN, TURN],
}


def grid(name, count, values=None, **more):
    axes = dict(zip(SYSTEMS[name].axes(count == 4), AXES[name, count], strict=True))
    if values is None:
        values = np.random.default_rng(1).uniform(0.1, 1.0, tuple(map(len, axes.values())))
    return Gridded(name, axes, values, **more)


def pairs(n=400):
    u = lattice(n, 4)
    theta = np.arccos(1.0 - 0.99 * u[:, :2])
    return gn.direction(theta[:, 0], 6.2 * u[:, 2]), gn.direction(theta[:, 1], 6.2 * u[:, 3])


@pytest.mark.parametrize(("name", "count"), AXES)
def test_directions_to_angles_and_back(name, count):
    kind = SYSTEMS[name]
    wi, wo = pairs()
    found = kind.angles(Direction(*wi.T), Direction(*wo.T), count == 4)
    back = kind.pairs(*found)
    if count == 4:
        np.testing.assert_allclose(back[0], wi, atol=1e-12)
        np.testing.assert_allclose(back[1], wo, atol=1e-12)
    else:
        again = kind.angles(*(Direction(*w.T) for w in back), False)
        np.testing.assert_allclose(again, found, atol=1e-9)
        np.testing.assert_allclose(np.sum(back[0] * back[1], -1), np.sum(wi * wo, -1), atol=1e-12)


def test_specular_angles_by_hand():
    """For wi = (sin t, 0, cos t): radial 0 is the mirror direction, azimuth 0 towards the horizon, pi/2 s x e1."""
    pairs = SYSTEMS["specular"].pairs
    t, r = math.radians(40.0), math.radians(10.0)
    for azimuth, theta, phi in ((0.0, 50.0, 180.0), (math.pi, 30.0, 180.0)):
        wi, wo = pairs(np.array(t), np.array(r), np.array(azimuth))
        np.testing.assert_allclose(wi, gn.direction(t, 0.0), atol=1e-15)
        np.testing.assert_allclose(wo, gn.direction(math.radians(theta), math.radians(phi)), atol=1e-15)
    _, wo = pairs(np.array(t), np.array(0.5 * math.pi), np.array(0.5 * math.pi))
    np.testing.assert_allclose(wo, [0.0, -1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(("name", "count"), AXES)
def test_exact_at_nodes(name, count):
    m = grid(name, count)
    wi, wo = m.directions()
    up = (wi[..., 2] > 1e-3) & (wo[..., 2] > 1e-3)
    # Where an angle is 0 the azimuth about it is not determined; and nodes on the seam of a polar axis.
    for k, name_ in enumerate(m.axes):
        if name_ in ("theta_i", "theta_o", "theta_h", "theta_d", "radial"):
            up &= (np.moveaxis(np.broadcast_to(m.axes[name_], (*np.delete(up.shape, k), up.shape[k])), -1, k)) > 1e-6
    assert up.sum() > 50
    np.testing.assert_allclose(m.f(wi[up], wo[up]), m.stored[up], rtol=1e-9)


@pytest.mark.parametrize(("name", "count"), AXES)
def test_linear_between_nodes(name, count):
    """Against a direct interpolation by SciPy, over the closed circle."""
    from scipy.interpolate import RegularGridInterpolator

    m = grid(name, count)
    values, nodes = m.stored, []
    for k, (axis, x) in enumerate(m.axes.items()):
        if axis in m.periods:
            values = np.concatenate([values, values.take([0], axis=k)], axis=k)
            x = np.append(x, x[0] + 2.0 * math.pi)
        nodes.append(x)
    wi, wo = pairs()
    angles = SYSTEMS[name].angles(Direction(*wi.T), Direction(*wo.T), count == 4)
    at = [
        x[0] + np.mod(a - x[0], 2.0 * math.pi) if axis in m.periods else np.clip(a, x[0], x[-1])
        for axis, a, x in zip(m.axes, angles, nodes, strict=True)
    ]
    if name == "half_difference":  # spaced as its square root
        nodes[0], at[0] = np.sqrt(nodes[0]), np.sqrt(at[0])
    expected = RegularGridInterpolator(nodes, values)(np.stack(at, -1))
    np.testing.assert_allclose(m.f(wi, wo), expected, rtol=1e-9)


def test_mirrored_and_period():
    axes = {"theta_i": EVEN, "theta_o": EVEN, "phi": np.radians([0.0, 60.0, 120.0, 180.0])}
    m = Gridded("angles", axes, rng.uniform(size=(7, 7, 4)), mirrored=True)
    wi, wo = pairs()
    flip = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(m.f(wi, wo), m.f(wi * flip, wo * flip), rtol=1e-9)
    half = {"theta_h": EVEN, "theta_d": EVEN, "phi_d": np.radians([0.0, 60.0, 120.0])}
    m = Gridded("half_difference", half, rng.uniform(size=(7, 7, 3)), periods={"phi_d": math.pi})
    np.testing.assert_allclose(m.f(wi, wo), m.f(wo, wi), rtol=1e-9)


def test_channels_uncertainty_and_names():
    axes = {"theta_i": EVEN, "theta_o": EVEN, "phi": [0.0]}
    values = rng.uniform(size=(7, 7, 1, 2))
    m = Gridded("angles", axes, values, channels=[450.0, 550.0], uncertainty=0.1 * values)
    assert m.channel_names == (450.0, 550.0)
    assert m.f(*pairs()).shape == (400, 2)
    assert m.data["uncertainty"].shape == (7, 7, 1, 2)
    assert m.data["wavelength"].attrs["units"] == "nm"
    assert pickle.loads(pickle.dumps(m)) == m
    assert m != Gridded("angles", axes, values, channels=[450.0, 560.0], uncertainty=0.1 * values)
    assert m != Gridded("angles", axes, values, channels=[450.0, 550.0])
    assert m != Gridded("angles", {**axes, "phi": [1.0]}, values, channels=[450.0, 550.0], uncertainty=0.1 * values)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_quantities(quantity):
    """A Lambertian surface, whatever the table holds of it."""
    axes = {"theta_i": UNEVEN, "theta_o": UNEVEN, "phi": TURN}
    flat = Gridded("angles", axes, np.full((7, 7, 5), 0.25))
    wi, wo = flat.directions()
    values = from_brdf(quantity, np.full((7, 7, 5), 0.25), wi[..., 2], wo[..., 2])
    np.testing.assert_allclose(to_brdf(quantity, values, wi[..., 2], wo[..., 2]), 0.25)
    m = Gridded("angles", axes, values, quantity=quantity, uncertainty=0.1 * values)
    np.testing.assert_allclose(m.f(*pairs()), 0.25, rtol=1e-12)
    np.testing.assert_allclose(m.brdf_uncertainty(), 0.025, rtol=1e-12)
    again = m.with_brdf(m.brdf(), m.brdf_uncertainty(), repaired="nothing")
    np.testing.assert_allclose(again.stored, m.stored, rtol=1e-14)
    assert again.quantity == quantity
    assert again.about["repaired"] == "nothing"


def test_undetermined_at_the_horizon():
    """A table of f cos(theta_o) says nothing of f at 90 degrees: a hole, not an infinity."""
    axes = {"theta_i": EVEN, "theta_o": EVEN, "phi": [0.0]}
    values = np.broadcast_to(0.25 * np.cos(EVEN)[:, None], (7, 7, 1))
    m = Gridded("angles", axes, values, quantity="brdf * cos(theta_o)")
    np.testing.assert_allclose(m.f(*pairs()), 0.25, rtol=1e-9)
    infinite = np.full((7, 7, 1), np.inf)
    infinite[:3] = 0.25
    assert np.isnan(Gridded("angles", axes, infinite).f_angles(1.5, 0.0, 0.3, 0.0))


def test_holes():
    """A node without data is left out; where only such nodes count, f is NaN."""
    axes = {"theta_i": EVEN, "theta_o": EVEN, "phi": [0.0]}
    values = np.ones((7, 7, 1))
    values[3, 3] = np.nan
    m = Gridded("angles", axes, values)
    inside, beside = np.array([EVEN[3], EVEN[3] + 0.02]), np.array([EVEN[3], EVEN[3] + 0.1])
    f = m.f_angles(inside, 0.0, beside, 0.0)
    assert np.isnan(f[0])
    assert f[1] == pytest.approx(1.0)
    assert not m.valid[3, 3, 0]
    nearest = Gridded("angles", axes, values, interpolation="nearest")
    assert np.isnan(nearest.f_angles(EVEN[3] + 0.1, 0.0, EVEN[3] - 0.1, 0.0))


def test_beyond_the_nodes():
    axes = {"theta_i": UNEVEN, "theta_o": np.radians([10.0, 80.0]), "phi": [0.0]}
    values = np.broadcast_to(np.array([1.0, 2.0])[:, None], (7, 2, 1))
    low, high = np.radians([5.0, 85.0])
    for outside, expected in (("hold", [1.0, 2.0]), ("missing", [np.nan, np.nan]), ("zero", [0.0, 0.0])):
        m = Gridded("angles", axes, values, outside=outside)
        np.testing.assert_array_equal(m.f_angles(0.5, 0.0, np.array([low, high]), 0.0), expected)
        assert m.f_angles(0.5, 0.0, np.radians(45.0), 0.0) == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("name", "count"), thinned(AXES, [case for case in AXES if case[1] == 4 or case[0] == "angles"])
)
@pytest.mark.parametrize("samples", thinned([1 << 14, 1 << 16], [1 << 14]))
def test_sampling(name, count, samples):
    m = grid(name, count)
    u = lattice(samples)
    wo = gn.direction(0.7, 0.4)
    s = m.sample(np.broadcast_to(wo, (len(u), 3)), u)
    used = s.pdf > 0.0
    np.testing.assert_allclose(m.pdf(s.wi, wo)[used], s.pdf[used], rtol=1e-7)
    weight = np.where(used, s.weight, 0.0)
    assert weight.mean() == pytest.approx(float(integrate(m, wo, 1e-3, incident=False).value), rel=1e-2)
    assert weight.max() < 5.01 * math.pi


def test_little_is_drawn_beside_the_lobe():
    m = gn.tables.tabulate(gn.Microfacet(gn.GGX(0.2)), "half_difference", resolution=(45, 20, 12))
    s = m.sample(np.broadcast_to(gn.direction(0.7, 0.4), (1 << 14, 3)), lattice(1 << 14))
    weight = np.where(s.pdf > 0.0, s.weight, 0.0)
    assert weight.std() < 0.35 * weight.mean()


def test_every_library(library):
    m = grid("specular", 3)
    wi, wo = pairs(50)
    found = library.numpy(m.f(library.array(wi), library.array(wo)))
    np.testing.assert_allclose(found, m.f(wi, wo), rtol=1e-9)


# Rows of measurements.


def rows_of(*axes):
    return [x.reshape(-1) for x in np.meshgrid(*axes, indexing="ij")]


def shuffled(*columns):
    order = np.random.default_rng(3).permutation(len(columns[0]))
    return [c[order] for c in columns]


def test_rows_that_are_a_grid():
    theta_i, theta_o, phi = rows_of(UNEVEN, EVEN, TURN)
    values = rng.uniform(size=len(phi))
    m = gridded_or_scattered(*shuffled(theta_i, 0.3 + 0.0 * phi, theta_o, phi + 0.3, values))
    keep = (theta_i > 1e-3) & (theta_o > 1e-3)
    assert type(m) is Gridded, "a pole has a row for each azimuth"
    np.testing.assert_array_equal(m.stored.reshape(-1), values)
    m = gridded_or_scattered(*shuffled(*(x[keep] for x in (theta_i, 0.3 + 0.0 * phi, theta_o, phi + 0.3, values))))
    assert type(m) is Gridded
    assert not m.is_mirrored
    np.testing.assert_allclose(m.axes["phi"], TURN, atol=1e-12)
    up = keep & (theta_o < 1.5)
    np.testing.assert_allclose(m.f_angles(theta_i[up], 0.0, theta_o[up], phi[up]), values[up], rtol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rows_on_one_side_are_mirrored(side):
    """A pole is one row, for all azimuths."""
    theta_i, theta_o, phi = rows_of(UNEVEN[1:], UNEVEN[1:], np.radians([0.0, 60.0, 180.0]))
    theta_i, theta_o, phi = (
        np.append(x, y) for x, y in ((theta_i, UNEVEN[1:]), (theta_o, 0.0 * EVEN[1:]), (phi, EVEN[1:]))
    )
    values = rng.uniform(size=len(phi))
    m = gridded_or_scattered(*shuffled(theta_i, 0.0 * phi, theta_o, side * phi, values), uncertainty=0.1)
    assert type(m) is Gridded
    assert m.is_mirrored
    for s in (1.0, -1.0):
        np.testing.assert_allclose(m.f_angles(theta_i, 0.4, theta_o, 0.4 + s * phi), values, rtol=1e-7)
    assert np.unique(m.uncertainty) == 0.1


def test_rows_of_a_turned_sample():
    axes = AXES["angles", 4]
    theta_i, theta_o, phi_i, phi_o = rows_of(axes[0][1:], axes[1][1:-1], *axes[2:])
    values = rng.uniform(size=(len(phi_i), 2))
    m = gridded_or_scattered(theta_i, phi_i, theta_o, phi_o, values, channels=("a", "b"))
    assert type(m) is Gridded
    assert len(m.axes) == 4
    np.testing.assert_allclose(m.f_angles(theta_i, phi_i, theta_o, phi_o), values, rtol=1e-9)


def test_scattered_rows():
    """A smooth BRDF measured at 3000 pairs: exact at none, close everywhere, as the residual says."""
    truth = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.6), 0.5)
    u = lattice(3000, 4)
    theta_i, theta_o = np.arccos(1.0 - 0.9 * u[:, 0]), np.arccos(1.0 - 0.9 * u[:, 1])
    phi_i, phi_o = 0.0 * theta_i, 2.0 * math.pi * u[:, 2]
    values = math.pi * truth.f_angles(theta_i, phi_i, theta_o, phi_o)
    m = gridded_or_scattered(theta_i, phi_i, theta_o, phi_o, values, quantity="reflectance factor", uncertainty=0.01)
    assert isinstance(m, Scattered)
    assert m.residual.rms < 0.04
    np.testing.assert_array_equal(m.stored, values)
    assert m.data["values"].dims == ("measurement",)
    assert m.brdf_uncertainty().max() == pytest.approx(0.01 / math.pi)
    wi, wo = pairs()
    near = (wi[:, 2] > 0.3) & (wo[:, 2] > 0.3)
    off = m.f(wi, wo)[near] / truth.f(wi, wo)[near] - 1.0
    assert np.abs(off).mean() < 0.02
    assert pickle.loads(pickle.dumps(m)) == m


def test_scans_in_the_plane_of_incidence():
    theta = np.radians(np.arange(5.0, 80.0, 5.0))
    theta_i = np.repeat(np.radians([10.0, 30.0, 50.0]), 30)
    theta_o, phi_o = np.tile(np.append(theta, theta), 3), np.tile(np.append(0.0 * theta, math.pi + 0.0 * theta), 3)
    values = gn.Phong(0.4, 8.0).f_angles(theta_i, 0.0, theta_o, phi_o)
    m = Scattered(theta_i, 0.0, theta_o, phi_o, values)
    assert m.residual.largest < 1e-9
    np.testing.assert_allclose(m.f_angles(theta_i, 0.0, theta_o, phi_o), values, rtol=1e-9, atol=1e-12)


def test_far_from_all_rows():
    theta = np.radians(np.linspace(0.0, 30.0, 12))
    theta_i, theta_o, phi = rows_of(theta, theta + 0.01, np.linspace(0.1, 3.0, 9))
    for outside, known in (("hold", True), ("missing", False)):
        m = Scattered(theta_i, 0.0, theta_o, phi, 1.0 + 0.0 * phi, outside=outside)
        assert np.isfinite(m.f_angles(1.4, 0.0, 1.4, 1.0)) == known
        assert m.f_angles(0.2, 0.0, 0.3, 1.0) == pytest.approx(1.0)
        again = m.replace(outside="hold")
        assert np.isfinite(again.f_angles(1.4, 0.0, 1.4, 1.0))


def test_nodes_below_the_horizon_keep_their_values():
    m = grid("half_difference", 3)
    below = (np.stack(m.directions())[..., 2] < 0.0).any(axis=0)
    assert below.any()
    np.testing.assert_array_equal(m.brdf(), m.stored)
    np.testing.assert_array_equal(m.with_brdf(m.brdf()).f(*pairs()), m.f(*pairs()))


def test_repeated_rows_are_averaged():
    theta = np.array([0.2, 0.2, 0.5, 0.9])
    m = Scattered(0.3, 0.0, theta, [0.1, 0.1, 2.0, 3.0], [1.0, 3.0, 4.0, 5.0], uncertainty=0.2)
    assert m.f_angles(0.3, 0.0, 0.2, 0.0) > 1.0
    assert len(m.stored) == 4


def test_each_channel_has_its_own_holes():
    theta = np.radians([0.0, 10.0, 30.0, 60.0])
    theta_i, theta_o, phi = (x.ravel() for x in np.meshgrid(theta, theta, [0.1, 1.0, 2.0], indexing="ij"))
    f = gn.Phong(0.4, 8.0).f_angles(theta_i, 0.0, theta_o, phi)
    values, spread = f[:, None] * [1.0, 2.0, 3.0], f[:, None] * [0.1, 0.2, 0.3]
    known = np.arange(len(f)) % 3 > 0  # of each pair of polar angles one azimuth is missing: the grids are the same
    values[~known, 0], values[:, 2] = np.nan, np.nan
    m = Scattered(theta_i, 0.0, theta_o, phi, values, channels="ABC", uncertainty=spread)
    assert np.isnan(m.brdf()[..., 2]).all()
    for c, of in ((0, known), (1, known | True)):
        alone = Scattered(theta_i[of], 0.0, theta_o[of], phi[of], values[of, c], uncertainty=spread[of, c])
        np.testing.assert_allclose(m.brdf()[..., c], alone.brdf(), rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(m.brdf_uncertainty()[..., c], alone.brdf_uncertainty())


def test_interpolation_is_that_of_scipy():
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import KDTree

    rng = np.random.default_rng(4)
    places, values, wanted = rng.uniform(size=(80, 3)), rng.normal(size=(80, 2)), rng.uniform(size=(2500, 3))
    found = _by_radial_functions(KDTree(places), values, wanted)
    fit = RBFInterpolator(places, values, neighbors=NEIGHBOURS, kernel="linear", degree=0)
    np.testing.assert_allclose(found, fit(wanted), rtol=0.0, atol=1e-12)


def test_rows_are_in_one_tree_which_is_asked_for_nodes(monkeypatch):
    """Of rows only so many look for the next one as tell the usual distance: all of a million would take half of it."""
    from scipy.spatial import KDTree

    rng, asked, trees = np.random.default_rng(5), [], []

    class Counted(KDTree):
        def query(self, x, *args, **kwargs):
            asked.append(len(x))
            return super().query(x, *args, **kwargs)

    def tree(places):
        trees.append(len(places))
        return Counted(places)

    monkeypatch.setattr(interpolation, "_tree", tree)
    n, grids = 3000, []
    values = rng.uniform(size=n)
    rows = rng.choice([0.2, 0.5, 0.9], n), 0.0, rng.uniform(0.0, 1.4, n), rng.uniform(0.0, np.pi, n)
    for enough in (n, 300):
        monkeypatch.setattr(interpolation, "ENOUGH", enough)
        asked.clear()
        trees.clear()
        m = Scattered(*rows, values)
        grids.append(m.brdf())
        assert trees == [n] and sum(asked) <= enough + 2 * grids[-1].size
    assert (np.abs(grids[1] - grids[0]) > 1e-12).mean() < 0.01  # of nodes twice the usual distance away


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Scattered([], [], [], [], []), "no rows"),
        (lambda: Scattered([0.1], [0.1], [0.1], [0.1], [[1.0, 2.0]]), "shape"),
        (lambda: Scattered([30.0], [0.1], [0.1], [0.1], [1.0]), "radians"),
        (lambda: Scattered([0.1], [np.nan], [0.1], [0.1], [1.0]), "finite"),
        (lambda: Scattered([0.1], [0.1], [0.1], [0.1], [np.nan]), "holds a number"),
    ],
)
def test_what_bad_rows_say(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


# What bad input says.

GOOD = {"theta_i": EVEN, "theta_o": EVEN, "phi": TURN}


def test_values_between_wavelengths():
    values = np.ones((7, 7, 5, 3)) * [0.1, 0.2, 0.3]
    m = Gridded("angles", GOOD, values, uncertainty=0.1 * values, channels=(450.0, 550.0, 650.0))
    between = m.at([500.0, 600.0])
    assert between.channel_names == (500.0, 600.0)
    np.testing.assert_allclose(between.f([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]), [0.15, 0.25])
    np.testing.assert_allclose(between.uncertainty, 0.1 * between.stored)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gridded("polar", GOOD, np.ones((7, 7, 5))), "expected one of 'angles'"),
        (lambda: Gridded("angles", {"theta_o": EVEN, "theta_i": EVEN, "phi": TURN}, np.ones((7, 7, 5))), "this order"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7))), "shape"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7, 5, 2)), channels="RGB"), "shape"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7, 5)), uncertainty=np.ones(3)), "uncertainty"),
        (lambda: Gridded("angles", {**GOOD, "theta_i": np.degrees(EVEN)}, np.ones((7, 7, 5))), "degrees"),
        (lambda: Gridded("angles", {**GOOD, "phi": TURN[::-1]}, np.ones((7, 7, 5))), "increasing"),
        (lambda: Gridded("angles", {**GOOD, "phi": [0.0, 7.0]}, np.ones((7, 7, 2))), "period"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7, 5)), mirrored=True), "mirrored"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7, 5)), quantity="radiance"), "quantity"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7, 5)), periods={"theta_i": 1.0}), "azimuths"),
        (lambda: Gridded("angles", GOOD, np.ones((7, 7, 5)), outside="guess"), "outside"),
    ],
)
def test_what_bad_input_says(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
