"""MERL files: the published convention, interpolation, gaps, sampling, writing, and damaged files."""

import hashlib
import math
import pickle
import struct
import tracemalloc

import numpy as np
import pytest
from binary_files import random_table
from house import PAINT

import gonio as gn
from gonio.formats import formats, load, merl, save
from gonio.formats.merl import MERL
from gonio.formula.direction import Direction, half_difference

SCALE = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
SIZE = {180: 34_992_012, 360: 69_984_012}
MODEL = PAINT.replace(rho=[0.1, 0.2, 0.3], alpha=0.3)


def directions(n, seed, low=0.0):
    """n unit vectors, uniform over the part of the hemisphere with cosine above `low`."""
    rng = np.random.default_rng(seed)
    z, phi = low + (1.0 - low) * rng.random(n), 2.0 * np.pi * rng.random(n)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def scalar_angles(wi, wo):
    """theta_h, theta_d, phi_d by two rotations, as the code published with the measurements does it."""
    h = [a + b for a, b in zip(wi, wo, strict=True)]
    length = math.sqrt(sum(x * x for x in h))
    h = [x / length for x in h]
    theta, phi = math.acos(min(h[2], 1.0)), math.atan2(h[1], h[0])
    x = wi[0] * math.cos(phi) + wi[1] * math.sin(phi)
    y = wi[1] * math.cos(phi) - wi[0] * math.sin(phi)
    x, z = x * math.cos(theta) - wi[2] * math.sin(theta), x * math.sin(theta) + wi[2] * math.cos(theta)
    return theta, math.acos(min(z, 1.0)), math.atan2(y, x)


def scalar_position(wi, wo, cells):
    """Position on the grid, in cells."""
    theta_h, theta_d, phi_d = scalar_angles(wi, wo)
    if phi_d < 0.0:
        phi_d += math.pi if cells == 180 else 2.0 * math.pi
    return 90.0 * math.sqrt(theta_h / (math.pi / 2)), 90.0 * theta_d / (math.pi / 2), 180.0 * phi_d / math.pi


def scalar_nearest(raw, wi, wo):
    i, j, k = (math.floor(x) for x in scalar_position(wi, wo, raw.shape[3]))
    return [raw[c, min(i, 89), min(j, 89), k % raw.shape[3]] * SCALE[c] for c in range(3)]


def scalar_trilinear(raw, wi, wo):
    at = [x - 0.5 for x in scalar_position(wi, wo, raw.shape[3])]
    at[:2] = [min(max(x, 0.0), 89.0) for x in at[:2]]
    start = [math.floor(x) for x in at]
    out = []
    for c in range(3):
        total = known = 0.0
        for corner in range(8):
            step = [corner >> axis & 1 for axis in range(3)]
            w = math.prod(1.0 - abs(x - (s + d)) for x, s, d in zip(at, start, step, strict=True))
            i, j, k = (s + d for s, d in zip(start, step, strict=True))
            value = raw[c, min(i, 89), min(j, 89), k % raw.shape[3]]
            if w > 0.0 and 0.0 <= value < math.inf:
                total, known = total + w * value * SCALE[c], known + w
        out.append(total / known if known > 1e-3 else math.nan)
    return out


def pair(theta_h, theta_d, phi_d, phi_h=0.7):
    """wi, wo of half and difference angles in degrees."""
    h, d, p = np.radians([theta_h, theta_d, phi_d])
    wm = np.array([np.sin(h) * np.cos(phi_h), np.sin(h) * np.sin(phi_h), np.cos(h)])
    t = np.array([np.cos(h) * np.cos(phi_h), np.cos(h) * np.sin(phi_h), -np.sin(h)])
    b = np.array([-np.sin(phi_h), np.cos(phi_h), 0.0])
    wi = np.cos(d) * wm + np.sin(d) * (np.cos(p) * t + np.sin(p) * b)
    return wi, 2.0 * np.dot(wi, wm) * wm - wi


# A table takes 35 MB, and what formulas look up as much again: none but `measured` is kept from test to test.


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A model, written."""
    file = tmp_path_factory.mktemp("merl") / "model.binary"
    save(MODEL, file)
    return file


@pytest.fixture(scope="module")
def measured(path):
    return load(path)


@pytest.fixture
def gaps():
    """A table without data in a tenth of the entries, in all the ways there are."""
    raw, rng = random_table(180, 2), np.random.default_rng(3)
    for value in (-1.0, -np.inf, np.inf, np.nan):
        raw.reshape(-1)[rng.integers(0, raw.size, raw.size // 40)] = value
    raw[:, 40:44, 30:34, 100:104] = -1.0
    return MERL(raw)


# The convention.


def test_bytes_are_where_the_format_says(tmp_path):
    file = tmp_path / "one-cell.binary"
    i, j, k = 30, 20, 100
    with file.open("wb") as out:
        out.write(struct.pack("<3i", 90, 90, 180))
        out.truncate(SIZE[180])
        for c, value in enumerate((1500.0, 3000.0, 4500.0)):
            out.seek(12 + 8 * (((c * 90 + i) * 90 + j) * 180 + k))
            out.write(struct.pack("<d", value))
    m = load(file)
    wi, wo = pair((i + 0.5) ** 2 / 90, j + 0.5, k + 0.5)
    np.testing.assert_allclose(m.f(wi, wo), [1.0, 2.0 * 1.15, 3.0 * 1.66], rtol=1e-11)
    np.testing.assert_allclose(m.f(wo, wi), m.f(wi, wo), rtol=1e-11)
    for other in ((i + 1.5, j + 0.5, k + 0.5), (i + 0.5, j + 1.5, k + 0.5), (i + 0.5, j + 0.5, k + 1.5)):
        assert np.all(np.abs(m.f(*pair(other[0] ** 2 / 90, *other[1:]))) < 1e-9)
    assert (m.raw[:, i, j, k] == [1500.0, 3000.0, 4500.0]).all()
    assert np.count_nonzero(m.raw) == 3
    assert {name: len(nodes) for name, nodes in m.axes.items()} == {"theta_h": 90, "theta_d": 90, "phi_d": 180}


def test_cells_by_hand(tmp_path):
    """theta_h, theta_d, phi_d [degrees] of theta_i, phi_i, theta_o, phi_o, and with them the cell that Matusik et al.
    2003 and their published code keep the pair in: theta_h counts 90 sqrt(theta_h/90), the others by degrees."""
    cells = {
        (30.0, 0.0, 60.0, 70.0): (59 * 90 + 27) * 180 + 51,  # 39.8093, 27.2356, -128.6534: phi_d + 180 = 51.3466
        (60.0, 70.0, 30.0, 0.0): (59 * 90 + 27) * 180 + 51,  # exchanged: phi_d is 51.3466
        (45.0, 10.0, 20.0, 300.0): (50 * 90 + 20) * 180 + 46,  # 28.2414, 20.8267, 46.2717
        (5.0, 33.0, 12.0, 250.0): (19 * 90 + 8) * 180 + 148,  # 4.2846, 8.1348, 148.5996
    }
    file = tmp_path / "cells.binary"
    with file.open("wb") as out:
        out.write(struct.pack("<3i", 90, 90, 180))
        out.truncate(SIZE[180])
        for place in cells.values():
            for c, value in enumerate((1500.0, 3000.0, 4500.0)):
                out.seek(12 + 8 * (c * 1_458_000 + place))
                out.write(struct.pack("<d", value * place))
    m = load(file).replace(interpolation="nearest")
    for degrees, place in cells.items():
        expected = np.array([1.0, 2.0 * 1.15, 3.0 * 1.66]) * place
        np.testing.assert_allclose(m.f_angles(*np.radians(degrees)), expected, rtol=1e-14)


def test_patches_become_a_merl_file_by_the_mean_over_turns(tmp_path):
    """The way that the error names: patches of a matrix have edges, which do not turn with the directions."""
    save(MODEL, tmp_path / "patches.xml", "WINDOW XML", basis="quarter")
    patches = load(tmp_path / "patches.xml")
    with pytest.raises(gn.errors.ParameterError, match=r"mean over turns: gonio.repair.symmetrize\(.*resample"):
        save(patches, tmp_path / "no.binary")
    table = gn.repair.resample(patches, resolution=(9, 9, 8, 8))
    save(gn.repair.symmetrize(table, "isotropy"), tmp_path / "mean.binary")
    wi, wo = directions(500, 25, 0.5), directions(500, 26, 0.5)
    off = load(tmp_path / "mean.binary").f(wi, wo) / MODEL.f(wi, wo) - 1.0
    assert np.abs(off.mean(axis=0)).max() < 0.1  # channels where they belong: they are up to 3 times apart


@pytest.mark.parametrize("names", [(450.0, 550.0, 650.0), ("a", "b", "c")])
def test_only_three_colours_are_red_green_and_blue(names, tmp_path):
    m = gn.Lambertian([0.1, 0.2, 0.3]).replace()
    m.__dict__["channel_names"] = names
    with pytest.raises(gn.errors.ParameterError, match="expected one, or colours: R, G, B or X, Y, Z"):
        save(m, tmp_path / "no.binary")


@pytest.mark.parametrize("cells", [180, 360])
def test_interpolation_against_a_scalar_implementation(cells):
    m = MERL(random_table(cells))
    wi, wo = directions(300, 10), directions(300, 11)
    nearest = [scalar_nearest(m.raw, *w) for w in zip(wi.tolist(), wo.tolist(), strict=True)]
    trilinear = [scalar_trilinear(m.raw, *w) for w in zip(wi.tolist(), wo.tolist(), strict=True)]
    np.testing.assert_allclose(m.replace(interpolation="nearest").f(wi, wo), nearest, rtol=1e-14)
    np.testing.assert_allclose(m.f(wi, wo), trilinear, rtol=1e-9)
    assert m.pdf(wi, wo).shape == (300,)


@pytest.mark.parametrize("cells", [180, 360])
def test_wraps_in_phi_and_stays_at_the_outermost_centres(cells):
    m = MERL(random_table(cells))
    for theta_d in (0.5, 30.0, 60.0):
        before, after = m.f(*pair(20.0, theta_d, cells - 1e-7)), m.f(*pair(20.0, theta_d, 1e-7))
        np.testing.assert_allclose(before, after, rtol=1e-6)
    opposite = m.f(*pair(20.0, 30.0, 40.5)), m.f(*pair(20.0, 30.0, 220.5))
    assert np.all((np.abs(opposite[0] / opposite[1] - 1.0) > 1e-3) == (cells == 360))
    for beyond, centre in (((1e-4, 40.5), (0.5**2 / 90, 40.5)), ((10.0, 0.01), (10.0, 0.5))):
        f, outermost = m.f(*pair(*beyond, 20.5)), m.f(*pair(*centre, 20.5))
        np.testing.assert_allclose(f, outermost, rtol=1e-6)
    top = m.f(*pair(1e-4, 89.9, 50.5))
    np.testing.assert_allclose(top, m.raw[:, 0, 89, 50] * SCALE, rtol=1e-5)


def test_angles_at_the_poles_and_in_single_precision():
    wi, wo = directions(2000, 12, 0.01), directions(2000, 13, 0.01)
    double = half_difference(Direction(*wi.T), Direction(*wo.T))
    single = half_difference(Direction(*wi.T.astype("f4")), Direction(*wo.T.astype("f4")))
    for a, b, bound in zip(double, single, (5e-6, 5e-6, 1e-3), strict=True):
        assert b.dtype == np.float32
        assert np.max(np.abs(np.sin(a - b))) < bound
    np.testing.assert_allclose(double, np.array([scalar_angles(*w) for w in zip(wi, wo, strict=True)]).T, atol=1e-7)
    swapped = half_difference(Direction(*wo.T), Direction(*wi.T))
    assert np.array_equal(swapped.theta_h, double.theta_h)
    assert np.array_equal(swapped.theta_d, double.theta_d)
    np.testing.assert_allclose(np.abs(swapped.phi_d - double.phi_d), np.pi, rtol=1e-14)
    z = Direction(0.0, 0.0, 1.0)
    np.testing.assert_allclose(half_difference(z, z), 0.0, atol=1e-14)


# Gaps.


def test_gaps_are_left_out_of_the_interpolation(gaps):
    wi, wo = directions(400, 14), directions(400, 15)
    expected = np.array([scalar_trilinear(gaps.raw, *w) for w in zip(wi.tolist(), wo.tolist(), strict=True)])
    np.testing.assert_allclose(gaps.f(wi, wo), expected, rtol=1e-9)
    assert gaps.valid.shape == (3, 90, 90, 180)
    assert gaps.valid.mean() == pytest.approx(0.9, abs=0.01)
    assert np.array_equal(gaps.valid, (gaps.raw >= 0.0) & np.isfinite(gaps.raw))
    inside = pair(42.0**2 / 90, 32.0, 102.0)
    assert np.isnan(gaps.f(*inside)).all()
    assert np.isfinite(gaps.pdf(*inside))
    for m in (gaps, gaps.replace(interpolation="nearest")):
        assert np.isnan(m.f(*pair(41.5**2 / 90, 31.5, 101.5))).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_centre_of_a_gap_is_nan_whatever_the_rounding(dtype):
    raw = random_table(180)
    raw[1, 30, 20, 100] = np.nan
    wi, wo = (w.astype(dtype) for w in pair(30.5**2 / 90, 20.5, 100.5))
    f = MERL(raw).f(wi, wo)
    assert f.dtype == dtype
    assert np.array_equal(np.isnan(f), [False, True, False])


def test_tables_without_light_or_without_data():
    for value in (0.0, -1.0):
        m = MERL(np.full((3, 90, 90, 180), value))
        s = m.sample(directions(1000, 16, 0.05), np.random.default_rng(17).random((1000, 2)))
        lost = s.pdf == 0.0
        assert 0.0 <= lost.mean() < 0.2
        assert np.all(np.isfinite(s.pdf))
        assert np.all(np.isnan(s.weight[~lost])) if value < 0.0 else np.all(s.weight == 0.0)


# A model, written and read.


def test_memory_is_the_table_as_read_and_once_more(path):
    up = np.array([0.0, 0.0, 1.0])
    for dtype, most in ((np.float64, 2.3), (np.float32, 2.8)):
        load(path).f(up.astype(dtype), up.astype(dtype))  # what compiling takes does not count
        tracemalloc.start()
        m = load(path)
        m.f(up.astype(dtype), up.astype(dtype))
        assert tracemalloc.get_traced_memory()[1] < most * m.raw.nbytes
        tracemalloc.stop()
        del m


def test_a_written_model_agrees_with_the_model(measured):
    wi, wo = directions(20_000, 20, 0.2), directions(20_000, 21, 0.2)
    expected = MODEL.f(wi, wo)
    trilinear = np.abs(measured.f(wi, wo) / expected - 1.0)
    nearest = np.abs(measured.replace(interpolation="nearest").f(wi, wo) / expected - 1.0)
    assert np.median(trilinear) < 1e-3
    assert trilinear.max() < 8e-3
    assert 0.02 < nearest.max() < 0.1
    assert np.median(trilinear) < 0.2 * np.median(nearest)


def test_centres_hold_the_model_and_below_the_horizon_is_no_data(measured):
    rng = np.random.default_rng(22)
    for i, j, k in rng.integers(0, (90, 90, 180), (300, 3)).tolist():
        wi, wo = pair((i + 0.5) ** 2 / 90, j + 0.5, k + 0.5)
        stored = measured.raw[:, i, j, k]
        if min(wi[2], wo[2]) < 1e-3:
            assert np.all(stored == -1.0) or min(wi[2], wo[2]) > 0.0
        else:
            np.testing.assert_allclose(stored * SCALE, MODEL.f(wi, wo), rtol=1e-9)


def test_write_read_write_is_bit_exact(tmp_path, path, measured):
    again = tmp_path / "again.binary"
    save(measured.replace(interpolation="nearest"), again)
    assert again.read_bytes() == path.read_bytes()
    assert path.stat().st_size == SIZE[180]


def test_odd_numbers_survive(tmp_path):
    raw = random_table(180)
    raw.reshape(-1)[:6] = [np.nan, np.inf, -np.inf, -0.0, 5e-324, 1e308]
    raw.view(np.uint64).reshape(-1)[6] = 0x7FF8_0000_DEAD_BEEF
    file, m = tmp_path / "odd.binary", MERL(raw)
    save(m, file)
    again = load(file)
    assert np.array_equal(again.raw.view(np.uint64), raw.view(np.uint64))
    assert again == m
    assert np.array_equal(again.valid.reshape(-1)[:7], [False, False, False, True, True, True, False])
    del m
    raw[0, 20, 30, 40] += 1.0  # it is still the caller's
    assert again != MERL(raw)


def test_the_long_variant_survives(tmp_path):
    file = tmp_path / "long.binary"
    save(MERL(random_table(360)), file)
    assert file.stat().st_size == SIZE[360]
    assert np.array_equal(load(file).raw, random_table(360))


def test_one_channel_is_written_as_gray_and_360_cells_on_demand(tmp_path):
    file = tmp_path / "gray.binary"
    merl.write(gn.Lambertian(0.5), file, phi_d=360)
    raw = load(file).raw
    assert raw.shape == (3, 90, 90, 360)
    above = np.moveaxis(raw[:, :50:7, :50:7], 0, -1)  # the horizon
    np.testing.assert_allclose(above * SCALE, 0.5 / np.pi, rtol=1e-12)


def test_derived_materials_keep_the_gaps(tmp_path, gaps):
    file = tmp_path / "half.binary"
    save(0.5 * gaps, file)
    wi, wo = zip(*(pair((i + 0.5) ** 2 / 90, j + 0.5, 90.5) for i in range(80) for j in range(5)), strict=True)
    at = np.array([(i, j) for i in range(80) for j in range(5)]).T
    up = (np.array(wi)[:, 2] > 1e-6) & (np.array(wo)[:, 2] > 1e-6)
    raw, half = gaps.raw[:, at[0], at[1], 90][:, up], load(file).raw[:, at[0], at[1], 90][:, up]
    valid = (raw >= 0.0) & np.isfinite(raw)
    assert not valid.all()
    np.testing.assert_allclose(half[valid], 0.5 * raw[valid], rtol=1e-9)
    assert np.all(half[~valid] == -1.0)


class _Fails(gn.Lambertian):
    """A material that fails in the middle of a table."""

    calls = 0

    def f(self, wi, wo, out=None):
        type(self).calls += 1
        if self.calls > 2:
            raise gn.errors.ParameterError("the lamp went out")
        return super().f(wi, wo, out)


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch, measured):
    file = tmp_path / "old.binary"
    file.write_bytes(b"what was there")
    with pytest.raises(gn.Error, match="the lamp went out"):
        save(_Fails(0.5), file)

    class Full:
        def tofile(self, file):
            raise OSError("no space left on device")

    monkeypatch.setattr(merl, "_tables", lambda raw: (Full(),))
    with pytest.raises(OSError, match="no space"):
        save(measured, file)
    assert file.read_bytes() == b"what was there"
    assert [p.name for p in tmp_path.iterdir()] == ["old.binary"]


@pytest.mark.parametrize(
    ("m", "text"),
    [
        (gn.Lambertian([0.1, 0.2, 0.3, 0.4]), "has 4 channels, expected 1 or 3 in MERL files"),
        (gn.Lambertian(np.full((2, 2, 3), 0.5)), "shape"),
        (gn.IdealSpecular(0.9) + gn.Lambertian(0.1), "perfect mirror"),
        (gn.Microfacet(gn.GGX(0.2, 0.5)), "anisotropic"),
    ],
)
def test_materials_that_a_table_cannot_hold(tmp_path, m, text):
    with pytest.raises(gn.errors.ParameterError, match=text):
        save(m, tmp_path / "no.binary")
    assert not list(tmp_path.iterdir())


def test_other_arguments_that_cannot_be(tmp_path):
    with pytest.raises(gn.errors.ParameterError, match="phi_d=90: expected 180 or 360"):
        save(gn.Lambertian(0.5), tmp_path / "no.binary", phi_d=90)
    for raw in (None, np.zeros((3, 90, 90, 90)), np.zeros((1, 90, 90, 180)), np.zeros(())):
        with pytest.raises(gn.errors.ParameterError, match="expected"):
            MERL(raw)
    with pytest.raises(gn.errors.ParameterError, match="expected one of 'trilinear', 'nearest'"):
        MERL(random_table(180), interpolation="cubic")
    with pytest.raises(gn.errors.NotFoundError, match="does not exist"):
        save(gn.Lambertian(0.5), tmp_path / "no" / "such.binary")


# Laws, libraries and precision.


def test_laws(measured, gaps):
    wi, wo = directions(5000, 30, -0.3), directions(5000, 31, -0.3)
    for m in (measured, measured.replace(interpolation="nearest"), gaps):
        f = m.f(wi, wo)
        below = (wi[:, 2] <= 1e-6) | (wo[:, 2] <= 1e-6)
        assert f.shape == (5000, 3)
        assert np.all(f[below] == 0.0)
        assert not np.any(f < 0.0)
        back = m.f(wo, wi)
        off = np.abs(back - f) > 1e-9 * f  # on the edge between two cells, rounding decides for one
        assert np.nanmean(off) < (2e-3 if m.interpolation == "nearest" else 1e-9)
    nan = np.array([0.0, np.nan, 1.0])
    for m in (measured, measured.replace(interpolation="nearest")):
        assert np.isnan(m.f(nan, wo[:1])).all()
        assert np.isnan(m.f(wo[:1], nan)).all()
        assert np.isnan(m.pdf(wo[:1], nan)).all()
        s = m.sample(nan, [0.2, 0.3])
        assert np.isnan(s.wi).all()
        assert np.isnan(s.weight).all()
    assert measured.f([0.0, 0.0, 1.0], [[[0.0, 0.0, 1.0]], [[0.6, 0.0, 0.8]]]).shape == (2, 1, 3)
    assert measured.parameters == {}


def test_single_precision(measured):
    wi, wo, u = (
        directions(5000, 32, 0.02),
        directions(5000, 33, 0.02),
        np.random.default_rng(34).random((5000, 2)),
    )
    single = [x.astype(np.float32) for x in (wi, wo, u)]
    f = measured.f(*single[:2])
    assert f.dtype == np.float32
    np.testing.assert_allclose(f, measured.f(wi, wo), rtol=1e-4)
    np.testing.assert_allclose(measured.pdf(*single[:2]), measured.pdf(wi, wo), rtol=1e-4)
    a, b = measured.sample(*single[1:]), measured.sample(wo, u)
    close = np.abs(a.wi - b.wi).max(-1) < 2e-4
    assert close.mean() > 0.998  # u beside the edge of a ring or of the cosine hemisphere may go to the other side
    np.testing.assert_allclose(a.weight[close], b.weight[close], rtol=2e-2, atol=1e-3)


def with_torch(function, *arrays):
    torch = pytest.importorskip("torch")
    return function(*map(torch.as_tensor, arrays))


def with_jax(function, *arrays):
    jax = pytest.importorskip("jax")
    return jax.jit(function)(*arrays)


def with_drjit(function, *arrays):
    dr = pytest.importorskip("drjit")
    if not dr.has_backend(dr.JitBackend.LLVM):
        pytest.skip("Dr.Jit finds no LLVM; test_drjit_scalars runs without")
    llvm = pytest.importorskip("drjit.llvm")
    return function(*map(llvm.TensorXf64, arrays))


@pytest.mark.parametrize("call", [with_torch, with_jax, with_drjit])
@pytest.mark.parametrize("interpolation", ["trilinear", "nearest"])
def test_libraries_agree(call, interpolation, gaps):
    m = gaps.replace(interpolation=interpolation)
    wi, wo, u = (
        directions(500, 35, -0.1),
        directions(500, 36, -0.1),
        np.random.default_rng(37).random((500, 2)),
    )
    single = call is with_jax  # which has no float64 unless told so
    if single:
        wi, wo, u = (x.astype(np.float32) for x in (wi, wo, u))
    np.testing.assert_allclose(np.asarray(call(m.f, wi, wo)), m.f(wi, wo), rtol=1e-4 if single else 1e-11)
    if interpolation == "trilinear":  # sampling does not depend on it
        pdf, (direction, _, density, _) = call(m.pdf, wi, wo), call(m.sample, wo, u)
        expected = m.sample(wo, u)
        np.testing.assert_allclose(np.asarray(pdf), m.pdf(wi, wo), rtol=1e-4 if single else 1e-11)
        np.testing.assert_allclose(np.asarray(direction), expected.wi, atol=2e-5 if single else 1e-11)
        np.testing.assert_allclose(np.asarray(density), expected.pdf, rtol=1e-3 if single else 1e-9)


def test_drjit_scalars(gaps):
    scalar = pytest.importorskip("drjit.scalar")
    wi, wo = directions(20, 38), directions(20, 39)
    for m in (gaps, gaps.replace(interpolation="nearest")):
        for i, o in zip(wi, wo, strict=True):
            f = m.f(scalar.Array3f64(*i), scalar.Array3f64(*o))
            np.testing.assert_allclose(np.array(f), m.f(i, o), rtol=1e-12)


def test_jax_compiles_and_libraries_do_not_mix_their_tables(gaps):
    jax = pytest.importorskip("jax")
    wi, wo = (directions(50, seed).astype(np.float32) for seed in (40, 41))
    fresh = MERL(gaps.raw)
    compiled = jax.jit(fresh.f)(wi, wo)
    np.testing.assert_allclose(compiled, fresh.f(wi, wo), rtol=1e-4)
    np.testing.assert_allclose(jax.jit(fresh.f)(wi, wo), compiled)


def test_gradients_are_finite_at_the_poles_and_at_the_horizon(measured):
    torch = pytest.importorskip("torch")
    for interpolation in ("trilinear", "nearest"):
        m = measured.replace(interpolation=interpolation)
        wi = torch.tensor([[0, 0, 1], [0, 0, 1], [0.6, 0, 0.8], [1, 0, 1e-8], [0.6, 0, 0.8], [0.6, 0, -0.8]])
        wo = torch.tensor([[0, 0, 1], [0.6, 0, 0.8], [-0.6, 0, 0.8], [0, 0, 1], [0.6, 0, 0.8], [0, 0, 1.0]])
        wi.requires_grad_()
        wo.requires_grad_()
        (m.f(wi, wo).sum() + m.pdf(wi, wo).sum()).backward()
        assert torch.isfinite(wi.grad).all()
        assert torch.isfinite(wo.grad).all()


# Sampling.


@pytest.fixture
def jax_double():
    jax = pytest.importorskip("jax")
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield jax
    jax.config.update("jax_enable_x64", before)


def test_density_is_the_inverse_of_the_jacobian(jax_double, measured):
    """pdf |dw/du| = 1 for both ways that the map takes, at random places inside rings."""
    jnp = jax_double.numpy
    wo, u = directions(200, 51, 0.2), np.random.default_rng(50).random((200, 2))
    seam = measured.hints.seam
    assert 0.1 < seam < 0.9

    def drawn(wo, u):
        return measured.sample(wo, u).wi

    columns = jax_double.jit(jax_double.vmap(jax_double.jacfwd(drawn, argnums=1)))(jnp.asarray(wo), jnp.asarray(u))
    area = np.linalg.norm(np.cross(columns[..., 0], columns[..., 1]), axis=-1)
    s = measured.sample(wo, u)
    kept = s.pdf > 0.0
    assert kept.mean() > 0.8
    # Either way leads to every direction: the density of the one taken is the mixture's without the other's.
    spread = (1.0 - seam) * s.wi[:, 2] / np.pi
    own = np.where(u[:, 0] < seam, s.pdf - spread, spread)
    np.testing.assert_allclose((own * area)[kept], 1.0, rtol=1e-7)


@pytest.mark.parametrize("theta", [0.0, 40.0, 75.0])
def test_density_integrates_to_what_is_not_lost(theta, measured):
    t = np.radians(theta)
    wo = np.array([np.sin(t), 0.0, np.cos(t)])
    n = 800
    mu, phi = (np.arange(n) + 0.5) / n, 2.0 * np.pi * (np.arange(n) + 0.5) / n
    s = np.sqrt(1.0 - mu * mu)[:, None]
    wi = np.stack(np.broadcast_arrays(s * np.cos(phi), s * np.sin(phi), mu[:, None]), -1)
    total = measured.pdf(wi, wo).sum() * 2.0 * np.pi / n**2
    u = np.stack(np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n), -1)
    kept = (measured.sample(wo, u).pdf > 0.0).mean()
    assert kept > 0.8
    assert total == pytest.approx(kept, abs=1e-3)


def test_samples_estimate_the_albedo(measured):
    t = np.radians(50.0)
    wo = np.array([np.sin(t), 0.0, np.cos(t)])
    u = np.stack(np.meshgrid(*2 * [(np.arange(400) + 0.5) / 400]), -1)
    s = measured.sample(wo, u)
    np.testing.assert_allclose(s.weight.mean((0, 1)), gn.albedo(measured, wo), rtol=2e-3)
    np.testing.assert_allclose(s.weight.mean((0, 1)), gn.albedo(MODEL, wo), rtol=4e-3)
    np.testing.assert_allclose(s.pdf, np.where(s.pdf > 0.0, measured.pdf(s.wi, wo), 0.0), rtol=1e-6)
    f = measured.f(s.wi, wo)
    assert np.all(s.weight <= 10.0 * np.pi * f * (1.0 + 1e-9))
    assert s.weight.max() < 15.0


# Files.


def test_recognized_and_described(path, measured):
    with path.open("rb") as file:
        head = file.read(4096)
    assert [m.NAME for m in formats() if m.matches(head, SIZE[180])] == ["MERL"]
    assert type(measured) is MERL
    assert measured.format == "MERL"
    assert measured.quantity == "brdf"
    assert measured.path == str(path)
    assert repr(measured) == f"load({str(path)!r})"
    assert measured == load(path)
    assert measured != measured.replace(interpolation="nearest")
    assert hash(measured) == hash(load(path))
    measured.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])
    copy = pickle.dumps(measured)
    assert len(copy) < SIZE[180] + 4096
    assert pickle.loads(copy) == measured


def test_data(measured):
    data = measured.data
    assert data["raw"].dims == ("channel", "theta_h", "theta_d", "phi_d")
    assert np.shares_memory(data["raw"].values, measured.raw)
    np.testing.assert_allclose(data["theta_h"][:2], [0.25 / 90, 2.25 / 90])
    np.testing.assert_allclose(data["theta_d"][[0, -1]], [0.5, 89.5])
    np.testing.assert_allclose(data["phi_d"][[0, -1]], [0.5, 179.5])
    assert {data[name].attrs["units"] for name in ("theta_h", "theta_d", "phi_d")} == {"degree"}
    assert data["scale"].attrs["units"] == "sr-1"
    brdf = (data["raw"].isel(theta_h=20) * data["scale"]).sel(channel="G", theta_d=10.5, phi_d=90.5).item()
    assert brdf == pytest.approx(MODEL.f(*pair(20.5**2 / 90, 10.5, 90.5))[1], rel=1e-9)


def test_published_files_are_recognized_by_their_bytes(monkeypatch, path, measured):
    assert measured.published is None
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    monkeypatch.setattr(merl, "_published", lambda: {digest: "model"})
    assert measured.published == "model"
    assert load(path).published == "model"


def test_the_table_of_published_files():
    table = merl._published()
    assert len(table) == len(set(table.values())) == 100
    assert all(len(digest) == 64 and set(digest) <= set("0123456789abcdef") for digest in table)
    assert {"alum-bronze", "gold-metallic-paint", "yellow-plastic"} <= set(table.values())


def header_file(folder, dims, size, fill=b""):
    file = folder / "steel.binary"
    with file.open("wb") as out:
        out.write(struct.pack("<3i", *dims) + fill)
        out.truncate(size)
    return file


@pytest.mark.parametrize(
    ("dims", "size", "text"),
    [
        (
            (90, 91, 180),
            SIZE[180],
            r"steel.binary: not a MERL file: header says 90×91×180, expected 90×90×180 or",
        ),
        ((90, 91, 180), 12 + 24 * 90 * 91 * 180, "header says 90×91×180"),
        ((45, 45, 90), 12 + 24 * 45 * 45 * 90, "header says 45×45×90, expected 90×90×180 or 90×90×360"),
        ((180, 90, 90), SIZE[180], "header says 180×90×90"),
        (
            (90, 90, 180),
            SIZE[180] - 8,
            "cut short: 34992004 bytes, expected 34992012 for 90×90×180; fetch it",
        ),
        ((90, 90, 180), SIZE[180] + 1, "too long: 34992013 bytes, expected 34992012"),
        ((90, 90, 360), SIZE[180], "cut short: 34992012 bytes, expected 69984012 for 90×90×360"),
        ((90, 90, 180), 12, "cut short: 12 bytes"),
        ((90, 90, 180), 11, "not a known format"),
        ((0, 90, 180), SIZE[180], "not a known format"),
        ((-90, 90, 180), SIZE[180], "not a known format"),
        ((2**31 - 1, 2**31 - 1, 2**31 - 1), SIZE[180], "not a known format"),
    ],
)
def test_wrong_files_say_what_is_wrong(tmp_path, dims, size, text):
    with pytest.raises(gn.errors.FormatError, match=text):
        load(header_file(tmp_path, dims, size))


def test_other_formats_are_not_claimed():
    four = struct.pack("<16i", 45, 45, 180, 90, *[0] * 12)  # the header of a format with four dimensions
    assert not merl.matches(four, 64 + 4 * 3 * 45 * 45 * 180 * 90)
    assert not merl.matches(b"", 0)
    for head in (
        b"tensor_file\0\1\0",
        b'{"type": "Lambertian"}',
        b"#DIM 3 3\n#PARAM_IN",
        b"\x89HDF\r\n\x1a\n" + bytes(99),
    ):
        assert not merl.matches(head, SIZE[180])
    assert not merl.matches(np.random.default_rng(60).random(100).tobytes(), 1_990_656)  # headerless float64
    assert not merl.matches(bytes(4096), SIZE[180])


@pytest.mark.parametrize("count", [100, pytest.param(300, marks=pytest.mark.full)])
def test_damaged_headers_raise_only_our_errors(count, tmp_path):
    rng = np.random.default_rng(61)
    file = header_file(tmp_path, (90, 90, 180), 5000)
    good = bytearray(file.read_bytes())
    for _ in range(count):
        bad = bytearray(good)
        for at in rng.integers(0, 12, rng.integers(1, 4)):
            bad[at] = rng.integers(0, 256)
        file.write_bytes(bad[: rng.integers(0, len(bad))] if rng.random() < 0.3 else bad)
        with pytest.raises(gn.Error):
            load(file)


def test_damaged_numbers_load_and_are_marked(tmp_path):
    rng = np.random.default_rng(62)
    file = header_file(tmp_path, (90, 90, 180), SIZE[180], rng.bytes(80_000))
    m = load(file)
    f = m.f(directions(1000, 63), directions(1000, 64))
    assert not np.any(f < 0.0)
    assert np.all(np.isfinite(m.raw[m.valid]))
    assert not m.valid.all()
