"""Materials whose parameters are textures: the same as with arrays of numbers, on every library and in pictures."""

from __future__ import annotations

import numpy as np
import pytest
from libraries import switch_off

import gonio as gn
from gonio.errors import ArrayTypeError, ParameterError, ShapeError

RNG = np.random.default_rng(5)
COUNT = 300
WI, WO = (gn.direction(RNG.uniform(0.0, 1.4, COUNT), RNG.uniform(0.0, 6.0, COUNT)) for _ in range(2))
UV = RNG.uniform(-2.0, 3.0, (COUNT, 2))
COLOURS, ROUGH = RNG.uniform(0.1, 0.9, (5, 4, 3)), RNG.uniform(0.1, 0.6, (3, 7))


def painted(**how: str) -> gn.Reflectance:
    return gn.Lambertian(gn.Texture(COLOURS, **how)) + gn.Microfacet(
        gn.GGX(gn.Texture(ROUGH, **how)), gn.Dielectric(1.5)
    )


def bilinear(texels: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Of repeating texels, written another way: the four about a place, each by its area."""
    x, y = uv[:, 0] * texels.shape[1] - 0.5, uv[:, 1] * texels.shape[0] - 0.5
    total = 0.0
    for i in (0, 1):
        for j in (0, 1):
            row, column = np.floor(y).astype(int) + i, np.floor(x).astype(int) + j
            share = (1.0 - np.abs(y - row)) * (1.0 - np.abs(x - column))
            total = total + share[:, None] * texels[row % texels.shape[0], column % texels.shape[1]].reshape(
                len(uv), -1
            )
    return total


@pytest.mark.parametrize("way", ["compiled", "arrays"])
def test_f_is_that_of_arrays_of_parameters(way, monkeypatch):
    if way == "arrays":
        switch_off(monkeypatch)
    rho, alpha = bilinear(COLOURS, UV), bilinear(ROUGH, UV)
    expected = (gn.Lambertian(rho) + gn.Microfacet(gn.GGX(alpha), gn.Dielectric(1.5))).f(WI, WO)
    m = painted()
    np.testing.assert_allclose(m.f(WI, WO, uv=UV), expected, rtol=1e-12)
    np.testing.assert_allclose(m.at(uv=UV).f(WI, WO), expected, rtol=1e-12)


@pytest.mark.parametrize("filter", ["bilinear", "nearest"])
@pytest.mark.parametrize("wrap", ["repeat", "mirror", "clamp"])
def test_kernels_look_up_what_at_does(filter, wrap):
    m = painted(filter=filter, wrap=wrap)
    np.testing.assert_allclose(m.f(WI, WO, uv=UV), m.at(uv=UV).f(WI, WO), rtol=1e-12)
    single = [x.astype(np.float32) for x in (WI, WO, np.abs(UV) % 1.0)]
    np.testing.assert_allclose(m.f(*single[:2], uv=single[2]), m.at(uv=single[2]).f(*single[:2]), rtol=3e-4)


def test_a_constant_texture_is_the_plain_number():
    m = gn.Lambertian(gn.Texture(np.full((4, 3, 3), [0.2, 0.5, 0.8])))
    plain = gn.Lambertian([0.2, 0.5, 0.8])
    np.testing.assert_allclose(m.f(WI, WO, uv=UV), plain.f(WI, WO), rtol=1e-14)
    assert m.channels == 3
    assert m.at(uv=[0.3, 0.1]) == plain
    glossy = gn.Microfacet(gn.GGX(gn.Texture([[0.25]])), gn.Conductor(gn.Texture([[0.2, 0.2]]), 3.9))
    one = glossy.f(WI, WO, uv=UV)
    np.testing.assert_allclose(one[:, 0], gn.Microfacet(gn.GGX(0.25), gn.Conductor(0.2, 3.9)).f(WI, WO), rtol=1e-13)


def test_parameters_tied_to_a_texture_follow():
    m = gn.Microfacet(gn.GGX(gn.Texture(ROUGH)))
    np.testing.assert_allclose(m.at(uv=UV).distribution.alpha_y, bilinear(ROUGH, UV))
    both = gn.Microfacet(gn.GGX(gn.Texture(ROUGH), 0.3))
    assert both.at(uv=UV).distribution.alpha_y == 0.3


def test_shapes_and_out():
    m = painted()
    grid = m.f(WI[:4, None], WO[0], uv=UV[None, :5])
    assert grid.shape == (4, 5, 3)
    np.testing.assert_allclose(grid[2, 3], m.f(WI[2], WO[0], uv=UV[3]), rtol=1e-13)
    out = np.empty((COUNT, 3))
    assert m.f(WI, WO, out, uv=UV) is out
    np.testing.assert_array_equal(out, m.f(WI, WO, uv=UV))
    assert gn.Lambertian(0.5).f(WI, WO, uv=UV).shape == (COUNT,)
    assert m.f([0, 0, 1], [0, 0, 1], uv=[0, 0]).shape == (3,)


def test_places_that_are_no_numbers_give_none():
    m, uv = painted(), UV.copy()
    uv[3, 0], uv[5, 1], uv[7] = np.nan, np.inf, 1e30
    f = m.f(WI, WO, uv=uv)
    assert np.isnan(f[[3, 5]]).all()
    assert np.isfinite(np.delete(f, [3, 5], 0)).all()
    assert np.isnan(gn.Lambertian(0.5).f(WI, WO, uv=uv)[[3, 5]]).all()
    assert np.isnan(painted(wrap="clamp").f(WI, WO, uv=uv)[[3, 5]]).all()
    with pytest.raises(ParameterError, match="NaN or infinite"):
        m.at(uv=uv)


def test_without_a_place_there_is_no_f():
    m = painted()
    calls = (lambda: m.f(WI, WO), lambda: m.pdf(WI, WO), lambda: m.sample(WO, UV), lambda: gn.albedo(m, [0, 0, 1]))
    for call in (*calls, lambda: m.jacobian(WI, WO, by=["0.rho"]), lambda: gn.check(m), lambda: m.is_isotropic()):
        with pytest.raises(ParameterError, match=r"no number until there is a place; write m\.f\(wi, wo, uv=uv\)"):
            call()
    assert gn.albedo(m.at(uv=UV[:2]), [0, 0, 1]).shape == (2, 3)


def test_channels_that_do_not_fit():
    with pytest.raises(ShapeError, match=r"\[2, 3\] channels"):
        (gn.Lambertian([0.1, 0.2, 0.3]) + gn.Lambertian(gn.Texture(COLOURS[..., :2]))).f(WI, WO, uv=UV)


def test_labelled_places_are_refused():
    xarray = pytest.importorskip("xarray")
    with pytest.raises(ArrayTypeError, match="uv: got a DataArray; expected a plain array"):
        painted().f(WI, WO, uv=xarray.DataArray(UV, dims=("place", "component")))
    named = gn.Lambertian(xarray.DataArray([0.1, 0.2], dims="x")) + gn.Lambertian(gn.Texture(ROUGH))
    with pytest.raises(ArrayTypeError, match="a texture beside parameters whose axes have names"):
        named.f(WI[0], WO[0], uv=UV[0])


@pytest.mark.parametrize("module", ["torch", "jax.numpy"])
def test_derivatives_by_texels(module):
    library = pytest.importorskip(module)

    def total(colours, rough, uv=UV):
        m = gn.Lambertian(gn.Texture(colours)) + gn.Microfacet(gn.GGX(gn.Texture(rough)), gn.Dielectric(1.5))
        like = [library.asarray(x) if not isinstance(colours, np.ndarray) else x for x in (WI, WO, uv)]
        return m.f(*like[:2], uv=like[2]).sum()

    def differences(k, place):
        values = []
        for step in (1e-5, -1e-5):
            moved = [COLOURS.copy(), ROUGH.copy()]
            moved[k][place] += step
            values.append(total(*moved))
        return (values[0] - values[1]) / 2e-5

    if module == "torch":
        leaves = [library.tensor(x, requires_grad=True) for x in (COLOURS, ROUGH)]
        total(*leaves).backward()
        slopes, limit = [x.grad.numpy() for x in leaves], 1e-6
    else:
        import jax

        slopes, limit = jax.grad(total, (0, 1))(library.asarray(COLOURS), library.asarray(ROUGH)), 2e-4
    for k, place in ((0, (0, 0, 0)), (0, (4, 3, 2)), (0, (2, 1, 1)), (1, (0, 0)), (1, (2, 6)), (1, (1, 3))):
        assert float(slopes[k][place]) == pytest.approx(differences(k, place), rel=limit, abs=limit)


@pytest.mark.parametrize("library", ["torch", "jax", "drjit"])
def test_texels_of_numpy_serve_every_library(library):
    pytest.importorskip(library)
    if library == "torch":
        from torch import asarray as convert
    elif library == "jax":
        from jax.numpy import asarray as convert
    else:
        from drjit.llvm import TensorXf as convert
    m = painted()
    single = [x.astype(np.float32) for x in (WI, WO, UV)]
    expected = m.f(*single[:2], uv=single[2])
    wi, wo, uv = map(convert, single)
    np.testing.assert_allclose(np.asarray(m.f(wi, wo, uv=uv)), expected, rtol=2e-4)
    np.testing.assert_allclose(np.asarray(m.at(uv=uv).f(wi, wo)), expected, rtol=2e-4)


def test_libraries_are_not_mixed():
    torch = pytest.importorskip("torch")
    m = gn.Lambertian(gn.Texture(torch.asarray(COLOURS)))
    with pytest.raises(ArrayTypeError, match="texels of Tensor at places of numpy; expected one library"):
        m.f(WI, WO, uv=UV)
    with pytest.raises(ArrayTypeError, match="expected linear ones"):
        gn.Texture(torch.asarray(COLOURS), colour="srgb")


def test_a_texture_is_trained_in_torch():
    torch = pytest.importorskip("torch")
    from gonio.bridges.torch import Material

    wanted = torch.asarray(gn.Lambertian(gn.Texture(COLOURS)).f(WI, WO, uv=UV), dtype=torch.float32)
    wi, wo, uv = (torch.asarray(x, dtype=torch.float32) for x in (WI, WO, UV))
    module = Material(gn.Lambertian(gn.Texture(np.full_like(COLOURS, 0.5))))
    optimizer = torch.optim.Adam(module.parameters(), 0.05)
    for _ in range(300):
        optimizer.zero_grad()
        ((module(wi, wo, uv) - wanted) ** 2).sum().backward()
        optimizer.step()
        module.clamp_()
    np.testing.assert_allclose(module.reflectance.rho.texels.detach(), COLOURS, atol=0.01)


@pytest.mark.slow_because("JAX compiles what it computes, and is started where no test has been before")
def test_a_textured_material_is_a_pytree():
    jax = pytest.importorskip("jax")
    import gonio.bridges.jax  # noqa: F401  (materials become pytrees)

    m = painted(wrap="mirror")
    leaves, structure = jax.tree.flatten(m)
    assert [np.shape(x) for x in leaves] == [(5, 4, 3), (3, 7, 1), ()]
    assert jax.tree.unflatten(structure, leaves) == m
    wi, wo, uv = map(jax.numpy.asarray, (WI, WO, UV))
    slope = jax.grad(lambda m: m.f(wi, wo, uv=uv).sum())(jax.tree.map(jax.numpy.asarray, m))
    assert slope.terms[0].rho.texels.shape == (5, 4, 3)


def test_a_map_of_one_normal_is_a_turned_frame():
    n = np.array([0.3, -0.2, np.sqrt(1.0 - 0.13)])
    codes = np.broadcast_to(0.5 * (n + 1.0), (6, 5, 3))
    inside = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2, 0.4), gn.Dielectric(1.5))
    m = gn.ShadingNormal(inside, *gn.normal_map(codes))
    # The tangent is d_x turned by the rotation that takes the normal to n, about z x n.
    axis = np.array([-n[1], n[0], 0.0]) / np.hypot(n[0], n[1])
    sin, cos = np.hypot(n[0], n[1]), n[2]
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    R = np.eye(3) + sin * K + (1.0 - cos) * K @ K
    wi, wo = WI @ R, WO @ R
    up = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
    expected = np.where(up, inside.f(wi, wo) * wi[:, 2] / WI[:, 2], 0.0)
    np.testing.assert_allclose(m.f(WI, WO, uv=UV)[:, 0], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        m.f(WI, WO, uv=UV)[:, 0], gn.ShadingNormal(inside, n[0], n[1]).f(WI, WO), rtol=1e-12, atol=1e-14
    )


def test_what_takes_numbers_alone_says_so():
    pytest.importorskip("mitsuba").set_variant("llvm_ad_rgb")
    from gonio.bridges import materialx, mitsuba, pbrt, radiance

    m = painted()
    for call in (mitsuba.bsdf, mitsuba.text, pbrt.text, materialx.text, radiance.text, gn.spectra.upsampled):
        with pytest.raises(ParameterError, match=r"0\.rho is a texture; expected numbers, those of a place: m\.at"):
            call(m)
    gn.spectra.upsampled(m.at(uv=[0.5, 0.5]))
