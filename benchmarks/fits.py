"""Fits: speed, calibration, global optima, published fits. `python benchmarks/fits.py [part ...] [--data DIR]`

Parts: one, table, catalogue, texels, calibration, elsewhere, few, starts, published. Ratios are of one run on one
machine.
`--data`: the folder that holds nbrdf/*.h5, neural fits of measured materials (Sztrajman et al. 2021), for `published`.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import timing
from scipy.optimize import least_squares

import gonio as gn
from gonio.fitting.problem import make_problem
from gonio.fitting.samples import spread_pairs
from gonio.fitting.selection import SETS

GLOSSY = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.15), gn.Schlick(0.06))
MODEL = gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())


def best(run, times=5):
    """The least time of a few runs, and the last result."""
    found, least = run(), float("inf")
    for _ in range(times):
        start = time.perf_counter()
        found = run()
        least = min(least, time.perf_counter() - start)
    return least, found


def plain_ggx(p, wi, wo):
    """Lambertian + weight * GGX with Schlick's Fresnel term, in plain NumPy."""
    rho, weight, alpha_x, alpha_y, f0 = p
    h = wi + wo
    h = h / np.sqrt((h * h).sum(axis=1))[:, None]
    cos_d = (wi * h).sum(axis=1)
    D = 1.0 / (np.pi * alpha_x * alpha_y * ((h[:, 0] / alpha_x) ** 2 + (h[:, 1] / alpha_y) ** 2 + h[:, 2] ** 2) ** 2)
    F = f0 + (1.0 - f0) * (1.0 - cos_d) ** 5

    def shadow(w):
        return 0.5 * (np.sqrt(1.0 + ((alpha_x * w[:, 0]) ** 2 + (alpha_y * w[:, 1]) ** 2) / w[:, 2] ** 2) - 1.0)

    return rho / np.pi + weight * D * F / ((1.0 + shadow(wi) + shadow(wo)) * 4.0 * wi[:, 2] * wo[:, 2])


def one():
    """One fit of five numbers to 1e5 values, against SciPy on plain NumPy."""
    wi, wo = spread_pairs(126_200)
    wi, wo = wi[:100_000], wo[:100_000]
    noise = 1.0 + 0.02 * np.random.default_rng(0).standard_normal(len(wi))
    y = plain_ggx((0.3, 0.6, 0.12, 0.3, 0.06), wi, wo) * noise
    print(
        f"one fit, 5 numbers, {len(wi)} values, f cos(theta_i); SciPy: least_squares, numeric derivatives, plain NumPy"
    )
    for x0 in ((0.5, 0.5, 0.2, 0.2, 0.04), (0.18, 1.0, 0.02, 0.02, 0.04), (0.5, 1.0, 0.5, 0.5, 0.5)):
        rho, weight, alpha_x, alpha_y, f0 = x0
        model = gn.Lambertian(rho) + weight * gn.Microfacet(gn.GGX(alpha_x, alpha_y), gn.Schlick(f0))
        ours, found = best(lambda model=model: gn.fit((wi, wo, y), model))
        single, alone = best(lambda model=model: gn.fit((wi, wo, y), model, starts=1))
        bounds = found.problem.bounds
        theirs, other = best(
            lambda x0=x0, bounds=bounds: least_squares(
                lambda p: (plain_ggx(p, wi, wo) - y) * wi[:, 2], x0, bounds=bounds
            ),
            2,
        )
        exact, _ = best(lambda model=model: gn.fit((wi, wo, y), model, starts=1, solver="scipy"), 2)
        print(
            f"  from {x0}: gonio {1e3 * ours:.1f} ms with all starts, {1e3 * single:.1f} ms with this one; SciPy "
            f"{1e3 * theirs:.0f} ms, {other.nfev} Jacobians; ratio {theirs / ours:.0f} and {theirs / single:.0f}; cost/"
            f"SciPy's {found.cost / (2.0 * other.cost):.9f}, {alone.cost / (2.0 * other.cost):.9f}; SciPy by our "
            f"derivatives {1e3 * exact:.0f} ms"
        )


def table():
    """A table of the size of a MERL file: 90 x 90 x 180 nodes of three channels."""
    truth = gn.Lambertian([0.3, 0.2, 0.1]) + gn.Microfacet(gn.GGX(0.15), gn.Schlick([0.04, 0.05, 0.06]))
    theta_h = 0.5 * np.pi * (np.arange(90) / 90.0) ** 2
    axes = {"theta_h": theta_h, "theta_d": np.linspace(0.0, 0.5 * np.pi, 90), "phi_d": np.pi * np.arange(180) / 180.0}
    empty = gn.Gridded(
        "half_difference", axes, np.zeros((90, 90, 180, 3)), channels=["R", "G", "B"], periods={"phi_d": np.pi}
    )
    wi, wo = empty.directions()
    up = (wi[..., 2] > 1e-3) & (wo[..., 2] > 1e-3)
    f = np.full((90, 90, 180, 3), np.nan)
    f[up] = truth.f(wi[up], wo[up])
    f *= 1.0 + 0.02 * np.random.default_rng(0).standard_normal(f.shape)
    m = empty.with_brdf(f)
    seconds, found = best(lambda: gn.fit(m, MODEL), 3)
    print(f"table of {f.size} values, {found.used} above the horizon, {len(found.names)} numbers: {seconds:.2f} s")


def catalogue():
    """The 100 measured fits that are built in, by five models each; and by one whose formula has an integral."""
    every = SETS["graphics"]()
    names = [e.name for e in gn.materials() if e.kind == "measured fit"]
    for chosen in (FIVE, ("Lambertian + GTR",)):
        models = [every[name] for name in chosen]
        for m in models:
            gn.fit(gn.material(names[0]), m, "log")
        start = time.perf_counter()
        count = sum(gn.fit(gn.material(name), m, "log").converged for name in names for m in models)
        seconds = time.perf_counter() - start
        print(
            f"{len(names)} materials x {', '.join(chosen)}: {seconds:.0f} s; "
            f"{count} of {len(names) * len(models)} converged"
        )


FIVE = ("Lambertian + GGX", "Lambertian + Beckmann", "EON + GGX", "Lambertian + Ward", "Lambertian + ABC")


def texels():
    """Fits of texels: Lambertian + GGX, three numbers, 32 observations."""
    random, count, shape = np.random.default_rng(0), 32, (131_072, 1, 1)
    wi, wo = spread_pairs(4000)
    half = wi + wo
    near = (half[:, 2] / np.linalg.norm(half, axis=1) > np.cos(0.6)) & (np.minimum(wi[:, 2], wo[:, 2]) > 0.2)
    rows = random.choice(np.flatnonzero(near), count, replace=False)
    wi, wo = wi[rows], wo[rows]
    rho, weight = random.uniform(0.05, 0.8, shape), random.uniform(0.05, 1.0, shape)
    alpha = np.exp(random.uniform(np.log(0.08), np.log(0.5), shape))
    f = (gn.Lambertian(rho) + weight * gn.Microfacet(gn.GGX(alpha), gn.Schlick(0.04))).f(wi, wo)[..., 0]
    f *= 1.0 + 0.01 * random.standard_normal(f.shape)
    model, by = gn.Lambertian() + 1.0 * gn.Microfacet(gn.GGX(), gn.Schlick(0.04)), ["rho", "weight", "alpha"]
    for threads in (1, 2):
        gn.engine.threads(threads)
        for loss in ("cosine", "log"):
            seconds, found = best(lambda loss=loss: gn.fitting.fit_map((wi, wo, f), model, loss, by=by), 3)
            off = np.median(np.abs(found.values["1.of.distribution.alpha_x"] / alpha[:, 0, 0] - 1.0))
            told = f"alpha is off by {off:.2%} in the median; flagged: {found.count() or 'none'}"
            print(f"{shape[0]} texels, {threads} threads, {loss}: {shape[0] / seconds:.0f} texels a second; {told}")


def calibration(trials=1000):
    """The share of 95 % intervals that hold the truth."""
    truth = {"0.rho": 0.3, "1.distribution.alpha_x": 0.15, "1.fresnel.F0": 0.06}
    wi, wo = spread_pairs(800)
    wi, wo = wi[:400], wo[:400]
    exact, model = GLOSSY.f(wi, wo), MODEL.replace(truth)
    print(f"95 % intervals of {trials} trials, 400 values, that hold rho, alpha, F0")
    for noise in (0.001, 0.01, 0.03, 0.1):
        for kind in ("likelihood", "cosine", "log", "ratio"):
            held = np.zeros(3)
            for seed in range(trials):
                f = exact * (1.0 + noise * np.random.default_rng(seed).standard_normal(len(exact)))
                data = (wi, wo, f, noise * exact) if kind == "likelihood" else (wi, wo, f)
                intervals = gn.fit(data, model, kind, starts=1).interval()
                held += [low <= truth[name] <= high for name, (low, high) in intervals.items()]
            print(f"  noise {noise:.1%}, {kind}: {', '.join(f'{x / trials:.1%}' for x in held)}")


def elsewhere(trials=400):
    """The same of two scenes by which nothing of the noise model was chosen."""
    paint = gn.Lambertian(0.6) + gn.Microfacet(gn.GGX(0.35), gn.Schlick(0.1))
    for m, count in ((paint, 250), (gn.OrenNayar(0.5, 0.4), 80)):
        wi, wo = spread_pairs(6 * count)
        rows = np.random.default_rng(77).choice(len(wi), count, replace=False)
        rows = rows[(wi[rows, 2] > 0.15) & (wo[rows, 2] > 0.15)]
        wi, wo = wi[rows], wo[rows]
        exact = m.f(wi, wo)
        truth = gn.fitting.fit_problem((wi, wo, exact), m).x0
        for what, u in (
            ("1% of f", 0.01 * exact),
            ("constant", np.full(len(exact), 0.01 * exact.mean())),
            ("3% of f", 0.03 * exact),
        ):
            for loss in ("cosine", "log", "plain"):
                held = np.zeros(len(truth))
                for seed in range(trials):
                    f = exact + u * np.random.default_rng(10_000 + seed).standard_normal(len(exact))
                    intervals = gn.fit((wi, wo, f), m, loss, starts=1).interval().values()
                    held += [low <= x <= high for x, (low, high) in zip(truth, intervals, strict=True)]
                told = ", ".join(f"{x / trials:.1%}" for x in held)
                print(f"  {type(m).__name__}, {len(exact)} values, {trials} trials, noise {what}, {loss}: {told}")


def few(trials=300):
    """The same of 30 values and of 250, in six draws of directions, with 3 % of noise that is not stated."""
    truth = gn.EON(0.55, 0.4) + gn.Microfacet(gn.Beckmann(0.22), gn.Schlick(0.08))
    for count in (30, 250):
        total = np.zeros(4)
        for scene in range(6):
            wi, wo = spread_pairs(6 * count)
            rows = np.random.default_rng(100 + scene).choice(len(wi), 2 * count, replace=False)
            rows = rows[(wi[rows, 2] > 0.15) & (wo[rows, 2] > 0.15)][:count]
            wi, wo = wi[rows], wo[rows]
            exact, held = truth.f(wi, wo), np.zeros(4)
            numbers = gn.fitting.fit_problem((wi, wo, exact), truth).x0
            for seed in range(trials):
                f = exact * (1.0 + 0.03 * np.random.default_rng(20_000 + seed).standard_normal(count))
                intervals = gn.fit((wi, wo, f), truth, starts=1).interval().values()
                held += [low <= x <= high for x, (low, high) in zip(numbers, intervals, strict=True)]
            total += held
            told = ", ".join(f"{x / trials:.1%}" for x in held)
            print(f"  {count} values, {trials} trials, directions {scene}: {told}", flush=True)
        print(f"  {count} values, all: {', '.join(f'{x / trials / 6:.1%}' for x in total)}", flush=True)


def global_optima(count=100):
    """The share of random starts, each alone, that come to the best optimum found: all built-in measured fits."""
    shares = []
    for name in [e.name for e in gn.materials() if e.kind == "measured fit"]:
        m = gn.material(name)
        for loss in ("cosine", "log"):
            problem = make_problem(m, MODEL, loss, "none", None, None, None, 0.5 * np.pi)
            from gonio.fitting.fitting import fitted

            costs = [fitted(problem, None, seed).cost for seed in range(5)]
            least = min(costs)
            shares.append((np.mean(np.array(costs) <= 1.001 * least), name, loss, fitted(problem, None, 0).agreeing))
    agreed = np.array([s for s, *_ in shares])
    single = np.array([s for *_, s in shares])
    print(f"{len(shares)} problems (100 materials, 2 losses), 5 seeds: {agreed.mean():.1%} at the best optimum")
    print(f"  a single random start: {single.mean():.1%} come to it on average, {np.median(single):.0%} in the median")


def published(data):
    """Published fits of three measured materials against ours, on neural fits of the measurements."""
    from gonio.formats import load

    for path in sorted(Path(data).glob("nbrdf/*.h5")):
        m = load(path)
        theirs = gn.material(path.stem)
        problem = make_problem(m, theirs, "log", "none", None, True, None, np.radians(80.0))
        cost = float(problem.squares(problem.unknowns.start[None]).cost[0])
        found = gn.fit(m, theirs, "log", per_channel=True, theta_max=np.radians(80.0))
        shared = gn.fit(m, theirs, "log", theta_max=np.radians(80.0))
        print(
            f"{path.stem}: Löw's ABC, log: rms {np.sqrt(cost / found.used):.5f} as published, {shared.rms:.5f} fitted, "
            f"{found.rms:.5f} with all numbers by channel"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("parts", nargs="*")
    parser.add_argument("--data", default="")
    arguments = parser.parse_args()
    every = {
        "one": one,
        "table": table,
        "catalogue": catalogue,
        "texels": texels,
        "calibration": calibration,
        "elsewhere": elsewhere,
        "few": few,
        "starts": global_optima,
        "published": lambda: published(arguments.data),
    }
    print("\n".join(timing.machine(3)))
    for part in arguments.parts or every:
        if part != "published" or arguments.data:
            every[part]()
