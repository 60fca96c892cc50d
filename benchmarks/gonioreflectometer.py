"""The virtual gonioreflectometer, how fast and how true: python benchmarks/gonioreflectometer.py [--out FILE]

Speed: rays from the source a second, each followed until it leaves (at most 16 facets), on a Gaussian surface of 512 x
512 cells, alpha 0.4, correlation length 10 cells: the best of several rounds by the clock, and by the time that a core
worked. Truth: light that a Gaussian surface of mirrors reflects once, in cells of about 5 x 10 degrees, against the
means of `Microfacet(Beckmann(0.4), 1)` over the same cells, and against a Gaussian process that is no height field at
all; the shares of light that leave V-grooves to either side after one facet, against geometry; and how much of the
light comes back from mirrors in all.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from pathlib import Path

import numpy as np
from timing import machine

import gonio as gn
from gonio.errors import ToleranceWarning
from gonio.instrument.cells import Cells
from gonio.instrument.march import tables
from gonio.instrument.trace import points, trace

ALPHA, ROUNDS, RAYS, SURFACES = 0.4, 12, 1 << 19, 32
FACETS, HEIGHTS, APART = 8000, 64, 1.0 / 16.0
CELLS = Cells(18, 36)


def speed() -> list[str]:
    """A line for each angle of incidence."""
    lines = [f"{'rays':28}{'angle':>7}{'M rays/s':>10}{'M rays/core-s':>15}"]
    surface, rng = tables(gn.surfaces.gaussian(ALPHA)), np.random.default_rng(0)
    facets = {"mirrors": 1.0, "GGX(0.2) facets": gn.Microfacet(gn.GGX(0.2), 0.9)}
    for name, facet in facets.items():
        for degrees in (0, 30, 60, 80):
            wall, work = [], []
            for _ in range(ROUNDS):
                start, at_work = time.perf_counter(), time.process_time()
                trace(surface, facet, math.radians(degrees), 0.0, CELLS, 16, points(RAYS), np.zeros(2), rng)
                wall.append(time.perf_counter() - start)
                work.append(time.process_time() - at_work)
            rates = [RAYS / min(times[1:]) / 1e6 for times in (wall, work)]
            lines.append(f"{name:28}{degrees:6d}°{rates[0]:10.1f}{rates[1]:15.1f}")
    return lines


def averaged(model: gn.Reflectance, theta_i: float) -> np.ndarray:
    """Means of f cos(theta_o) over the cells (rings, sectors/2 + 1), over those of cos(theta_o)."""
    x, w = np.polynomial.legendre.leggauss(8)
    edges = CELLS.width * np.maximum(np.arange(CELLS.rings + 1) - 0.5, 0.0)
    edges[-1] = 0.5 * math.pi
    low, high = np.sin(edges[:-1, None]) ** 2, np.sin(edges[1:, None]) ** 2
    theta = np.arcsin(np.sqrt(low + (high - low) * 0.5 * (x + 1.0)))
    phi = CELLS.phi[: CELLS.sectors // 2 + 1, None] + math.pi / CELLS.sectors * x
    f = model.f(gn.direction(theta_i, 0.0), gn.direction(theta[:, None, :, None], phi[None, :, None, :]))
    means = np.einsum("rpij,i,j->rp", f, w, w) / 4.0
    means[0] = means[0].mean() if theta_i == 0.0 else np.average(means[0], weights=np.r_[1, np.full(17, 2), 1])
    return means


def smith(w: np.ndarray) -> float:
    """Smith's Lambda for Beckmann's slopes."""
    steep = math.hypot(w[0], w[1])
    if steep < 1e-9:
        return 0.0
    a = w[2] / (ALPHA * steep)
    return 0.5 * (math.erf(a) - 1.0) + math.exp(-a * a) / (2.0 * a * math.sqrt(math.pi))


def visible(slopes: np.ndarray, ways: list[np.ndarray], rng: np.random.Generator) -> float:
    """How often a facet of these slopes is seen along both ways, on a Gaussian process of correlation length 1.

    Its heights at places along both ways are drawn together, given height and slopes at the facet: without a grid,
    triangles, a period, or a walk from cell to cell.
    """
    sigma = 0.5 * ALPHA
    places, rays = [np.zeros((0, 2))], [np.zeros(0)]
    for w in ways:
        steep = math.hypot(w[0], w[1])
        if steep < 1e-6:
            continue
        far = min(9.0 * sigma * steep / w[2], 14.0)
        r = far * np.arange(1.0, math.ceil(far / APART) + 1.0) / math.ceil(far / APART)
        places.append(r[:, None] * w[:2] / steep)
        rays.append(r * w[2] / steep)
    x, rises = np.concatenate(places), np.concatenate(rays)
    covariance = sigma**2 * np.exp(-((x[:, None] - x) ** 2).sum(-1))
    with_height = sigma**2 * np.exp(-(x**2).sum(-1))
    given = np.column_stack([with_height, 2.0 * with_height[:, None] * x])
    variances = sigma**2 * np.array([1.0, 2.0, 2.0])
    covariance -= (given / variances) @ given.T - 1e-9 * sigma**2 * np.eye(len(x))
    height = sigma * rng.standard_normal(HEIGHTS)
    mean = given[:, :1] / variances[0] * height + (given[:, 1:] @ slopes / variances[1])[:, None]
    heights = mean + np.linalg.cholesky(covariance) @ rng.standard_normal((len(x), HEIGHTS))
    return float((heights <= height + rises[:, None]).all(axis=0).mean())


def process(theta_i: float, rng: np.random.Generator) -> tuple[float, float]:
    """By how much more light a Gaussian process reflects once than Smith's theory says, in parts of that, and the
    standard error: the same facets by chance for both."""
    wi, more, whole = np.array([math.sin(theta_i), 0.0, math.cos(theta_i)]), np.zeros(FACETS), np.zeros(FACETS)
    for k, slopes in enumerate(rng.normal(0.0, ALPHA / math.sqrt(2.0), (FACETS, 2))):
        n = np.append(-slopes, 1.0)
        wo = 2.0 * (n @ wi) / (n @ n) * n - wi
        if n @ wi > 0.0 and wo[2] > 0.0:
            lit = n @ wi / wi[2]
            whole[k] = lit / (1.0 + smith(wi) + smith(wo))
            more[k] = lit * visible(slopes, [wi, wo], rng) - whole[k]
    return more.mean() / whole.mean(), more.std(ddof=1) / math.sqrt(FACETS) / whole.mean()


def beckmann() -> list[str]:
    """A line for each angle of incidence: the light in all, and the cells."""
    degrees = [10, 30, 50, 60, 70]
    m = gn.gonioreflectometer(
        gn.surfaces.gaussian(ALPHA), theta_i=np.radians(degrees), bounces=1, tolerance=1e-5, surfaces=SURFACES
    )
    model, weight = gn.Microfacet(gn.Beckmann(ALPHA), 1.0), CELLS.projected * np.r_[1.0, np.full(17, 2.0), 1.0]
    rng = np.random.default_rng(0)
    names = f"{'mean of f':>12}{'of a process':>18}{'cells, rms':>12}{'by chance':>12}"
    lines = [f"{'once reflected':16}{'measured':>10}{'Beckmann':>10}{names}"]
    for i, angle in enumerate(degrees):
        f, u, expected = m.stored[i], m.uncertainty[i], averaged(model, math.radians(angle))
        shares = [(weight * x).sum() for x in (f, expected)]
        kept = expected > 0.01 * expected.max()
        by_light = np.where(kept, weight * expected, 0.0) / (weight * expected)[kept].sum()
        safe = np.where(kept, expected, 1.0)
        rms = [100.0 * math.sqrt((by_light * (x / safe) ** 2).sum()) for x in (f - expected, u)]
        line = f"{angle:15d}°{shares[0]:10.5f}{shares[1]:10.5f}{100.0 * (shares[0] / shares[1] - 1.0):11.2f}%"
        theory = "{:9.2f} +- {:.2f}%".format(*(100.0 * x for x in process(math.radians(angle), rng)))
        lines.append(f"{line}{theory:>18}{rms[0]:11.2f}%{rms[1]:11.2f}%")
    return lines


def sides(slope: float, theta: float) -> list[float]:
    """Shares of light from the side of +x that leave V-grooves after one facet: to the side of +x, and of -x."""
    d, shares = np.array([-math.sin(theta), -math.cos(theta)]), {1.0: 0.0, -1.0: 0.0}
    for side in (-1.0, 1.0):  # of the groove, from x = 0 at its bottom to crests at x = -1 and 1
        n = np.array([-side * slope, 1.0]) / math.hypot(slope, 1.0)
        r = d - 2.0 * (d @ n) * n
        if d @ n >= 0.0 or r[1] <= 0.0:
            continue
        x = np.linspace(0.0, side, 1_000_001)[1:]
        entry, leaves = (x + w[0] * (slope - slope * np.abs(x)) / w[1] for w in (d, r))
        out = (np.abs(entry) <= 1.0) & (np.abs(leaves) <= 1.0)
        shares[math.copysign(1.0, r[0])] += out.sum() * abs(entry[1] - entry[0]) / 2.0
    return [shares[1.0], shares[-1.0]]


def grooves() -> list[str]:
    """A line for each angle of incidence."""
    lines = [f"{'V-grooves, 0.6':16}{'towards, traced':>17}{'theory':>9}{'away, traced':>14}{'theory':>9}"]
    cells, degrees = Cells(45, 4), [5, 20, 40, 60]
    m = gn.gonioreflectometer(
        gn.surfaces.v_grooves(0.6),
        theta_i=np.radians(degrees),
        phi_i=0.0,
        cells=cells,
        bounces=1,
        tolerance=0.5,
        rays=1 << 20,
    )
    light = m.stored[..., 0] * cells.projected
    for i, angle in enumerate(degrees):
        cap = light[i, 0].sum()
        found = [light[i, 1:, 0].sum() + 0.5 * cap, light[i, 1:, 2].sum() + 0.5 * cap]
        theory = sides(0.6, math.radians(angle))
        lines.append(f"{angle:15d}°{found[0]:17.5f}{theory[0]:9.5f}{found[1]:14.5f}{theory[1]:9.5f}")
    return lines


def energy() -> list[str]:
    """What comes back from white mirrors, by surface."""
    lines = [f"{'white mirrors':50}{'back':>10}{'still inside':>14}{'lost':>10}"]
    for surface in (gn.surfaces.gaussian(0.4), gn.surfaces.weave(), gn.surfaces.spheres(0.4), gn.surfaces.brushed()):
        around = None if surface.turn == 0.0 else 0.3
        named = {"phi_i": around, "bounces": 200, "tolerance": 0.5, "rays": 1 << 17}
        m = gn.gonioreflectometer(surface, theta_i=np.radians([0.0, 45.0, 75.0]), **named)
        back, inside, lost = (x.mean() for x in (m.report.reflected, m.report.unfinished, m.report.lost))
        lines.append(f"{surface.title[:48]:50}{back:10.6f}{inside:14.1e}{lost:10.1e}")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path)
    lines = machine(ROUNDS)
    warnings.simplefilter("ignore", ToleranceWarning)  # the error that was reached is printed
    for part in (speed, beckmann, grooves, energy):
        lines += ["", *part()]
        print("\n".join(lines[-8:]), flush=True)
    out = parser.parse_args().out
    if out is not None:
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
