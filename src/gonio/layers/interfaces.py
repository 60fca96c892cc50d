"""Matrices of interfaces between two media, smooth or rough."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..compile.threads import share
from ..machine.caches import kept
from .adding import Matrices, even
from .facets import fresnel, masking, shares, spread
from .grid import NodeGrid

Pairs = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""A function of the places of two nodes, (pairs, 1), and of 1 - cos(phi), phi = 0 forward."""


def smooth(grid: NodeGrid, a: complex, b: complex) -> tuple[np.ndarray, np.ndarray]:
    """Reflectances of a smooth interface at the nodes, from the medium of index a and from that of index b below.

    What is not reflected goes through, at the same node.
    """
    common = min(grid.count(a), grid.count(b))
    once = fresnel(grid.mu(a)[:common], b / a)
    return tuple(np.concatenate([once, np.ones(grid.count(n) - common)]) for n in (a, b))  # type: ignore[return-value]  # of two: two


def smooth_matrices(grid: NodeGrid, a: complex, b: complex) -> Matrices:
    """The same as matrices, alike for all orders."""
    above, below = smooth(grid, a, b)
    through = np.zeros((len(below), len(above)), above.dtype)
    common = min(through.shape)
    through[range(common), range(common)] = 1.0 - above[:common]
    return Matrices(np.diag(above)[None], through[None], through.T[None], np.diag(below)[None])


def rough(
    grid: NodeGrid, a: complex, b: complex, alpha: complex, kept: bool
) -> Callable[[range], tuple[Matrices, Matrices]]:
    """What makes the matrices, of orders that are asked for from 0 on, of an interface of GGX facets with Smith's
    separable masking, Walter et al. 2007, and of what it scatters once.

    `kept`: whether light that facets scatter more than once leaves as in Kulla & Conty's lobe, to both sides.
    With f_t over n_o^2 light may go either way: |wi.wm||wo.wm| (1 - F) G D/(mu_i mu_o (n_i wi.wm + n_o wo.wm)^2).
    """
    (mu_a, s), mu_b = (grid.mu(a), np.sqrt(grid.s2)), grid.mu(b)

    def reflected(n: complex, mu: np.ndarray, eta: complex) -> Pairs:
        sine = s[: len(mu)] / n

        def f(i: np.ndarray, o: np.ndarray, turn: np.ndarray) -> np.ndarray:
            z, across = mu[i] + mu[o], _across(sine[i], sine[o], turn)  # of wi + wo
            cos_d = 0.5 * np.sqrt(across + z * z)
            masked = masking(mu[i], alpha) * masking(mu[o], alpha)
            return fresnel(cos_d, eta) * spread(z * z, across, alpha) * masked / (4.0 * mu[i] * mu[o] * n * n)

        return f

    side = 1.0 if (b - a).real > 0.0 else -1.0

    def refracted(i: np.ndarray, o: np.ndarray, turn: np.ndarray) -> np.ndarray:
        z, across = side * (b * mu_b[o] - a * mu_a[i]), _across(s[i], s[o], turn)  # of -side (n_i wi + n_o wo)
        length2 = across + z * z
        both = -a * mu_a[i] * b * mu_b[o] - s[i] * s[o] * (1.0 - turn)  # n_i n_o wi.wo
        lit, seen = -side * (a * a + both) / a, side * (b * b + both) / b
        passes = (lit.real > 0.0) & (seen.real > 0.0)
        lit, length2 = np.where(passes, lit, 1.0), np.where(passes, length2, 1.0)
        through = 1.0 - fresnel(lit / np.sqrt(length2), b / a)
        masked = masking(mu_a[i], alpha) * masking(mu_b[o], alpha)
        f = lit * seen * through * spread(z * z, across, alpha) * masked / (mu_a[i] * mu_b[o] * length2 * length2)
        return np.where(passes, f, 0.0)

    def z_reflected(mu: np.ndarray, n: complex) -> Callable[[Any, Any], Any]:
        return lambda i, o: n * (mu[i] + mu[o])

    i, o = np.indices((len(mu_a), len(mu_b))).reshape(2, -1)
    pole = poles(s, b * mu_b[o] - a * mu_a[i], i, o, alpha)
    ga, gb = grid.root(a), grid.root(b)
    shadow = tilted(grid, a, b) * np.outer(gb, ga)

    def scattered(orders: range) -> list[np.ndarray]:
        """Reflection above and below, and transmission downwards."""
        above, below = (
            symmetric(reflected(n, mu, eta), s[: len(mu)], z_reflected(mu, n), alpha, orders) * np.outer(g, g)
            for n, mu, eta, g in ((a, mu_a, b / a, ga), (b, mu_b, a / b, gb))
        )
        down = series(refracted, i, o, pole, orders).reshape(len(orders), len(mu_a), len(mu_b))
        return [above, below, np.swapaxes(down, 1, 2) * shadow]

    (again_a, through_a), (again_b, through_b) = shares(mu_a, b / a, alpha), shares(mu_b, a / b, alpha)
    sides = ((ga, again_a, ga, again_a), (gb, again_b, gb, again_b), (ga, through_a, gb, through_b))
    factors: list[np.ndarray] = []  # of all orders, by the first

    def matrices(orders: range) -> tuple[Matrices, Matrices]:
        found = scattered(orders)
        if orders.start == 0:
            factors[:] = [
                scaling(of[0], x * share_x, y * share_y, x, y)
                for of, (x, share_x, y, share_y) in zip(found, sides, strict=True)
            ]
        above, below, down = (of * factor for of, factor in zip(found, factors, strict=True))
        above, below = even(above), even(below)
        once = Matrices(above, down, np.swapaxes(down, 1, 2), below)
        if kept and orders.start == 0:
            lost_a, lost_b = ga - ga @ above[0] - gb @ down[0], gb - gb @ below[0] - down[0] @ ga
            lobe = 1.0 / (ga @ lost_a + gb @ lost_b)
            more = (lobe * np.outer(x, y) for x, y in ((lost_a, lost_a), (lost_b, lost_b), (lost_b, lost_a)))
            above, below, down = (
                np.concatenate([of[:1] + extra, of[1:]]) for of, extra in zip((above, below, down), more, strict=True)
            )
        return Matrices(above, down, np.swapaxes(down, 1, 2), below), once

    return matrices


def tilted(grid: NodeGrid, a: complex, b: complex) -> np.ndarray:
    """The share (nodes of b, nodes of a) of light between two nodes' cells that facets could refract, not steeper than
    walls: f ends there at once, where n_i |wi.z| = n_o |wo.z|."""
    (low_a, high_a), (low_b, high_b) = (grid.cells(n) for n in (a, b))

    def beyond(x: Any, y: Any) -> Any:  # twice the area where s_b^2 - s_a^2 is less, from this corner on
        gap = x - y[:, None] + (b * b - a * a)
        gap = gap if b.real > a.real else -gap
        return np.where(gap.real > 0.0, gap * gap, 0.0)

    first, last = (low_b, high_b), (high_a, low_a)
    if b.real < a.real:
        first, last = (high_b, low_b), (low_a, high_a)
    area = beyond(last[0], first[0]) - beyond(last[0], first[1]) - beyond(last[1], first[0]) + beyond(last[1], first[1])
    return 0.5 * area / np.outer(high_b - low_b, high_a - low_a)


def scaling(matrix: np.ndarray, columns: Any, rows: Any, into: Any, out: Any) -> np.ndarray:
    """Factors of a matrix, products of one for its column and one for its row, that make `columns` of out @ matrix, and
    `rows` of matrix @ into.

    Sinkhorn & Knopp's iteration, by roots of its steps: what is symmetric stays so.
    """
    right, left = np.ones_like(columns), np.ones_like(rows)
    for _ in range(ROUNDS):
        more = columns / (right * ((out * left) @ matrix)), rows / (left * (matrix @ (into * right)))
        right, left = right * np.sqrt(more[0]), left * np.sqrt(more[1])
    return np.outer(left, right)


ROUNDS = 256
"""Steps of `scaling`."""


def _across(a: Any, b: Any, turn: Any) -> Any:
    """Squared length, along the surface, of the sum of two vectors that are this long there."""
    return (a - b) * (a - b) + 2.0 * a * b * turn


def poles(s: np.ndarray, z: Any, i: Any, o: Any, alpha: complex) -> np.ndarray:
    """How far from the real axis D has its pole along phi: Fourier coefficients fall as exp(-m pole)."""
    a, b = s[i].real, s[o].real
    return np.arccosh(1.0 + ((a - b) ** 2 + (alpha.real * np.abs(np.real(z))) ** 2) / (2.0 * a * b))


def symmetric(f: Pairs, s: np.ndarray, z: Callable[[Any, Any], Any], alpha: complex, orders: range) -> np.ndarray:
    """Fourier coefficients (orders, nodes, nodes) of what is the same with both directions exchanged."""
    i, o = np.tril_indices(len(s))
    found = series(f, i, o, poles(s, z(i, o), i, o, alpha), orders)
    whole = np.empty((len(orders), len(s), len(s)), found.dtype)
    whole[:, i, o] = whole[:, o, i] = found
    return whole


def series(f: Pairs, i: np.ndarray, o: np.ndarray, pole: np.ndarray, orders: range) -> np.ndarray:
    """Integrals of f cos(m phi) over the circle, (orders, pairs).

    Trapezoids in t, tan(phi/2) = k tan(t/2): with k = sqrt(pole/2) the peak at phi = 0 is as wide in t as the map
    allows. Pairs of nodes share the k of their class.
    """
    k = classes(pole, 2.0**-6)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for shared in np.unique(k):
        of_class = np.flatnonzero(k == shared)
        phi, weights = turns(float(shared), orders)
        turn = 2.0 * np.sin(0.5 * phi) ** 2
        parts += [(x, turn, weights) for x in np.array_split(of_class, 1 + len(of_class) * len(turn) // TOGETHER)]
    result = np.empty((len(orders), len(i)), f(i[:1, None], o[:1, None], np.ones(1)).dtype)

    def work(part: np.ndarray, turn: np.ndarray, weights: np.ndarray) -> None:
        result[:, part] = (f(i[part, None], o[part, None], turn) @ weights).T

    share(work, parts)
    return result


TOGETHER = 200_000
"""Values of f that are computed together: more do not stay in a processor's cache."""


def classes(pole: np.ndarray, least: float) -> np.ndarray:
    """The k of `series` for peaks with poles at such distances: powers of two."""
    return np.clip(2.0 ** np.round(np.log2(np.sqrt(0.5 * np.minimum(pole, 2.0)))), least, 1.0)


@kept
def turns(k: float, orders: range) -> tuple[np.ndarray, np.ndarray]:
    """The angles of `series`, and weights (angles, orders)."""
    count = 64 + orders.stop
    t = np.pi * (np.arange(count) + 0.5) / count
    phi = 2.0 * np.arctan(k * np.tan(0.5 * t))
    slope = k / (np.cos(0.5 * t) ** 2 + k * k * np.sin(0.5 * t) ** 2)
    return phi, np.cos(phi[:, None] * np.array(orders)) * (slope * (2.0 * np.pi / count))[:, None]
