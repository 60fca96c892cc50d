"""Matrices of layers: conservation, reciprocity, closed forms of slabs, true shares of facets, a real file's series."""

import math

import numpy as np
import pytest
from layered_walk import Rough, walked
from libraries import thinned
from places import real

import gonio as gn
from gonio.layers import adding, facets, interfaces, media
from gonio.layers.base import LEAST, NodePairs, _series
from gonio.layers.grid import NodeGrid, grid

TWO_FLUX = NodeGrid(np.array([0.75]), np.array([0.5]), ((1.0, 1),))
"""One node, at cosine 1/2, with the etendue of the whole hemisphere."""


def shares(matrices, first, second):
    """What light from each node of either side becomes, in all."""
    above = (first @ matrices.above[0] + second @ matrices.down[0]) / first
    below = (second @ matrices.below[0] + first @ matrices.up[0]) / second
    return above, below


@pytest.mark.parametrize(("depth", "g"), [(1e-3, 0.0), (1.0, 0.5), (8.0, -0.7), (50.0, 0.9), (1e5, 0.0)])
def test_media_lose_no_light_where_particles_absorb_none(depth, g):
    nodes = grid([1.0], 48)
    slab, *_ = media.slab(nodes, 1.0, (depth, 1.0, g), range(1), 90)
    above, below = shares(slab, nodes.root(1.0), nodes.root(1.0))
    np.testing.assert_allclose(above, 1.0, atol=2e-8)
    np.testing.assert_allclose(below, 1.0, atol=2e-8)


def test_slabs_of_one_cosine_are_kubelka_and_munks():
    # Kubelka 1948, J. Opt. Soc. Am. 38:448: R and T of a layer over nothing, by hyperbolic functions.
    K, S = 0.3, 3.0
    a = 1.0 + K / S
    b = math.sqrt(a * a - 1.0)
    whole = a * math.sinh(b * S) + b * math.cosh(b * S)
    depth = 0.5 * K + S
    slab, *_ = media.slab(TWO_FLUX, 1.0, (depth, S / depth, 0.0), range(1), 1)
    np.testing.assert_allclose(slab.above, math.sinh(b * S) / whole, rtol=1e-13)
    np.testing.assert_allclose(slab.down, b / whole, rtol=1e-13)


def test_slabs_add_up():
    nodes = grid([1.0, 1.5], 16)
    thin, thick = (media.slab(nodes, 1.5, (depth, 0.9, 0.6), range(8), 20)[0] for depth in (0.7, 2.1))
    twice = adding.added(thin, adding.added(thin, thin))
    for one, other in zip(twice, thick, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)  # of eigenvectors: 1.1e-11 on AVX2, 3.6e-11 on AVX-512


@pytest.mark.parametrize(
    ("depth", "albedo", "g"), [(0.003, 1.0, 0.9), (1e6, 1.0, 0.0), (50.0, 0.7, -0.9), (2.0, 0.0, 0.5)]
)
def test_slabs_by_eigenvectors_are_those_by_doubling(depth, albedo, g):
    nodes = grid([1.0], 48)
    found = [media.slab(nodes, 1.0, (number, albedo, g), range(3), 90)[0] for number in (depth, depth + 0j)]
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=2e-11)


@pytest.mark.parametrize("eta", [1.5, 1.0 / 1.5, 2.4])
def test_smooth_interfaces_lose_no_light(eta):
    nodes = grid([1.0, eta], 16)
    found = interfaces.smooth_matrices(nodes, 1.0, eta)
    for share in shares(found, nodes.root(1.0), nodes.root(eta)):
        np.testing.assert_allclose(share, 1.0, rtol=1e-13)
    cos = nodes.mu(1.0)
    np.testing.assert_allclose(np.diag(found.above[0]), gn.Dielectric(eta).F(cos), atol=1e-14)


INTERFACES = [(1.5, 0.1, 1), (1.33, 0.4, 1), (1.0 / 1.5, 0.2, 1), (1.0 / 1.5, 0.2, 8), (2.0, 1.0, 1)]


@pytest.mark.parametrize(("eta", "alpha", "every"), thinned(INTERFACES, [*INTERFACES[:2], *INTERFACES[3:]]))
def test_rough_interfaces_reflect_as_facets_do_and_keep_all_light_if_asked(eta, alpha, every):
    """Albedos at every so many of the nodes."""
    nodes = grid([1.0, eta], 64)
    found, once = interfaces.rough(nodes, 1.0, eta, alpha, kept=True)(range(2))
    root, other = nodes.root(1.0), nodes.root(eta)
    for share in shares(found, root, other):
        np.testing.assert_allclose(share, 1.0, atol=1e-12)
    w = gn.direction(np.arccos(nodes.mu(1.0)), 0.0)
    model = gn.Microfacet(gn.GGX(alpha), gn.Dielectric(eta), "separable")
    steep = np.flatnonzero(nodes.mu(1.0) > 0.03)[::every]
    exact = gn.albedo(model, w[steep], tolerance=1e-6)
    np.testing.assert_allclose(((root @ once.above[0]) / root)[steep], exact, atol=1e-5)
    for matrix in (found.above, found.below):
        np.testing.assert_array_equal(matrix, matrix.swapaxes(1, 2))
    np.testing.assert_array_equal(found.up, found.down.swapaxes(1, 2))


@pytest.mark.parametrize("alpha", thinned([0.15, 0.4], [0.4]))
def test_what_facets_transmit_is_what_their_lobe_holds(alpha):
    nodes = grid([1.0, 1.5], 128)
    wanted = facets.shares(nodes.mu(1.0), 1.5, alpha)[1]
    rng = np.random.default_rng(3)
    for cos in (0.995, 0.54, 0.009):
        number = int(np.abs(nodes.mu(1.0) - cos).argmin())
        mu = nodes.mu(1.0)[number]
        _, down = walked([Rough(1.5, alpha)], None, gn.direction(math.acos(mu), 0.0), 200_000, rng)
        share = len(down) / 200_000
        assert abs(share - wanted[number]) < 4.5 * math.sqrt(share * (1.0 - share) / 200_000)


def test_fourier_coefficients_are_those_of_layerlabs_rough_gold():
    """At the file's own nodes. Beside Walter's facets the file has, in order 0, what facets scatter more than once: a
    lobe that is the product of two functions of one angle each, and Kulla & Conty's but for a twentieth."""
    file = gn.load(real("fbsdf/roughgold_alpha_0.2.bsdf.gz"))
    gold = gn.Conductor([0.14355224, 0.37743778, 1.4382481], [3.98397448, 2.38495423, 1.60433814])
    model = gn.Microfacet(gn.Beckmann(0.2), gold, masking="separable")
    mu, half, orders = file.parts["mu"].astype(float), int((file.parts["mu"] < 0.0).sum()), 172
    above = mu[-half:]
    i, o = np.indices((half, half)).reshape(2, -1)
    s = np.sqrt(np.maximum(1.0 - above * above, 1e-30))
    k = interfaces.classes(interfaces.poles(s, above[i] + above[o], i, o, 0.2), LEAST)
    red = _series(model, above, NodePairs(i, o, k), range(orders), None)[0].reshape(orders, half, half) * above[:, None]
    red /= np.pi * np.where(np.arange(orders) == 0, 2.0, 1.0)[:, None, None]
    exact = model.f(gn.direction(np.arccos(above[4:, None]), math.pi), gn.direction(np.arccos(above[4:]), 0.0))[..., 0]
    np.testing.assert_allclose(red[:, 4:, 4:].sum(axis=0), exact * above[4:, None], rtol=1e-6, atol=1e-7)
    theirs = np.zeros_like(red)
    for a in range(half):
        for b in range(half):
            at, length = (int(x) for x in file.parts["places"][len(mu) - half + b, half - 1 - a])
            theirs[:length, a, b] = file.parts["coefficients"][at + length : at + 2 * length]
    clear = above > 0.1
    off = np.abs(theirs - red)[:, clear][:, :, clear] / red.max()
    np.testing.assert_array_less(np.percentile(off[1:].max(axis=0), [50, 90, 100]), [1e-4, 4e-4, 2e-3])
    more = ((theirs - red)[0] / above[:, None])[clear][:, clear]
    np.testing.assert_allclose(more, more.T, atol=1e-5 * more.max())
    scale = np.linalg.svd(more, compute_uv=False)
    assert scale[1] < 5e-3 * scale[0]
    w = gn.direction(np.arccos(above[clear]), 0.0)
    mirrors = gn.Microfacet(gn.Beckmann(0.2), 1.0, masking="separable")
    x, weights = np.polynomial.legendre.leggauss(32)
    x, weights = 0.5 + 0.5 * x, 0.5 * weights
    lost = 1.0 - gn.albedo(mirrors, w)
    mean = (2.0 * x * weights * (1.0 - gn.albedo(mirrors, gn.direction(np.arccos(x), 0.0)))).sum()
    F = (2.0 * x * weights * gold.F(x[:, None])[:, 0]).sum()
    lobe = F * F * (1.0 - mean) / (1.0 - F * mean) * np.outer(lost, lost) / (np.pi * mean)
    assert np.abs(more - lobe).max() < 0.06 * lobe.max()
