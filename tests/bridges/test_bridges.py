"""Materials inside PyTorch and JAX: modules and pytrees."""

import numpy as np
import pytest

import gonio as gn
from gonio.errors import NotFoundError


def material():
    return gn.Lambertian([0.1, 0.2, 0.3]) + 0.5 * gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))


def test_jax_pytrees_pass_through_grad_and_jit():
    jax = pytest.importorskip("jax")
    import gonio.bridges.jax  # noqa: F401  (materials become pytrees)

    m = material()
    leaves, structure = jax.tree.flatten(m)
    assert len(leaves) == len(m.parameters)
    assert repr(jax.tree.unflatten(structure, leaves)) == repr(m)
    wi, wo = jax.numpy.array([0.6, 0.0, 0.8]), jax.numpy.array([-0.48, 0.36, 0.8])

    def brightness(m):
        return m.f(wi, wo).sum()

    gradient = jax.grad(lambda m: jax.jit(brightness)(m))(m)
    assert gradient.terms[0].rho.shape == (3,)
    np.testing.assert_allclose(gradient.terms[0].rho, 1.0 / np.pi, rtol=1e-6)
    h = 1e-3
    above = m.replace({"1.of.distribution.alpha_x": 0.3 + h}).f(np.array(wi, float), np.array(wo, float)).sum()
    below = m.replace({"1.of.distribution.alpha_x": 0.3 - h}).f(np.array(wi, float), np.array(wo, float)).sum()
    np.testing.assert_allclose(gradient.terms[1].of.distribution.alpha_x, (above - below) / (2 * h), rtol=2e-3)


def test_torch_modules_train_and_keep_their_bounds():
    torch = pytest.importorskip("torch")
    from gonio.bridges.torch import Material

    m = material()
    wi, wo = torch.tensor([[0.6, 0.0, 0.8]]), torch.tensor([[-0.48, 0.36, 0.8]])
    goal = m.replace({"0.rho": [0.4, 0.1, 0.2]}).f(wi, wo)
    module = Material(m, ["0.rho"])
    assert set(module.state_dict()) == {"0_rho"}
    optimizer = torch.optim.Adam(module.parameters(), lr=0.05)
    for _ in range(200):
        optimizer.zero_grad()
        loss = ((module(wi, wo) - goal) ** 2).sum()
        loss.backward()
        optimizer.step()
        module.clamp_()
    np.testing.assert_allclose(module.reflectance.terms[0].rho.detach(), [0.4, 0.1, 0.2], atol=2e-3)
    with torch.no_grad():
        next(module.parameters()).fill_(7.0)
    module.clamp_()
    assert float(module.reflectance.terms[0].rho.detach().max()) == 1.0
    with pytest.raises(NotFoundError, match="known: "):
        Material(m, ["rho"])
