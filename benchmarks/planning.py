"""Plans of measurements: what they promise and what fits show, beside regular directions.

    python benchmarks/planning.py [FILE ...] > benchmarks/planning.txt

FILE is a measurement: a model is fitted to it, directions are planned for that model, and the values that the file has
there get 1 % of noise, 400 times. The regular directions are a grid in theta_i, theta_o and phi. The figure of merit is
the error of a number on average over the axes of the ellipsoid of errors: det(covariance)^(1/(2 p)).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import timing

import gonio as gn

TRIALS, NOISE = 400, 0.01
MODEL = gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())
PAINT = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))


def volume(c: np.ndarray) -> float:
    """The error of a parameter on average over the axes of the ellipsoid."""
    return float(np.exp(np.linalg.slogdet(c)[1] / (2 * len(c))))


def shown(f: np.ndarray, wi: np.ndarray, wo: np.ndarray, model: gn.Reflectance) -> np.ndarray:
    """The covariance of numbers fitted to noisy values."""
    found = []
    for seed in range(TRIALS):
        noisy = f * (1.0 + NOISE * np.random.default_rng(seed).standard_normal(len(f)))
        found.append(gn.fit((wi, wo, noisy, NOISE * f), model, starts=1).values)
    return np.cov(np.array(found).T)


def regular(n: int) -> tuple[np.ndarray, np.ndarray]:
    """About n pairs of a grid up to 75 degrees."""
    side = max(2, round((n / 3) ** 0.5))
    theta = np.linspace(0.0, np.radians(75.0), side + 1)[1:]
    grid = np.meshgrid(theta, theta, np.radians([0.0, 90.0, 180.0]), indexing="ij")
    theta_i, theta_o, phi = (x.ravel() for x in grid)
    wi, wo = gn.direction(theta_i, 0.0), gn.direction(theta_o, phi)
    apart = (wi * wo).sum(axis=1) < np.cos(np.radians(5.0))
    return np.broadcast_to(wi, wo.shape)[apart], wo[apart]


def compare(name: str, data: gn.Reflectance, model: gn.Reflectance) -> None:
    """Print promised and shown errors of planned directions, and how many regular ones show the same."""
    for n in (8, 16):
        planned = gn.plan(model, n, noise=NOISE)
        f = np.reshape(data.f(planned.wi, planned.wo), (n, -1)).mean(axis=1)
        ours = shown(f, planned.wi, planned.wo, model)
        ratio = volume(ours) / volume(planned.covariance)
        told = []
        for times in (1, 2, 4, 6, 8, 12):
            wi, wo = regular(times * n)
            f = np.reshape(data.f(wi, wo), (len(wi), -1)).mean(axis=1)
            good = np.isfinite(f) & (f > 0.0)
            told.append((len(wi[good]), volume(shown(f[good], wi[good], wo[good], model)) / volume(ours)))
        text = ", ".join(f"{count}: {x:.2f}" for count, x in told)
        print(
            f"{name}, {n} planned directions: shown errors {ratio:.3f} of those promised; regular directions and their"
        )
        print(f"  errors beside those: {text}")


def main() -> None:
    """Print all comparisons."""
    print("\n".join(timing.machine(3)))
    compare("Lambertian + GGX", PAINT, PAINT)
    for path in sys.argv[1:]:
        m = gn.load(path)
        rows = m if m.channels is None else _gray(m)
        found = gn.fit(rows, MODEL, "log", theta_max=np.radians(75.0))
        print(f"{Path(path).name}: {found.title}, rms {found.rms:.4f}")
        compare(Path(path).name, m, found.model)


def _gray(m: gn.Reflectance) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from gonio.fitting.samples import samples

    s = samples(m)
    return s.wi, s.wo, s.f.mean(axis=1)


if __name__ == "__main__":
    main()
