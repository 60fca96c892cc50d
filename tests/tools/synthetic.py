"""Synthetic measurements of known surfaces, on grids and in rows as laboratories make them, by number."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import gonio as gn

NOISE = (0.0, 0.0, 0.002, 0.01, 0.05)
"""Relative standard uncertainties of the values; of 0 nothing is stated."""

KINDS = {"grid": 0.46, "mirrored grid": 0.46, "rows in half-planes": 0.04, "rows anywhere": 0.04}
"""Kinds of measurements, and their shares."""


class Synthetic(NamedTuple):
    """A measurement `m` of a surface, and what it is."""

    surface: Any
    m: Any
    kind: str
    step: float
    planes: int
    noise: float


def surface(rng: np.random.Generator) -> Any:
    """A surface of any of the common kinds: matt, glossy, hot spot, forward scattering, sheen."""
    a = rng.random(8)
    made = [
        lambda: gn.Lambertian(0.1 + 0.8 * a[0]),
        lambda: gn.OrenNayar(0.1 + 0.8 * a[0], 0.1 + 0.5 * a[1]),
        lambda: gn.Lambertian(0.5 * a[0]) + gn.Microfacet(gn.GGX(0.08 + 0.4 * a[1]), gn.Dielectric(1.3 + 0.5 * a[2])),
        lambda: gn.Microfacet(gn.GGX(0.15 + 0.45 * a[0]), gn.Conductor(0.2, 3.9)),
        lambda: 0.8 * gn.Lambertian(0.1 + 0.5 * a[0]) + gn.Ward(0.2 * a[1], 0.1 + 0.3 * a[2]),
        lambda: gn.NormalizedLafortune(0.1 + 0.5 * a[0], -0.9, C_z=0.9, n=2.0 + 30.0 * a[1] ** 2),
        lambda: gn.RPV(0.05 + 0.3 * a[0], 0.6 + 0.4 * a[1], -0.3 * a[2]),
        lambda: gn.Hapke(0.2 + 0.6 * a[0], 0.1 + 0.3 * a[1], 0.3 * a[2]),
        lambda: gn.RossLi(0.2 + 0.2 * a[0], 0.1 * a[1], 0.04 * a[2]),
        lambda: gn.Minnaert(0.1 + 0.6 * a[0], 0.7 + 0.5 * a[1]),
        lambda: gn.Lambertian(0.4 * a[0]) + gn.AshikhminVelvet(0.1 + 0.4 * a[1], 0.2 + 0.3 * a[2]),
        lambda: gn.LommelSeeliger(0.2 + 0.7 * a[0]),
    ]
    return made[rng.integers(len(made))]()


def synthetic(number: int) -> Synthetic:
    """The measurement of this number."""
    rng = np.random.default_rng(number)
    of, kind = surface(rng), str(rng.choice(list(KINDS), p=list(KINDS.values())))
    step, planes = (
        float(rng.choice([2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0])),
        int(rng.choice([2, 4, 6, 8, 12, 18, 24, 36])),
    )
    noise, last = float(rng.choice(NOISE)), float(rng.choice([60.0, 75.0, 80.0, 85.0]))
    return measured(rng, of, kind, step, planes, noise, last)


def measured(rng: Any, of: Any, kind: str, step: float, planes: int, noise: float, last: float) -> Synthetic:
    """The measurement of a surface by angles in steps up to the last [degrees], in a number of half-planes."""
    made = _grid if "grid" in kind else _rows
    return Synthetic(of, made(rng, of, kind, step, planes, noise, last), kind, step, planes, noise)


def _noisy(rng: np.random.Generator, f: np.ndarray, noise: float) -> tuple[np.ndarray, Any]:
    if noise == 0.0:
        return f, None
    return f * (1.0 + noise * rng.standard_normal(f.shape)), noise * np.abs(f)


def _grid(rng: Any, of: Any, kind: str, step: float, planes: int, noise: float, last: float) -> Any:
    theta_o = np.radians(np.arange(0.0, last + 1e-6, step))
    theta_i = np.radians(np.arange(0.0, last + 1e-6, max(step, float(rng.choice([5.0, 15.0, 30.0])))))
    mirrored = "mirrored" in kind or planes == 2
    phi = np.linspace(0.0, math.pi, planes // 2 + 1) if mirrored else 2.0 * math.pi * np.arange(planes) / planes
    wi, wo = gn.direction(theta_i, 0.0), gn.direction(theta_o[:, None], phi)
    f, u = _noisy(rng, of.f(wi[:, None, None], wo), noise)
    axes = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
    return gn.Gridded("angles", axes, f, uncertainty=u, mirrored=mirrored)


def _rows(rng: Any, of: Any, kind: str, step: float, planes: int, noise: float, last: float) -> Any:
    if "half-planes" in kind:
        theta_o = np.radians(np.arange(0.0, last + 1e-6, max(step, 5.0)) + 0.3)  # not on one node at the normal
        theta_i = np.radians(np.arange(0.0, last + 1e-6, max(step, 15.0)))
        phi = 2.0 * math.pi * np.arange(planes) / planes
        theta_i, theta_o, phi = (x.reshape(-1) for x in np.meshgrid(theta_i, theta_o, phi, indexing="ij"))
        theta_o = theta_o + np.radians(0.2) * rng.random(theta_o.shape)
    else:
        n = int(60 * 2.0 ** (4.0 * rng.random()))
        theta_i, theta_o = (np.radians(last) * np.sqrt(rng.random(n)) for _ in range(2))
        phi = 2.0 * math.pi * rng.random(n)
    f, u = _noisy(rng, of.f(gn.direction(theta_i, 0.0), gn.direction(theta_o, phi)), noise)
    return gn.Scattered(theta_i, 0.0 * theta_i, theta_o, phi, f, uncertainty=u)


class Result(NamedTuple):
    """Numbers of gonio for a measurement: errors, u, and its components; (n,) each. `size`: of the true results."""

    name: str
    error: np.ndarray
    u: np.ndarray
    noise: np.ndarray
    interpolation: np.ndarray
    size: np.ndarray


def results(number: int, made: Synthetic, sky: bool = True, angles: int = 3) -> Iterator[Result]:
    """Albedos at some angles, if `sky` the white-sky albedo, f at 8 pairs of directions off the nodes."""
    rng = np.random.default_rng([number, 1])
    wi = gn.direction(np.radians([*(70.0 * rng.random(2)), 0.0][:angles]), 0.0)
    sides = [gn.direction(np.radians(75.0) * np.sqrt(rng.random(8)), 2.0 * math.pi * rng.random(8)) for _ in range(2)]
    yield _result("albedo", gn.albedo, made, wi)
    if sky:
        yield _result("white-sky albedo", gn.remote_sensing.white_sky_albedo, made)
    yield _result("f", gn.Reflectance.f, made, *sides)


def _result(name: str, function: Any, made: Synthetic, *args: Any) -> Result:
    exact = {} if name == "f" else {"tolerance": 1e-5}
    truth = np.atleast_1d(function(made.surface, *args, **exact))
    q = gn.with_uncertainty(function, made.m, *args, correlation="independent" if made.noise else None)
    error = np.atleast_1d(q.value) - truth
    return Result(name, error, *map(np.atleast_1d, (q.u, q.u_noise, q.u_interpolation)), np.abs(truth))
