"""KAIST: interpolation by hand and beside Mitsuba's, holes, writing, memory, damage."""

from __future__ import annotations

import math
import struct
import tracemalloc

import numpy as np
import pytest
from binary_files import halved, polarized
from format_cases import ANISOTROPIC, GRAY, MODEL, claimed, directions, file_of
from libraries import thinned

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import formats, kaist, load, save
from gonio.formats._reading import tensor_file
from gonio.formats.kaist import KAIST


def trilinear(table, at):
    start = [min(int(x), n - 2) for x, n in zip(at, table.shape, strict=False)]
    total = 0.0
    for corner in np.ndindex(2, 2, 2):
        weight = math.prod(1.0 - abs(x - s - c) for x, s, c in zip(at, start, corner, strict=True))
        total = total + weight * table[tuple(s + c for s, c in zip(start, corner, strict=True))].astype(float)
    return total


def test_kaist_between_nodes_is_linear(tmp_path):
    fields = polarized()
    path = tmp_path / "random.pbsdf"
    tensor_file.write(path, fields)
    m = load(path)
    assert m.channel_names == (450.0, 500.0, 550.0, 600.0, 650.0)
    wi, wo = directions(200, 3, 0.05), directions(200, 4, 0.05)
    for a, b, found in zip(wi, wo, m.f(wi, wo), strict=True):
        theta_h, theta_d, phi_d = halved(a, b)
        at = ((phi_d + np.pi) / (2 * np.pi) * 12, theta_d / (np.pi / 2) * 7, theta_h / (np.pi / 2) * 8)
        np.testing.assert_allclose(found, trilinear(fields["M"][..., 0, 0], at), rtol=1e-6)
    np.testing.assert_array_equal(m.matrices, fields["M"])
    assert m.data["mueller"].sizes["stokes_i"] == 4
    assert claimed(path) == ["KAIST"]


def test_kaist_beside_mitsuba(tmp_path):
    mi = pytest.importorskip("mitsuba")
    if "scalar_spectral_polarized" not in mi.variants():
        pytest.skip("this Mitsuba has no variant scalar_spectral_polarized")
    before = mi.variant()
    mi.set_variant("scalar_spectral_polarized")
    try:
        path = tmp_path / "random.pbsdf"
        tensor_file.write(path, polarized())
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
    tensor_file.write(path, polarized(holes=0.2))
    m = load(path)
    wi, wo = directions(2000, 3), directions(2000, 4)
    f = m.f(wi, wo)
    assert 0.0 < np.isnan(f).mean() < 0.1
    assert np.nanmin(f) >= 0.1
    assert np.nanmax(f) <= 1.0
    assert m.valid.mean() == pytest.approx(0.8, abs=0.1)


def test_kaist_writes_its_fields_and_models(tmp_path):
    path, copy = tmp_path / "random.pbsdf", tmp_path / "copy.pbsdf"
    tensor_file.write(path, {**polarized(), "description": np.frombuffer(b"of a stone", "u1")})
    save(load(path), copy)
    assert copy.read_bytes() == path.read_bytes()
    save(0.5 * gn.Lambertian(0.4) + gn.Microfacet(gn.GGX(0.5), 0.9), path, resolution=(31, 31, 25))
    m = load(path)
    wi, wo = directions(500, 1, 0.2), directions(500, 2, 0.2)
    true = (0.2 / np.pi + gn.Microfacet(gn.GGX(0.5), 0.9).f(wi, wo))[:, None]
    assert np.abs(m.f(wi, wo) / true - 1.0).max() < 0.05
    assert not m.matrices[..., 0, 1][np.isfinite(m.matrices[..., 0, 0])].any()
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


@pytest.mark.parametrize(("polar", "turns"), thinned([(46, 181), (91, 361)], [(46, 181)]))
def test_kaist_takes_the_memory_of_what_f_needs(polar, turns, tmp_path):
    """The larger one is as large as published files."""
    counts = {"theta_h": polar, "theta_d": polar, "phi_d": turns}
    shape = (turns, polar, polar, 5, 4, 4)
    axes = {name: ("f4", (1, n)) for name, n in counts.items()}
    head, places, size = header_of({**axes, "wvls": ("u2", (5,)), "M": ("f4", shape)})
    assert size == pytest.approx(957e6 if turns == 361 else 122.5e6, rel=1e-3)
    path = tmp_path / "sparse.pbsdf"
    with path.open("wb") as file:
        file.write(head)
        for name, n in counts.items():
            file.seek(places[name])
            low, high = (-1.0, 1.0) if name == "phi_d" else (0.0, 0.5)
            file.write((np.linspace(low, high, n) * np.pi).astype("<f4").tobytes())
        file.seek(places["wvls"])
        file.write(np.array(kaist.WAVELENGTHS, "<u2").tobytes())
        file.truncate(size)
    formats()  # what modules import does not count
    tracemalloc.start()
    m = load(path)
    assert tracemalloc.get_traced_memory()[1] < 7 / 6 * size / 16 + 200_000  # M00 are a sixteenth of the file
    tracemalloc.stop()
    assert m.fields_stored["M"].shape == shape
    assert {axis.spacing for axis in m.layout} == {"even"}


def test_kaist_damage(tmp_path):
    path, fields = tmp_path / "damaged.pbsdf", polarized(counts=(3, 3, 5), wavelengths=(450, 550))
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
            kaist.read(file_of(tmp_path, data[:size]))
    tensor_file.write(path, {k: v for k, v in fields.items() if k != "M"})
    with pytest.raises(FormatError, match="'M' is missing"):
        load(path)
    with pytest.raises(FormatError):
        KAIST({k: v for k, v in fields.items() if k != "wvls"})
