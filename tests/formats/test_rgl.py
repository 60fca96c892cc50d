"""RGL tensor files, real and synthetic: against analytic content and Mitsuba's `measured`; laws; damage."""

from __future__ import annotations

import math
import pickle
import struct
from pathlib import Path

import numpy as np
import places
import pytest
from libraries import switch_off, thinned
from rgl_files import WAVELENGTHS, D, S, sigma, slopes, synthetic, unit, unwarp

import gonio as gn
from gonio.conversion.comparison import resampling_error
from gonio.errors import Error, FormatError, ParameterError
from gonio.formats import load, rgl, save
from gonio.formats._reading import tensor_file
from gonio.formats.merl import MERL
from gonio.formats.rgl import writer

PAPER, IBIZA = "paper_white_rgb.bsdf", "cc_ibiza_sunset_rgb.bsdf"


def real(name: str) -> str:
    return str(places.real(f"rgl/{name}"))


def directions(rng: np.random.Generator, n: int, lowest: float = 0.01) -> np.ndarray:
    z, phi = rng.uniform(lowest, 1.0, n), rng.uniform(-np.pi, np.pi, n)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def expected(wi, wo, r, channels=3):
    """f that the synthetic file stands for."""
    m = (wi + wo) / np.linalg.norm(wi + wo, axis=-1, keepdims=True)
    w, m = list(wi.T), list(m.T)
    if r == 0:  # in the frame where wi has azimuth 0
        s = np.hypot(w[0], w[1])
        c, d = w[0] / s, w[1] / s
        w, m = [s, 0.0 * s, w[2]], [c * m[0] + d * m[1], c * m[1] - d * m[0], m[2]]
    f = S([v[:, None] for v in w], [v[:, None] for v in m], np.arange(channels), r)
    return f * (D(m, r) / (4.0 * sigma(w, r) * wo[:, 2]))[:, None]


SYNTHETIC = [(0, 3), (0, 5), (1, 3), (2, 3), (4, 3), (1, 5), (4, 5)]


@pytest.mark.parametrize(("r", "channels"), SYNTHETIC)
def test_synthetic_file_gives_the_content_it_was_made_from(r, channels, tmp_path):
    path = tmp_path / "a.bsdf"
    tensor_file.write(path, synthetic(r, channels=channels))
    m = load(path)
    assert m.reduction == max(r, 1)
    assert m.isotropic == (r == 0)
    assert m.channel_names == (("R", "G", "B") if channels == 3 else WAVELENGTHS)
    rng = np.random.default_rng(r)
    wi, wo = directions(rng, 2000), directions(rng, 2000)
    error = np.abs(m.f(wi, wo) / expected(wi, wo, r, channels) - 1.0)
    # What remains is the error of interpolating between nodes 11 degrees apart.
    assert np.quantile(error, 0.99) < 0.03
    assert error.max() < 0.08


@pytest.mark.parametrize("r", [2, 4])
@pytest.mark.parametrize("zero", [0.0, -0.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_folded_files_are_right_on_the_axes_they_are_folded_at(r, axis, zero):
    """Mitsuba is not: its arctan2(-0, -1) is +pi, the wrong end of phi_i."""
    rng = np.random.default_rng(1)
    wi, wo = directions(rng, 200), directions(rng, 200)
    wi[:, axis] = zero
    wi /= np.linalg.norm(wi, axis=-1, keepdims=True)
    np.testing.assert_allclose(rgl.RGL(synthetic(r)).f(wi, wo), expected(wi, wo, r), rtol=0.05)


@pytest.mark.parametrize("field", ["rgb", "ndf", "sigma", "vndf"])
def test_synthetic_content_tells_axes_apart(field):
    fields = synthetic(2, n_ndf=20)
    fields[field] = fields[field][..., ::-1, :]
    rng = np.random.default_rng(3)
    wi, wo = directions(rng, 500), directions(rng, 500)
    assert np.median(np.abs(rgl.RGL(fields).f(wi, wo) / expected(wi, wo, 2) - 1.0)) > 0.015


@pytest.mark.parametrize("r", [0, 1, 2, 4])
def test_nodes_are_met_exactly(r):
    """Without Jacobian, f cos(theta_o) at a node of all axes is the stored number: axes, strides and warp."""
    n, fields = 9, synthetic(r, n=9, jacobian=0)
    m = rgl.RGL(fields)
    rng, found = np.random.default_rng(5), 0
    inner = 0 if r == 0 else 1  # the outermost azimuths of a folded file are each other's, turned
    i = rng.integers(inner, len(fields["phi_i"]) - inner, 400)
    j = rng.integers(1, len(fields["theta_i"]) - 1, 400)
    p, q = rng.integers(1, n - 1, (2, 400))  # rows and columns of the grid of s
    theta, phi = fields["theta_i"].astype(float)[j], fields["phi_i"].astype(float)[i]
    a, b = slopes(theta, phi)
    x, y = unwarp(q / (n - 1), a), unwarp(p / (n - 1), b)
    wi = np.stack(unit(theta, phi), -1)
    wm = np.stack(unit(0.5 * np.pi * x * x, (2 * y - 1) * np.pi + (phi if r == 0 else 0.0)), -1)
    wo = 2.0 * (wi * wm).sum(-1, keepdims=True) * wm - wi
    up = wo[:, 2] > 0.01
    got = m.f(wi, wo)[up] * wo[up, 2:]
    want = fields["rgb"][i, j, :, p, q][up]
    found = up.sum()
    assert found > 50
    np.testing.assert_allclose(got, want, rtol=3e-6)


# Against Mitsuba.


@pytest.fixture
def mitsuba():
    mi = pytest.importorskip("mitsuba")
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    yield mi
    if before is not None:
        mi.set_variant(before)


def turned(w, angle):
    """w about the normal by angle."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * w[:, 0] - sin * w[:, 1], sin * w[:, 0] + cos * w[:, 1], w[:, 2]], -1)


def where_nothing_is_folded(w):
    """Angle that turns each w to x = y < 0.

    Mitsuba folds directions by `m_reduction`, which it does not set for isotropic files: it is what a BSDF before left
    in the same memory. Just after a file with two mirrors, 3.9.1 mirrors half of the directions of an isotropic one.
    Isotropic files are asked where folding changes nothing.
    """
    return -0.75 * np.pi - np.arctan2(w[:, 1], w[:, 0])


def mitsuba_f_pdf(mi, path, m, wi, wo, wavelengths=None):
    """f(wi, wo), and the density of wi for given wo: Mitsuba's si.wi is our wi for f, our wo for pdf."""
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    context, si = mi.BSDFContext(), mi.SurfaceInteraction3f()
    if wavelengths is not None:
        si.wavelengths = wavelengths

    def each(ask, w, v):
        if m.isotropic:
            angle = where_nothing_is_folded(w)
            w, v = turned(w, angle), turned(v, angle)
        got = []
        for a, b in zip(w.tolist(), v.tolist(), strict=True):
            si.wi = a
            got.append(np.array(ask(context, si, b)))
        return np.array(got)

    return each(bsdf.eval, wi, wo).reshape(len(wi), -1) / wo[:, 2:], each(bsdf.pdf, wo, wi)


def agreement(got, want):
    return (np.abs(got - want) <= 1e-4 * np.abs(want) + 1e-5 * np.median(np.abs(want))).mean()


def table_pdf(m, wi, wo):
    """The part of the density that comes from the tables."""
    return (m.pdf(wi, wo) - rgl.COSINE_SHARE * wi[..., 2] / np.pi) / (1.0 - rgl.COSINE_SHARE)


@pytest.mark.parametrize("name", [PAPER, IBIZA])
def test_real_files_agree_with_mitsuba(name, mitsuba):
    path, rng = real(name), np.random.default_rng(11)
    m = load(path)
    wi, wo = directions(rng, 2000), directions(rng, 2000)
    f, pdf = mitsuba_f_pdf(mitsuba, path, m, wi, wo)
    assert agreement(m.f(wi, wo), f) >= 0.999
    assert agreement(table_pdf(m, wi, wo), pdf) >= 0.999


@pytest.mark.parametrize("r", [1, 2, 4])
def test_anisotropic_files_agree_with_mitsuba(r, mitsuba, tmp_path):
    path = tmp_path / "a.bsdf"
    tensor_file.write(path, synthetic(r, n=16, n_ndf=20))
    m, rng = load(path), np.random.default_rng(r)
    wi, wo = directions(rng, 1500), directions(rng, 1500)
    f, pdf = mitsuba_f_pdf(mitsuba, path, m, wi, wo)
    assert agreement(m.f(wi, wo), f) >= 0.999
    assert agreement(table_pdf(m, wi, wo), pdf) >= 0.999


def test_spectral_file_agrees_with_mitsuba(mitsuba, tmp_path):
    mitsuba.set_variant("scalar_spectral")
    path = tmp_path / "a.bsdf"
    tensor_file.write(path, synthetic(2, n=16, n_ndf=20, channels=5))
    m, rng = load(path), np.random.default_rng(2)
    wi, wo = directions(rng, 1000), directions(rng, 1000)
    f, _ = mitsuba_f_pdf(mitsuba, path, m, wi, wo, wavelengths=list(WAVELENGTHS[1:]))
    assert agreement(m.f(wi, wo)[:, 1:], f) >= 0.999


def test_samples_agree_with_mitsuba(mitsuba):
    path, rng = real(PAPER), np.random.default_rng(4)
    wo, u = directions(rng, 500, 0.1), rng.uniform(0.001, 0.999, (500, 2))
    bsdf = mitsuba.load_dict({"type": "measured", "filename": path})
    context, si, want = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f(), []
    angle, share = where_nothing_is_folded(wo), rgl.COSINE_SHARE
    for w, v in zip(turned(wo, angle).tolist(), u.tolist(), strict=True):
        si.wi = w
        want.append(np.array(bsdf.sample(context, si, 0.5, v)[0].wo))
    got = load(path).sample(wo, np.stack([share + (1.0 - share) * u[:, 0], u[:, 1]], -1)).wi
    assert np.quantile(np.linalg.norm(got - turned(np.array(want), -angle), axis=-1), 0.99) < 1e-4


# Any reflectance, written.

GLASS = gn.Dielectric(1.5)
WRITTEN = {
    "sharp": (gn.Microfacet(gn.GGX(0.1), 1.0), (7e-4, 9e-3, 0.04)),
    "glossy": (gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.3), GLASS), (2.5e-3, 1.3e-2, 0.08)),
    "paint": (gn.material("gold-metallic-paint"), (2.5e-3, 2e-2, 0.4)),
    "gray": (gn.Lambertian(0.5), (2.5e-3, 1.3e-2, 0.08)),
    "brushed": (gn.Lambertian(0.1) + gn.Microfacet(gn.GGX(0.2, 0.4), 0.7), (1.5e-2, 0.1, 0.5)),
}
"""Materials, and what the mean, the 99th percentile and the largest relative error of their files stay below."""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Name -> path and material of a file, written when first asked for."""
    folder, made = tmp_path_factory.mktemp("rgl"), {}

    def get(name):
        if name not in made:
            made[name] = folder / f"{name}.bsdf"
            save(WRITTEN[name][0], made[name], format="RGL", resolution=64, phi_i=16 if name == "brushed" else 32)
        return made[name], load(made[name])

    return get


@pytest.mark.parametrize("name", thinned(WRITTEN, WRITTEN.keys() - {"brushed"}))
def test_a_written_material_is_close_to_the_material(name, written):
    model, bounds = WRITTEN[name]
    _, m = written(name)
    error = resampling_error(model, m)
    assert error.mean < bounds[0] and error.high < bounds[1] and error.largest < bounds[2], error
    assert error.albedo < (1.2e-2 if name == "brushed" else 3e-3)
    assert m.channel_names == ("R", "G", "B") and m.isotropic == (name != "brushed") and m.valid.all()
    assert m.reduction == (4 if name == "brushed" else 1)


@pytest.mark.parametrize("name", WRITTEN)
def test_written_files_agree_with_mitsuba(name, written, mitsuba):
    """To 1e-4; but where S goes through 0 at the horizon single precision leaves fewer digits."""
    path, m = written(name)
    rng = np.random.default_rng(5)
    wi, wo = directions(rng, 600), directions(rng, 600)
    f, pdf = mitsuba_f_pdf(mitsuba, path, m, wi, wo)
    up = wo[:, 2] > 0.1
    assert agreement(m.f(wi, wo)[up], f[up]) == 1.0
    assert agreement(m.f(wi, wo), f) >= 0.99
    assert agreement(table_pdf(m, wi, wo), pdf) >= 0.99


def test_mitsuba_samples_written_files_well(written, mitsuba):
    """`luminance` is what is reflected per area of the tables: weights are nearly the albedo."""
    path, _ = written("glossy")
    rng = np.random.default_rng(6)
    wo = np.array([np.sin(0.7), 0.0, np.cos(0.7)])
    bsdf = mitsuba.load_dict({"type": "measured", "filename": str(path)})
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    si.wi = wo.tolist()
    weights = np.array([np.array(bsdf.sample(context, si, 0.5, v)[1]) for v in rng.uniform(0, 1, (2000, 2)).tolist()])
    kept = weights[weights.sum(axis=1) > 0.0].mean(axis=1)
    np.testing.assert_allclose(weights.mean(axis=0), gn.albedo(WRITTEN["glossy"][0], wo), rtol=0.01)
    assert kept.std() < 0.05 * kept.mean() and len(kept) > 1960


def test_spectra_are_written_by_wavelength_and_agree_with_mitsuba(mitsuba, tmp_path):
    mitsuba.set_variant("scalar_spectral")
    model, path = gn.material("gold", wavelengths=[650, 450, 500, 550, 600]), tmp_path / "a.bsdf"
    save(model, path, format="RGL", resolution=32, theta_i=9)
    m, rng = load(path), np.random.default_rng(2)
    assert m.channel_names == (450.0, 500.0, 550.0, 600.0, 650.0)
    wi, wo = directions(rng, 300, 0.1), directions(rng, 300, 0.1)
    assert np.median(np.abs(m.f(wi, wo)[:, [4, 0, 1, 2, 3]] / model.f(wi, wo) - 1.0)) < 0.01
    f, _ = mitsuba_f_pdf(mitsuba, path, m, wi, wo, wavelengths=[450.0, 500.0, 600.0, 650.0])
    assert agreement(m.f(wi, wo)[:, [0, 1, 3, 4]], f) == 1.0


@pytest.mark.parametrize(("turned", "parts"), [(0.0, 4), (0.4, 2)])
def test_what_repeats_is_stored_once(turned, parts, tmp_path):
    model = gn.Rotated(gn.Microfacet(gn.GGX(0.3, 0.6), 1.0), turned)
    fields = writer.fields(model, 24, 7, 16)
    assert len(fields["phi_i"]) == 16 // parts + 1
    m, rng = rgl.RGL(fields), np.random.default_rng(1)
    wi, wo = directions(rng, 1000, 0.3), directions(rng, 1000, 0.3)
    assert np.median(np.abs(m.f(wi, wo)[:, 0] / model.f(wi, wo) - 1.0)) < 0.03


def test_without_symmetry_the_whole_circle_is_stored():
    model = gn.ShadingNormal(gn.Microfacet(gn.GGX(0.4), 1.0), 0.2)
    fields = writer.fields(model, 24, 7, 16)
    assert len(fields["phi_i"]) == 17
    m, rng = rgl.RGL(fields), np.random.default_rng(1)
    wi, wo = directions(rng, 1000, 0.15), directions(rng, 1000, 0.15)
    true = model.f(wi, wo)
    seen = true > 0.0  # its own normal hides some
    assert np.median(np.abs(m.f(wi, wo)[seen, 0] / true[seen] - 1.0)) < 0.015


@pytest.mark.parametrize(("name", "mean"), [(PAPER, 0.01), (IBIZA, 0.04)])
def test_real_files_are_resampled(name, mean):
    """Their f grows as 1/cos(theta_o), their values are noisy, and some are negative."""
    m = load(real(name))
    assert resampling_error(m, rgl.RGL(writer.fields(m))).mean < mean


def test_coarse_files_do_not_run_away():
    """At the edge of what the tables cover, and where f does not end at the horizon."""
    m = rgl.RGL(writer.fields(gn.Lambertian(0.5), 16, 7))
    again = rgl.RGL(writer.fields(m, 16, 7))
    assert resampling_error(m, again).mean < 0.03
    assert np.abs(again.stored["rgb"]).max() < 10.0


def test_the_facets_are_those_of_the_material():
    """D of a mirror's facets is GGX itself: the paper's iteration finds it, up to the masking that it leaves out."""
    fields = writer.fields(gn.Microfacet(gn.GGX(0.2), 1.0, masking="separable"), 8, 5, 8)
    theta = 0.5 * np.pi * np.linspace(0.0, 1.0, 256) ** 2
    true = 0.04 / (np.pi * (0.04 * np.cos(theta) ** 2 + np.sin(theta) ** 2) ** 2)
    np.testing.assert_allclose(fields["ndf"][0, :150], true[:150], rtol=0.03)
    assert fields["sigma"][0, 0] == pytest.approx(1.0, abs=1e-3)


def test_holes_are_filled_and_the_source_is_noted(tmp_path):
    raw = np.full((3, 90, 90, 180), 20.0)
    raw[:, 30:40, 30:40] = -1.0
    save(MERL(raw), tmp_path / "a.binary")
    source = load(tmp_path / "a.binary")
    save(source, tmp_path / "a.bsdf", format="RGL", resolution=16, theta_i=5)
    m = load(tmp_path / "a.bsdf")
    assert m.valid.all()
    noted = m.provenance["converted_from"]
    assert (noted["file"], noted["sha256"]) == ("a.binary", source.provenance["sha256"])
    save(m, tmp_path / "b.bsdf", format="RGL")
    assert (tmp_path / "b.bsdf").read_bytes() == (tmp_path / "a.bsdf").read_bytes()


@pytest.mark.parametrize(
    ("m", "options", "text"),
    [
        (gn.Lambertian([0.1, 0.2]), {}, "expected one, R, G and B, or wavelengths"),
        (gn.Lambertian(np.full((2, 2, 3), 0.5)), {}, "without maps"),
        (gn.IdealSpecular(0.9), {}, "perfect mirror"),
        (gn.Lambertian(0.5), {"resolution": 2}, "resolution=2: expected a whole number from 4"),
        (gn.Lambertian(0.5), {"resolution": (16, 16)}, "resolution="),
        (gn.Lambertian(0.5), {"phi_i": 10}, "a multiple of 4"),
        (
            gn.Lambertian(0.5),
            {"theta": 10},
            "theta=10: no option to write RGL files; did you mean 'theta_i'.; expected one of resol",
        ),
    ],
)
def test_what_cannot_be_written_is_said(m, options, text, tmp_path):
    with pytest.raises(ParameterError, match=text):
        save(m, tmp_path / "a.bsdf", format="RGL", **options)
    assert not (tmp_path / "a.bsdf").exists()


# Sampling.


@pytest.mark.parametrize("source", [0, 2, 4, PAPER, IBIZA])
def test_density_is_the_jacobian_of_the_table_warp(source):
    m = rgl.RGL(synthetic(source, n=12, n_ndf=16)) if isinstance(source, int) else load(real(source))
    rng, h = np.random.default_rng(8), 1e-6
    wo, v = directions(rng, 400, 0.2), rng.uniform(0.01, 0.99, (400, 2))

    def wi(dv, du):
        share = rgl.COSINE_SHARE
        return m.sample(wo, np.stack([share + (1.0 - share) * (v[:, 0] + dv), v[:, 1] + du], -1)).wi

    du, dv = (wi(h, 0) - wi(-h, 0)) / (2 * h), (wi(0, h) - wi(0, -h)) / (2 * h)
    area = np.linalg.norm(np.cross(du, dv), axis=-1)
    up = wi(0, 0)[:, 2] > 0.01
    law = table_pdf(m, wi(0, 0)[up], wo[up]) * area[up]
    assert np.median(np.abs(law - 1.0)) < 1e-6
    # The other points lie within h of an edge between cells, where the warp has a kink.
    assert (np.abs(law - 1.0) < 1e-3).mean() > 0.97


@pytest.mark.parametrize("source", [0, 1, 4, PAPER])
def test_pdf_integrates_to_one_less_what_is_lost(source):
    m = rgl.RGL(synthetic(source, n=12, n_ndf=16)) if isinstance(source, int) else load(real(source))
    n = 250
    t = (np.arange(n) + 0.5) / n
    u = np.stack(np.meshgrid(t, t, indexing="ij"), -1).reshape(-1, 2)
    for wo in directions(np.random.default_rng(6), 3, 0.3):
        kept = (m.sample(wo, u).pdf > 0.0).mean()
        # Over half vectors, which resolves the peak that the tables have where theta_m is small.
        theta, phi = 0.5 * np.pi * u[:, 0] ** 3, 2.0 * np.pi * u[:, 1]
        wm = np.stack(unit(theta, phi), -1)
        cos = wm @ wo
        wi = 2.0 * cos[:, None] * wm - wo
        up = (cos > 0.0) & (wi[:, 2] > 1e-6)
        per_u = 4.0 * cos * np.sin(theta) * (1.5 * np.pi * u[:, 0] ** 2) * 2.0 * np.pi
        total = (m.pdf(np.where(up[:, None], wi, [0.0, 0.0, 1.0]), wo) * per_u * up).mean()
        assert total == pytest.approx(kept, abs=4e-3)


@pytest.mark.parametrize("source", [2, PAPER, IBIZA])
def test_samples_are_distributed_as_pdf_says_and_weights_are_bounded(source):
    m = rgl.RGL(synthetic(source, n=12, n_ndf=16)) if isinstance(source, int) else load(real(source))
    n = 300
    t = (np.arange(n) + 0.5) / n
    u = np.stack(np.meshgrid(t, t, indexing="ij"), -1).reshape(-1, 2)
    for wo in directions(np.random.default_rng(7), 2, 0.3):
        s = m.sample(wo, u)
        up = s.pdf > 0.0
        f = m.f(s.wi[up], wo)
        np.testing.assert_allclose(s.weight[up], f * (s.wi[up, 2] / s.pdf[up])[:, None], rtol=1e-9)
        assert (np.abs(s.weight[up]) <= 10.0 * np.pi * np.abs(f) * (1.0 + 1e-9)).all()
        # Monte Carlo integrals against quadrature: of cos^2, and of f cos over the hemisphere.
        z, phi = np.meshgrid(t, 2.0 * np.pi * t, indexing="ij")
        r = np.sqrt(1.0 - z * z)
        w = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).reshape(-1, 3)
        albedo = 2.0 * np.pi * (m.f(w, wo) * w[:, 2:]).mean(0)
        assert (s.wi[up, 2] ** 2 / s.pdf[up]).sum() / len(u) == pytest.approx(2.0 * np.pi / 3.0, rel=0.02)
        np.testing.assert_allclose(s.weight.mean(0), albedo, rtol=0.01)


# Laws of every reflectance.


@pytest.mark.parametrize(("r", "channels"), thinned(SYNTHETIC, [(0, 3), (4, 5)]))
def test_float32_agrees_with_float64(r, channels):
    m, rng = rgl.RGL(synthetic(r, n=12, n_ndf=16, channels=channels)), np.random.default_rng(9)
    wi, wo = directions(rng, 1000, 0.05), directions(rng, 1000, 0.05)
    f32 = m.f(wi.astype(np.float32), wo.astype(np.float32))
    assert f32.dtype == np.float32
    assert m.pdf(wi.astype(np.float32), wo.astype(np.float32)).dtype == np.float32
    np.testing.assert_allclose(f32, m.f(wi, wo), rtol=2e-4)


@pytest.mark.parametrize(("r", "dtype"), [pytest.param(0, "float32", marks=pytest.mark.full), (4, "float64")])
def test_libraries_agree(library, r, dtype):
    m, rng = rgl.RGL(synthetic(r, n=8, n_ndf=10)), np.random.default_rng(10)
    wi, wo = directions(rng, 200), directions(rng, 200)
    wi[:20, 1], wi[20:40, 1], wi[40:60, 0] = 0.0, -0.0, 0.0  # where folded files' azimuths jump
    wi[:60] /= np.linalg.norm(wi[:60], axis=-1, keepdims=True)
    f = m.f(library.array(wi, dtype), library.array(wo, dtype))
    assert library.dtype(f) == dtype
    rtol = 3e-4 if dtype == "float32" else 1e-9
    np.testing.assert_allclose(library.numpy(f), m.f(wi, wo), rtol=rtol)


def test_libraries_draw_the_same_samples(library):
    m, rng = rgl.RGL(synthetic(4, n=8, n_ndf=10)), np.random.default_rng(10)
    wo, u = directions(rng, 200), rng.uniform(0, 1, (200, 2))
    got, want = m.sample(library.array(wo), library.array(u)), m.sample(wo, u)
    library.compute(got.wi, got.weight, got.pdf)
    for name in ("wi", "weight", "pdf"):
        np.testing.assert_allclose(library.numpy(getattr(got, name)), getattr(want, name), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("r", [0, 2])
def test_gradients_are_finite(r, torch):
    m = rgl.RGL(synthetic(r, n=8, n_ndf=10))
    special = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -0.6, 0.8], [-0.6, 0.0, 0.8], [0.36, 0.48, 0.8]]
    wi, wo = np.array([(a, b) for a in special for b in special]).transpose(1, 0, 2)
    for dtype in (torch.float32, torch.float64):
        a, b = (torch.tensor(w, dtype=dtype, requires_grad=True) for w in (wi, wo))
        (m.f(a, b).sum() + m.pdf(a, b).sum()).backward()
        assert torch.isfinite(a.grad).all() and torch.isfinite(b.grad).all()


def test_broadcasting_horizon_and_nan():
    m, rng = rgl.RGL(synthetic(2, n=8, n_ndf=10)), np.random.default_rng(12)
    wi, wo = directions(rng, 5)[:, None], directions(rng, 4)
    f = m.f(wi, wo)
    assert f.shape == (5, 4, 3)
    np.testing.assert_allclose(f[3, 2], m.f(wi[3, 0], wo[2]), rtol=1e-12)
    assert (m.f(wi, -wo) == 0.0).all()
    assert np.isnan(m.f([np.nan, 0.0, 1.0], wo)).all()


# Values that are kept as they are.


def test_negative_values_are_kept_and_invalid_ones_poison_only_their_cells():
    fields = synthetic(0, n=12, n_ndf=16)
    fields["rgb"] = np.where(fields["rgb"] > 1.0, -fields["rgb"], fields["rgb"])
    rng = np.random.default_rng(13)
    wi, wo = directions(rng, 20000), directions(rng, 20000)
    clean = rgl.RGL(fields)
    assert clean.valid.all() and (clean.f(wi, wo) < 0.0).any()
    damaged = {k: v.copy() for k, v in fields.items()}
    damaged["rgb"][0, 4, 1, 5, 7] = np.nan
    damaged["rgb"][0, 4, 1, 5, 8] = np.inf
    damaged["luminance"][0, 2, 3, 3] = np.nan
    m = rgl.RGL(damaged)
    assert (~m.valid).sum() == 2 and m.valid.shape == (1, 9, 3, 12, 12)
    f, nan = m.f(wi, wo), np.isnan(m.f(wi, wo))
    assert nan[:, 1].any() and not nan[:, [0, 2]].any() and nan.mean() < 0.03
    np.testing.assert_array_equal(f[~nan], clean.f(wi, wo)[~nan])
    assert np.isfinite(m.pdf(wi, wo)).all()


@pytest.mark.parametrize("name", [PAPER, IBIZA])
def test_real_file_is_written_bit_by_bit(name, tmp_path):
    path = real(name)
    m = load(path)
    save(m, tmp_path / "copy.bsdf", format="RGL")
    assert (tmp_path / "copy.bsdf").read_bytes() == Path(path).read_bytes()
    assert m.valid.all()
    assert m.quantity.startswith("brdf * cos(theta_o)")


def test_written_file_is_read_as_the_same_material(tmp_path):
    note = {"note": np.arange(6, dtype=np.int16).reshape(2, 3), "nothing": np.empty((0, 2), np.float16)}
    fields = {**synthetic(4, n=6, n_ndf=8, channels=5, description=""), **note}
    m = rgl.RGL(fields)
    save(m, tmp_path / "a.bsdf", format="RGL")
    again = load(tmp_path / "a.bsdf")
    assert list(again.stored) == list(fields)
    for name, a in fields.items():
        assert again.stored[name].dtype == a.dtype
        np.testing.assert_array_equal(again.stored[name], a)
    assert again == m and pickle.loads(pickle.dumps(again)) == m
    assert again != rgl.RGL(synthetic(4, n=6, n_ndf=9, channels=5))
    with pytest.raises(ParameterError, match="is that of several formats"):
        save(m, tmp_path / "b.bsdf")
    assert not (tmp_path / "b.bsdf").exists()


def test_the_callers_arrays_stay_as_they_are():
    fields = synthetic(0, n=6, n_ndf=8)
    m = rgl.RGL(fields)
    before = m.f([0.0, 0.0, 1.0], [0.0, 0.6, 0.8])
    fields["rgb"][...] = 0.0
    np.testing.assert_array_equal(m.f([0.0, 0.0, 1.0], [0.0, 0.6, 0.8]), before)


@pytest.mark.parametrize("channels", [3, 5])
def test_data_has_named_axes_and_units(channels):
    fields = {**synthetic(2, n=6, n_ndf=8, channels=channels), "note": np.arange(6).reshape(2, 3)}
    data = rgl.RGL(fields).data
    main = data["rgb" if channels == 3 else "spectra"]
    third = "channel" if channels == 3 else "wavelength"
    assert main.dims == ("phi_i", "theta_i", third, "s_y", "s_x")
    assert data["vndf"].dims == ("phi_i", "theta_i", "phi_m", "theta_m")
    assert data["ndf"].attrs["units"] == "sr-1" and data["theta_i"].attrs["units"] == "rad"
    assert list(data[third].values) == (list("RGB") if channels == 3 else list(WAVELENGTHS))
    assert data["theta_m"].values[-1] == pytest.approx(math.pi / 2)
    np.testing.assert_array_equal(main.values, fields[main.name])
    np.testing.assert_array_equal(data["field_note"].values, fields["note"])
    np.testing.assert_array_equal(data["valid"].values, fields["valid"])


# Damaged files.


def small():
    return synthetic(2, n_theta=3, n=4, n_ndf=4)


def changed(**arrays):
    return lambda fields: {**fields, **{k: v(fields[k].copy()) for k, v in arrays.items()}}


def put(index, value):
    def change(a):
        a[index] = value
        return a

    return change


BROKEN_FIELDS = {
    "missing": (lambda f: {k: v for k, v in f.items() if k != "ndf"}, "field 'ndf' is missing"),
    "no values": (lambda f: {k: v for k, v in f.items() if k != "rgb"}, "neither spectra nor rgb"),
    "theta order": (changed(theta_i=lambda a: a[::-1]), "theta_i is .* expected finite, increasing"),
    "theta NaN": (changed(theta_i=put(1, np.nan)), "theta_i is .* expected finite, increasing"),
    "phi infinite": (changed(phi_i=put(-1, np.inf)), "phi_i is .* expected finite, increasing"),
    "theta in degrees": (changed(theta_i=lambda a: a * 57.3), "theta_i runs from 0 to 90"),
    "third of circle": (changed(phi_i=lambda a: a * np.float32(2 / 3) - np.float32(1.04)), "phi_i covers"),
    "other half": (changed(phi_i=lambda a: a + np.float32(np.pi)), "phi_i covers"),
    "sigma zero": (changed(sigma=put((1, 1), 0.0)), "sigma holds 0, expected positive"),
    "vndf negative": (changed(vndf=put((0, 0, 0, 0), -1.0)), "vndf holds numbers from -1"),
    "vndf empty": (changed(vndf=put((1, 2), 0.0)), "vndf holds numbers"),
    "vndf one row": (changed(vndf=lambda a: a[:, :, :1]), "vndf has shape .* at least 2"),
    "rgb grid": (changed(rgb=lambda a: a[..., :-1]), r"rgb is float32 of shape .* expected .*4, 4\)"),
    "rgb channels": (changed(rgb=lambda a: a[:, :, :2]), "rgb is float32 of shape"),
    "vndf nodes": (changed(vndf=lambda a: a[:, 1:]), "vndf is float32 of shape"),
    "double": (changed(ndf=lambda a: a.astype(float)), "ndf is float64"),
    "jacobian": (changed(jacobian=lambda a: a[:0]), "jacobian is uint8 of shape"),
    "no theta": (changed(theta_i=lambda a: a[:0]), "theta_i is float32 of shape"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN_FIELDS)
def test_inconsistent_fields_are_named(name, tmp_path):
    change, message = BROKEN_FIELDS[name]
    tensor_file.write(tmp_path / "bad.bsdf", change(small()))
    with pytest.raises(FormatError, match=message) as caught:
        load(tmp_path / "bad.bsdf")
    assert "bad.bsdf" in str(caught.value)


def test_wavelengths_must_increase():
    fields = synthetic(0, n_theta=3, n=4, n_ndf=4, channels=5)
    fields["wavelengths"] = fields["wavelengths"][::-1]
    with pytest.raises(FormatError, match=r"wavelengths is .* expected positive, increasing"):
        rgl.RGL(fields)


def entry(data: bytes, name: bytes) -> int:
    """Where the header's entry of a field goes on behind its name."""
    return data.index(name) + len(name)


BROKEN_BYTES = {
    "magic": (lambda d: b"tensor_life\0" + d[12:], "not a tensor file: starts with"),
    "version": (lambda d: d[:12] + b"\2\0" + d[14:], "version 2.0, expected 1.0"),
    "count": (lambda d: d[:14] + struct.pack("<I", 2**31) + d[18:], "header says 2147483648 fields"),
    "type": (lambda d: d[: entry(d, b"ndf") + 2] + b"\x63" + d[entry(d, b"ndf") + 3 :], "'ndf' has type 99"),
    "axes": (
        lambda d: d[: entry(d, b"ndf")] + b"\xff\xff" + d[entry(d, b"ndf") + 2 :],
        "'ndf' has 65535 axes",
    ),
    "offset": (
        lambda d: d[: entry(d, b"ndf") + 3] + struct.pack("<Q", 2**63) + d[entry(d, b"ndf") + 11 :],
        "'ndf', float32 of shape .* lies at bytes 9223372036854775808",
    ),
    "shape": (
        lambda d: d[: entry(d, b"ndf") + 11] + struct.pack("<QQ", 2**62, 0) + d[entry(d, b"ndf") + 27 :],
        "'ndf', float32 of shape",
    ),
    "twice": (
        lambda d: d.replace(b"vndf", b"vndg", 1).replace(b"sigma", b"phi_i", 1),
        "'phi_i' occurs twice",
    ),
    "name": (lambda d: d.replace(b"sigma", b"s\xff\xfema", 1), "expected UTF-8 text"),
    "header cut": (lambda d: d[:200], "truncated: .* the file has 200"),
    "data cut": (lambda d: d[:-1], "'valid', uint8 of shape .* truncated or damaged"),
}


@pytest.mark.parametrize("name", BROKEN_BYTES)
def test_damaged_containers_are_described(name, tmp_path):
    change, message = BROKEN_BYTES[name]
    path = tmp_path / "bad.bsdf"
    path.write_bytes(change(tensor_file.serialize(small())))
    with pytest.raises(FormatError, match=message) as caught:
        rgl.read(path)
    assert "bad.bsdf" in str(caught.value)


@pytest.mark.parametrize("part", [0.25, pytest.param(1.0, marks=pytest.mark.full)])
def test_any_damage_is_an_error_of_ours_or_harmless(part, tmp_path, monkeypatch):
    switch_off(monkeypatch)  # every damaged table would be a kernel
    data = tensor_file.serialize(small())
    rng, path = np.random.default_rng(14), tmp_path / "bad.bsdf"
    wi, wo = directions(rng, 8), directions(rng, 8)
    header = data.index(b"valid") + 30
    cuts = [data[:n] for n in rng.integers(0, len(data), int(60 * part))]
    flips = []
    for i in range(int(300 * part)):
        b = bytearray(data)
        for at in rng.integers(0, header if i % 3 else len(data), 1 + i % 4):
            b[at] = int(rng.choice([0, 1, 255, b[at] ^ (1 << int(rng.integers(8)))]))
        flips.append(bytes(b))
    refused = 0
    for damaged in cuts + flips:
        path.write_bytes(damaged)
        try:
            m = rgl.read(path)
        except Error as error:
            refused += 1
            assert "bad.bsdf" in str(error)
        else:
            m.f(wi.astype(np.float32), wo.astype(np.float32))
            m.sample(wo, wi[:, :2] * 0.5 + 0.5)
            assert m.valid.size
    assert refused > 200 * part


def test_other_tensor_files_are_left_to_other_formats(tmp_path):
    tensor_file.write(tmp_path / "a.bsdf", {"M": np.zeros(3), "theta_h": np.zeros(3)})
    with pytest.raises(FormatError, match="not a known format"):
        load(tmp_path / "a.bsdf")
