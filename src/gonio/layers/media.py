"""Matrices of a medium that absorbs and scatters: a thin slab of it exactly, and that doubled until it is thick."""

from __future__ import annotations

import math

import numpy as np

from .adding import Matrices, doubled
from .grid import Grid


def slab(
    grid: Grid, n: complex, depth: complex, albedo: complex, g: complex, orders: range, terms: int
) -> tuple[Matrices, np.ndarray, Matrices]:
    """A slab of optical depth `depth`, of particles that scatter the share `albedo` by Henyey & Greenstein's function.

    The equation of transfer of an order is u' = -A u + B v, v' = A v - B u, u downwards, v upwards. Even and odd
    illumination part: with P = A + B, Q = A - B the slab between -h and h has

    T + R = (C - h Q S)/(C + h Q S),  C = cosh(h sqrt(P Q)), S = sinh(h sqrt(P Q))/(h sqrt(P Q)),

    and T - R the same with P and Q exchanged. Series of C and S give a thin one to rounding; then it is doubled. Also
    returns what goes straight through, at each node, and the matrices of what was scattered once.
    """
    mu, root = grid.mu(n), grid.root(n)
    beyond = g**terms  # of the phase function, forward: what a series that ends misses (Wiscombe 1977, delta-M)
    depth, albedo = (1.0 - albedo * beyond) * depth, albedo * (1.0 - beyond) / (1.0 - albedo * beyond)
    ahead, back = scattering(mu, root, n, g, orders, terms)
    # What the rule over the nodes misses of a particle's light goes straight on, in all orders: no light is lost.
    first, again = (ahead, back) if orders.start == 0 else scattering(mu, root, n, g, range(1), terms)
    missed = 1.0 / mu - (root @ (first[0] + again[0])) / root
    away = np.diag(1.0 / mu) - albedo * (ahead + np.diag(missed))
    p, q = away + albedo * back, away - albedo * back
    steps = max(0, math.ceil(math.log2(max(depth.real / mu.real.min(), 1e-300))))
    h = depth * 0.5 ** (steps + 1)
    even, odd = _half(h, p, q), _half(h, q, p)
    reflection, change = 0.5 * (even - odd), 0.5 * (even + odd)
    for _ in range(steps):
        reflection, change = doubled(reflection, change)
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
    y = np.zeros((len(orders), len(mu), terms), mu.dtype)
    sine = np.sqrt(1.0 - mu * mu)
    start = np.array(
        [math.exp(0.5 * (math.lgamma(2 * k + 1) - 2.0 * math.lgamma(k + 1)) - k * math.log(2.0)) for k in m]
    )
    for i, k in enumerate(m):
        if k < terms:
            y[i, :, k] = np.where(np.abs(sine) ** k < NOTHING, 0.0, start[i] * sine**k)
    for degree in range(1, terms):
        inner = m < degree
        if inner.any():
            k = m[inner, None]
            lower = y[inner, :, degree - 2] if degree > 1 else 0.0
            last = (2 * degree - 1) * mu * y[inner, :, degree - 1] - np.sqrt((degree - 1.0) ** 2 - k * k) * lower
            y[inner, :, degree] = last / np.sqrt(degree * degree - k * k)
    return y
