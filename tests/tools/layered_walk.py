"""Light through a stack of layers, photon by photon: an independent way to the numbers of `gonio.Stack`.

Nothing is shared with the package: microfacets are drawn as Heitz 2018 draws visible normals, free paths and angles of
scattering by their distribution functions; absorption and masking end a walk.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Smooth(NamedTuple):
    eta: float


class Rough(NamedTuple):
    eta: float
    alpha: float


class Medium(NamedTuple):
    depth: float
    albedo: float
    g: float


class Diffuse(NamedTuple):
    """A Lambertian base."""

    rho: float


class Metal(NamedTuple):
    """A base of GGX facets that reflect `F`, with Smith's height-correlated masking."""

    alpha: float
    F: float


def walked(parts, base, wi, count, rng):
    """Directions (n, 3) in which light from wi leaves, upwards, and downwards where there is no base."""
    w = np.tile(-np.asarray(wi, float), (count, 1))
    gap = np.zeros(count, int)
    up, down = [], []
    while len(w):
        rises = w[:, 2] > 0.0
        out, through = rises & (gap == 0), ~rises & (gap == len(parts))
        up.append(w[out])
        if base is None:
            down.append(w[through])
            alive = ~(out | through)
        else:
            w[through], stays = _at_base(base, w[through], rng)
            alive = ~out
            alive[np.flatnonzero(through)[~stays]] = False
        w, gap, moved = w[alive], gap[alive], (out | through)[alive]
        for number, part in enumerate(parts):
            for upwards in (False, True):
                here = ~moved & (gap == number + upwards) & ((w[:, 2] > 0.0) == upwards)
                if here.any():
                    met, passed, stays = _at_part(part, w[here], rng)
                    w[here] = met
                    gap[here] += np.where(passed, -1 if upwards else 1, 0)
                    moved |= here
                    if not stays.all():
                        lost = np.flatnonzero(here)[~stays]
                        w, gap, moved = (np.delete(x, lost, axis=0) for x in (w, gap, moved))
    return np.concatenate(up), np.concatenate(down) if down else np.zeros((0, 3))


def _at_base(base, w, rng):
    if isinstance(base, Diffuse):
        u, phi = rng.random(len(w)), 2.0 * np.pi * rng.random(len(w))
        r = np.sqrt(u)
        return np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1.0 - u)], -1), rng.random(len(w)) < base.rho
    seen, alpha = -w, base.alpha
    h = _facets(seen, alpha, rng)
    out = 2.0 * (seen * h).sum(-1, keepdims=True) * h - seen
    above = out[:, 2] > 0.0
    lambdas = [0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 / x[:, 2] ** 2 - 1.0)) - 1.0) for x in (seen, out)]
    shadowed = (1.0 + lambdas[0]) / (1.0 + lambdas[0] + lambdas[1])  # G_2/G_1
    return np.where(above[:, None], out, [0.0, 0.0, 1.0]), above & (rng.random(len(w)) < base.F * shadowed)


def _at_part(part, w, rng):
    """Directions after a part, whether it was passed, and which walks go on."""
    if isinstance(part, Medium):
        return _in_medium(part, w, rng)
    sign = np.where(w[:, 2] > 0.0, 1.0, -1.0)
    seen = -w
    seen[:, 2] = np.abs(w[:, 2])  # from a side that is called the upper one
    eta = np.where(sign < 0.0, part.eta, 1.0 / part.eta)[:, None]
    h = _facets(seen, part.alpha, rng) if isinstance(part, Rough) else np.broadcast_to([0.0, 0.0, 1.0], w.shape)
    cos = (seen * h).sum(-1, keepdims=True)
    c2 = 1.0 - (1.0 - cos**2) / eta**2
    t = np.sqrt(np.maximum(c2, 0.0))
    rs, rp = (cos - eta * t) / (cos + eta * t), (eta * cos - t) / (eta * cos + t)
    F = np.where(c2 <= 0.0, 1.0, 0.5 * (rs**2 + rp**2))
    passed = rng.random(len(w)) >= F[:, 0]
    out = np.where(passed[:, None], (cos / eta - t) * h - seen / eta, 2.0 * cos * h - seen)
    stays = np.where(passed, out[:, 2] < 0.0, out[:, 2] > 0.0)
    if isinstance(part, Rough):
        z = np.maximum(np.abs(out[:, 2]), 1e-9)
        stays &= rng.random(len(w)) < 2.0 / (1.0 + np.sqrt(1.0 + part.alpha**2 * (1.0 / z**2 - 1.0)))
    out[:, 2] *= -sign
    return out, passed, stays


def _facets(w, alpha, rng):
    """Normals of GGX facets as they are seen from w."""
    s = w * [alpha, alpha, 1.0]
    s /= np.linalg.norm(s, axis=-1, keepdims=True)
    r2 = s[:, 0] ** 2 + s[:, 1] ** 2
    x = np.where(r2[:, None] > 1e-20, np.stack([-s[:, 1], s[:, 0], 0.0 * r2], -1), [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    y = np.cross(s, x)
    r, phi = np.sqrt(rng.random(len(w))), 2.0 * np.pi * rng.random(len(w))
    a, b = r * np.cos(phi), r * np.sin(phi)
    half = 0.5 * (1.0 + s[:, 2])
    b = (1.0 - half) * np.sqrt(1.0 - a * a) + half * b
    n = a[:, None] * x + b[:, None] * y + np.sqrt(np.maximum(1.0 - a * a - b * b, 0.0))[:, None] * s
    n = n * [alpha, alpha, 1.0]
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def _in_medium(medium, w, rng):
    w, depth = w.copy(), np.where(w[:, 2] > 0.0, medium.depth, 0.0)
    enters_up, stays, inside = w[:, 2] > 0.0, np.ones(len(w), bool), np.arange(len(w))
    while len(inside):
        depth[inside] += np.log1p(-rng.random(len(inside))) * w[inside, 2]  # paths upwards lessen it
        inside = inside[(depth[inside] > 0.0) & (depth[inside] < medium.depth)]
        absorbed = rng.random(len(inside)) >= medium.albedo
        stays[inside[absorbed]] = False
        inside = inside[~absorbed]
        w[inside] = _scattered(w[inside], medium.g, rng)
    return w, (w[:, 2] > 0.0) == enters_up, stays


def _scattered(w, g, rng):
    u, phi = rng.random(len(w)), 2.0 * np.pi * rng.random(len(w))
    cos = 1.0 - 2.0 * u if g == 0.0 else (1.0 + g * g - ((1.0 - g * g) / (1.0 + g - 2.0 * g * u)) ** 2) / (2.0 * g)
    sin = np.sqrt(np.maximum(1.0 - cos * cos, 0.0))
    side = np.where(np.abs(w[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    x = np.cross(side, w)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    y = np.cross(w, x)
    out = (sin * np.cos(phi))[:, None] * x + (sin * np.sin(phi))[:, None] * y + cos[:, None] * w
    return out / np.linalg.norm(out, axis=-1, keepdims=True)
