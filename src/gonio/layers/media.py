"""Matrices of a medium that absorbs and scatters: by eigenvectors, or a thin slab of it doubled until it is thick."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .adding import Matrices, doubled
from .grid import NodeGrid


def slab(
    grid: NodeGrid, n: complex, medium: Sequence[complex], orders: range, terms: int
) -> tuple[Matrices, np.ndarray, Matrices]:
    """A slab of a medium, (depth, albedo, g): of this optical depth, of particles that scatter the share `albedo` by
    Henyey & Greenstein's function.

    The equation of transfer of an order is u' = -A u + B v, v' = A v - B u, u downwards, v upwards. Even and odd
    illumination part: with P = A + B, Q = A - B the slab between -h and h has

    T + R = (C - h Q S)/(C + h Q S),  C = cosh(h sqrt(P Q)), S = sinh(h sqrt(P Q))/(h sqrt(P Q)),

    and T - R the same with P and Q exchanged. Also returns what goes straight through, at each node, and the matrices
    of what was scattered once.
    """
    (depth, albedo, g), mu, root = medium, grid.mu(n), grid.root(n)
    beyond = g**terms  # of the phase function, forward: what a series that ends misses (Wiscombe 1977, delta-M)
    depth, albedo = (1.0 - albedo * beyond) * depth, albedo * (1.0 - beyond) / (1.0 - albedo * beyond)
    ahead, back = scattering(mu, root, n, g, orders, terms)
    # What the rule over the nodes misses of a particle's light goes straight on, in all orders: no light is lost.
    first, again = (ahead, back) if orders.start == 0 else scattering(mu, root, n, g, range(1), terms)
    missed = 1.0 / mu - (root @ (first[0] + again[0])) / root
    away = np.diag(1.0 / mu) - albedo * (ahead + np.diag(missed))
    p, q = away + albedo * back, away - albedo * back
    if np.iscomplexobj(p) or np.iscomplexobj(depth):
        reflection, change = _by_doubling(p, q, depth, mu)
    else:
        reflection, change = _by_eigenvectors(p, q, depth.real)
    transmission = change + np.eye(len(mu))
    straight = 1.0 / mu - albedo * missed
    paths = straight[:, None] + straight
    reflected = -np.expm1(-depth * paths) / paths * (albedo * back)
    far = straight[:, None] - straight
    more = np.where(far.real < 0.0, -far, far)
    steep = np.abs(depth * more) > 1e-12
    mean = np.where(steep, -np.expm1(-depth * more) / np.where(steep, more, 1.0), depth)  # over the depth of scattering
    passed = np.exp(-depth * 0.5 * (paths - more)) * mean * (albedo * ahead)
    once = Matrices(reflected, passed, passed, reflected)
    return Matrices(reflection, transmission, transmission, reflection), np.exp(-depth * straight), once


def _by_eigenvectors(p: np.ndarray, q: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """What a slab reflects, and what it transmits, less 1, of real numbers.

    P = L L^T, L^T Q L = V k^2 V^T, A = L V and B = A^-T: P Q = A k^2 A^-1. With G = B k tanh(h k) B^T, T + R is
    1 - 2 G/(1 + G), and with G = A tanh(h k)/k A^T so is T - R. P is positive; Q is not, where nothing is absorbed.
    """
    h = 0.5 * depth
    lower = np.linalg.cholesky(p)
    v = np.linalg.eigh(np.swapaxes(lower, -1, -2) @ q @ lower)[1]
    v = v + v @ _turned(lower @ v, q)
    a = lower @ v
    k = np.sqrt(np.maximum(np.sum(a * (q @ a), axis=-2, keepdims=True), 0.0))
    b = np.linalg.solve(np.swapaxes(lower, -1, -2), v)
    small = h * k < 1e-9
    slope = np.where(small, h, np.tanh(h * k) / np.where(small, 1.0, k))
    odd, even = (_gone(x * factor @ np.swapaxes(x, -1, -2)) for x, factor in ((a, slope), (b, k * np.tanh(h * k))))
    return odd - even, -odd - even


def _turned(a: np.ndarray, q: np.ndarray) -> np.ndarray:
    """By how much eigenvectors must turn into each other: A^T Q A should be diagonal.

    It is so but for the rounding of the largest k^2, 1/mu^2 of the last node; beside the products it is large where
    vectors are small.
    """
    off = np.swapaxes(a, -1, -2) @ (q @ a)
    square = np.diagonal(off, axis1=-2, axis2=-1)
    apart = square[..., None, :] - square[..., None]
    near = np.abs(apart) <= 100.0 * np.abs(off)
    return np.where(near, 0.0, off / np.where(near, 1.0, apart))


def _gone(g: np.ndarray) -> np.ndarray:
    """G/(1 + G)."""
    return np.linalg.solve(np.eye(g.shape[-1]) + g, g)


def _by_doubling(p: np.ndarray, q: np.ndarray, depth: complex, mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of any numbers: series of C and S give a thin slab to rounding, which is doubled."""
    steps = max(0, math.ceil(math.log2(max(depth.real / mu.real.min(), 1e-300))))
    h = depth * 0.5 ** (steps + 1)
    even, odd = _half(h, p, q), _half(h, q, p)
    reflection, change = 0.5 * (even - odd), 0.5 * (even + odd)
    for _ in range(steps):
        reflection, change = doubled(reflection, change)
    return reflection, change


def _half(h: complex, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """(C - h Q S)/(C + h Q S) of a thin slab, less 1."""
    x = (h * p) @ (h * q)
    one = np.zeros_like(x)
    one[:] = np.eye(x.shape[-1])
    c, s = one + x / (2 * TERMS * (2 * TERMS - 1)), one + x / (2 * TERMS * (2 * TERMS + 1))
    for k in range(TERMS - 1, 0, -1):
        c, s = one + x @ c / (2 * k * (2 * k - 1)), one + x @ s / (2 * k * (2 * k + 1))
    s = h * q @ s
    half = np.linalg.solve(np.swapaxes(c + s, -1, -2), np.swapaxes(-2.0 * s, -1, -2))
    return np.ascontiguousarray(np.swapaxes(half, -1, -2))


NOTHING = 1e-20
"""What is less is 0: products of such numbers would be computed ten times as slowly."""

TERMS = 7
"""Terms of the series of cosh and sinh, whose argument is 1/2 at most: 1e-15."""


def scattering(
    mu: np.ndarray, root: np.ndarray, n: complex, g: complex, orders: range, terms: int
) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (orders, nodes, nodes) of light that particles scatter on into the same hemisphere, and into the other.

    Legendre's series of the phase function by the addition theorem, sum_l (2 l + 1)/2 g^l Y_lm(mu) Y_lm(mu').
    """
    y = harmonics(mu, orders, terms)
    share = (np.arange(terms) + 0.5) * (g ** np.arange(terms) - g**terms) / (1.0 - g**terms)
    weight = root / (n * mu)
    parity = (-1.0) ** (np.arange(terms) + np.array(orders)[:, None])
    y = y * weight[:, None]
    ahead = (y * share) @ np.swapaxes(y, -1, -2)
    back = (y * (share * parity)[:, None]) @ np.swapaxes(y, -1, -2)
    return ahead, back


def harmonics(mu: np.ndarray, orders: range, terms: int) -> np.ndarray:
    """Associated Legendre functions (orders, nodes, terms): sqrt((l - m)!/(l + m)!) P_l^m(mu), and 0 for l < m."""
    m = np.array(orders)
    y = np.zeros((terms, len(orders), len(mu)), mu.dtype)
    sine = np.sqrt(1.0 - mu * mu)
    start = [math.exp(0.5 * (math.lgamma(2 * k + 1) - 2.0 * math.lgamma(k + 1)) - k * math.log(2.0)) for k in orders]
    for i, order in enumerate(orders):
        if order < terms:
            y[order, i] = np.where(np.abs(sine) ** order < NOTHING, 0.0, start[i] * sine**order)
    for degree in range(1, terms):
        inner = slice(0, max(0, degree - orders.start))  # orders below the degree
        k = m[inner, None]
        lower = y[degree - 2, inner] if degree > 1 else 0.0
        last = (2 * degree - 1) * mu * y[degree - 1, inner] - np.sqrt((degree - 1.0) ** 2 - k * k) * lower
        y[degree, inner] = last / np.sqrt(degree * degree - k * k)
    return np.ascontiguousarray(np.moveaxis(y, 0, -1))
