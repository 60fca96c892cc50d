"""Lights of PyTorch and JAX arrays: radiance is differentiated by where they are and how strong."""

from __future__ import annotations

import numpy as np
import pytest
from house import PAINT

import gonio as gn

WO = [0.0, 0.6, 0.8]
KINDS = {"distant": (gn.DistantLight, [0.1, 0.3, 1.0]), "point": (gn.PointLight, [0.5, 0.3, 2.0])}


def slopes(kind, place, strength):
    """Central differences of the summed radiance, by each coordinate."""

    def total(p):
        return gn.reflected_radiance(PAINT, kind(p, strength), WO).sum()

    return [(total(place + h) - total(place - h)) / 2e-6 for h in 1e-6 * np.eye(3)]


@pytest.mark.parametrize("name", KINDS)
def test_torch_differentiates_by_lights(torch, name):
    kind, place = KINDS[name]
    strength = np.array([1.0, 2.0, 3.0])
    at, power = (torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in (place, strength))
    for wo in (WO, np.array(WO), torch.tensor(WO, dtype=torch.float64)):
        L = gn.reflected_radiance(PAINT, kind(at, power), wo)
        by_place, by_power = torch.autograd.grad(L.sum(), (at, power))
        expected = gn.reflected_radiance(PAINT, kind(place, strength), WO)
        np.testing.assert_allclose(L.detach(), expected, rtol=1e-12)
        np.testing.assert_allclose(by_place, slopes(kind, np.array(place), strength), rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(by_power, expected / strength, rtol=1e-12)


def test_jax_differentiates_by_lights(jax):
    grad = jax.grad(lambda p: gn.reflected_radiance(PAINT, gn.DistantLight(p, 1.0), jax.numpy.array(WO)).sum())
    place = np.array([0.1, 0.3, 1.0])
    np.testing.assert_allclose(grad(jax.numpy.array(place)), slopes(gn.DistantLight, place, 1.0), rtol=1e-6)


def test_pictures_and_integrals_take_the_values_alone(torch):
    at = torch.tensor([0.0, 0.3, 1.0], dtype=torch.float64, requires_grad=True)
    light, plain = gn.DistantLight(at, torch.tensor(2.0)), gn.DistantLight([0.0, 0.3, 1.0], 2.0)
    pictures = [gn.render(PAINT, x, size=8, samples=2).pixels for x in (light, plain)]
    np.testing.assert_allclose(*pictures, rtol=1e-6)
    np.testing.assert_allclose(*(gn.reflectance(PAINT, sky=x) for x in (light, plain)), rtol=1e-6)
    for wrong in (torch.zeros(3), torch.zeros(2), torch.tensor([0.0, 0.0, float("nan")]), torch.zeros(3) * 1j):
        with pytest.raises(gn.errors.ParameterError, match="expected three"):
            gn.DistantLight(wrong)
