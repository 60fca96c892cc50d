"""Any reflectance as a BSDF of Mitsuba 3: values and samples against gonio's own and Mitsuba's plugins, chi-square
tests, derivatives, variants, scenes, refusals. Mitsuba's numbers are those of the version that is installed (3.9.1)."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from libraries import colour_science
from materials import MODELS, Draw

import gonio as gn
from gonio.base.calls import disperses
from gonio.base.sums import Sum
from gonio.errors import DependencyError, NotFoundError, ParameterError

pytestmark = pytest.mark.slow_because("Mitsuba compiles each BSDF anew")
EVERYDAY = {"Microfacet", "RoughDielectric", "DisneyPrincipled", "TwoSided", "KullaContyDielectric", "Hapke"}
"""Models that the default tests try; the others are `full`."""


def each(models):
    return [pytest.param(m, id=m.__name__, marks=() if m.__name__ in EVERYDAY else pytest.mark.full) for m in models]


def variant(name: str):
    mitsuba = pytest.importorskip("mitsuba")
    try:
        mitsuba.set_variant(name)
        mitsuba.Float([0.0, 1.0]) + 1.0  # the first use of LLVM, which may be missing
    except (ImportError, RuntimeError) as error:
        pytest.skip(f"Mitsuba's {name} cannot be used here: {error}")
    return mitsuba


@pytest.fixture
def mi():
    return variant("llvm_ad_rgb")


def directions(count: int, sides: str = "both") -> np.ndarray:
    rng = np.random.default_rng(4)
    w = rng.normal(size=(2, count, 3))
    w[..., 2] = np.abs(w[..., 2]) if sides == "front" else w[..., 2]
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def interaction(mi, w):
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(w))
    si.wi = vectors(mi, w)
    return si


def vectors(mi, w):
    return mi.Vector3f(*np.ascontiguousarray(w.T, np.float32))


def evaluated(mi, bsdf, wi, wo, mode=None, wavelengths=None):
    """f times the cosine and the density, (N, C) and (N,)."""
    context = mi.BSDFContext() if mode is None else mi.BSDFContext(mode)
    si = interaction(mi, wi)
    if wavelengths is not None:
        si.wavelengths = mi.UnpolarizedSpectrum(*wavelengths)
    value, pdf = bsdf.eval_pdf(context, si, vectors(mi, wo))
    return np.array(value).T + np.zeros((len(wi), 1)), np.array(pdf) + np.zeros(len(wi))


def bridged(m):
    import gonio.bridges.mitsuba

    return gonio.bridges.mitsuba.bsdf(m)


def ordinary(m) -> bool:
    return not (m.fluoresces or disperses(m))


def in_layouts():
    """Each model without channels and with three; of everyday ones one of the two by turns, the other is `full`."""
    models = [*MODELS, Sum]
    tried = {m: (None, 3)[k % 2] for k, m in enumerate(m for m in models if m.__name__ in EVERYDAY)}
    cases = [(model, channels) for model in models for channels in (None, 3)]
    return [
        pytest.param(*case, marks=() if case in tried.items() else pytest.mark.full, id=f"{case[1]}-{case[0].__name__}")
        for case in cases
    ]


@pytest.mark.parametrize(("model", "channels"), in_layouts())
def test_values_and_densities_are_those_of_numpy(mi, model, channels):
    m = Draw(model, 0).material(channels)
    if not ordinary(m):
        pytest.skip("no one direction, or no one wavelength: refused, see below")
    wi, wo = directions(400)
    value, pdf = evaluated(mi, bridged(m), wo, wi)
    cos = np.abs(wi[:, 2:])
    by_wavelength = gn.pictures.colour.rgb_of(m.channel_names)

    def by_numpy(dtype):
        inputs = wi.astype(np.float32).astype(dtype), wo.astype(np.float32).astype(dtype)
        f = m.f(*inputs)
        f = f if np.ndim(f) > 1 else f[:, None]
        return (f if by_wavelength is None else f @ by_wavelength) * cos, m.pdf(*inputs)

    exact, rounded = by_numpy(float), by_numpy(np.float32)
    for ours, theirs, single in zip((value, pdf), exact, rounded, strict=True):
        # What 95 % keep, and the mean: the last digits of narrow lobes are those of float32, on NumPy too.
        size = np.maximum(np.abs(theirs).reshape(len(wi), -1).max(axis=-1), 1e-4)
        error, usual = (np.abs(x - theirs).reshape(len(wi), -1).max(axis=-1) / size for x in (ours, single))
        assert np.percentile(error, 95.0) < 2e-4 + 3.0 * np.percentile(usual, 95.0)
        np.testing.assert_allclose(ours.mean(), theirs.mean(), rtol=2e-3, atol=1e-7)


OWN = {
    "rough glass": (
        lambda: gn.RoughDielectric(gn.GGX(0.3), 1.5),
        {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.3, "int_ior": 1.5, "ext_ior": 1.0},
    ),
    "glass": (lambda: gn.SmoothDielectric(1.5), {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}),
    "pane": (  # whose bounces count as unpolarized there; ThinDielectric sums those of s and of p
        lambda: gn.Stack([gn.Interface(1.5), gn.Interface(1.0 / 1.5)]),
        {"type": "thindielectric", "int_ior": 1.5, "ext_ior": 1.0},
    ),
    "mirror": (lambda: gn.IdealSpecular(1.0), {"type": "conductor", "material": "none"}),
}


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("name", OWN)
def test_both_modes_of_transport_are_those_of_mitsubas_plugins(mi, name, mode):
    import drjit as dr

    make, plugin = OWN[name]
    mode = getattr(mi.TransportMode, mode)
    ours, theirs = bridged(make()), mi.load_dict(plugin)
    wi, wo = directions(2000)
    a, b = (evaluated(mi, x, wi, wo, mode)[0] for x in (ours, theirs))
    # Near the horizon of the half vector float32 leaves 1e-3; the mean weighs what is bright.
    np.testing.assert_allclose(a.mean(), b.mean(), rtol=1e-5, atol=1e-12)
    n = 200_000
    u = np.random.default_rng(3).random((3, n)).astype(np.float32)
    for z in (0.7, -0.8):
        si = interaction(mi, np.broadcast_to([np.sqrt(1.0 - z * z), 0.0, z], (n, 3)))
        results = []
        for bsdf in (ours, theirs):
            bs, weight = bsdf.sample(mi.BSDFContext(mode), si, mi.Float(u[2]), mi.Point2f(*u[:2]))
            weight, across = np.array(weight)[0] + np.zeros(n), np.array(bs.wo)[2] * z < 0.0
            eta = np.unique((np.array(bs.eta) + np.zeros(n))[across & (weight > 0.0)])
            types = np.unique((np.array(bs.sampled_type) + np.zeros(n, int))[weight > 0.0])
            results.append((np.mean(weight * ~across), np.mean(weight * across), eta, types))
            assert np.isfinite(weight).all()
        # Standard error: below 0.5/sqrt(n) = 1.1e-3 of weights up to 2.25.
        np.testing.assert_allclose(results[0][:2], results[1][:2], atol=6e-3)
        np.testing.assert_allclose(results[0][2], results[1][2], rtol=1e-6)
        assert results[0][3].tolist() == results[1][3].tolist()
        passed = [np.array(bsdf.eval_null_transmission(si)).reshape(3, -1)[0, 0] for bsdf in (ours, theirs)]
        np.testing.assert_allclose(*passed, rtol=1e-5)
    dr.sync_thread()


def chi2(mi, m, wi) -> tuple[bool, str]:
    import drjit as dr
    from mitsuba.chi2 import ChiSquareTest, SphericalDomain

    bsdf, context = bridged(m), mi.BSDFContext()

    def sample(u):
        bs, _ = bsdf.sample(
            context, interaction(mi, np.broadcast_to(wi, (dr.width(u), 3))), u[0], mi.Point2f(u[1], u[2])
        )
        drawn = (bs.pdf > 0.0) & ~mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        return bs.wo, dr.select(drawn, 1.0, 0.0)

    def pdf(wo):
        return bsdf.pdf(context, interaction(mi, np.broadcast_to(wi, (dr.width(wo), 3))), wo)

    test = ChiSquareTest(SphericalDomain(), sample, pdf, sample_dim=3, ires=32)
    # Šidák's correction for all models from two directions.
    return test.run(0.01, test_count=2 * len(MODELS), quiet=True), test.messages


WIDE = {"OpenPBRCoat": {"coat_roughness": 0.5}}
"""Parameters of models whose lobe by default is narrower than a cell of that test."""
VIEWS = {"front": ([0.35, 0.2, 0.915], [-0.5, 0.81, 0.3]), "across": ([0.35, 0.2, 0.915], [-0.5, 0.6, -0.62])}


@pytest.mark.parametrize("model", each(MODELS))
def test_samples_have_their_density_by_mitsubas_own_test(mi, model):
    m = model().replace(WIDE.get(model.__name__, {}))
    if not ordinary(m) or all(lobe.is_delta for _, lobe in m.lobes()):
        pytest.skip("no density")
    for w in VIEWS["front" if m.sides == "front" else "across"]:
        passed, messages = chi2(mi, m, np.array(w) / np.linalg.norm(w))
        assert passed, messages


def test_a_wrong_density_fails_that_test(mi):
    class Wrong(gn.Lambertian):
        """As Lambertian, with a density that is off by a third at the normal.

        Looks    as Lambertian.
        Shapes   as Lambertian.
        Units    as Lambertian.
        Error    a wrong density.
        Source   made up.
        """

        def density(self, wi, wo):
            return super().density(wi, wo) * (1.3 - 0.45 * wi.z)

    try:
        assert not chi2(mi, Wrong(0.5), np.array([0.0, 0.0, 1.0]))[0]
    finally:
        from gonio.formula.fields import CLASSES

        CLASSES.pop("Wrong", None)


@pytest.fixture
def plate():
    """A scene whose pixels all are the albedo of a material at 40 degrees: a plate in light of equal radiance."""

    def scene(mi, bsdf, integrator="direct"):
        origin = (3.0 * gn.direction(np.radians(40.0), 0.3)).tolist()
        camera = mi.ScalarTransform4f().look_at(origin=origin, target=[0, 0, 0], up=[0, 0, 1])
        return mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": integrator},
                "sensor": {
                    "type": "orthographic",
                    "to_world": camera @ mi.ScalarTransform4f().scale([0.01, 0.01, 1.0]),
                    "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
                },
                "plate": {"type": "rectangle", "bsdf": bsdf},
                "light": {"type": "constant"},
            }
        )

    return scene


WO = gn.direction(np.radians(40.0), 0.3)


@pytest.mark.parametrize("integrator", ["direct", "path", "prb"])
def test_derivatives_of_a_picture_are_those_of_the_albedo(mi, plate, integrator):
    import drjit as dr

    m = gn.Lambertian([0.4, 0.2, 0.1]) + 0.5 * gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5))
    scene = plate(mi, bridged(m), integrator)
    numbers = mi.traverse(scene)
    for path in ("0.rho", "1.weight", "1.of.distribution.alpha_x", "1.of.fresnel.eta"):
        (key,) = (k for k, _ in numbers if k.endswith("bsdf." + path.replace(".", "_")))
        dr.enable_grad(numbers[key])
        numbers.update()
        picture = mi.render(scene, params=numbers, spp=8192, seed=1)
        dr.backward(dr.mean(picture, axis=None) * 3.0)
        slope = float(np.sum(np.array(dr.grad(numbers[key]))))
        dr.disable_grad(numbers[key])
        value, h = np.asarray(m.parameters[path].value), 1e-3
        above, below = (gn.albedo(m.replace({path: value + s * h}), WO, tolerance=1e-7).sum() for s in (1, -1))
        assert slope == pytest.approx((above - below) / (2.0 * h), rel=0.02), path
        np.testing.assert_allclose(np.array(picture).mean(axis=(0, 1))[:3], gn.albedo(m, WO), rtol=0.01)


def test_new_values_of_parameters_are_used(mi, plate):
    scene = plate(mi, bridged(gn.Lambertian([0.4, 0.2, 0.1])))
    numbers = mi.traverse(scene)
    (key,) = (k for k, _ in numbers if "rho" in k)
    numbers[key] = mi.Color3f(0.1, 0.5, 0.9)
    numbers.update()
    seen = np.array(mi.render(scene, spp=256)).mean(axis=(0, 1))[:3]
    np.testing.assert_allclose(seen, [0.1, 0.5, 0.9], rtol=0.02)  # 16384 samples: a standard error of 0.2 %


def test_scenes_name_materials_as_the_command_line_does(mi, tmp_path):
    import gonio.bridges.mitsuba

    gonio.bridges.mitsuba.register()
    gn.save(gn.tables.tabulate(gn.Lambertian([0.6, 0.3, 0.1]), "angles", resolution=(5, 5, 5)), tmp_path / "m.csv")
    wi, wo = directions(50, "front")
    cases = {
        "gold-metallic-paint": gn.material("gold-metallic-paint"),
        str(tmp_path / "m.csv"): gn.load(tmp_path / "m.csv"),
        "Lambertian(0.2) + 0.5 * Microfacet(GGX(0.3), Dielectric(1.4))": gn.expression(
            "Lambertian(0.2) + 0.5 * Microfacet(GGX(0.3), Dielectric(1.4))"
        ),
    }
    for text, m in cases.items():
        xml = f'<bsdf version="3.0.0" type="gonio"><string name="material" value="{text}"/></bsdf>'
        value, _ = evaluated(mi, mi.load_string(xml), wo, wi)
        np.testing.assert_allclose(
            value, m.f(wi, wo).reshape(50, -1) * wi[:, 2:] + np.zeros((1, 3)), rtol=2e-3, atol=1e-5
        )
    for inner, expected in (('<string name="material" value="golt"/>', "nearest: gold"), ("", "without material")):
        with pytest.raises(RuntimeError, match=expected):
            mi.load_string(f'<bsdf version="3.0.0" type="gonio">{inner}</bsdf>')


def test_spectral_variants_take_numbers_at_the_wavelengths_of_each_ray():
    mi = variant("llvm_ad_spectral")
    colour_science()  # of whose basis RGB becomes spectra
    wi, wo = directions(100, "front")
    nm, nodes = [412.0, 503.3, 611.0, 777.0], np.arange(400.0, 781.0, 20.0)
    gold = gn.material("gold", alpha=0.4, wavelengths=nodes)
    red = gn.Lambertian([0.6, 0.1, 0.05])
    graded = gn.Lambertian(gn.Spectrum([380.0, 780.0], [0.2, 0.8])).at(nodes)
    table = gn.tables.tabulate(graded, "angles", resolution=(6, 6, 9))
    for m, expected in (
        (gold, gold.at(nm).f(wi, wo)),
        (red, gn.spectra.upsampled(red).at(nm).f(wi, wo)),
        (table, np.stack([np.interp(nm, nodes, f) for f in table.f(wi, wo)])),
        (gn.Lambertian(0.3), np.full((100, 4), 0.3 / np.pi)),
    ):
        value, _ = evaluated(mi, bridged(m), wo, wi, wavelengths=nm)
        np.testing.assert_allclose(value, expected * wi[:, 2:], rtol=2e-4, atol=1e-6)


def test_one_channel_variants_take_the_luminance():
    mi = variant("llvm_ad_mono")
    wi, wo = directions(20, "front")
    value, _ = evaluated(mi, bridged(gn.Lambertian([0.6, 0.1, 0.05])), wo, wi)
    expected = 0.2126 * 0.6 + 0.7152 * 0.1 + 0.0722 * 0.05  # weights of ITU-R BT.709
    np.testing.assert_allclose(value, expected / np.pi * wi[:, 2:], rtol=1e-3)


def test_wavelengths_become_rgb_as_everywhere_else(mi):
    nodes = np.arange(400.0, 701.0, 20.0)
    m = gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.2, 0.8])).at(nodes)
    wi, wo = directions(20, "front")
    value, _ = evaluated(mi, bridged(m), wo, wi)
    expected = m.f(wi, wo) @ gn.pictures.colour.to_rgb(nodes)
    np.testing.assert_allclose(value, expected * wi[:, 2:], rtol=1e-4, atol=1e-6)


def test_two_sided_wrappers_of_mitsuba_take_it(mi):
    both = mi.load_dict({"type": "twosided", "bsdf": bridged(gn.Lambertian(0.5))})
    wi, wo = directions(100, "front")
    value, _ = evaluated(mi, both, -wo, -wi)
    np.testing.assert_allclose(value, 0.5 / np.pi * wi[:, 2:] + np.zeros((1, 3)), rtol=1e-5)


def test_holes_of_measurements_are_black(mi):
    table = gn.tables.tabulate(gn.Lambertian(0.5), "angles", resolution=(5, 5, 5))
    values = table.stored.copy()
    values[1:3] = np.nan
    holed = table.with_table(values)
    wi, wo = directions(100, "front")
    value, pdf = evaluated(mi, bridged(holed), wo, wi)
    assert np.isnan(holed.f(wi, wo)).any()
    assert np.isfinite(value).all() and np.isfinite(pdf).all()


def test_refusals_say_what_to_do(mi, monkeypatch):
    import gonio.bridges.mitsuba

    bsdf = gonio.bridges.mitsuba.bsdf
    for m, expected in (
        (gn.Lambertian(np.full((4, 4, 3), 0.5)), "a map"),
        (gn.SmoothDielectric([1.51, 1.53, 1.55]), r"m.at\(550.0\)"),
        (gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0]), r"m.under\(light\)"),
        (gn.Lambertian([0.1, 0.2, 0.3, 0.4]), "with_channels"),
    ):
        with pytest.raises(ParameterError, match=expected):
            bsdf(m)
    some = mi.BSDFContext()
    some.type_mask = int(mi.BSDFFlags.Diffuse)
    wi, wo = directions(4)
    with pytest.raises(ParameterError, match="type_mask"):
        bsdf(gn.Lambertian(0.5)).eval(some, interaction(mi, wi), vectors(mi, wo))
    mi.set_variant("scalar_rgb")
    with pytest.raises(ParameterError, match="llvm_ad_rgb"):
        bsdf(gn.Lambertian(0.5))
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(DependencyError, match="pip install"):
        bsdf(gn.Lambertian(0.5))
    with pytest.raises(NotFoundError):
        gn.material("golt")


def test_facets_of_a_table_that_leans(mi):
    """Its whole numbers stay above 0, since those of Mitsuba have no sign."""
    facets = gn.TabulatedAnisotropicFacets([0.1, 0.5, 1.4], [0.2, 1.0, 4.0], [[1, 1, 1], [5, 3, 1], [0, 1, 0]])
    m = gn.Microfacet(facets, gn.Schlick(0.5))
    wi, wo = directions(400)
    value, pdf = evaluated(mi, bridged(m), wo, wi)
    np.testing.assert_allclose(value[:, 0], m.f(wi, wo) * np.abs(wi[:, 2]), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(pdf.mean(), m.pdf(wi, wo).mean(), rtol=2e-3)
