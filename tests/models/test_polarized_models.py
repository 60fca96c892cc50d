"""Polarized reflection: closed forms, compositions, and Mitsuba's polarized plugins where they are installed."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.formula.fresnel.dielectric import interface_amplitudes, interface_mueller
from gonio.formula.mueller import of_amplitudes
from gonio.polarization import dop, realizable, rotator, to_frames

PI = math.pi
ALUMINIUM = gn.Conductor(1.2, 6.0)
ROUGH = gn.Microfacet(gn.GGX(0.3, 0.15), gn.Conductor(1.2, 2.5), masking="separable")
D = np.diag([1.0, 1.0, -1.0, 1.0])

MODELS = {
    "dielectric": gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5)),
    "conductor": ROUGH,
    "channels": gn.Microfacet(gn.Beckmann(0.2), gn.Conductor([0.2, 0.9, 1.1], [3.9, 2.5, 2.2])),
    "many channels": gn.Microfacet(gn.GGX(0.2), gn.Conductor(np.linspace(0.2, 2.0, 11), 3.0)),
    "V-grooves": gn.Microfacet(gn.GGX(0.3), ALUMINIUM, masking="v_groove"),
    "Cook-Torrance": gn.CookTorrance(0.3),
    "Torrance-Sparrow": gn.TorranceSparrow(0.3, ALUMINIUM),
    "Cox-Munk": gn.CoxMunk(5.0, wind_azimuth=1.0),
    "Turquin": gn.Turquin(0.5, ALUMINIUM),
    "Turquin, gray": gn.Turquin(0.5, 0.8),
    "Kulla-Conty": gn.KullaConty(0.5, ALUMINIUM),
    "sum": gn.Lambertian([0.1, 0.2, 0.3]) + 0.5 * gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5)),
    "rotated": gn.Rotated(ROUGH, 0.7),
    "tilted": gn.ShadingNormal(ROUGH, 0.3, 0.2),
    "normal map": gn.NormalMapped(ROUGH, 0.3, 0.2),
    "coated": gn.Coated(gn.Lambertian(0.5), tau=0.3),
    "coated metal": gn.Coated(ROUGH, eta=1.4),
    "rough coat": gn.RoughCoated(gn.Lambertian(0.5), alpha=0.3),
    "OpenPBR coat": gn.OpenPBRCoat(ROUGH),
    "retro": gn.RetroMicrofacet(gn.GGX(0.3), ALUMINIUM),
    "Maignan": gn.Maignan(5.0, 0.3),
    "Priest-Germer": gn.PriestGermer(0.2, 1.2, 3.0),
}
DELTA = {
    "glass": gn.IdealSpecular(gn.Dielectric(1.5)),
    "metal": gn.Lambertian(0.3) + 0.5 * gn.IdealSpecular(gn.Conductor([0.2, 0.5, 1.0], 3.0)),
    "turned": gn.Rotated(gn.IdealSpecular(ALUMINIUM), 0.4),
    "tilted": gn.ShadingNormal(gn.IdealSpecular(ALUMINIUM), 0.2, 0.1),
    "normal map": gn.NormalMapped(gn.IdealSpecular(ALUMINIUM), 0.2, 0.1),
    "coated": gn.Coated(gn.IdealSpecular(ALUMINIUM)),
    "gray": gn.IdealSpecular(0.5),
}


def directions(n: int, low: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    theta, phi = np.arccos(rng.uniform(low, 1.0, (2, n))), rng.uniform(0.0, 2.0 * PI, (2, n))
    return gn.direction(theta[0], phi[0]), gn.direction(theta[1], phi[1])


COMPILED = ("channels", "many channels", "sum", "rotated", "Cox-Munk")
each_with_few_kernels = pytest.mark.parametrize(
    ("name", "evaluation"),
    thinned(
        [
            (name, way)
            for name, way in product(MODELS, ("uncompiled", "compiled"))
            if (name, way) != ("Cox-Munk", "uncompiled")
        ],
        {*product(MODELS, ["uncompiled"]), *product(COMPILED, ["compiled"])},
    ),
    indirect=["evaluation"],
)
"""Matrices of all models on arrays; those of a few by kernels, and all with `full`."""


@each_with_few_kernels
def test_the_first_element_is_f_and_the_matrix_can_be(name, evaluation):
    m, (wi, wo) = MODELS[name], directions(300)
    M, f = m.mueller(wi, wo), m.f(wi, wo)
    assert M.shape == (*f.shape, 4, 4)
    np.testing.assert_allclose(M[..., 0, 0], f, rtol=1e-12, atol=1e-15)
    assert realizable(M, 1e-10).all()
    assert m.polarizes == bool(np.abs(M.reshape(-1, 16)[:, 1:]).max() > 0.0)


@each_with_few_kernels
def test_polarized_light_takes_the_same_way_back(name, evaluation):
    if name in ("tilted", "Turquin", "Turquin, gray"):
        return  # they break reciprocity
    m, (wi, wo) = MODELS[name], directions(300)
    there, back = m.mueller(wi, wo), m.mueller(wo, wi)
    np.testing.assert_allclose(back, D @ np.swapaxes(there, -1, -2) @ D, rtol=1e-9, atol=1e-11 * np.abs(there).max())


@pytest.mark.parametrize("m", DELTA.values(), ids=DELTA)
def test_matrices_of_mirrors_have_their_reflectance_first(m):
    _, wo = directions(100)
    M = m.delta_mueller(wo)
    np.testing.assert_allclose(M[..., 0, 0], m.delta_reflectance(wo), rtol=1e-12, atol=1e-15)
    assert realizable(M, 1e-10).all()


def test_a_mirror_turned_about_its_normal_is_the_same_mirror():
    _, wo = directions(100)
    wo = np.concatenate([wo, [[0.0, 0.0, 1.0]]])
    plain = gn.IdealSpecular(ALUMINIUM)
    np.testing.assert_allclose(gn.Rotated(plain, 0.4).delta_mueller(wo), plain.delta_mueller(wo), atol=1e-14)


@pytest.mark.parametrize("at", ["pair", "light along the normal", "viewer along the normal"])
def test_a_turned_surface_sees_turned_light(at):
    """Turning the sample by an angle is turning both directions back, whose axes turn with them; at the pole, where
    the axes stay, Stokes vectors are turned by hand."""
    angle, up = 0.7, gn.direction(0.0, 0.0)
    wi = up if at.startswith("light") else gn.direction(0.6, 0.3)
    wo = up if at.startswith("viewer") else gn.direction(0.9, 2.0)
    c, s = math.cos(angle), math.sin(angle)
    back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    expected = ROUGH.mueller(wi @ back.T, wo @ back.T)
    if at.startswith("light"):
        expected = expected @ rotator(-angle)
    if at.startswith("viewer"):
        expected = rotator(-angle) @ expected
    np.testing.assert_allclose(gn.Rotated(ROUGH, angle).mueller(wi, wo), expected, rtol=1e-9, atol=1e-13)


def test_near_the_normal_the_matrix_goes_over_into_that_of_the_normal():
    """Towards the normal along azimuth 0, from where the axes there are."""
    wo, near, up = gn.direction(0.9, 2.0), gn.direction(1e-9, 0.0), gn.direction(0.0, 0.0)
    np.testing.assert_allclose(ROUGH.mueller(near, wo), ROUGH.mueller(up, wo), atol=1e-10)
    np.testing.assert_allclose(ROUGH.mueller(wo, near), ROUGH.mueller(wo, up), atol=1e-10)


def test_back_towards_the_light_handedness_is_turned_over():
    """Of a facet hit at normal incidence the matrix is F diag(1, 1, -1, -1), whatever the axes, also very close by."""
    w = gn.direction(0.5, 0.3)
    for away in (0.0, 1e-9, 1e-7, 1e-5):
        M = MODELS["dielectric"].mueller(w, gn.direction(0.5 + 0.6 * away, 0.3 + 1.7 * away))
        np.testing.assert_allclose(M / M[0, 0], np.diag([1.0, 1.0, -1.0, -1.0]), atol=5e-5)


def test_at_brewsters_angle_all_light_is_horizontal():
    brewster = math.atan(1.5)
    M = MODELS["dielectric"].mueller(gn.direction(brewster, 0.0), gn.direction(brewster, PI))
    assert dop(M[:, 0]) == pytest.approx(1.0, abs=1e-12)
    assert M[1, 0] == pytest.approx(M[0, 0], rel=1e-12)


@pytest.mark.parametrize("contrast", [1.25, -0.6, complex(1.2, 6.0) ** 2 - 1.0, complex(0.05, 3.0) ** 2 - 1.0])
def test_the_quick_matrix_is_that_of_the_amplitudes(contrast):
    c = np.linspace(1e-6, 1.0, 999)
    slow, quick = of_amplitudes(*interface_amplitudes(c, contrast)), interface_mueller(c, contrast)
    for a, b in zip(slow.rows, quick.rows, strict=True):
        for x, y in zip(a, b, strict=True):
            np.testing.assert_allclose(x + 0.0 * c, y + 0.0 * c, atol=2e-15)
    n = np.sqrt(contrast + 1.0 + 0j)
    q = np.sqrt(contrast + c * c + 0j)
    r_s, r_p = (np.asarray(r.re) + 1j * np.asarray(r.im) for r in interface_amplitudes(c, contrast))
    np.testing.assert_allclose(r_s, (c - q) / (c + q), rtol=1e-12)
    np.testing.assert_allclose(r_p, (n * n * c - q) / (n * n * c + q), atol=1e-12)


def test_below_the_horizon_there_is_nothing_and_nan_stays():
    m, w, below = MODELS["sum"], gn.direction(0.5, 0.0), np.array([0.6, 0.0, -0.8])
    assert not m.mueller(w, below).any() and not m.mueller(below, w).any()
    assert np.isnan(m.mueller([np.nan, 0.0, 1.0], w)).all()
    assert np.isnan(gn.Lambertian(0.5).mueller([np.nan, 0.0, 1.0], w)).all()


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_libraries_agree_and_gradients_are_finite(library):
    wi, wo = (w[:64] for w in directions(64))
    wi[0], wo[0] = wi[1], wi[1]
    wi[2], wo[3] = [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]
    if library == "torch":
        torch = pytest.importorskip("torch")
        x = torch.tensor(wi, requires_grad=True)
        M = ROUGH.mueller(x, torch.tensor(wo))
        M.sum().backward()
        assert torch.isfinite(x.grad).all()
        values = M.detach().numpy()
    else:
        jax = pytest.importorskip("jax")
        jax.config.update("jax_enable_x64", True)
        values = np.asarray(jax.jit(ROUGH.mueller)(jax.numpy.array(wi), jax.numpy.array(wo)))
        slope = jax.jit(jax.grad(lambda x: ROUGH.mueller(x, jax.numpy.array(wo)).sum()))(jax.numpy.array(wi))
        assert np.isfinite(slope).all()
    expected = ROUGH.mueller(wi, wo)
    np.testing.assert_allclose(values, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("m", [ROUGH, MODELS["channels"]], ids=["one channel", "channels"])
def test_drjit_agrees(m):
    llvm = pytest.importorskip("drjit.llvm")
    wi, wo = directions(50)
    expected = m.mueller(wi, wo)
    for vectors in ([llvm.TensorXf64(w) for w in (wi, wo)], [llvm.Array3f64(w.T) for w in (wi, wo)]):
        found = np.array(m.mueller(*vectors))
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_arrays_with_named_axes_keep_them():
    xarray = pytest.importorskip("xarray")
    theta = xarray.DataArray([0.2, 0.4, 0.6], dims="theta", coords={"theta": [0.2, 0.4, 0.6]})
    wo = gn.direction(0.5, PI)
    for m, dims in ((ROUGH, ("theta",)), (MODELS["channels"], ("theta", "channel"))):
        M = m.mueller(gn.direction(theta, 0.0), wo)
        assert M.dims == (*dims, "stokes_o", "stokes_i")
        np.testing.assert_allclose(M.values, m.mueller(gn.direction(theta.values, 0.0), wo))
        assert M.sel(stokes_o="Q", stokes_i="I").shape == M.shape[:-2]


# The land-surface model.


def test_leaves_of_all_orientations_mirror_as_maignans_model_without_its_exponentials():
    """Leaves of area u per volume, oriented at random, take u/2 of light per path; those of normal wm, u/(2 pi) per
    solid angle with both sides, mirror F (wi . wm) of it into 4 (wo . wm) as much solid angle: F u/(8 pi). Summed over
    depth that is F/(4 pi (cos_i + cos_o))."""
    z_i, z_o, u = 0.7, 0.4, 3.0
    z, w = np.polynomial.legendre.leggauss(200)
    depth = 5.0 * (z + 1.0)
    once = u / (8.0 * PI) * np.exp(-0.5 * u * depth * (1.0 / z_i + 1.0 / z_o)) / (z_i * z_o)
    f = (5.0 * w * once).sum()
    assert f == pytest.approx(1.0 / (4.0 * PI * (z_i + z_o)), rel=1e-9)
    m = gn.Maignan(C=2.0, ndvi=0.4, eta=1.5)
    wi, wo = gn.direction(math.acos(z_i), 0.2), gn.direction(math.acos(z_o), 1.9)
    cos_alpha = math.sqrt(0.5 * (1.0 + wi @ wo))
    factor = 2.0 * math.exp(-0.4 - math.sqrt(1.0 - cos_alpha**2) / cos_alpha)
    assert m.f(wi, wo) == pytest.approx(factor * f * gn.Dielectric(1.5).F(cos_alpha), rel=1e-12)
    facet = to_frames(m.mueller(wi, wo), wi, wo, "facet")
    assert facet[1, 0] > 0.0 and abs(facet[2, 0]) < 1e-15


def test_priest_and_germers_model_masked_is_the_microfacet_model():
    wi, wo = directions(100)
    masked = gn.PriestGermer(0.2, 1.2, 6.0, masking="height_correlated")
    same = gn.Microfacet(gn.Beckmann(math.sqrt(2.0) * 0.2), ALUMINIUM)
    np.testing.assert_allclose(masked.mueller(wi, wo), same.mueller(wi, wo), rtol=1e-9, atol=1e-15)


# Mitsuba.


def of_mitsuba(description: dict, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    mi = pytest.importorskip("mitsuba")
    if "llvm_ad_mono_polarized" not in mi.variants():
        pytest.skip("this Mitsuba has no llvm_ad_mono_polarized")
    mi.set_variant("llvm_ad_mono_polarized")
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi = mi.Vector3f(wo.T)
    value = mi.load_dict(description).eval(mi.BSDFContext(), si, mi.Vector3f(wi.T))
    rows = [[np.array(value[i, j]).reshape(-1) + np.zeros(len(wi)) for j in range(4)] for i in range(4)]
    return np.moveaxis(np.array(rows), -1, 0) / wi[:, 2, None, None]


def difference(m: gn.Reflectance, description: dict) -> np.ndarray:
    """The largest difference of an element over the first one, at each of 20 000 pairs."""
    wi, wo = (w.astype("f4") for w in directions(20_000, 0.05))
    expected = of_mitsuba(description, wi, wo)
    M = to_frames(m.mueller(wi.astype(float), wo.astype(float)), wi, wo, "mitsuba")
    return np.abs(M / M[:, :1, :1] - expected / expected[:, :1, :1]).max(axis=(-1, -2))


@pytest.mark.parametrize(("u", "v", "eta", "k"), [(0.3, 0.3, 0.2, 3.9), (0.3, 0.15, 1.2, 2.5)])
def test_rough_metals_agree_with_mitsuba(u, v, eta, k):
    m = gn.Microfacet(gn.GGX(u, v), gn.Conductor(eta, k), masking="separable")
    widths = {"alpha_u": u, "alpha_v": v, "eta": eta, "k": k}
    off = difference(m, {"type": "roughconductor", "distribution": "ggx", **widths})
    assert np.quantile(off, 0.999) < 3.5e-6 and off.max() < 3e-5


def test_plastic_agrees_with_mitsuba():
    """Its diffuse light is eta^2 times ours, for which nothing is reflected inside."""
    below = gn.Coated(gn.Lambertian(0.5), internal="lost")
    m = gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5), masking="separable") + 2.25 * below
    indices = {"int_ior": 1.5, "ext_ior": 1.0, "diffuse_reflectance": 0.5}
    off = difference(m, {"type": "pplastic", "distribution": "ggx", "alpha": 0.3, **indices})
    assert np.quantile(off, 0.999) < 6e-6 and off.max() < 1e-5


@pytest.mark.parametrize(("eta", "limit"), [(1.5, 4e-7), (1 / 1.5, 1e-5), (0.2 + 3.9j, 4e-7), (1.3 + 0.01j, 4e-7)])
def test_interfaces_agree_with_mitsuba(eta, limit):
    mi = pytest.importorskip("mitsuba")
    if "llvm_ad_mono_polarized" not in mi.variants():
        pytest.skip("this Mitsuba has no llvm_ad_mono_polarized")
    mi.set_variant("llvm_ad_mono_polarized")
    c = np.linspace(0.001, 1.0, 2000).astype("f4")
    index = mi.Complex2f(eta.real, eta.imag) if isinstance(eta, complex) else mi.Float(eta)
    value = mi.mueller.specular_reflection(mi.Float(c), index)
    mirror = gn.Conductor(eta.real, eta.imag) if isinstance(eta, complex) else gn.Dielectric(eta)
    M = mirror.polarized(c.astype(float))
    for i in range(4):
        for j in range(4):
            expected = np.array(value[i, j]).reshape(-1)
            np.testing.assert_allclose(M.rows[i][j] + 0.0 * c, expected + 0.0 * c, atol=limit)


# Transmission.

BOTH = {
    "rough": gn.RoughDielectric(gn.GGX(0.3, 0.15), 1.5),
    "rough, thinner behind": gn.RoughDielectric(gn.GGX(0.3), 1.0 / 1.5),
    "compensated": gn.KullaContyDielectric(0.4, 1.5),
    "two sides": gn.TwoSided(gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5)), gn.Lambertian(0.3)),
    "turned": gn.Rotated(gn.RoughDielectric(gn.GGX(0.3, 0.15), 1.5), 0.5),
}


def sphere(n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    theta, phi = np.arccos(rng.uniform(-1.0, 1.0, (2, n))), rng.uniform(0.0, 2.0 * PI, (2, n))
    return gn.direction(theta[0], phi[0]), gn.direction(theta[1], phi[1])


@pytest.mark.parametrize("m", BOTH.values(), ids=BOTH)
def test_matrices_on_the_whole_sphere(m):
    """The first element is f; M/n_o^2 goes the same way back."""
    wi, wo = sphere(500)
    M, f = m.mueller(wi, wo), m.f(wi, wo)
    np.testing.assert_allclose(M[:, 0, 0], f, rtol=1e-11, atol=1e-15)
    assert realizable(M, 1e-9).all() and m.polarizes
    n_i, n_o = (np.where(w[:, 2] < 0.0, m.index, 1.0)[:, None, None] for w in (wi, wo))
    back = D @ np.swapaxes(m.mueller(wo, wi) / n_i**2, -1, -2) @ D
    np.testing.assert_allclose(M / n_o**2, back, atol=1e-12 * M.max())


def test_light_that_goes_straight_through_stays_as_it_was():
    for w in (gn.direction(0.0, 0.0), gn.direction(0.4, 1.0)):
        M = BOTH["rough, thinner behind"].mueller(-w, w)
        if M[0, 0] > 0.0:
            np.testing.assert_allclose(M / M[0, 0], np.eye(4), atol=1e-12)


def test_what_a_smooth_interface_reflects_and_transmits_shares_the_light():
    """R + T = 1 for s and for p: the upper left blocks of J and of T n_o^2/n_i^2 add up to one of full transmission."""
    glass = gn.SmoothDielectric(1.5)
    for theta in (0.0, 0.7, math.atan(1.5), 1.4):
        w = gn.direction(theta, 0.3)
        c, ct = math.cos(theta), math.sqrt(1.0 - (math.sin(theta) / 1.5) ** 2)
        R, T = glass.delta_mueller(w), glass.delta_mueller(w, across=True) * 1.5**2
        np.testing.assert_allclose((R + T)[:2, :2], np.eye(2), atol=1e-12)
        t_s, t_p = 2.0 * c / (c + 1.5 * ct), 2.0 * c / (1.5 * c + ct)
        assert T[2, 2] == pytest.approx(1.5 * ct / c * t_s * t_p, rel=1e-12)
    below = glass.delta_mueller(gn.direction(PI - 1.0, 0.3))  # beyond the critical angle all light is reflected
    assert below[0, 0] == pytest.approx(1.0, abs=1e-12) and abs(below[2, 3]) > 0.1


def test_a_sheet_polarizes_where_either_side_does():
    facets = gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
    assert gn.TwoSided(gn.Lambertian(0.5), facets).polarizes and gn.TwoSided(facets, gn.Lambertian(0.5)).polarizes
    assert not gn.TwoSided(gn.Lambertian(0.5), gn.Lambertian(0.1)).polarizes


def test_total_reflection_shifts_the_phases_of_s_and_p():
    """Beyond the critical angle all light comes back, and linear light at 45 degrees elliptical: 45 degrees of phase at
    54.6 degrees in glass of 1.51, of which Fresnel made his rhomb."""
    M = gn.SmoothDielectric(1.51).delta_mueller(gn.direction(PI - math.radians(54.6), 0.3))
    assert M[0, 0] == pytest.approx(1.0, abs=1e-12)
    assert math.degrees(abs(math.atan2(M[2, 3], M[2, 2]))) % 180.0 == pytest.approx(45.0, abs=0.1)
