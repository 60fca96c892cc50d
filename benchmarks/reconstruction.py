"""Whole tables from few directions: built-in materials left out in turn, and measured files.

    python benchmarks/reconstruction.py [FILE ...] > benchmarks/reconstruction.txt

The 100 built-in materials are left out five at a time. Errors are those of ln f, over all pairs of directions weighted
by both cosines: the root mean square over materials and channels, and in brackets their median. Values have 1 % noise.
Regular directions are a grid in theta_i, theta_o and phi up to 75 degrees; "ridge" is that of Nielsen, Jensen &
Ramamoorthi 2015: ln((f w + 0.001)/(f_ref w + 0.001)), w the product of both cosines, f_ref the median, eta = 40, all
components. "Within 2 u" are the shares of the table within two standard deviations of ln f; of FILE, a measurement,
those of its values up to 75 degrees.

Last, what is unlike the basis: models that none of its materials is, and each FILE, from planned directions. The shares
of values (up to 80 degrees; both cosines above 0.25; above 0.5) that the 95 % interval holds, the error of
ln(f + offset), and the geometric mean of its standard deviation, over three draws of the noise.
"""

from __future__ import annotations

import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import timing

import gonio as gn
from gonio.fitting.samples import samples

NOISE, EPS, ETA = 0.01, 1e-3, 40.0
LIMIT = np.radians(75.0)
MODEL = gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())
UNLIKE = [
    "OrenNayar(0.8, 0.5)",
    "OrenNayar(0.3, 0.3)",
    "EON(0.55, 0.4)",
    "EON(0.2, 0.9)",
    "EON(0.5, 0.5) + Microfacet(GGX(0.2), Schlick(0.04))",
    "EON(0.3, 0.3) + Microfacet(GGX(0.35), Schlick(0.04))",
    "EON(0.55, 0.4) + Microfacet(Beckmann(0.22), Schlick(0.08))",
    "Lambertian(0.5)",
    "Lambertian(0.4) + Microfacet(GGX(0.1), Schlick(0.04))",
    "Microfacet(GGX(0.3), Schlick(0.9))",
    "Microfacet(GGX(0.15), Schlick(0.7))",
    "KullaConty(0.5)",
    "Coated(Lambertian(0.6))",
    "Lambertian(0.1) + Microfacet(GTR(0.2, 1.5), Schlick(0.05))",
]
Pairs = tuple[np.ndarray, np.ndarray]


def regular(n: int) -> Pairs:
    """n pairs of a grid up to 75 degrees, evenly taken."""
    side = max(2, int(np.ceil((n / 3) ** 0.5)))
    theta = np.linspace(0.0, LIMIT, side + 1)[1:]
    theta_i, theta_o, phi = (
        x.ravel() for x in np.meshgrid(theta, theta, np.radians([30.0, 100.0, 180.0]), indexing="ij")
    )
    taken = np.linspace(0, len(phi) - 1, n).round().astype(int)
    return gn.direction(theta_i[taken], 0.0 * phi[taken]), gn.direction(theta_o[taken], phi[taken])


class Ridge:
    """The published mapping and regression, on pairs at which all materials are known."""

    def __init__(self, f: np.ndarray, wi: np.ndarray, wo: np.ndarray):
        self.w = np.maximum(wi[:, 2] * wo[:, 2], EPS)[:, None]
        self.reference = np.median(f, axis=1, keepdims=True) * self.w + EPS
        mapped = np.log((f * self.w + EPS) / self.reference)
        self.mean = mapped.mean(axis=1)
        self.centred = mapped - self.mean[:, None]

    def f(self, known: np.ndarray, at: np.ndarray) -> np.ndarray:
        """f at all pairs, from values (n, C) at some of them."""
        mapped = np.log((known * self.w[at] + EPS) / self.reference[at]) - self.mean[at, None]
        q = self.centred[at]  # of all components: as good as q, whose sums of products are the same
        c = q.T @ np.linalg.solve(q @ q.T + ETA * np.eye(len(at)), mapped)
        raised = np.exp(self.mean[:, None] + self.centred @ c) * self.reference - EPS
        return np.maximum(raised / self.w, 1e-6)


def left_out() -> None:
    """Print errors and shares of materials that the basis does not know."""
    every = [(e.name, gn.material(e.name)) for e in gn.materials() if e.kind == "measured fit"]
    random, u = np.random.default_rng(0), np.random.default_rng(1).random((3, 3000))
    theta_i, theta_o = (np.arccos(np.sqrt(x)) for x in u[:2])
    wi, wo = gn.direction(theta_i, 0.0 * theta_i), gn.direction(theta_o, 2.0 * np.pi * u[2])
    up = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    wi, wo = wi[up], wo[up]
    can = gn.planning.Goniometer().pairs()
    errors, shares, promised = defaultdict(list), defaultdict(list), defaultdict(list)
    for fold in range(20):
        rest = [m for k, (_, m) in enumerate(every) if k % 20 != fold]
        bases = {x: gn.reconstruction.reflectance_basis(rest, departure=x) for x in (0.0, 0.05)}
        f_there = np.concatenate([m.f(wi, wo) for m in rest], axis=1)
        for n in (5, 10, 20):
            some = random.choice(len(can[0]), n, replace=False)
            ways: dict[str, Pairs] = {"regular": regular(n), "random": (can[0][some], can[1][some])}
            for x, basis in bases.items():
                planned = gn.planning.plan_table(n, basis, noise=NOISE)
                ways[f"planned, departure {x:g}"] = planned.wi, planned.wo
            for way, (a, b) in ways.items():
                both = np.concatenate([wi, a]), np.concatenate([wo, b])
                own_f = np.concatenate([m.f(a, b) for m in rest], axis=1)
                ridge = Ridge(np.concatenate([f_there, own_f]), *both)
                own = bases[float(way[-4:])] if way.endswith("0.05") else bases[0.0]
                for _, m in every[fold::20]:
                    truth = m.f(wi, wo)
                    f = m.f(a, b)
                    f = f * (1.0 + NOISE * random.standard_normal(f.shape))
                    found = gn.reconstruction.reconstruct((a, b, f, NOISE * f), own)
                    off = np.log(found.reflectance.f(wi, wo) / truth)
                    errors[n, way, "ours"] += (off**2).mean(axis=0).tolist()
                    promised[n, way] += np.square(found.error).tolist()
                    deviation = _deviation(found).f(wi, wo)
                    shares[n, way] += (np.abs(off) < 2.0 * deviation).mean(axis=0).tolist()
                    off = np.log(ridge.f(f, np.arange(len(wi), len(both[0])))[: len(wi)] / truth)
                    errors[n, way, "ridge"] += (off**2).mean(axis=0).tolist()
    for n, way in shares:
        ours, ridge = (np.array(errors[n, way, name]) for name in ("ours", "ridge"))
        print(
            f"{n:2} {way:25} error {_told(ours)}, promised {np.mean(promised[n, way]) ** 0.5:.4f}, "
            f"within 2 u {np.mean(shares[n, way]):.3f}; ridge {_told(ridge)}"
        )


def _told(squares: np.ndarray) -> str:
    return f"{np.sqrt(squares.mean()):.4f} [{np.sqrt(np.median(squares)):.4f}]"


def _deviation(found: gn.results.Reconstruction) -> gn.Gridded:
    """The standard deviation of ln f as a table."""
    return found.reflectance.with_table(found.log_u)


def measured(path: str) -> None:
    """Print the errors of reconstructions and fits from few values of a file."""
    m = gn.load(path)
    every = samples(m, LIMIT)
    every = every.at(every.valid.all(axis=1) & (every.f > 0.0).all(axis=1))
    if isinstance(m, gn.Gridded) and len(every) < 10_000:  # rows of a laboratory
        weights, can = every.wi[:, 2] * every.wo[:, 2], (every.wi, every.wo)
        at, truth, value = can, every.f, every.f
    else:
        u = np.random.default_rng(0).random((3, 20_000))
        theta_i, theta_o = (np.arcsin(np.sin(LIMIT) * np.sqrt(x)) for x in u[:2])
        at = gn.direction(theta_i, 0.0 * theta_i), gn.direction(theta_o, 2.0 * np.pi * u[2])
        can = gn.planning.Goniometer().pairs()
        truth, value = (np.reshape(m.f(*pairs), (len(pairs[0]), -1)) for pairs in (at, can))
        good = (value > 0.0).all(axis=1)
        can, value = (can[0][good], can[1][good]), value[good]
        good = (truth > 0.0).all(axis=1)
        at, truth, weights = (at[0][good], at[1][good]), truth[good], np.ones(good.sum())
    rows = {key: k for k, key in enumerate(_keys(*can))}
    random = np.random.default_rng(0)
    for n in (5, 10, 20, 50):
        planned = gn.planning.plan_table(n, candidates=can)
        ways = {
            "planned": np.array([rows[key] for key in _keys(planned.wi, planned.wo)]),
            "random": random.choice(len(value), n, replace=False),
        }
        for way, some in ways.items():
            data = can[0][some], can[1][some], value[some]
            found = gn.reconstruction.reconstruct(data)
            off = np.log(np.reshape(found.reflectance.f(*at), truth.shape) / truth)
            deviation = np.reshape(_deviation(found).f(*at), truth.shape)
            share = np.average((np.abs(off) < 2.0 * deviation).mean(axis=1), weights=weights)
            fit = gn.fit(data, MODEL, "log").model
            of_fit = np.log(np.reshape(fit.f(*at), truth.shape) / truth)
            ours, theirs = (np.sqrt(np.average((x**2).mean(axis=1), weights=weights)) for x in (off, of_fit))
            print(
                f"{Path(path).name}, {n:2} {way:7} error {ours:.4f}, promised {np.mean(found.error):.4f}, "
                f"within 2 u {share:.3f}; Lambertian + GGX {theirs:.4f}"
            )


def unlike(paths: list[str]) -> None:
    """Print what intervals hold of materials that are unlike the basis."""
    u, least = np.random.default_rng(0).random((4, 4000)), np.cos(np.radians(80.0)) ** 2
    theta_i, theta_o = (np.arccos(np.sqrt(least + (1.0 - least) * x)) for x in u[::2])
    wi, wo = gn.direction(theta_i, 2.0 * np.pi * u[1]), gn.direction(theta_o, 2.0 * np.pi * u[3])
    cosine = np.minimum(wi[:, 2], wo[:, 2])
    materials = {text: gn.expression(text) for text in UNLIKE} | {Path(x).name: gn.load(x) for x in paths}
    for n in (10, 20):
        planned, means = gn.planning.plan_table(n), []
        for name, m in materials.items():
            truth, value = (np.reshape(m.f(*at), (len(at[0]), -1)) for at in ((wi, wo), (planned.wi, planned.wo)))
            rows = []
            for seed in range(3):
                noisy = value * (1.0 + NOISE * np.random.default_rng(seed).standard_normal(value.shape))
                found = gn.reconstruction.reconstruct((planned.wi, planned.wo, noisy, NOISE * value))
                low, high = (np.reshape(x.f(wi, wo), truth.shape) for x in found.interval(0.95))
                within = ((low <= truth) & (truth <= high)).mean(axis=1)
                held = [within[cosine > least].mean() for least in (0.0, 0.25, 0.5)]
                there, offset = found.reflectance.f(wi, wo), found.basis.offset
                off = np.log((np.reshape(there, truth.shape) + offset) / (np.maximum(truth, 0.0) + offset))
                rows.append([*held, np.mean(off**2), np.log(_deviation(found).f(wi, wo)).mean()])
            row = np.mean(rows, axis=0)
            means.append(row)
            print(f"{n:2} {name:60} {_held(row)}")
        print(f"{n:2} {'mean':60} {_held(np.mean(means, axis=0))}")


def _held(row: np.ndarray) -> str:
    return "holds {:.3f} {:.3f} {:.3f}, error {:.3f}, u {:.3f}".format(*row[:3], row[3] ** 0.5, np.exp(row[4]))


def _keys(wi: np.ndarray, wo: np.ndarray) -> list[tuple[float, ...]]:
    return [tuple(row) for row in np.concatenate([wi, wo], axis=1).round(12).tolist()]


def main() -> None:
    """Print all comparisons."""
    print("\n".join(timing.machine(3)))
    start = time.perf_counter()
    gn.reconstruction.reflectance_basis()
    times = [time.perf_counter() - start]
    for n in (5, 10, 20):
        start = time.perf_counter()
        planned = gn.planning.plan_table(n)
        times.append(time.perf_counter() - start)
    f = gn.material("blue-fabric").f(planned.wi, planned.wo)
    start = time.perf_counter()
    gn.reconstruction.reconstruct((planned.wi, planned.wo, f))
    times.append(time.perf_counter() - start)
    basis, *plans, one = times
    told = ", ".join(f"{t:.2f}" for t in plans)
    print(f"basis {basis:.2f} s; plans of 5, 10, 20 directions {told} s; a reconstruction of 3 channels {one:.3f} s")
    left_out()
    for path in sys.argv[1:]:
        measured(path)
    unlike(sys.argv[1:])


if __name__ == "__main__":
    main()
