"""Facet normals of retro-reflection: power iteration gives back the facets that made it."""

from __future__ import annotations

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.authoring import Direction
from gonio.errors import ParameterError, ShapeError

W = Direction(*np.moveaxis(gn.direction(np.linspace(0.0, 1.4, 80)[:, None], np.linspace(0.0, 6.0, 7)), -1, 0))
POLE = Direction(0.0, 0.0, 1.0)


FACETS = [
    *(*map(gn.GGX, (0.05, 0.3, 0.8)), *map(gn.Beckmann, (0.05, 0.3)), gn.GTR(0.2, 3.0)),
    *(gn.GGX(0.1, 0.4), gn.Beckmann(0.5, 0.2)),
]


@pytest.mark.parametrize("facets", thinned(FACETS, [FACETS[k] for k in (0, 2, 4, 5, 6)]), ids=repr)
def test_facets_come_back(facets):
    found = gn.reconstruction.retro_facets(gn.Microfacet(facets, gn.Schlick([0.9, 0.05])))
    np.testing.assert_allclose(found.F0, [0.9, 0.05], rtol=1e-3)
    assert np.abs(found.facets.D(W) - facets.D(W)).max() < 2e-3 * float(facets.D(POLE))
    anisotropic = facets.slope_spread is not None and facets.slope_spread.alpha_x != facets.slope_spread.alpha_y
    assert isinstance(found.facets, gn.TabulatedAnisotropicFacets) == anisotropic
    if isinstance(facets, (gn.GGX, gn.Beckmann)):
        guess = (found.ggx if isinstance(facets, gn.GGX) else found.beckmann).distribution
        assert [guess.alpha_x, guess.alpha_y] == pytest.approx([facets.alpha_x, facets.alpha_y], rel=2e-2)


def test_the_model_is_right_elsewhere_too():
    true = gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.5))
    model = gn.reconstruction.retro_facets(true).model
    wi, wo = gn.direction([0.2, 0.9], [0.0, 1.0]), gn.direction([0.8, 1.2], [2.0, 3.0])
    np.testing.assert_allclose(model.f(wi, wo), true.f(wi, wo), rtol=2e-3)


def test_a_diffuse_part_is_taken_off_and_suspected_otherwise():
    paint = gn.Lambertian([0.5, 0.2]) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))
    found = gn.reconstruction.retro_facets(paint, diffuse=[0.5, 0.2])
    np.testing.assert_allclose(found.F0, 0.04, rtol=2e-3)
    assert found.ggx.parameters["1.distribution.alpha_x"].value == pytest.approx(0.2, rel=5e-3) and not found.notes
    wi, wo = gn.direction([0.2, 0.9], [0.0, 1.0]), gn.direction([0.8, 1.2], [2.0, 3.0])
    np.testing.assert_allclose(found.model.f(wi, wo), paint.f(wi, wo), rtol=2e-3)
    assert any("diffuse" in note for note in gn.reconstruction.retro_facets(paint).notes)
    assert any("below the diffuse part" in note for note in gn.reconstruction.retro_facets(paint, diffuse=0.4).notes)


def test_directions_decide_unless_told():
    brushed = gn.Microfacet(gn.GGX(0.1, 0.4))
    even = gn.reconstruction.retro_facets(brushed, isotropic=True)
    assert isinstance(even.facets, gn.TabulatedFacets) and 0.1 < even.ggx.distribution.alpha_x < 0.4
    uneven = gn.reconstruction.retro_facets(gn.Microfacet(gn.GGX(0.3)), isotropic=False)
    assert isinstance(uneven.facets, gn.TabulatedAnisotropicFacets)


def test_gaps_are_filled_and_told():
    class Gaps(gn.Reflectance):
        def formula(self, wi, wo):
            f = gn.Microfacet(gn.GGX(0.3)).formula(wi, wo)
            return gn.authoring.ops.where((wi.z > 0.8) & (wi.z < 0.82), np.nan, f)

    found = gn.reconstruction.retro_facets(Gaps())
    assert found.ggx.distribution.alpha_x == pytest.approx(0.3, rel=1e-2)
    assert any("no number" in note for note in found.notes)


@pytest.mark.parametrize("alpha", [0.1, 0.5])
def test_the_published_masking(alpha):
    """f(w, w) = F0 D G1/(4 cos^2), made from the closed forms of GGX."""
    ggx = gn.GGX(alpha)

    class Same(gn.Reflectance):
        def formula(self, wi, wo):
            wm = gn.authoring.normalize(Direction(wi.x + wo.x, wi.y + wo.y, wi.z + wo.z))
            return 0.3 * ggx.D(wm) / (4.0 * wi.z * ggx.projected_area(wo))

    found = gn.reconstruction.retro_facets(Same(), masking="view")
    np.testing.assert_allclose(found.F0, 0.3, rtol=1e-3)
    assert found.ggx.distribution.alpha_x == pytest.approx(alpha, rel=5e-3)
    assert gn.reconstruction.retro_facets(Same()).ggx.distribution.alpha_x != pytest.approx(alpha, rel=5e-3)


def test_it_is_a_start_for_fits():
    true = gn.Microfacet(gn.GGX(0.07), gn.Schlick(0.3))
    guess = gn.reconstruction.retro_facets(true).ggx
    fit = gn.fit(true, guess, starts=1)
    assert fit.model.distribution.alpha_x == pytest.approx(0.07, rel=1e-4)


def test_bad_data_are_refused():
    with pytest.raises(ParameterError, match="nothing comes back"):
        gn.reconstruction.retro_facets(gn.Lambertian(0.0))
    with pytest.raises(ParameterError, match="beside the diffuse part"):
        gn.reconstruction.retro_facets(gn.Lambertian(0.5), diffuse=0.6)
    with pytest.raises(ShapeError, match="diffuse"):
        gn.reconstruction.retro_facets(gn.Lambertian(0.5), diffuse=[0.1, 0.2])
    with pytest.raises(ParameterError, match="diffuse"):
        gn.reconstruction.retro_facets(gn.Lambertian(0.5), diffuse=-0.2)
    with pytest.raises(ShapeError, match="no map"):
        gn.reconstruction.retro_facets(gn.Lambertian(np.full((4, 4, 1, 1), 0.5)))
    with pytest.raises(ParameterError, match="masking"):
        gn.reconstruction.retro_facets(gn.Lambertian(0.5), masking="smith")
    with pytest.raises(ParameterError, match="mirror"):
        gn.reconstruction.retro_facets(gn.IdealSpecular())
