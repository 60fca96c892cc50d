"""Kernels: one set for what has one side and for what light goes through."""

import numpy as np
import pytest

import gonio as gn
from gonio.base import kernels
from gonio.base.sides import hemispheres, lit_sides, refuse_transmission
from gonio.base.sums import drawn_apart, lets_through, lobes_on
from gonio.errors import ParameterError
from gonio.evaluate.tracing import traced
from gonio.numerics.lattice import lattice

GLASS, MATT, MIRROR = gn.RoughDielectric(gn.GGX(0.3), 1.5), gn.Lambertian(0.4), gn.IdealSpecular(0.1)
VIEW = gn.direction(0.7, 0.4)


def sphere(n: int) -> np.ndarray:
    w = np.random.default_rng(2).normal(size=(n, 3))
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


@pytest.mark.parametrize("of", [MATT, MATT + MIRROR, gn.Coated(MATT), gn.Microfacet(gn.GGX(0.2, 0.4)) + MATT], ids=repr)
@pytest.mark.parametrize("numbers", [2, 3])
def test_what_has_one_side_is_black_behind(of, numbers):
    """It is a material of two sides whose back is black: f, pdf, samples and mirrors are the same to rounding."""
    both, wi, wo = gn.TwoSided(of, gn.Lambertian(0.0)), sphere(400), sphere(800)[400:]
    for name in ("f", "mueller"):
        np.testing.assert_allclose(getattr(both, name)(wi, wo), getattr(of, name)(wi, wo), rtol=1e-12, atol=1e-300)
    up = np.abs(wo)
    np.testing.assert_allclose(both.delta_reflectance(wo), of.delta_reflectance(wo), rtol=1e-12)
    u = lattice(400, numbers)
    s, t = both.sample(up, u), of.sample(up, u)
    same = np.isclose(s.pdf, t.pdf, rtol=1e-3).mean()
    assert same > 0.99  # the estimate of the black back chooses it once in a million


@pytest.mark.parametrize("m", [GLASS + MATT, MATT + GLASS], ids=repr)
def test_a_lobe_that_shares_its_draw_stands_alone_without_the_other(m):
    """What a glass reflects, by itself and beside others: its samples find its albedo, and have its density."""
    front = lobes_on(m, "front")
    s = front.sample(np.broadcast_to(VIEW, (1 << 14, 3)), lattice(1 << 14))
    assert s.weight.mean() == pytest.approx(gn.albedo(front, VIEW), rel=3e-3)
    np.testing.assert_allclose(front.pdf(s.wi, VIEW), s.pdf, rtol=1e-9)


def test_answers_for_either_kind():
    assert hemispheres(MATT) == (1.0,)
    assert hemispheres(GLASS) == hemispheres(gn.Absorber(0.5)) == hemispheres(gn.TwoSided()) == (1.0, -1.0)
    assert lit_sides(MATT) == ("front",)
    assert lit_sides(GLASS) == ("front", "across")
    assert lit_sides(gn.Absorber(0.5)) == ("across",)
    assert [lets_through(m) for m in (MATT, gn.TwoSided(), GLASS, gn.Absorber(0.5), gn.Sheet())] == [False] * 2 + [
        True
    ] * 3
    assert [lobe for _, lobe in drawn_apart(MATT + MIRROR)] == [MATT, MIRROR]
    assert list(drawn_apart(GLASS)) == [(1.0, GLASS)]
    for sides, back in (("front", True), ("across", False), ("across", True)):
        assert not list(lobes_on(MATT, sides, back).lobes())
    refuse_transmission(MATT, "fine")
    with pytest.raises(ParameterError, match="not through this"):
        refuse_transmission(GLASS, "not through this")


def test_the_turn_folds_away_for_what_has_one_side():
    """The kernel of a Lambertian surface: NaN of two directions, two comparisons and a mask, and its formula."""
    assert traced(kernels.F, MATT, None).operations <= 25
