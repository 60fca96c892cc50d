"""SCATFUN: splines of Fourier series by hand, a real file bit by bit, sides, models, damage."""

from __future__ import annotations

import gzip
import math
import struct
import tracemalloc

import numpy as np
import pytest
from binary_files import layered, random_layered
from format_cases import ANISOTROPIC, GRAY, MODEL, claimed, directions, file_of
from libraries import thinned
from places import real

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import load, save, scatfun
from gonio.formats.scatfun import contents

ROUGH_GOLD = "fbsdf/roughgold_alpha_0.2.bsdf.gz"


def near_mirror(n, seed):
    """Pairs, half of them about the mirror direction."""
    wi, wo = directions(n, seed, 0.02), directions(n, seed + 1, 0.02)
    turned = wi[::2] * [-1.0, -1.0, 1.0] + 0.1 * np.random.default_rng(seed).normal(size=wi[::2].shape)
    turned[:, 2] = np.abs(turned[:, 2]) + 0.02
    wo[::2] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return wi, wo


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
    m = load(file_of(tmp_path, layered({(0.75, -0.5): [0.25, 0.1]})))
    wi = gn.direction(math.acos(0.5), 0.3)
    for phi, expected in ((0.0, 0.35), (math.pi, 0.15), (math.pi / 2, 0.25), (1.0, 0.25 + 0.1 * math.cos(1.0))):
        wo = gn.direction(math.acos(0.75), 0.3 + math.pi + phi)  # phi = 0 is forward
        np.testing.assert_allclose(m.f(wi, wo), expected / 0.5, rtol=2e-5)
    assert m.f(wi, gn.direction(math.acos(0.5), 0.3)) == pytest.approx(0.0, abs=1e-7)
    assert m.f(gn.direction(math.acos(0.75), 0.0), gn.direction(math.acos(0.5), 0.0)) == pytest.approx(0.0, abs=1e-7)


def test_scatfun_green_follows_from_luminance_red_and_blue(tmp_path):
    m = load(file_of(tmp_path, layered({(0.5, -0.5): [[0.3], [0.5], [0.1]]}, 3)))
    f = m.f(gn.direction(math.pi / 3, 0.0), gn.direction(math.pi / 3, 1.0))
    green = 1.39829 * 0.3 - 0.297375 * 0.5 - 0.100913 * 0.1
    np.testing.assert_allclose(f, np.array([0.5, green, 0.1]) / 0.5, rtol=1e-6)
    assert m.channel_names == ("R", "G", "B")


def test_scatfun_sides(tmp_path):
    path = file_of(tmp_path, layered({(0.5, -0.5): [0.1], (-0.5, 0.5): [0.3], (-0.5, -0.5): [9.0]}))
    pair = gn.direction(math.pi / 3, 0.0), gn.direction(math.pi / 3, 1.0)
    np.testing.assert_allclose([scatfun.read(path, side=s).f(*pair) for s in ("front", "back")], [0.2, 0.6], rtol=1e-6)
    with pytest.raises(ParameterError, match="'front', 'back', 'both'"):
        load(path, side="left")


@pytest.mark.parametrize("channels", [1, 3])
def test_scatfun_is_splines_of_fourier_series(tmp_path, channels, evaluation):
    m = load(file_of(tmp_path, random_layered(channels)))
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
    m = load(real(ROUGH_GOLD))
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
@pytest.mark.parametrize("nodes", thinned([16, 24], [16]))
def test_scatfun_of_a_model(tmp_path, m, nodes):
    path = tmp_path / "model.bsdf"
    save(m, path, format="SCATFUN", nodes=nodes)
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
            load(file_of(tmp_path, damaged))


def test_scatfun_gzip(tmp_path):
    data = random_layered(1)
    packed = gzip.compress(data)
    assert load(file_of(tmp_path, packed)) == scatfun.Scatfun(contents.parse(data, ""))
    # 2000 nodes and no coefficients: 48 MB of zeros after the header.
    nodes = np.linspace(-1.0, 1.0, 2000, dtype="f4")
    head = struct.pack("<7sB9I5f", b"SCATFUN", 1, 1, 2000, 0, 1, 1, 1, 0, 0, 0, 1.0, *[0.0] * 4)
    bomb = gzip.compress(head + nodes.tobytes() + bytes(12 * 2000**2))
    tracemalloc.start()
    with pytest.raises(FormatError, match="more than 100 times"):
        load(file_of(tmp_path, bomb))
    assert tracemalloc.get_traced_memory()[1] < 3_000_000
    tracemalloc.stop()
    for damaged, why in ((packed[:-100], "cut short|damaged"), (packed[:300] + b"\xff" * 300, "gzip")):
        with pytest.raises(FormatError, match=why):
            load(file_of(tmp_path, damaged))
    with pytest.raises(FormatError, match="cut short or damaged"):
        load(file_of(tmp_path, gzip.compress(data + bytes(1000))))
    assert claimed(file_of(tmp_path, gzip.compress(b"some text"))) == []
