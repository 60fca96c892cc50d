"""Sound measurements of lawful surfaces, simulated in five shapes, with errors as large as stated; and unsound ones."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import gonio as gn

SHAPES = ("in-plane rows", "grid", "few rows", "colours", "oriented grid")

LAWS = ("positivity", "reciprocity", "isotropy", "energy", "furnace", "cavity")
"""Those that uncertainties decide about."""

FLOOR = 2e-4
"""Absolute standard uncertainty of a value [1/sr], beside the relative one."""


class Layout(NamedTuple):
    """The directions (n, 3) of a measurement, the angles that say so, and what becomes of its values."""

    wi: np.ndarray
    wo: np.ndarray
    made: Any
    channels: int


def layout(shape: str) -> Layout:
    """What is measured."""
    if "rows" in shape:
        step, last = (15.0, 75.0) if shape == "in-plane rows" else (30.0, 60.0)
        theta_i, theta = np.arange(0.0, 61.0, step), np.arange(-last, last + 1.0, step)
        i, o = (np.radians(x.ravel()) for x in np.meshgrid(theta_i, theta, indexing="ij"))
        apart = np.abs(i + o) > 1e-6  # the detector would shade the lamp
        i, o = i[apart], o[apart]
        angles = i, 0.0 * i, np.abs(o), np.where(o < 0.0, 0.0, np.pi)

        def rows(f: np.ndarray, u: np.ndarray) -> Any:
            return gn.Scattered(*angles, f[:, 0], uncertainty=u[:, 0])

        return Layout(gn.direction(*angles[:2]), gn.direction(*angles[2:]), rows, 1)
    theta = np.radians(np.arange(0.0, 61.0, 30.0 if shape == "oriented grid" else 15.0))
    names = ["R", "G", "B"] if shape == "colours" else None
    axes, mirrored = {"theta_i": theta, "theta_o": theta, "phi": np.radians(np.arange(0.0, 181.0, 30.0))}, True
    if shape == "oriented grid":
        round_ = np.radians(np.arange(0.0, 359.0, 45.0))
        axes, mirrored = {"theta_i": theta, "theta_o": theta, "phi_i": round_, "phi_o": round_}, False
    size = tuple(map(len, axes.values()))
    empty = gn.Gridded("angles", axes, np.zeros(size), mirrored=mirrored)
    wi, wo = (np.reshape(w, (-1, 3)) for w in empty.directions())
    count = 3 if names else 1

    def grid(f: np.ndarray, u: np.ndarray) -> Any:
        own = (x.reshape((*size, 3) if names else size) for x in (f, u))
        values, spread = own
        return gn.Gridded("angles", axes, values, uncertainty=spread, channels=names, mirrored=mirrored)

    return Layout(wi, wo, grid, count)


def surface(rng: np.random.Generator, oriented: bool) -> Any:
    """A lawful surface: white, gray, black, glossy."""
    a = rng.random(4)
    if oriented:
        return gn.Lambertian(0.5 * a[0]) + gn.Microfacet(gn.GGX(0.3 + 0.2 * a[1], 0.5 + 0.2 * a[2]), gn.Schlick(0.04))
    made = [
        lambda: gn.Lambertian(1.0),
        lambda: gn.Lambertian(0.95 + 0.05 * a[0]),
        lambda: gn.Lambertian(1e-3 * a[0]),
        lambda: gn.EON(a[0], a[1]),
        lambda: gn.Lambertian(0.6 * a[0]) + gn.Microfacet(gn.GGX(0.3 + 0.4 * a[1]), gn.Schlick(0.05)),
    ]
    return made[rng.integers(len(made))]()


def errors(rng: np.random.Generator, shape: tuple[int, ...], common: float) -> np.ndarray:
    """Errors of standard deviation 1, of whose variance a share is common to all."""
    return np.sqrt(1.0 - common) * rng.standard_normal(shape) + np.sqrt(common) * rng.standard_normal()


def sound(number: int, common: float) -> tuple[str, Any]:
    """The shape and the measurement of this number."""
    rng = np.random.default_rng(number)
    shape = SHAPES[number % len(SHAPES)]
    at = layout(shape)
    of, relative = surface(rng, shape == "oriented grid"), float(np.exp(rng.uniform(np.log(0.003), np.log(0.05))))
    f = np.repeat(np.reshape(of.f(at.wi, at.wo), (-1, 1)), at.channels, axis=1)
    u = np.hypot(relative * f, FLOOR)
    return shape, at.made(f + u * errors(rng, f.shape, common), u)


def unreciprocal(number: int, size: float, common: float) -> tuple[str, Any]:
    """A measurement whose values differ from those of the exchanged pairs by `size` standard uncertainties, root mean
    square."""
    rng = np.random.default_rng(number)
    shape = SHAPES[number % len(SHAPES)]
    at = layout(shape)
    f = np.full((len(at.wi), at.channels), 0.5 / np.pi)
    u = 0.01 * f
    way = (at.wi[:, 2] - at.wo[:, 2])[:, None] + 0.0 * f
    breach = 0.5 * size * u * way / np.sqrt(np.mean(way[np.abs(way) > 1e-6] ** 2))
    return shape, at.made(f + breach + u * errors(rng, f.shape, common), u)


def too_white(number: int, size: float, common: float) -> tuple[str, Any]:
    """A measurement of a surface whose albedo is 1 and `size` of the standard uncertainties that `check` says."""
    rng = np.random.default_rng(number)
    shape = SHAPES[number % len(SHAPES)]
    at, relative = layout(shape), float(np.exp(rng.uniform(np.log(0.003), np.log(0.03))))
    f = np.full((len(at.wi), at.channels), 1.0 / np.pi)
    noise = f * relative * errors(rng, f.shape, common)
    u = float(gn.check(at.made(f + noise, relative * f), laws=["energy"])["energy"].u)
    return shape, at.made((1.0 + size * u) * f + noise, relative * f)
