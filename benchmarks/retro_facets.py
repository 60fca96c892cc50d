"""Facets from retro-reflection: known ones that come back, published tables, and the built-in materials beside fits.

    python benchmarks/retro_facets.py [FILE.bsdf ...] > benchmarks/retro_facets.txt

FILE is an RGL measurement, which carries the D and the projected areas that its authors found in the same way, from
retro-reflection that they measured apart. The loss is that of `gn.fit(..., "log")`, ln(1 + f cos(theta_i)). The albedo
of the diffuse part is pi times the least f(w, w) up to 80 degrees. Times are ratios to the fit of the same material.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import timing

import gonio as gn
from gonio.authoring import Direction
from gonio.fitting.samples import samples

MODEL = gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())
EVEN = (0.05, 0.1, 0.2, 0.3, 0.5, 0.8)
UNEVEN = tuple((x, y) for x, y in product(EVEN, EVEN) if x < y)
UP_TO_80 = gn.direction(np.radians(np.linspace(0.0, 80.0, 161)), 0.0)


def main() -> None:
    """Print all comparisons."""
    print("\n".join(timing.machine(3)))
    for kind in (gn.GGX, gn.Beckmann):
        _known(kind, [(x, x) for x in EVEN])
        _known(kind, list(UNEVEN))
    for path in sys.argv[1:]:
        _published(path)
    _built_in([e.name for e in gn.materials() if e.kind == "measured fit"])


def _known(kind: Any, alphas: list[tuple[float, float]]) -> None:
    w = Direction(*np.moveaxis(gn.direction(np.linspace(0.0, 1.4, 80)[:, None], np.linspace(0.0, 6.0, 31)), -1, 0))
    pole = Direction(0.0, 0.0, 1.0)
    rows = []
    for x, y in alphas:
        facets = kind(x, y)
        found = gn.reconstruction.retro_facets(gn.Microfacet(facets, gn.Schlick(0.9)))
        near: Any = (found.ggx if kind is gn.GGX else found.beckmann).distribution
        D = np.abs(found.facets.D(w) - facets.D(w)).max() / float(facets.D(pole))
        off = [abs(near.alpha_x / x - 1.0), abs(near.alpha_y / y - 1.0)]
        rows.append((abs(found.F0 / 0.9 - 1.0), D, max(off), found.steps))
    most, middle = np.max(rows, axis=0), np.median(rows, axis=0)
    what = "isotropic" if alphas[0][0] == alphas[0][1] else "anisotropic"
    print(f"{kind.__name__}, {what}, {len(alphas)} of alpha {EVEN[0]} to {EVEN[-1]}: relative errors, largest (median)")
    told = zip(("F0", "D, of its largest value,", "alpha"), most, middle, strict=False)
    print("  " + ", ".join(f"{name} {a:.1e} ({b:.1e})" for name, a, b in told) + f"; steps at most {most[3]:.0f}")


def _published(path: str) -> None:
    m = gn.load(path)
    D, area = (np.asarray(table)[0] for table in (m.ndf, m.sigma))
    theta = 0.5 * np.pi * np.square(np.linspace(0.0, 1.0, len(D)))
    w = Direction(*gn.direction(theta, 0.0).T)
    stored = gn.TabulatedFacets(theta, D)
    error = np.abs(stored.projected_area(w) / area - 1.0)[theta < np.radians(89.0)].max()
    print(f"{Path(path).name}: projected area of the stored D beside the stored one: within {error:.1e}")
    weight = np.sin(2.0 * theta) * np.gradient(theta)
    for masking in ("view", "height_correlated"):
        found = gn.reconstruction.retro_facets(m, masking=masking).facets.D(w)
        apart = (np.abs(found - stored.D(w)) * weight).sum() / ((found + stored.D(w)) * weight).sum()
        print(f'  masking="{masking}": {apart:.1%} of the facets are elsewhere than in the stored D')
    _beside(m)


def _beside(m: Any) -> None:
    fit = gn.fit(m, MODEL, "log")
    plain, less = gn.reconstruction.retro_facets(m), gn.reconstruction.retro_facets(m, diffuse=_least(m))
    print(
        f"  rms of the log loss: fit of Lambertian + GGX {fit.rms:.4f}; extracted model {_rms(m, plain.model):.4f}, "
        f"with a diffuse part {_rms(m, less.model):.4f}, F0 and that part fitted {_rms(m, _coloured(m, less)):.4f}"
    )


def _coloured(m: Any, found: Any) -> Any:
    """The extracted facets, with F0 and a Lambertian part fitted: D stays."""
    facets = gn.Microfacet(found.facets, gn.Schlick(np.minimum(found.F0, 1.0)))
    return gn.fit(m, gn.Lambertian(found.diffuse) + facets, "log", starts=1).model


def _least(m: Any) -> np.ndarray:
    """The albedo of the largest Lambertian part that f(w, w) allows."""
    f = np.reshape(m.f(UP_TO_80, UP_TO_80), (len(UP_TO_80), -1))
    return np.clip(np.pi * np.nanmin(f, axis=0), 0.0, 1.0)


def _rms(m: Any, model: Any) -> float:
    rows = samples(m)
    cos = rows.wi[:, 2:]
    shown = np.reshape(model.f(rows.wi, rows.wo), (len(rows), -1))
    apart = np.log1p(np.maximum(shown * cos, 0.0)) - np.log1p(np.maximum(rows.f * cos, 0.0))
    return float(np.sqrt(np.square(apart[rows.valid]).mean()))


def _built_in(names: list[str]) -> None:
    rms: dict[str, list[float]] = {}
    times, cost, same, alone = [], [], [], []
    for name in names:
        m = gn.material(name)
        fit, fit_time = _timed(lambda m=m: gn.fit(m, MODEL, "log"))
        rho = _least(m)
        found, found_time = _timed(lambda m=m, rho=rho: gn.reconstruction.retro_facets(m, diffuse=rho))
        times.append(found_time / fit_time)
        plain = gn.reconstruction.retro_facets(m)
        models = {
            "the fit": fit.model,
            "extracted, masking of the published method": gn.reconstruction.retro_facets(m, masking="view").model,
            "extracted": plain.model,
            "extracted, F0 and a Lambertian part fitted": _coloured(m, plain),
            "extracted beside a diffuse part": found.model,
            "extracted beside a diffuse part, F0 and that part fitted": _coloured(m, found),
            "the GGX of that": found.ggx,
        }
        for key, model in models.items():
            rms.setdefault(key, []).append(_rms(m, model))
        alpha = next(p.value for path, p in found.ggx.parameters.items() if path.endswith("alpha_x"))
        start = gn.Lambertian(rho) + gn.Microfacet(gn.GGX(alpha), gn.Schlick(np.minimum(found.F0, 1.0)))
        begun, begun_time = _timed(lambda m=m, start=start: gn.fit(m, start, "log", starts=1))
        cost.append(begun_time / fit_time)
        same.append(begun.rms <= 1.001 * fit.rms)
        alone.append(gn.fit(m, MODEL, "log", starts=1).rms <= 1.001 * fit.rms)
    base = np.array(rms.pop("the fit"))
    print(f"{len(names)} built-in materials: rms of the log loss over that of the fit of Lambertian + GGX")
    for key, found_rms in rms.items():
        ratio = np.array(found_rms) / base
        low, middle, high = np.quantile(ratio, [0.1, 0.5, 0.9])
        print(f"  {key}: median {middle:.2f} (10 to 90 %: {low:.2f} to {high:.2f}), below 1: {(ratio < 1).mean():.0%}")
    print(f"  time of an extraction over that of a fit: median {np.median(times):.2f}")
    print(
        f"  one start at the extracted GGX: the optimum of the default starts or a better one, for {np.mean(same):.0%},"
    )
    print(f"  in {np.median(cost):.2f} of the time; one start at the model's numbers: for {np.mean(alone):.0%}")


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    work()  # compiled
    begun = time.perf_counter()
    return work(), time.perf_counter() - begun


if __name__ == "__main__":
    main()
