"""The reflection equation: closed forms, frames, gradients, furnaces, and what bad input says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from materials import COMPILED, Draw, Sum, breaks, draws, on_sphere

import gonio as gn
from gonio.arrays import ops
from gonio.base.frames import Frame
from gonio.errors import ArrayTypeError, ParameterError, ShapeError

PI = math.pi
UP = np.array([0.0, 0.0, 1.0])
BRUSHED = gn.Microfacet(gn.GGX(0.1, 0.4), gn.Conductor(1.2, 6.0)) + gn.Lambertian([0.1, 0.2, 0.3])


def rotation(seed: int) -> np.ndarray:
    """A random rotation R: world vectors w become w @ R.T."""
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def around(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation about a unit axis."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k


# Point sources (rows 4, 14, 15 of the mission's table).


def test_lambertian_under_a_distant_source():
    """L = rho E cos(theta)/pi (lecture 4, eq. 4.10)."""
    for theta in (0.0, 0.4, 1.2):
        light = gn.DistantLight(on_sphere(theta, 0.7), 5.0)
        for wo in (UP, on_sphere(1.0, 2.0)):
            radiance = gn.reflected_radiance(gn.Lambertian(0.3), light, wo)
            assert radiance == pytest.approx(0.3 * 5.0 * math.cos(theta) / PI, rel=1e-14)
    below = gn.DistantLight((0.1, 0.2, -0.9), 5.0)
    assert gn.reflected_radiance(gn.Lambertian(0.3), below, UP) == 0.0
    assert gn.reflected_radiance(gn.Lambertian(0.3), gn.DistantLight(), -UP) == 0.0


def test_lambertian_under_a_nearby_source():
    """rho N.S/r^2 (slides B), with S = I/pi: L = rho I cos(theta)/(pi r^2)."""
    light = gn.PointLight((1.0, 2.0, 3.0), 7.0)
    position = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 1.0], [5.0, -2.0, 2.5], [0.0, 0.0, 4.0]])
    to = np.array([1.0, 2.0, 3.0]) - position
    r = np.linalg.norm(to, axis=-1)
    expected = 0.4 / PI * 7.0 * np.maximum(to[:, 2], 0.0) / r**3
    radiance = gn.reflected_radiance(gn.Lambertian(0.4), light, on_sphere(0.3, 1.0), position=position)
    np.testing.assert_allclose(radiance, expected, rtol=1e-13)
    assert np.isnan(light.arrival([1.0, 2.0, 3.0]).w).all()
    with pytest.raises(ParameterError, match="expected positions outside the light"):
        gn.reflected_radiance(gn.Lambertian(0.4), light, UP, position=(1.0, 2.0, 3.0))


def test_sum_over_sources():
    """L = sum of E_i f cos+ (Szeliski 2.85)."""
    w, E = on_sphere([0.2, 0.9, 1.4, 2.0], [0.1, 2.0, -1.0, 0.4]), np.array([1.0, 3.0, 0.5, 100.0])
    wo = on_sphere([0.5, 0.8], [0.0, 1.0])
    lights = [gn.DistantLight(d, e) for d, e in zip(w, E, strict=True)]
    f = BRUSHED.f(w[:, None], wo)
    expected = (E[:, None, None] * f * np.maximum(w[:, None, 2:], 0.0)).sum(0)
    np.testing.assert_allclose(gn.reflected_radiance(BRUSHED, lights, wo), expected, rtol=1e-13)


def test_a_far_point_is_a_distant_source():
    r = 1e6
    near = gn.PointLight(r * on_sphere(0.5, 1.0), 3.0 * r * r)
    far = gn.DistantLight(on_sphere(0.5, 1.0), 3.0)
    wo, position = on_sphere(0.9, 2.0), (0.1, -0.2, 0.3)
    a, b = (gn.reflected_radiance(BRUSHED, light, wo, position=position) for light in (near, far))
    np.testing.assert_allclose(a, b, rtol=1e-5)


# Any incident radiance (rows 3 and 16).


@pytest.mark.parametrize("rho", [0.0, 0.4, 1.0])
def test_lambertian_in_constant_light(rho):
    """L_e = rho L_i (lecture 4, eq. 4.11)."""
    wo = on_sphere([0.0, 0.7, 1.5], [0.0, 1.0, 2.0])
    radiance = gn.reflected_radiance(gn.Lambertian(rho), gn.ConstantLight(2.5), wo)
    np.testing.assert_allclose(radiance, 2.5 * rho, rtol=1e-12)


IN_KERNELS = [Draw(kind, 0) for kind in (gn.Lambertian, gn.ModifiedPhong, gn.Across)]
FURNACES = [
    pytest.param(draw, evaluation, marks=() if draw in few else pytest.mark.full)
    for evaluation, few in (("uncompiled", [draw for draw in COMPILED if draw.seed == 0]), ("compiled", IN_KERNELS))
    for draw in draws(3, every=7)
]


@pytest.mark.parametrize(("draw", "evaluation"), FURNACES, ids=str, indirect=["evaluation"])
def test_white_furnace(draw, evaluation):
    """In equilibrium, radiance n^2 on each side, a reciprocal material returns albedo + transmittance, on every side.

    f(wi, wo)/n_o^2 = f(wo, wi)/n_i^2 gives L_o = integral of f(wi, wo) |cos_i| n_i^2 = n_o^2 (albedo + transmittance).
    Of a sheet whose two ways differ, these are those of the light that goes the other way.
    """
    m = draw.material()
    if "reciprocity" not in breaks(m):
        wo = on_sphere([0.0, 0.9, 1.45], [0.0, 1.0, -2.0])
        both = gn.FunctionLight(lambda w: np.where(w[..., 2] > 0.0, 1.0, m.index**2))
        light = gn.ConstantLight(1.0) if m.index == 1.0 else both
        for view, n in [(wo, 1.0), (-wo, m.index)][: 1 if m.sides == "front" else 2]:
            radiance = gn.reflected_radiance(m, light, view)
            other = gn.Sheet(m.front, m.back, m.backward, m.forward) if isinstance(m, gn.Sheet) else m
            returned = n * n * (gn.albedo(other, view) + gn.transmittance(other, view))
            # A table has kinks, and of a sum each part is integrated to its share of the tolerance.
            near = 1e-4 * n * n if isinstance(m, (gn.KullaContyDielectric, Sum)) else 0.0
            np.testing.assert_allclose(radiance, returned, rtol=1e-9, atol=near)


def test_which_side_is_integrated():
    """Albedo integrates over viewers, radiance over light: a model that is not reciprocal tells them apart."""
    m = gn.OriginalPhong(0.1, 4.0)  # f = rho_s (s.wo)^n / cos(theta_i)
    assert gn.albedo(m, UP, tolerance=1e-6) == pytest.approx(2.0 * PI * 0.1 / 6.0, rel=1e-5)
    seen = gn.reflected_radiance(m, gn.ConstantLight(1.0), UP, tolerance=1e-6)
    assert seen == pytest.approx(2.0 * PI * 0.1 / 5.0, rel=1e-5)


def test_lambertian_under_a_sky():
    """L(w) = 1 + cos(theta): L_o = rho/pi (pi + 2 pi/3); half a sky: half of it; and a spectrum of its own."""
    wo = on_sphere(0.8, 0.3)
    sky = gn.FunctionLight(lambda w: 1.0 + w[..., 2])
    assert gn.reflected_radiance(gn.Lambertian(0.6), sky, wo) == pytest.approx(0.6 * 5.0 / 3.0, rel=1e-5)
    slope = gn.FunctionLight(lambda w: 1.0 + w[..., 0])
    assert gn.reflected_radiance(gn.Lambertian(0.6), slope, wo) == pytest.approx(0.6, rel=1e-9)
    colours = gn.FunctionLight(lambda w: np.stack([w[..., 2], w[..., 2] ** 2], -1))
    np.testing.assert_allclose(
        gn.reflected_radiance(gn.Lambertian([0.6, 0.3]), colours, wo), [0.6 * 2.0 / 3.0, 0.3 / 2.0], rtol=1e-5
    )


def test_mirror_under_a_function():
    """L_o = k L_i(mirror direction), exactly (lecture 4, eq. 4.6 corrected), in any frame."""
    sky = gn.FunctionLight(lambda w: np.sin(5.0 * w[..., 0]) + w[..., 1] + 2.0)
    wo = on_sphere([0.0, 0.4, 1.3], [0.0, 2.0, -1.0])
    mirrored = wo * [-1.0, -1.0, 1.0]
    expected = np.sin(5.0 * mirrored[:, 0]) + mirrored[:, 1] + 2.0
    np.testing.assert_allclose(gn.reflected_radiance(gn.IdealSpecular(0.7), sky, wo), 0.7 * expected, rtol=1e-13)
    n = on_sphere(0.5, 1.0)
    mirrored = 2.0 * (wo @ n)[:, None] * n - wo
    expected = np.where(wo @ n > 0.0, np.sin(5.0 * mirrored[:, 0]) + mirrored[:, 1] + 2.0, 0.0)
    np.testing.assert_allclose(gn.reflected_radiance(gn.IdealSpecular(), sky, wo, normal=n), expected, rtol=1e-12)


def test_delta_light_in_a_delta_lobe():
    """Contributes nothing, by definition, and the other lobes stay."""
    light = gn.DistantLight(on_sphere(0.6, 1.0), 3.0)
    wo = on_sphere(0.6, 1.0 + PI)
    assert gn.reflected_radiance(gn.IdealSpecular(), light, wo) == 0.0
    both = gn.reflected_radiance(gn.IdealSpecular() + gn.Lambertian(0.5), light, wo)
    assert both == gn.reflected_radiance(gn.Lambertian(0.5), light, wo)


def test_lights_and_lobes_add():
    wo = on_sphere([0.3, 1.0], [0.0, 2.0])
    lights = [gn.DistantLight((1, 1, 1), [1.0, 2.0, 3.0]), gn.ConstantLight(0.5), gn.FunctionLight(lambda w: w[..., 2])]
    terms = [gn.Lambertian([0.1, 0.2, 0.3]), 0.5 * gn.Microfacet(gn.GGX(0.4)), 0.2 * gn.IdealSpecular()]
    whole = gn.reflected_radiance(terms[0] + terms[1] + terms[2], lights, wo)
    parts = sum(np.reshape(gn.reflected_radiance(m, light, wo), (2, -1)) for m in terms for light in lights)
    np.testing.assert_allclose(whole, parts, rtol=2e-4)  # the tolerance: both are integrated adaptively


# Frames.


@pytest.mark.parametrize("seed", range(4))
def test_turning_everything_changes_nothing(seed):
    R = rotation(seed)
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(5, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangent = rng.normal(size=(5, 3))
    wo = normal + 0.7 * rng.normal(size=(5, 3))
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    position = rng.normal(size=(5, 3))

    def lights(turn):
        return [
            gn.DistantLight(turn @ [1.0, 2.0, 3.0], 2.0),
            gn.PointLight(turn @ [3.0, -1.0, 2.0], [1.0, 2.0, 3.0]),
            gn.FunctionLight(lambda w: 1.0 + w @ turn @ [0.5, 0.3, 0.1]),
        ]

    here = gn.reflected_radiance(BRUSHED, lights(np.eye(3)), wo, normal, tangent, position)
    there = gn.reflected_radiance(BRUSHED, lights(R), wo @ R.T, normal @ R.T, tangent @ R.T, position @ R.T)
    assert (here > 0.0).any()
    np.testing.assert_allclose(there, here, rtol=1e-9, atol=1e-12)


def test_tangent_is_the_brushing_direction():
    """Turning the tangent by phi is turning light and viewer by -phi; its length and its normal part do not matter."""
    wi, wo = on_sphere(0.6, 0.4), on_sphere(0.7, 2.9)
    light = gn.DistantLight(wi, PI)
    for phi in (0.0, 0.3, 1.2, PI / 2):
        tangent = np.array([3.0 * math.cos(phi), 3.0 * math.sin(phi), 0.8])
        turned = BRUSHED.f(on_sphere(0.6, 0.4 - phi), on_sphere(0.7, 2.9 - phi)) * PI * wi[2]
        np.testing.assert_allclose(gn.reflected_radiance(BRUSHED, light, wo, tangent=tangent), turned, rtol=1e-12)
    plain = gn.reflected_radiance(BRUSHED, light, wo)
    np.testing.assert_allclose(gn.reflected_radiance(BRUSHED, light, wo, tangent=(1, 0, 0)), plain, rtol=1e-13)
    other = gn.reflected_radiance(BRUSHED, light, wo, tangent=(0, 1, 0))
    assert abs(other / plain - 1.0).max() > 0.1


def test_without_a_tangent_x_turns_with_the_normal():
    """d_x is where the shortest rotation of the world's z into the normal takes the world's x."""
    rng = np.random.default_rng(5)
    for _ in range(6):
        normal = rng.normal(size=3)
        normal[2] = abs(normal[2])
        normal /= np.linalg.norm(normal)
        axis = np.cross(UP, normal)
        turn = around(axis / np.linalg.norm(axis), math.acos(normal[2]))
        wo = normal + 0.5 * rng.normal(size=3)
        wo /= np.linalg.norm(wo)
        light = gn.DistantLight(normal + 0.5 * rng.normal(size=3))
        given = gn.reflected_radiance(BRUSHED, light, wo, normal=normal, tangent=turn @ [1.0, 0.0, 0.0])
        np.testing.assert_allclose(gn.reflected_radiance(BRUSHED, light, wo, normal=normal), given, rtol=1e-9)


def test_normals_of_any_length_and_side():
    """Frames are right-handed and finite everywhere, straight down too."""
    light = gn.FunctionLight(lambda w: 2.0 + w[..., 0])
    for normal in ((0.0, 0.0, -1.0), (0.0, 0.0, -7.0), (1e-9, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, -0.5, -0.8)):
        n = np.array(normal) / np.linalg.norm(normal)
        radiance = gn.reflected_radiance(gn.Lambertian(1.0), light, n, normal=normal)
        # Integral of (2 + w.x) cos(theta)/pi about n: 2 + 2/3 n.x
        assert radiance == pytest.approx(2.0 + 2.0 / 3.0 * n[0], rel=1e-5)


def test_frames_are_right_handed():
    """d_x, d_y, normal, with and without a tangent; no symmetric material would show a mirrored frame."""
    rng = np.random.default_rng(6)
    normal, tangent = rng.normal(size=(2, 50, 3))
    normal[:4] = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [1e-9, 0, -2]]
    for given in (None, tangent):
        t, b, n = (np.stack(axis, -1) for axis in Frame.of_arrays(ops.library(normal), normal, given))
        np.testing.assert_allclose(
            np.stack([t, b, n], -2) @ np.stack([t, b, n], -1), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-12
        )
        np.testing.assert_allclose(np.cross(t, b), n, atol=1e-12)
        np.testing.assert_allclose(n * np.linalg.norm(normal, axis=-1, keepdims=True), normal, atol=1e-12)
        if given is not None:
            assert ((t * given).sum(-1) > 0.0).all()


# Shapes, libraries, gradients.


def test_shapes():
    wo, normal = on_sphere(np.full((4, 1), 0.3), np.full((4, 1), 1.0)), on_sphere(np.full(5, 0.1), 0.0)
    for lights in (gn.DistantLight(), gn.ConstantLight(), [gn.PointLight((0, 0, 5)), gn.ConstantLight()]):
        for m, channels in ((gn.Lambertian(0.5), ()), (gn.Lambertian([0.5]), (1,)), (BRUSHED, (3,))):
            assert gn.reflected_radiance(m, lights, wo, normal).shape == (4, 5, *channels)
            assert gn.reflected_radiance(m, lights, UP).shape == channels
            position = np.zeros((2, 3))
            assert gn.reflected_radiance(m, lights, UP, position=position).shape == (2, *channels)
            map_ = gn.Lambertian(np.full((4, 5, 1), 0.5)) + m
            assert gn.reflected_radiance(map_, lights, UP).shape == (4, 5, *(channels or (1,)))
    for light in (gn.DistantLight(irradiance=[1.0, 2.0, 3.0]), gn.ConstantLight([1.0, 2.0, 3.0])):
        assert gn.reflected_radiance(gn.Lambertian(0.5), light, wo).shape == (4, 1, 3)
    assert gn.reflected_radiance(BRUSHED, gn.ConstantLight(), np.zeros((0, 3))).shape == (0, 3)


def test_maps_are_points():
    """A map of parameters is evaluated texel by texel, under delta lights and fields alike."""
    rho = np.random.default_rng(0).random((3, 2, 1))
    alpha = np.random.default_rng(1).uniform(0.2, 0.9, (3, 2, 1))
    m = gn.Lambertian(rho) + gn.Microfacet(gn.GGX(alpha)) + gn.IdealSpecular(0.2 * rho)
    normal = on_sphere(0.3 * rho[..., 0], alpha[..., 0])
    for lights in (gn.DistantLight((1, 0, 2)), gn.FunctionLight(lambda w: 1.0 + 0.3 * w[..., 0])):
        whole = gn.reflected_radiance(m, lights, UP, normal)
        for i, j in np.ndindex(3, 2):
            r, a = float(rho[i, j, 0]), float(alpha[i, j, 0])
            one = gn.Lambertian(r) + gn.Microfacet(gn.GGX(a)) + gn.IdealSpecular(0.2 * r)
            expected = gn.reflected_radiance(one, lights, UP, normal[i, j])
            assert whole[i, j, 0] == pytest.approx(expected, rel=1e-6)


def test_libraries_agree(library):
    wo, normal = on_sphere([0.2, 0.9], [0.0, 1.0]), on_sphere([0.1, 0.3], [2.0, 0.0])
    lights = [gn.DistantLight((1, 1, 1)), gn.PointLight((0, 1, 2), [1.0, 2.0, 3.0])]
    expected = gn.reflected_radiance(BRUSHED, lights, wo, normal, (0.0, 1.0, 0.0))
    own = library.array(wo)
    if library.name.startswith("drjit"):
        with pytest.raises(ArrayTypeError, match="NumPy, PyTorch or JAX"):
            gn.reflected_radiance(BRUSHED, lights, own, library.array(normal))
        return
    for n in (library.array(normal), normal, normal.tolist()):
        radiance = gn.reflected_radiance(BRUSHED, lights, own, n, (0.0, 1.0, 0.0))
        np.testing.assert_allclose(library.numpy(radiance), expected, rtol=1e-12)
    single = gn.reflected_radiance(BRUSHED, lights, library.array(wo, "float32"), normal, (0.0, 1.0, 0.0))
    assert library.dtype(single) == "float32"
    np.testing.assert_allclose(library.numpy(single), expected, rtol=1e-5)


@pytest.mark.few_by_jax()
def test_libraries_agree_in_even_light(library):
    if library.name.startswith("drjit"):
        return
    wo = on_sphere([0.2, 0.9], [0.0, 1.0])
    whole = gn.reflected_radiance(BRUSHED, gn.ConstantLight(), wo)
    own = gn.reflected_radiance(BRUSHED, gn.ConstantLight(), library.array(wo))
    np.testing.assert_allclose(library.numpy(own), whole, rtol=5e-3)


@pytest.mark.few_by_jax()
@pytest.mark.parametrize("light", [gn.RectangleLight([0, 0, 2], [5, 0, 0], [0, -5, 0]), gn.ConstantLight(2.0)], ids=str)
@pytest.mark.parametrize(
    "m",
    [
        gn.Lambertian(0.2) + 0.5 * gn.IdealSpecular(0.8),
        gn.NormalMapped(gn.IdealSpecular(0.8), 0.2),
        gn.SmoothDielectric(1.5),
        gn.Absorber(0.5),
    ],
    ids=lambda m: type(m).__name__,
)
def test_libraries_see_light_in_delta_lobes(m, light, library):
    if library.name.startswith("drjit"):
        return
    wo = on_sphere([0.2, 0.9, 2.8], [0.0, 1.0, 2.0])
    own = gn.reflected_radiance(m, light, library.array(wo))
    np.testing.assert_allclose(library.numpy(own), gn.reflected_radiance(m, light, wo), rtol=5e-3, atol=1e-12)


def test_derivatives_of_light_in_delta_lobes_that_transmit(torch):
    wo, sky = on_sphere(0.6, 1.0), gn.FunctionLight(lambda w: 1.0 + 0.5 * w[..., 2])
    eta = torch.tensor(1.5, dtype=torch.float64, requires_grad=True)
    gn.reflected_radiance(gn.ThinDielectric(eta), sky, torch.tensor(wo)).backward()
    high, low = (gn.reflected_radiance(gn.ThinDielectric(1.5 + x), sky, wo) for x in (1e-4, -1e-4))
    np.testing.assert_allclose(eta.grad, (high - low) / 2e-4, rtol=5e-3)


@pytest.mark.few_by_jax()
@pytest.mark.parametrize("m", [gn.Lambertian(0.1) + gn.DiffuseTransmission(0.2), gn.RoughDielectric(gn.GGX(0.3), 1.5)])
def test_albedos_of_libraries_are_of_what_comes_back(m, library):
    if library.name.startswith("drjit"):
        return
    wi = on_sphere([0.2, 0.9, 2.5], [0.0, 1.0, 2.0])
    np.testing.assert_allclose(library.numpy(gn.albedo(m, library.array(wi))), gn.albedo(m, wi), atol=3e-3)


def test_gradients_under_delta_lights(torch):
    """dL/drho = E cos(theta)/pi, dL/dI = rho cos(theta)/(pi r^2), dL/dn by differences."""
    rho = torch.tensor([0.2, 0.5, 0.7], dtype=torch.float64, requires_grad=True)
    power = torch.tensor(3.0, dtype=torch.float64, requires_grad=True)
    normal = torch.tensor([0.1, 0.2, 0.9], dtype=torch.float64, requires_grad=True)
    wo = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    lights = [gn.DistantLight((0.0, 0.6, 0.8), 2.0), gn.PointLight((0.0, 0.0, 2.0), power)]
    gn.reflected_radiance(gn.Lambertian(rho), lights, wo).sum().backward()
    np.testing.assert_allclose(rho.grad, (2.0 * 0.8 + 3.0 / 4.0) / PI, rtol=1e-12)
    np.testing.assert_allclose(power.grad, 1.4 / 4.0 / PI, rtol=1e-12)

    m = gn.Microfacet(gn.GGX(0.3), 0.8)
    light = gn.DistantLight((0.0, 0.6, 0.8), 2.0)
    gn.reflected_radiance(m, light, wo, normal).backward()
    h = 1e-6
    for i in range(3):
        step = np.eye(3)[i] * h
        n = normal.detach().numpy()
        above, below = (gn.reflected_radiance(m, light, UP, n + s) for s in (step, -step))
        assert normal.grad[i] == pytest.approx((above - below) / (2.0 * h), rel=1e-6)


# Bad input.


@pytest.mark.parametrize("lights", [1.0, "sun", [], [1.0], gn.Lambertian(), [gn.DistantLight(), gn.Lambertian()], None])
def test_things_that_are_no_lights(lights):
    with pytest.raises(ParameterError, match="lights"):
        gn.reflected_radiance(gn.Lambertian(0.5), lights, UP)


def test_bad_frames():
    m, light = gn.Lambertian(0.5), gn.DistantLight()
    with pytest.raises(ParameterError, match="normal"):
        gn.reflected_radiance(m, light, UP, normal=(0.0, 0.0, 0.0))
    for tangent in ((0.0, 0.0, 2.0), (0.0, 0.0, 0.0)):
        with pytest.raises(ParameterError, match="tangent"):
            gn.reflected_radiance(m, light, UP, tangent=tangent)
    for bad in ({"wo": [0.0, 1.0]}, {"wo": UP, "normal": [0.0, 1.0]}, {"wo": UP, "position": np.zeros((2, 2))}):
        with pytest.raises(ShapeError):
            gn.reflected_radiance(m, light, **bad)
    with pytest.raises(ShapeError, match="broadcast"):
        gn.reflected_radiance(m, light, np.zeros((4, 3)), np.ones((5, 3)))
    with pytest.raises(ShapeError, match="FunctionLight"):
        gn.reflected_radiance(m, gn.FunctionLight(lambda w: w[..., :1, 0]), UP)


def test_nan_directions_give_nan():
    for light in (gn.DistantLight(), gn.PointLight((0, 0, 1)), gn.ConstantLight()):
        for bad in ({"wo": [0.0, math.nan, 1.0]}, {"wo": UP, "normal": [math.nan, 0.0, 1.0]}):
            assert np.isnan(gn.reflected_radiance(gn.Lambertian(0.5), light, **bad))
