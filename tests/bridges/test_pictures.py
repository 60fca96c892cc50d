"""Pictures inside PyTorch and JAX: gradients against differences of pictures, and what has none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import ArrayTypeError, ParameterError
from gonio.formula import tree

STUDIO = gn.EnvironmentLight.studio(height=32)
LIGHTS = {
    "studio": ("scale", STUDIO),
    "sky": ("radiance", gn.ConstantLight(1.0)),
    "sun": ("irradiance", gn.DistantLight([0.3, -1.0, 0.5], [3.0, 2.0, 1.0])),
}
START = {"alpha": 0.35, "eta": 1.5, "rho": np.array([0.1, 0.3, 0.6]), "light": 1.5}
MANY = {"size": 24, "samples": 4096}
FEW = {"size": 16, "samples": 64}
WEIGHTS = np.random.default_rng(4).random((12, 12, 3)).astype(np.float32)
INSIDE = np.s_[6:18, 6:18]
"""At the edge of a sphere rough dielectrics take many more samples."""


@pytest.fixture
def torch() -> Any:
    return pytest.importorskip("torch")


@pytest.fixture
def jax() -> Any:
    return pytest.importorskip("jax")


def made(light: str, numbers: dict[str, Any]) -> tuple[gn.Reflectance, list[Any]]:
    """A material and its light of these numbers, by name."""
    m = gn.Lambertian(numbers["rho"]) + gn.Microfacet(gn.GGX(numbers["alpha"]), gn.Dielectric(numbers["eta"]))
    name, start = LIGHTS[light]
    return m, [start.replace({name: numbers["light"]}), gn.ConstantLight(0.1)]


def differences(light: str) -> dict[str, np.ndarray]:
    """Of the weighted mean of pictures, by each number."""

    def mean(numbers: dict[str, Any]) -> float:
        return float((gn.render(*made(light, numbers), **MANY).pixels[INSIDE].astype(float) * WEIGHTS).mean())

    found = {}
    for name, value in START.items():
        h = {"alpha": 0.04, "eta": 0.05}.get(name, 0.1)
        steps = h * np.eye(np.size(value)).reshape(-1, *np.shape(value))
        found[name] = np.reshape(
            [(mean(START | {name: value + s}) - mean(START | {name: value - s})) / (2 * h) for s in steps],
            np.shape(value),
        )
    return found


@pytest.mark.parametrize("light", thinned(LIGHTS, ["sun"]))
def test_gradients_are_those_of_differences(light, torch, jax):
    """Within 1 %, of an environment, a sky and a sun; both libraries give the same, within jit too."""
    import gonio.bridges.jax
    import gonio.bridges.torch

    numbers = {name: torch.tensor(x, dtype=torch.float64, requires_grad=True) for name, x in START.items()}
    picture = gonio.bridges.torch.render(*made(light, numbers), **MANY)
    np.testing.assert_allclose(picture.detach(), gn.render(*made(light, START), **MANY).pixels, rtol=1e-5, atol=1e-6)
    (picture[INSIDE] * torch.from_numpy(WEIGHTS)).mean().backward()

    def mean(numbers: dict[str, Any]) -> Any:
        return (gonio.bridges.jax.render(*made(light, numbers), **MANY)[INSIDE] * WEIGHTS).mean()

    slopes = jax.jit(jax.grad(mean))({name: jax.numpy.asarray(x) for name, x in START.items()})
    for name, expected in differences(light).items():
        assert numbers[name].grad.dtype == torch.float64
        assert numbers[name].grad.shape == expected.shape
        np.testing.assert_allclose(numbers[name].grad, expected, rtol=1e-2, err_msg=name)
        np.testing.assert_allclose(slopes[name], numbers[name].grad, rtol=1e-5, err_msg=name)


def test_by_the_direction_of_a_light(torch):
    """Through the length that it loses on the way."""
    from gonio.bridges.torch import render

    m, start = gn.Lambertian(0.5) + gn.Microfacet(gn.GGX(0.5), 0.5), np.array([0.3, -2.0, 0.5])
    at = torch.tensor(start, requires_grad=True)
    render(m, gn.DistantLight(at), **MANY)[INSIDE].mean().backward()
    means = [
        gn.render(m, gn.DistantLight(start + s), **MANY).pixels[INSIDE].astype(float).mean()
        for s in (*(0.02 * np.eye(3)), *(-0.02 * np.eye(3)))
    ]
    np.testing.assert_allclose(at.grad, np.subtract(means[:3], means[3:]) / 0.04, rtol=1e-2, atol=1e-4)


def test_by_each_wavelength_of_what_becomes_colours(torch, jax):
    """The picture of a matt sphere is linear in its albedo: the gradient is the difference."""
    import gonio.bridges.jax
    import gonio.bridges.torch

    bands, light = np.linspace(420.0, 680.0, 5), gn.ConstantLight(gn.spectra.illuminant("A"))
    start = np.linspace(0.2, 0.6, 5)
    weights = np.random.default_rng(4).random((16, 16, 3)).astype(np.float32)

    def mean(rho: np.ndarray) -> float:
        m = gn.Lambertian(rho, wavelengths=bands)
        return float((gn.render(m, light, **FEW).pixels.astype(float) * weights).mean())

    expected = [(mean(start + s) - mean(start - s)) / 0.2 for s in 0.1 * np.eye(5)]
    rho = torch.tensor(start, requires_grad=True)
    picture = gonio.bridges.torch.render(gn.Lambertian(rho, wavelengths=bands), light, **FEW)
    (picture * torch.from_numpy(weights)).mean().backward()
    np.testing.assert_allclose(rho.grad, expected, rtol=1e-3, atol=1e-6)

    def of_jax(rho: Any) -> Any:
        m = gn.Lambertian(rho, wavelengths=bands)
        return (gonio.bridges.jax.render(m, light, **FEW) * weights).mean()

    np.testing.assert_allclose(jax.grad(of_jax)(jax.numpy.asarray(start)), rho.grad, rtol=1e-5)


LAMPS = [gn.DistantLight([0.5, -1.0, 0.5], 2.0), gn.ConstantLight(0.2)]
GOAL = gn.Lambertian([0.5, 0.2, 0.1]) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))


def test_torch_recovers_the_material_of_a_picture(torch):
    """The roughness and the colour of a picture that was made with another seed."""
    from gonio.bridges.torch import Material, render

    goal = torch.from_numpy(gn.render(GOAL, LAMPS, size=24, samples=1024, seed=1).pixels)
    start = GOAL.replace({"0.rho": [0.3, 0.3, 0.3], "1.distribution.alpha_x": 0.5})
    module = Material(start, ["0.rho", "1.distribution.alpha_x"])
    optimizer = torch.optim.Adam(module.parameters(), lr=0.03)
    for _ in range(120):
        optimizer.zero_grad()
        ((render(module.reflectance, LAMPS, size=24, samples=64) - goal) ** 2).mean().backward()
        optimizer.step()
        module.clamp_()
    found = module.reflectance.parameters
    np.testing.assert_allclose(found["0.rho"].value.detach(), [0.5, 0.2, 0.1], atol=0.01)
    assert found["1.distribution.alpha_x"].value.item() == pytest.approx(0.2, abs=0.01)


def test_jax_recovers_the_material_of_a_picture(jax):
    """The same, by Gauss and Newton's steps from jax.jacfwd."""
    from gonio.bridges.jax import render

    goal = gn.render(GOAL, LAMPS, size=24, samples=1024, seed=1).pixels

    @jax.jit
    def residual(x: Any) -> Any:
        m = tree.with_values(GOAL, {"0.rho": x[:3], "1.distribution.alpha_x": x[3]})
        return (render(m, LAMPS, size=24, samples=64) - goal).ravel()

    x = jax.numpy.array([0.3, 0.3, 0.3, 0.4])
    for _ in range(8):
        step = jax.numpy.linalg.lstsq(jax.jacfwd(residual)(x), residual(x))[0]
        x = jax.numpy.clip(x - step, 0.01, 1.0)
    np.testing.assert_allclose(x, [0.5, 0.2, 0.1, 0.2], atol=0.01)


def test_what_needs_no_gradient_is_the_picture_of_render(torch, jax):
    from gonio.bridges.jax import render as by_jax
    from gonio.bridges.torch import render

    plain = gn.render(gn.Lambertian(0.5), STUDIO, **FEW).pixels
    for rho in (0.5, torch.tensor(0.5), torch.tensor(0.5, requires_grad=True)):
        with torch.no_grad():
            found = render(gn.Lambertian(rho), STUDIO, **FEW)
        assert not found.requires_grad
        assert found.dtype == torch.float32
        np.testing.assert_array_equal(found, plain)
    np.testing.assert_array_equal(by_jax(gn.Lambertian(jax.numpy.asarray(0.5)), STUDIO, **FEW), plain)
    np.testing.assert_array_equal(jax.jit(lambda x: by_jax(gn.Lambertian(x), STUDIO, **FEW))(0.5), plain)
    assert by_jax(gn.Lambertian(0.5), STUDIO, **FEW).dtype == np.float32


def test_one_tensor_in_several_places_gets_the_sum(torch):
    from gonio.bridges.torch import render

    x = torch.tensor(0.4, requires_grad=True)
    picture = render(gn.Lambertian(x), gn.ConstantLight(x), **FEW)
    (slope,) = torch.autograd.grad(picture[8, 8, 0], x)
    assert slope.item() == pytest.approx(0.8, rel=1e-4)


def test_maps_of_functions_of_pictures(torch, jax):
    """JAX maps and pushes forward; PyTorch has gradients of functions, and says that it does not map."""
    from gonio.bridges.jax import render as by_jax
    from gonio.bridges.torch import render

    def bright(x: Any, render: Any = by_jax) -> Any:
        return render(gn.Lambertian(x), gn.ConstantLight(2.0), **FEW)[8, 8, 0]

    xs = jax.numpy.array([0.25, 0.5])
    np.testing.assert_allclose(jax.vmap(bright)(xs), [0.5, 1.0], rtol=1e-5)
    np.testing.assert_allclose(jax.vmap(jax.grad(bright))(xs), [2.0, 2.0], rtol=1e-5)
    np.testing.assert_allclose(jax.jvp(bright, (0.5,), (3.0,)), [1.0, 6.0], rtol=1e-5)
    one = torch.func.grad(lambda x: bright(x, render))
    assert one(torch.tensor(0.5)).item() == pytest.approx(2.0, rel=1e-5)
    with pytest.raises(RuntimeError, match="vmap"):
        torch.func.vmap(one)(torch.tensor([0.25, 0.5]))


def test_second_derivatives_are_refused(torch, jax):
    from gonio.bridges.jax import render as by_jax
    from gonio.bridges.torch import render

    x = torch.tensor(0.5, requires_grad=True)
    (slope,) = torch.autograd.grad(render(gn.Lambertian(x), STUDIO, **FEW).sum(), x, create_graph=True)
    with pytest.raises(RuntimeError, match="does not require grad"):
        slope.backward()
    with pytest.raises(ValueError, match="Pure callbacks do not support JVP"):
        jax.grad(jax.grad(lambda x: by_jax(gn.Lambertian(x), STUDIO, **FEW).sum()))(0.5)


def test_what_has_no_derivative(torch, jax):
    from gonio.bridges.jax import render as by_jax
    from gonio.bridges.torch import render

    matt = gn.Lambertian(torch.tensor(0.5, requires_grad=True))
    with pytest.raises(ParameterError, match="FunctionLight is a function of arrays"):
        render(matt, gn.FunctionLight(lambda w: w[..., 0]), **FEW)
    lamp = gn.SphereLight([0.0, -3.0, 3.0], torch.tensor(0.5, requires_grad=True))
    with pytest.raises(ParameterError, match="SphereLight has edges"):
        render(gn.Lambertian(0.5), lamp, **FEW)
    with pytest.raises(ParameterError, match="SphereLight has edges"):
        jax.grad(lambda r: by_jax(gn.Lambertian(0.5), gn.SphereLight([0.0, -3.0, 3.0], r), **FEW).sum())(0.5)
    texels = torch.full((4, 4), 0.5, requires_grad=True)
    with pytest.raises(ParameterError, match="rho is a texture"):
        render(gn.Lambertian(gn.Texture(texels)), STUDIO, **FEW)
    with torch.no_grad():
        assert render(gn.Lambertian(gn.Texture(texels)), STUDIO, **FEW).shape == (16, 16, 3)
    with pytest.raises(ParameterError, match="out of bounds"):
        render(gn.Microfacet(gn.GGX(torch.tensor(-0.1, requires_grad=True)), 0.9), STUDIO, **FEW)
    with pytest.raises(ParameterError, match="samples=0"):
        render(matt, STUDIO, samples=0)


def test_pictures_of_arrays_say_where_derivatives_are(torch, jax):
    for x, name in ((torch.tensor(0.5), "torch"), (jax.numpy.asarray(0.5), "jax")):
        with pytest.raises(ArrayTypeError, match=f"gonio.bridges.{name}.render"):
            gn.render(gn.Lambertian(x), STUDIO, **FEW)
        with pytest.raises(ArrayTypeError, match=f"gonio.bridges.{name}.render"):
            gn.scenes.picture_jacobian(gn.Lambertian(x), STUDIO, by="rho", **FEW)
