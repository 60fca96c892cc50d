"""Plans of measurements: what they promise and what fits show, beside regular directions.

    python benchmarks/planning.py [FILE ...] > benchmarks/planning.txt

FILE is a measurement: a model is fitted to all of it (ln f, up to 75 degrees), directions are planned for that model,
and the values that the file has there get 1 % of noise, 400 times. Regular directions are grids in theta_i, theta_o and
phi, of 3 and of 9 azimuths. What is printed is relative, the root mean square over the numbers of the model: the spread
that noise leaves; and how far the mean is from the fit to the whole file, where the model is not the material.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import timing

import gonio as gn

TRIALS, NOISE, MISFIT = 400, 0.01, 0.03
MODEL = gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())
PAINT = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))


def shown(data: gn.Reflectance, wi: np.ndarray, wo: np.ndarray, model: gn.Reflectance) -> np.ndarray:
    """Numbers (TRIALS, p) fitted to noisy values."""
    f = np.reshape(data.f(wi, wo), (len(wi), -1)).mean(axis=1)
    good = np.isfinite(f) & (f > 0.0)
    wi, wo, f = wi[good], wo[good], f[good]
    found = []
    for seed in range(TRIALS):
        noisy = f * (1.0 + NOISE * np.random.default_rng(seed).standard_normal(len(f)))
        found.append(gn.fit((wi, wo, noisy, NOISE * f), model, starts=1).values)
    return np.array(found)


def regular(n: int, azimuths: int) -> tuple[np.ndarray, np.ndarray]:
    """About n pairs of a grid up to 75 degrees."""
    side = max(2, round((n / azimuths) ** 0.5))
    theta = np.linspace(0.0, np.radians(75.0), side + 1)[1:]
    grid = np.meshgrid(theta, theta, np.linspace(0.0, np.pi, azimuths), indexing="ij")
    theta_i, theta_o, phi = (x.ravel() for x in grid)
    wi, wo = gn.direction(theta_i, 0.0), gn.direction(theta_o, phi)
    apart = (wi * wo).sum(axis=1) < np.cos(np.radians(5.0))
    return wi[apart], wo[apart]


def tell(what: str, numbers: np.ndarray, truth: np.ndarray) -> None:
    """Print a line about fitted numbers."""
    spread = np.sqrt(np.mean((numbers.std(axis=0, ddof=1) / truth) ** 2))
    off = np.sqrt(np.mean((numbers.mean(axis=0) / truth - 1.0) ** 2))
    print(f"  {what}: noise {spread:.2%}, off by {off:.0%}")


def compare(name: str, data: gn.Reflectance, model: gn.Reflectance, truth: np.ndarray) -> None:
    """Print what planned and regular directions come to."""
    print(name)
    for n in (8, 16):
        for criterion in ("D", "A"):
            planned = gn.planning.plan(model, n, criterion, noise=NOISE)
            numbers = shown(data, planned.wi, planned.wo, model)
            c = np.cov(numbers.T), planned.covariance
            ratio = np.exp(np.subtract(*(np.linalg.slogdet(x)[1] for x in c)) / (2 * len(truth)))
            worth = f"worth {planned.regular:.0f} of all directions, {planned.in_plane:.0f} in the plane of incidence"
            tell(f"{n} planned, {criterion}, {worth}; errors {ratio:.3f} of those promised", numbers, truth)
        robust = gn.planning.plan(model, n, "A", noise=NOISE, misfit=MISFIT)
        tell(f"{n} planned, A, misfit {MISFIT:.0%}", shown(data, robust.wi, robust.wo, model), truth)
    for azimuths in (3, 9):
        for n in (16, 32, 64, 128):
            wi, wo = regular(n, azimuths)
            tell(f"{len(wi)} regular, {azimuths} azimuths", shown(data, wi, wo, model), truth)


def main() -> None:
    """Print all comparisons."""
    print("\n".join(timing.machine(3)))
    compare("Lambertian(0.3) + GGX(0.2)", PAINT, PAINT, np.array([0.3, 0.2, 0.04]))
    for path in sys.argv[1:]:
        m = gn.load(path)
        rows = m if m.channels is None else _gray(m)
        found = gn.fit(rows, MODEL, "ratio", theta_max=np.radians(75.0))
        compare(f"{Path(path).name}: {found.title}, rms {found.rms:.2%} of f", m, found.model, found.values)


def _gray(m: gn.Reflectance) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from gonio.fitting.samples import samples

    s = samples(m)
    return s.wi, s.wo, s.f.mean(axis=1)


if __name__ == "__main__":
    main()
