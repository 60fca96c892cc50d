"""Binary tables of databases: what their bytes mean, by hand and beside other readers; writing; damaged files."""

from __future__ import annotations

import gzip
import math
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from conftest import switch_off

import gonio as gn
from gonio.errors import Error, FormatError, NotFoundError, ParameterError
from gonio.formats import csail, curet, formats, kaist, load, neural, save, scatfun, utia
from gonio.formats._reading import tensor_file
from gonio.formats.kaist import KAIST
from gonio.formats.scatfun import contents
from gonio.pictures.colour import RGB_OF_XYZ
from gonio.pictures.image import Image, read_image

REAL = Path(__file__).parents[2] / "shared" / "data"
ROUGH_GOLD = REAL / "fbsdf" / "roughgold_alpha_0.2.bsdf.gz"
MODEL = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.3), [0.9, 0.5, 0.2])
GRAY = 0.5 * gn.Lambertian(0.4)
ANISOTROPIC = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.2, 0.5), [0.9, 0.5, 0.2])


def real(path):
    if not path.exists():
        pytest.skip(f"{path.name} is not in ../shared/data: real files are not part of the repository")
    return path


def directions(n, seed, low=0.0):
    rng = np.random.default_rng(seed)
    z, phi = low + (1.0 - low) * rng.random(n), 2.0 * np.pi * rng.random(n)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def near_mirror(n, seed):
    """Pairs, half of them about the mirror direction."""
    wi, wo = directions(n, seed, 0.02), directions(n, seed + 1, 0.02)
    turned = wi[::2] * [-1.0, -1.0, 1.0] + 0.1 * np.random.default_rng(seed).normal(size=wi[::2].shape)
    turned[:, 2] = np.abs(turned[:, 2]) + 0.02
    wo[::2] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return wi, wo


def written(tmp_path, data, name="file"):
    path = tmp_path / name
    path.write_bytes(data)
    return path


def claimed(path):
    """Names of the formats that say the file is theirs."""
    data = path.read_bytes()
    return [m.NAME for m in formats() if m.matches(data[:4096], len(data))]


# SCATFUN.

NODES = np.array([-1.0, -0.75, -0.5, -0.2, 0.0, 0.0, 0.2, 0.5, 0.75, 1.0], "f4")


def layered(pairs, channels=1, nodes=NODES, metadata=b"{}", orders=None):
    """A file of {(mu_o, mu_i): coefficients (channels, orders)}."""
    n = len(nodes)
    places, series, at = np.zeros((n, n, 2), "<u4"), [], 0
    for (o, i), values in pairs.items():
        values = np.array(values, "<f4").reshape(channels, -1)
        row = np.flatnonzero(nodes == np.float32(o))[0]
        column = np.flatnonzero(nodes == np.float32(i))[0]
        places[row, column] = at, values.shape[1]
        series.append(values.reshape(-1))
        at += values.size
    orders = max((places[..., 1].max(), 1)) if orders is None else orders
    head = struct.pack("<7sB9I", b"SCATFUN", 1, 1, n, at, orders, channels, 1, len(metadata), 0, 0)
    head += struct.pack("<5f", 1.0, 0.0, 0.0, 0.0, 0.0)
    body = [nodes.astype("<f4"), np.zeros((n, n), "<f4"), places, np.concatenate(series)]
    return head + b"".join(a.tobytes() for a in body) + metadata


def random_layered(channels, seed=3):
    rng = np.random.default_rng(seed)
    pairs = {}
    for o in (0.2, 0.5, 0.75, 1.0, -0.5):
        for i in (-0.2, -0.5, -0.75, -1.0, 0.5):
            orders = int(rng.integers(1, 40))
            pairs[o, i] = rng.normal(size=(channels, orders)) / (1.0 + np.arange(orders))
    return layered(pairs, channels)


def catmull_rom(nodes, x):
    """First node and weights of four, as pbrt-v3 documents them."""
    k = int(np.searchsorted(nodes, x, "right")) - 1
    k = min(max(k, 0), len(nodes) - 2)
    x1, x2 = nodes[k], nodes[k + 1]
    t = (x - x1) / (x2 - x1)
    rise, fall = t**3 - 2 * t**2 + t, t**3 - t**2
    w = np.array([0.0, 2 * t**3 - 3 * t**2 + 1, -2 * t**3 + 3 * t**2, 0.0])
    if k > 0:
        w += rise * (x2 - x1) / (x2 - nodes[k - 1]) * np.array([-1.0, 0.0, 1.0, 0.0])
    else:
        w += rise * np.array([0.0, -1.0, 1.0, 0.0])
    if k + 2 < len(nodes):
        w += fall * (x2 - x1) / (nodes[k + 2] - x1) * np.array([0.0, -1.0, 0.0, 1.0])
    else:
        w += fall * np.array([0.0, -1.0, 1.0, 0.0])
    return k - 1, w


def fourier(parts, wi, wo):
    """f cos(theta_i) of one pair, by splines of the coefficients and one sum."""
    mu, width = parts["mu"].astype(float), parts["channels"]
    (i, weights_i), (o, weights_o) = catmull_rom(mu, -wi[2]), catmull_rom(mu, wo[2])
    sines = math.hypot(*wi[:2]) * math.hypot(*wo[:2])
    phi = math.acos(min(max(-(wi[0] * wo[0] + wi[1] * wo[1]) / sines, -1.0), 1.0)) if sines > 0.0 else 0.0
    a = np.zeros((width, parts["orders"]))
    for row, v in enumerate(weights_o):
        for column, u in enumerate(weights_i):
            if u * v != 0.0:
                at, length = (int(x) for x in parts["places"][o + row, i + column])
                a[:, :length] += u * v * parts["coefficients"][at : at + width * length].reshape(width, length)
    total = a @ np.cos(np.arange(parts["orders"]) * phi)
    if width == 1:
        return total
    y, r, b = total
    return np.array([r, 1.39829 * y - 0.100913 * b - 0.297375 * r, b])


def test_scatfun_by_hand(tmp_path):
    # f cos(theta_i) = 0.25 + 0.1 cos(phi) at cos(theta_i) = 0.5, cos(theta_o) = 0.75
    m = load(written(tmp_path, layered({(0.75, -0.5): [0.25, 0.1]})))
    wi = gn.direction(math.acos(0.5), 0.3)
    for phi, expected in ((0.0, 0.35), (math.pi, 0.15), (math.pi / 2, 0.25), (1.0, 0.25 + 0.1 * math.cos(1.0))):
        wo = gn.direction(math.acos(0.75), 0.3 + math.pi + phi)  # phi = 0 is forward
        np.testing.assert_allclose(m.f(wi, wo), expected / 0.5, rtol=2e-5)
    assert m.f(wi, gn.direction(math.acos(0.5), 0.3)) == pytest.approx(0.0, abs=1e-7)
    assert m.f(gn.direction(math.acos(0.75), 0.0), gn.direction(math.acos(0.5), 0.0)) == pytest.approx(0.0, abs=1e-7)


def test_scatfun_green_follows_from_luminance_red_and_blue(tmp_path):
    m = load(written(tmp_path, layered({(0.5, -0.5): [[0.3], [0.5], [0.1]]}, 3)))
    f = m.f(gn.direction(math.pi / 3, 0.0), gn.direction(math.pi / 3, 1.0))
    green = 1.39829 * 0.3 - 0.297375 * 0.5 - 0.100913 * 0.1
    np.testing.assert_allclose(f, np.array([0.5, green, 0.1]) / 0.5, rtol=1e-6)
    assert m.channel_names == ("R", "G", "B")


def test_scatfun_sides(tmp_path):
    path = written(tmp_path, layered({(0.5, -0.5): [0.1], (-0.5, 0.5): [0.3], (-0.5, -0.5): [9.0]}))
    pair = gn.direction(math.pi / 3, 0.0), gn.direction(math.pi / 3, 1.0)
    np.testing.assert_allclose([scatfun.read(path, side=s).f(*pair) for s in ("front", "back")], [0.2, 0.6], rtol=1e-6)
    with pytest.raises(ParameterError, match="'front' or 'back'"):
        scatfun.read(path, side="left")


@pytest.mark.parametrize("channels", [1, 3])
def test_scatfun_is_splines_of_fourier_series(tmp_path, channels, evaluation):
    m = load(written(tmp_path, random_layered(channels)))
    wi, wo = directions(300, 5), directions(300, 6)
    expected = np.array([fourier(m.parts, a, b) for a, b in zip(wi, wo, strict=True)])
    found = (m.f(wi, wo) * (wi[:, 2] if channels == 1 else wi[:, 2:])).reshape(expected.shape)
    np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())


def test_scatfun_real_file_is_its_splines_and_the_surface_it_was_made_of():
    m = load(real(ROUGH_GOLD))
    wi, wo = near_mirror(1000, 1)
    expected = np.array([fourier(m.parts, a, b) for a, b in zip(wi, wo, strict=True)])
    off = np.abs(m.f(wi, wo) * wi[:, 2:] - expected)
    assert off.max() < 2e-5 * expected.max()
    # At nodes: Au at alpha = 0.2, as the file's metadata say; layerlab's microfacets are Beckmann's.
    assert '"roughness": 0.2' in m.about["metadata"]
    gold = gn.Conductor([0.14355224, 0.37743778, 1.4382481], [3.98397448, 2.38495423, 1.60433814])
    model = gn.Microfacet(gn.Beckmann(0.2), gold, masking="separable")
    mu = m.parts["mu"].astype(float)
    theta = np.arccos(mu[mu > 0.1])
    wi, wo = gn.direction(theta[:, None, None], np.linspace(0.0, 3.0, 40)), gn.direction(theta[:, None], math.pi)
    true = model.f(wi, wo) * wi[..., 2:]
    off = np.abs(m.f(wi, wo) * wi[..., 2:] - true)
    bright = true > 0.01 * true.max()
    np.testing.assert_array_less(np.percentile(off[bright] / true[bright], [50, 90, 99]), [5e-4, 4e-3, 0.04])
    assert off.max() < 0.01 * true.max()


def test_scatfun_real_file_bit_by_bit(tmp_path):
    data = gzip.decompress(real(ROUGH_GOLD).read_bytes())
    m = load(ROUGH_GOLD)
    save(m, tmp_path / "copy.bsdf", format="SCATFUN")
    save(m, tmp_path / "copy.bsdf.gz", format="SCATFUN")
    assert (tmp_path / "copy.bsdf").read_bytes() == data
    assert load(tmp_path / "copy.bsdf.gz") == load(tmp_path / "copy.bsdf") == m
    assert claimed(tmp_path / "copy.bsdf") == claimed(tmp_path / "copy.bsdf.gz") == ["SCATFUN"]
    assert m.data.sizes["mu_i"] == 58


def test_scatfun_real_file_samples_what_it_reflects():
    m = load(real(ROUGH_GOLD))
    rng = np.random.default_rng(2)
    wo = np.broadcast_to(gn.direction(0.8, 0.3), (100_000, 3))
    sample = m.sample(wo, rng.random((100_000, 2)))
    np.testing.assert_allclose(sample.weight.mean(axis=0), gn.albedo(m, wo[0]), rtol=0.01)
    assert sample.weight.max() < 10.0


@pytest.mark.parametrize("m", [MODEL, GRAY], ids=["rgb", "gray"])
def test_scatfun_of_a_model(tmp_path, m):
    path = tmp_path / "model.bsdf"
    save(m, path, format="SCATFUN", nodes=24)
    found = load(path)
    mu = found.parts["mu"].astype(float)
    theta = np.arccos(mu[mu > 0.0])
    wi, wo = gn.direction(theta[:, None, None], np.linspace(0.0, 3.0, 20)), gn.direction(theta[:, None], 0.2)
    true, width = m.f(wi, wo), found.parts["channels"]
    off = np.abs(found.f(wi, wo) - true).reshape(-1, width) * np.cos(theta).repeat(len(theta) * 20)[:, None]
    assert off.max() < 5e-4 * np.max(true)
    w = gn.direction(np.array([0.1, 0.7, 1.2]), 0.0)
    np.testing.assert_allclose(gn.albedo(found, w), gn.albedo(m, w), rtol=0.01)
    # The integrals that pbrt samples by are those of the spline through order 0: of a Lambertian rho/pi mu^2/2.
    if m is GRAY:
        last = found.parts["cdf"][-1, : len(mu) // 2]
        np.testing.assert_allclose(last[-1] - last[0], 0.2 / np.pi / 2, rtol=2e-3)


def test_scatfun_refuses_what_it_cannot_hold(tmp_path):
    save(GRAY, tmp_path / "gray.bsdf", format="SCATFUN", nodes=4, orders=1)
    for m, why in (
        (ANISOTROPIC, "anisotropic"),
        (gn.IdealSpecular(0.5), "mirror"),
        (gn.Lambertian([0.1, 0.2]), "1 or 3"),
    ):
        with pytest.raises(ParameterError, match=why):
            save(m, tmp_path / "other.bsdf", format="SCATFUN")
    with pytest.raises(ParameterError, match="expected a whole number from 4"):
        save(GRAY, tmp_path / "other.bsdf", format="SCATFUN", nodes=2)


def patched(data, at, code, *values):
    return data[:at] + struct.pack("<" + code, *values) + data[at + struct.calcsize("<" + code) :]


def test_scatfun_damage(tmp_path):
    data = random_layered(1)
    places = 64 + 4 * 10 + 4 * 100
    coefficients = struct.unpack_from("<I", data, 16)[0]
    for damaged, why in (
        (data[:40], "its header alone"),
        (data[:-5], "cut short or damaged"),
        (data + b"x", "cut short or damaged"),
        (patched(data, 7, "B", 2), "version 1"),
        (patched(data, 8, "I", 3), "flags is 3"),
        (patched(data, 24, "I", 2), "channels is 2"),
        (patched(data, 28, "I", 4), "bases is 4"),
        (patched(data, 12, "I", 2**31), "expected"),
        (patched(data, 64, "f", math.nan), "increasing"),
        (patched(data, 64, "f", -0.7), "increasing"),
        (patched(data, 64 + 16, "3f", 0.0, 0.0, 0.0), "increasing"),
        (patched(data, places + 8 * 65, "2I", coefficients, 1), "their coefficients end"),
        (patched(data, places + 8 * 65, "2I", 0, 10**9), "orders"),
        (patched(data, places, "4I", 0, 30, 0, 30), "share coefficients"),
    ):
        with pytest.raises(FormatError, match=why):
            load(written(tmp_path, damaged))


def test_scatfun_gzip(tmp_path):
    data = random_layered(1)
    packed = gzip.compress(data)
    assert load(written(tmp_path, packed)) == scatfun.Scatfun(contents.parse(data, ""))
    # 4000 nodes and no coefficients: 192 MB of zeros after the header.
    nodes = np.linspace(-1.0, 1.0, 4000, dtype="f4")
    head = struct.pack("<7sB9I5f", b"SCATFUN", 1, 1, 4000, 0, 1, 1, 1, 0, 0, 0, 1.0, *[0.0] * 4)
    bomb = gzip.compress(head + nodes.tobytes() + bytes(12 * 4000**2))
    tracemalloc.start()
    with pytest.raises(FormatError, match="more than 100 times"):
        load(written(tmp_path, bomb))
    assert tracemalloc.get_traced_memory()[1] < 3_000_000
    tracemalloc.stop()
    for damaged, why in ((packed[:-100], "cut short|damaged"), (packed[:300] + b"\xff" * 300, "gzip")):
        with pytest.raises(FormatError, match=why):
            load(written(tmp_path, damaged))
    with pytest.raises(FormatError, match="cut short or damaged"):
        load(written(tmp_path, gzip.compress(data + bytes(1000))))
    assert claimed(written(tmp_path, gzip.compress(b"some text"))) == []


# KAIST.


def polarised(seed=1, counts=(9, 8, 13), wavelengths=(450, 500, 550, 600, 650), holes=0.0):
    """Fields of a file, random matrices."""
    rng = np.random.default_rng(seed)
    axes = [np.linspace(0.0, np.pi / 2, n, dtype="f4") for n in counts[:2]]
    axes.append(np.linspace(-np.pi, np.pi, counts[2], dtype="f4"))
    M = rng.uniform(0.1, 1.0, (*counts[::-1], len(wavelengths), 4, 4)).astype("f4")
    M[-1] = M[0]  # phi_d = pi is phi_d = -pi
    M[rng.random(M.shape[:3]) < holes] = np.nan
    if holes:
        M[5:8, 2:5, 2:6] = np.nan
    names = ("theta_h", "theta_d", "phi_d")
    return {**{n: x[None] for n, x in zip(names, axes, strict=True)}, "wvls": np.array(wavelengths, "u2"), "M": M}


def halved(wi, wo):
    """theta_h, theta_d, phi_d of one pair by vectors: phi_d is the azimuth of wi about the half vector."""
    h = (wi + wo) / np.linalg.norm(wi + wo)
    b = np.cross([0.0, 0.0, 1.0], h)
    b = b / np.linalg.norm(b)
    t = np.cross(b, h)
    return math.acos(min(h[2], 1.0)), math.acos(min(wi @ h, 1.0)), math.atan2(b @ wi, t @ wi)


def trilinear(table, at):
    start = [min(int(x), n - 2) for x, n in zip(at, table.shape, strict=False)]
    total = 0.0
    for corner in np.ndindex(2, 2, 2):
        weight = math.prod(1.0 - abs(x - s - c) for x, s, c in zip(at, start, corner, strict=True))
        total = total + weight * table[tuple(s + c for s, c in zip(start, corner, strict=True))].astype(float)
    return total


def test_kaist_between_nodes_is_linear(tmp_path):
    fields = polarised()
    path = tmp_path / "random.pbsdf"
    tensor_file.write(path, fields)
    m = load(path)
    assert m.channel_names == (450.0, 500.0, 550.0, 600.0, 650.0)
    wi, wo = directions(200, 3, 0.05), directions(200, 4, 0.05)
    for a, b, found in zip(wi, wo, m.f(wi, wo), strict=True):
        theta_h, theta_d, phi_d = halved(a, b)
        at = ((phi_d + np.pi) / (2 * np.pi) * 12, theta_d / (np.pi / 2) * 7, theta_h / (np.pi / 2) * 8)
        np.testing.assert_allclose(found, trilinear(fields["M"][..., 0, 0], at), rtol=1e-6)
    np.testing.assert_array_equal(m.mueller, fields["M"])
    assert m.data["mueller"].sizes["stokes_i"] == 4
    assert claimed(path) == ["KAIST"]


def test_kaist_beside_mitsuba(tmp_path):
    mi = pytest.importorskip("mitsuba", reason="mitsuba is not installed")
    if "scalar_spectral_polarized" not in mi.variants():
        pytest.skip("this Mitsuba has no variant scalar_spectral_polarized")
    before = mi.variant()
    mi.set_variant("scalar_spectral_polarized")
    try:
        path = tmp_path / "random.pbsdf"
        tensor_file.write(path, polarised())
        m = load(path)
        wi, wo = directions(200, 3, 0.05), directions(200, 4, 0.05)
        f = m.f(wi, wo)
        for k, nm in ((1, 500.0), (4, 650.0)):
            bsdf = mi.load_dict({"type": "measured_polarized", "filename": str(path), "wavelength": nm})
            for a, b, found in zip(wi, wo, f[:, k], strict=True):
                si = mi.SurfaceInteraction3f()
                si.wi, si.sh_frame = mi.Vector3f(*b), mi.Frame3f([0, 0, 1])  # the camera's side is our wo
                value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*a))).reshape(4, 4, -1)[0, 0, 0]
                assert value == pytest.approx(found * a[2], rel=5e-5)
    finally:
        if before:
            mi.set_variant(before)


def test_kaist_holes(tmp_path):
    path = tmp_path / "holes.pbsdf"
    tensor_file.write(path, polarised(holes=0.2))
    m = load(path)
    wi, wo = directions(2000, 3), directions(2000, 4)
    f = m.f(wi, wo)
    assert 0.0 < np.isnan(f).mean() < 0.1
    assert np.nanmin(f) >= 0.1
    assert np.nanmax(f) <= 1.0
    assert m.valid.mean() == pytest.approx(0.8, abs=0.1)


def test_kaist_writes_its_fields_and_models(tmp_path):
    path, copy = tmp_path / "random.pbsdf", tmp_path / "copy.pbsdf"
    tensor_file.write(path, {**polarised(), "description": np.frombuffer(b"of a stone", "u1")})
    save(load(path), copy)
    assert copy.read_bytes() == path.read_bytes()
    save(0.5 * gn.Lambertian(0.4) + gn.Microfacet(gn.GGX(0.5), 0.9), path, resolution=(31, 31, 25))
    m = load(path)
    wi, wo = directions(500, 1, 0.2), directions(500, 2, 0.2)
    true = (0.2 / np.pi + gn.Microfacet(gn.GGX(0.5), 0.9).f(wi, wo))[:, None]
    assert np.abs(m.f(wi, wo) / true - 1.0).max() < 0.05
    assert not m.mueller[..., 0, 1][np.isfinite(m.mueller[..., 0, 0])].any()
    for other in (MODEL, ANISOTROPIC, gn.IdealSpecular(0.5)):
        with pytest.raises(ParameterError, match="KAIST files hold"):
            save(other, path)
    with pytest.raises(ParameterError, match="resolution"):
        save(GRAY, path, resolution=(1, 2, 3))


def header_of(shapes):
    """A tensor file of these fields' names, types and shapes, without data; and its whole length."""
    codes = {dtype: code for code, dtype in tensor_file.TYPES.items()}
    at = 18 + sum(13 + len(n) + 8 * len(s) for n, (_, s) in shapes.items())
    head = b"tensor_file\0\1\0" + struct.pack("<I", len(shapes))
    places = {}
    for name, (dtype, shape) in shapes.items():
        at += -at % 8
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack(f"<HBQ{len(shape)}Q", len(shape), codes[np.dtype(dtype)], at, *shape)
        places[name] = at
        at += math.prod(shape) * np.dtype(dtype).itemsize
    return head, places, at


def test_kaist_of_full_size_takes_the_memory_of_what_f_needs(tmp_path):
    shapes = {name: ("f4", (1, n)) for name, n in (("theta_h", 91), ("theta_d", 91), ("phi_d", 361))}
    shapes |= {"wvls": ("u2", (5,)), "M": ("f4", (361, 91, 91, 5, 4, 4))}
    head, places, size = header_of(shapes)
    assert size == pytest.approx(957e6, rel=1e-3)
    path = tmp_path / "sparse.pbsdf"
    with path.open("wb") as file:
        file.write(head)
        for name, n, low, high in (
            ("theta_h", 91, 0.0, 0.5),
            ("theta_d", 91, 0.0, 0.5),
            ("phi_d", 361, -1.0, 1.0),
        ):
            file.seek(places[name])
            file.write((np.linspace(low, high, n) * np.pi).astype("<f4").tobytes())
        file.seek(places["wvls"])
        file.write(np.array(kaist.WAVELENGTHS, "<u2").tobytes())
        file.truncate(size)
    formats()  # what modules import does not count
    tracemalloc.start()
    m = load(path)
    assert tracemalloc.get_traced_memory()[1] < 70_000_000  # M00 are 60 MB: a sixteenth of the file
    tracemalloc.stop()
    assert m.fields_stored["M"].shape == (361, 91, 91, 5, 4, 4)
    assert {axis.spacing for axis in m.layout} == {"even"}


def test_kaist_damage(tmp_path):
    path, fields = tmp_path / "damaged.pbsdf", polarised(counts=(3, 3, 5), wavelengths=(450, 550))
    for change, why in (
        ({"M": fields["M"][:-1]}, "M is float32 of shape"),
        ({"M": fields["M"].astype("f8")}, "expected float32"),
        ({"wvls": np.array([550, 450], "u2")}, "increasing wavelengths"),
        ({"theta_h": fields["theta_h"][:, ::-1]}, "theta_h"),
        ({"theta_h": fields["theta_h"] * np.nan}, "theta_h"),
        ({"phi_d": np.degrees(fields["phi_d"])}, "rad"),
    ):
        tensor_file.write(path, {**fields, **change})
        with pytest.raises(FormatError, match=why):
            load(path)
    tensor_file.write(path, fields)
    data = path.read_bytes()
    for size in (20, 100, len(data) - 1):
        with pytest.raises(FormatError):
            kaist.read(written(tmp_path, data[:size]))
    tensor_file.write(path, {k: v for k, v in fields.items() if k != "M"})
    with pytest.raises(FormatError, match="'M' is missing"):
        load(path)
    with pytest.raises(FormatError):
        KAIST({k: v for k, v in fields.items() if k != "wvls"})


# UTIA.


def utia_index(plane, ti, pi, to, po):
    """As all readers have it."""
    return plane * 288 * 288 + 288 * (48 * ti + pi) + 48 * to + po


@pytest.fixture(scope="module")
def utia_numbers():
    return np.random.default_rng(1).uniform(0.1, 0.9, 3 * 288 * 288)


def test_utia_numbers_are_where_readers_find_them(tmp_path, utia_numbers):
    path = written(tmp_path, utia_numbers.tobytes(), "random.bin")
    assert path.stat().st_size == 1_990_656
    m = load(path)
    for ti, pi, to, po in ((0, 0, 0, 0), (1, 2, 3, 4), (5, 47, 5, 46), (2, 30, 0, 7)):
        angles = np.radians([15.0 * ti, 7.5 * pi, 15.0 * to, 7.5 * po])
        if ti == 0:
            angles[0], angles[1] = 1e-9, angles[1]
        expected = [utia_numbers[utia_index(c, ti, pi, to, po)] for c in range(3)]
        np.testing.assert_allclose(m.f_angles(*np.maximum(angles, [1e-8, 0.0, 1e-8, 0.0])), expected, rtol=1e-6)
    # Half way between two azimuths, across 360 degrees; and beyond 75 degrees, where it stays.
    found = m.f_angles(*np.radians([30.0, 356.25, 45.0, 15.0]))
    ends = [[utia_numbers[utia_index(c, 2, p, 3, 2)] for c in range(3)] for p in (47, 0)]
    np.testing.assert_allclose(found, np.mean(ends, axis=0), rtol=1e-9)
    np.testing.assert_allclose(
        m.f_angles(*np.radians([88.0, 15.0, 45.0, 15.0])), m.f_angles(*np.radians([75.0, 15.0, 45.0, 15.0])), rtol=1e-9
    )
    assert claimed(path) == ["UTIA"]


def test_utia_decodings(tmp_path, utia_numbers):
    stored = utia_numbers.copy()
    stored[utia_index(0, 1, 0, 1, 0)], stored[utia_index(1, 1, 0, 1, 0)] = 0.5, -0.02
    stored[utia_index(2, 1, 0, 1, 0)] = 70.0
    path = written(tmp_path, stored.tobytes(), "random.bin")
    at = np.radians([15.0, 0.0, 15.0, 0.0])
    assert load(path) == utia.read(path, decoding="linear") != utia.read(path, decoding="srgb")
    np.testing.assert_allclose(load(path).f_angles(*at), [0.5, -0.02, 70.0])
    # IEC 61966-2-1: 0.5 is 0.21404 linear; dj_brdf divides by 140 before, and multiplies by 100 after.
    found = utia.read(path, decoding="srgb").f_angles(*at)
    np.testing.assert_allclose(found[:2], [0.214041, -0.02 / 12.92], rtol=1e-5)
    found = utia.read(path, decoding="dj_brdf").f_angles(*at)
    np.testing.assert_allclose(found, [100 * 0.5 / 140 / 12.92, -100 * 0.02 / 140 / 12.92, 21.4041], rtol=1e-5)
    with pytest.raises(ParameterError, match="'srgb'"):
        utia.read(path, decoding="gamma")


def test_utia_writes(tmp_path, utia_numbers):
    stored = utia_numbers.copy()
    stored[7] = -1.0
    path, copy = written(tmp_path, stored.tobytes(), "random.bin"), tmp_path / "copy.bin"
    save(utia.read(path, decoding="srgb"), copy)
    assert copy.read_bytes() == path.read_bytes()
    for m in (ANISOTROPIC, GRAY):
        save(m, copy)
        theta, phi = np.radians([15.0, 45.0, 75.0]), np.radians([7.5, 352.5])
        at = np.meshgrid(theta, phi, theta, phi, indexing="ij")
        expected = m.f_angles(*at)
        found = load(copy).f_angles(*at)
        np.testing.assert_allclose(
            found, np.broadcast_to(expected[..., None] if m is GRAY else expected, found.shape), rtol=1e-9
        )
    for m, why in ((gn.IdealSpecular(0.5), "mirror"), (gn.Lambertian([0.1, 0.2]), "1 or 3")):
        with pytest.raises(ParameterError, match=why):
            save(m, copy)
    holes = csail.CSAIL(np.full((3, 2, 2, 2, 2), -1.0, "f4"), header((2, 2, 2, 2)))
    with pytest.raises(ParameterError, match="holes"):
        save(holes, copy)


def test_utia_damage(tmp_path, utia_numbers):
    data = utia_numbers.tobytes()
    with pytest.raises(FormatError, match="1990656 for 6 theta"):
        utia.read(written(tmp_path, data[:-8]))
    assert claimed(written(tmp_path, data[:-8])) == []
    assert claimed(written(tmp_path, b"0.125 " * 331776)) == []  # a text of the same length
    with pytest.raises(ParameterError, match="theta_step"):
        utia.read(written(tmp_path, data), theta_step=20.0)


def test_utia_pictures(tmp_path):
    m = ANISOTROPIC
    table = tmp_path / "m.bin"
    save(m, table, "UTIA")
    as_table = load(table)
    picture = tmp_path / "m.exr"
    save(as_table, picture)
    assert claimed(picture) == ["UTIA"]
    found = load(picture)
    np.testing.assert_array_equal(found.raw, as_table.raw.astype(np.float32))
    # The pixel in row 48 * 2 + 5, column 48 * 3 + 7 is theta_i = 30, phi_i = 37.5, theta_o = 45, phi_o = 52.5 degrees.
    pixels = read_image(picture).pixels
    f = as_table.f_angles(*np.radians([30.0, 37.5, 45.0, 52.5]))
    np.testing.assert_allclose(pixels[101, 151], f, rtol=1e-6)
    # Turned upside down it is the same material, for that one is reciprocal; unless that is said otherwise.
    turned = tmp_path / "turned.exr"
    Image(pixels[::-1]).save(turned)
    np.testing.assert_array_equal(load(turned).raw, found.raw)
    np.testing.assert_array_equal(load(turned, rows="down").raw[:, 0, 0], found.raw[:, 5, 47])
    np.testing.assert_allclose(
        utia.read(picture, decoding="xyz").f_angles(*np.radians([30.0, 37.5, 45.0, 52.5])), f @ RGB_OF_XYZ.T, rtol=1e-6
    )
    with pytest.raises(ParameterError, match="rows='left': expected 'down' or 'up'"):
        load(picture, rows="left")
    Image(pixels[:287]).save(turned)
    with pytest.raises(FormatError, match="not a known format"):
        load(turned)
    Image(pixels[..., :1]).save(turned)
    with pytest.raises(FormatError, match=r"a picture of \(288, 288, 1\), expected \(288, 288, 3\)"):
        load(turned)


@pytest.mark.full  # 1.5 GB
def test_utia_dense(tmp_path):
    path = tmp_path / "dense.bin"
    with path.open("wb") as file:
        file.truncate(8 * 3 * (44 * 180) ** 2)
        index = (44 * 180) * (180 * 10 + 5) + 180 * 20 + 7  # plane 0, theta_i 10, phi_i 5, theta_o 20, phi_o 7
        file.seek(8 * index)
        file.write(struct.pack("<d", 0.75))
    formats()
    tracemalloc.start()
    m = load(path)
    assert tracemalloc.get_traced_memory()[1] < 1.01 * path.stat().st_size
    tracemalloc.stop()
    assert m.stored[10, 20, 5, 7].tolist() == [0.75, 0.0, 0.0]
    assert [round(math.degrees(x[1] - x[0]), 9) for x in m.axes.values()] == [2.0] * 4


# CSAIL.


def header(counts, half=0, **other):
    found = np.zeros(16, "<i4")
    found[[0, 1, 2, 3, 6, 9, 10]] = *counts, 1, half, 3
    for at, value in other.items():
        found[int(at[1:])] = value
    return found


def ngan(counts=(5, 4, 8, 6), half=0, seed=1, holes=0.0):
    rng = np.random.default_rng(seed)
    raw = rng.uniform(0.1, 1.0, (3, *counts)).astype("<f4")
    raw[:, rng.random(counts) < holes] = -1.0
    if holes:
        raw[:, 1:3, 1:3, 2:5, 1:4] = -1.0
    return header(counts, half), raw


def brdf_explorer(raw, wi, wo):
    """Bin of a pair, as BRDF Explorer finds it."""
    _, n_i, n_o, n_d, n_p = raw.shape
    phi_o, phi_i = math.atan2(-wo[1], -wo[0]), math.atan2(-wi[1], -wi[0])
    phi = (phi_o - phi_i) % (2 * math.pi)
    i, o = (int(math.acos(w[2]) * n * 2 / math.pi) for w, n in ((wi, n_i), (wo, n_o)))
    d, p = int(phi * n_d / (2 * math.pi)), int(phi_i % (2 * math.pi) * n_p / (2 * math.pi))
    return raw.reshape(3, -1)[:, p + n_p * (d + n_d * (o + n_o * i))]


def test_csail_bins_are_brdf_explorers(tmp_path):
    head, raw = ngan()
    path = written(tmp_path, head.tobytes() + raw.tobytes(), "random.dat")
    m = load(path)
    nearest = m.replace(interpolation="nearest")
    wi, wo = directions(300, 3), directions(300, 4)
    expected = [brdf_explorer(raw, a, b) for a, b in zip(wi, wo, strict=True)]
    np.testing.assert_allclose(nearest.f(wi, wo), expected, rtol=1e-6)
    # and linear between centres: half way between two phi
    at = np.radians([45.0 / 5, 30.0, 45.0 / 4, 30.0 + 22.5 + 22.5])  # theta_i 0, phi_i bin 3 about 30, theta_o 0
    found = m.f_angles(*at)
    np.testing.assert_allclose(found, raw[:, 0, 0, [0, 1], 3].mean(axis=1), rtol=1e-6)
    assert claimed(path) == ["CSAIL"]


def test_csail_half_is_mirrored():
    head, raw = ngan(half=1)
    m = csail.CSAIL(raw, head)
    theta_i, theta_o, phi_i, phi = np.radians([20.0, 50.0, 77.0, 33.0])
    np.testing.assert_allclose(
        m.f_angles(theta_i, phi_i, theta_o, phi_i + phi), m.f_angles(theta_i, phi_i, theta_o, phi_i - phi)
    )
    centre = np.radians([9.0, 30.0, 11.25, 30.0 + 11.25])  # first bins; phi has 8 in 180 degrees
    np.testing.assert_allclose(m.f_angles(*centre), raw[:, 0, 0, 0, 3], rtol=1e-6)


def test_csail_negative_is_no_data():
    head, raw = ngan(holes=0.3)
    m = csail.CSAIL(raw, head, scale=10.0)
    f = m.f(directions(2000, 3), directions(2000, 4))
    assert 0.0 < np.isnan(f).mean() < 0.05
    assert np.nanmin(f) >= 1.0
    assert m.valid.mean() == pytest.approx(0.7, abs=0.1)
    np.testing.assert_array_equal(np.isfinite(m.brdf()), m.valid)
    assert m != csail.CSAIL(raw, head)


def test_csail_writes(tmp_path):
    head, raw = ngan(holes=0.3)
    head[13] = 77  # reserved
    path, copy = written(tmp_path, head.tobytes() + raw.tobytes(), "random.dat"), tmp_path / "copy.dat"
    save(load(path), copy, format="CSAIL")
    assert copy.read_bytes() == path.read_bytes()
    save(ANISOTROPIC, copy, format="CSAIL", resolution=(6, 5, 12, 9))
    m = load(copy)
    wi, wo = m.directions()
    np.testing.assert_allclose(m.stored, ANISOTROPIC.f(wi, wo), rtol=1e-6)
    np.testing.assert_allclose(m.f(wi, wo), m.stored, rtol=1e-6)
    with pytest.raises(ParameterError, match="mirror"):
        save(gn.IdealSpecular(0.5), copy, format="CSAIL")
    with pytest.raises(ParameterError, match="resolution"):
        save(GRAY, copy, format="CSAIL", resolution=(0, 1, 1, 1))
    with pytest.raises(ParameterError, match="format"):
        save(GRAY, copy)


def test_csail_damage(tmp_path):
    head, raw = ngan()
    for damaged, why in (
        (header((5, 4, 8, 6), _6=0), "paramType is 0"),
        (header((5, 4, 8, 6), _7=1), "binType is 1"),
        (header((5, 4, 8, 6), _9=2), "half_data is 2"),
        (header((5, 4, 8, 6), _10=4), "channels is 4"),
        (header((5, 4, 8, -6)), "expected"),
        (header((2000, 2000, 2000, 2000)), "cut short"),
    ):
        with pytest.raises(FormatError, match=why):
            csail.read(written(tmp_path, damaged.tobytes() + raw.tobytes()))
    with pytest.raises(FormatError, match="cut short"):
        load(written(tmp_path, head.tobytes() + raw.tobytes()[:-4]))
    with pytest.raises(FormatError, match="cut short"):
        csail.read(written(tmp_path, head.tobytes()[:20]))
    with pytest.raises(ParameterError, match="scale"):
        csail.CSAIL(raw, head, scale=-1.0)


# CUReT.


def curet_table(values, first=1):
    lines = [f"{k}  " + "  ".join(f"{x:.3f}" for x in row) + " \n" for k, row in enumerate(values, start=first)]
    return "".join(lines).encode()


def lambertian_table(samples=3):
    return np.array([[0.05 * (k + 1)] * 205 for k in range(samples)])


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
    path = written(tmp_path, curet_table(values), "abrdf.dat")
    m = curet.read(path, sample=2)
    assert m.about["sample"] == 2
    np.testing.assert_allclose(m.stored, values[1], atol=5e-4)
    # The rows, looked up: light comes first in f, and second in the table.
    inner = np.maximum(theta_i, theta_o) < 1.2
    found = m.f_angles(theta_i, phi_i, theta_o, phi_o)[inner]
    assert np.median(np.abs(found / values[1][inner] - 1.0)) < 0.05
    np.testing.assert_allclose(curet.read(path, sample=3).f_angles(0.5, 0.0, 0.3, 1.0), 0.15, rtol=1e-3)
    assert claimed(path) == ["CUReT"]
    one = written(tmp_path, curet_table(values[:1]), "one.dat")
    np.testing.assert_allclose(load(one).f_angles(0.5, 0.0, 0.3, 1.0), 0.05, rtol=1e-3)


def test_curet_colours(tmp_path):
    for k, name in enumerate(("rbrdf.dat", "gbrdf.dat", "bbrdf.dat")):
        written(tmp_path, curet_table(lambertian_table() * (k + 1)), name)
    m = curet.read(tmp_path / "gbrdf.dat", sample=1, rgb=True)
    assert m.channel_names == ("R", "G", "B")
    np.testing.assert_allclose(m.f_angles(0.5, 0.0, 0.3, 1.0), [0.05, 0.1, 0.15], rtol=1e-3)
    with pytest.raises(ParameterError, match="rbrdf"):
        curet.read(written(tmp_path, curet_table(lambertian_table()), "other.dat"), sample=1, rgb=True)


def test_curet_oren_nayar(tmp_path):
    path = written(tmp_path, b"1 0.5 0.3 0.8\r\n2 0.25 0.0 1.0\r\n3 1.5 0.1 1\r\n", "op.dat")
    assert curet.read(path, sample=1) == 0.8 * gn.OrenNayar(0.5, 0.3)
    assert curet.read(path, sample=1, kd=False) == gn.OrenNayar(0.5, 0.3)
    assert claimed(path) == ["CUReT"]
    with pytest.raises(FormatError, match=r"sample 3.*out of bounds"):
        curet.read(path, sample=3)


def test_curet_koenderink_modes(tmp_path):
    path = written(tmp_path, b"1 0.5 0 0 0 0\n", "kp2.dat")
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
            curet.read(written(tmp_path, data))
    assert claimed(written(tmp_path, b"1 2 3\n4 5 6\n")) == []
    assert claimed(written(tmp_path, b"1 0.5 0.5 0.5\n3 0.5 0.5 0.5\n")) == []


# Neural-BRDF.

NETWORKS = ("gold-metallic-paint", "pink-felt", "yellow-plastic")


def network(name):
    return neural.read(real(REAL / "nbrdf" / f"{name}.h5"))


def random_network(seed=1):
    rng = np.random.default_rng(seed)
    return neural.Neural(
        [rng.normal(0.0, 0.4, s).astype("f4") for s in neural.SHAPES],
        [rng.normal(0.0, 0.2, s[1:]).astype("f4") for s in neural.SHAPES],
    )


def forward(m, wi, wo):
    theta_h, theta_d, phi_d = halved(wi, wo)
    s = math.sin(theta_d)
    x = np.array(
        [math.sin(theta_h), 0.0, math.cos(theta_h), s * math.cos(phi_d), s * math.sin(phi_d), math.cos(theta_d)]
    )
    for k in (1, 2):
        x = np.maximum(x @ getattr(m, f"kernel_{k}") + getattr(m, f"bias_{k}"), 0.0)
    return np.exp(x @ m.kernel_3 + m.bias_3) - 1.0


def test_neural_is_the_network(evaluation):
    m = random_network()
    wi, wo = directions(100, 1), directions(100, 2)
    expected = [forward(m, a, b) for a, b in zip(wi, wo, strict=True)]
    np.testing.assert_allclose(m.f(wi, wo), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", NETWORKS)
def test_neural_real_files_are_like_published_fits_of_the_same_materials(name, monkeypatch):
    switch_off(monkeypatch)  # the kernel of a network takes longer to compile than all this to compute
    m = network(name)
    w = gn.direction(np.radians([5.0, 30.0, 60.0]), 0.0)
    np.testing.assert_allclose(gn.albedo(m, w), gn.albedo(gn.material(name), w), atol=0.035)


def test_neural_writes(tmp_path):
    m, path = random_network(), tmp_path / "copy.h5"
    save(m, path)
    assert load(path) == m
    assert claimed(path)[0] == "Neural-BRDF"  # before netCDF, which takes all of HDF5
    with pytest.raises(ParameterError, match="not fitted"):
        save(GRAY, path)


def test_neural_damage(tmp_path):
    import h5py

    path = tmp_path / "copy.h5"
    save(random_network(), path)
    data = path.read_bytes()
    for size in (100, 3000, len(data) - 5000):
        with pytest.raises(FormatError):
            neural.read(written(tmp_path, data[:size]))
    for k, shape in ((1, (7, 21)), (3, (21, 4))):
        save(random_network(), path)
        with h5py.File(path, "a") as file:
            del file[f"dense_{k}/dense_{k}/kernel:0"]
            file[f"dense_{k}/dense_{k}/kernel:0"] = np.zeros(shape, "f4")
        with pytest.raises(FormatError, match="expected floats of shape"):
            load(path)
    save(random_network(), path)
    with h5py.File(path, "a") as file:
        del file["dense_2/dense_2/bias:0"]
        file["dense_2/dense_2/bias:0"] = h5py.ExternalLink("/etc/passwd", "/")
    with pytest.raises(FormatError, match="in another file"):
        load(path)
    with pytest.raises(ParameterError, match="layer 2"):
        neural.Neural([np.zeros(s) for s in ((6, 21), (21, 20), (21, 3))], [np.zeros(s[1:]) for s in neural.SHAPES])


# All.


def test_no_other_format_claims_them(tmp_path):
    files = {
        "SCATFUN": layered({(0.5, -0.5): [1.0]}),
        "CSAIL": b"".join(a.tobytes() for a in ngan()),
        "CUReT": curet_table(lambertian_table()),
        "KAIST": tensor_file.serialise(polarised(counts=(2, 2, 3), wavelengths=(550,))),
    }
    for name, data in files.items():
        assert claimed(written(tmp_path, data)) == [name]


def test_missing_files():
    for module in (scatfun, kaist):
        with pytest.raises(NotFoundError):
            module.read(Path("/nowhere/at/all"))
    assert issubclass(NotFoundError, Error)
