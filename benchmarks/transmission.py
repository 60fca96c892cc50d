"""Rough and smooth interfaces: f and pdf beside Mitsuba's `roughdielectric`, sampling, reciprocity, energy, time.

    python benchmarks/transmission.py

Needs `pip install mitsuba`. Pairs of directions are spread over the whole sphere. Mitsuba computes in single precision,
and near the critical angle its own rounding is what differs: gonio's single precision stands beside it, both against
gonio in double precision. For Beckmann's facets Mitsuba has a rational fit for the masking.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import timing

import gonio as gn

PAIRS, SAMPLES = 200_000, 1 << 20
MATERIALS = (
    ("ggx", 0.1, 0.1, 1.5),
    ("ggx", 0.3, 0.3, 1.5),
    ("ggx", 0.1, 0.4, 1.5),
    ("ggx", 0.3, 0.3, 1.33),
    ("ggx", 0.2, 0.2, 0.67),
    ("ggx", 0.25, 0.25, 2.4),
    ("beckmann", 0.2, 0.2, 1.5),
)
"""Distribution, slope scales along x and y, index behind over index in front."""


def material(kind: str, ax: float, ay: float, eta: float) -> gn.Reflectance:
    """gonio's."""
    facets = {"ggx": gn.GGX, "beckmann": gn.Beckmann}[kind](ax, ay)
    return gn.RoughDielectric(facets, eta)


def peer(mi: Any, kind: str, ax: float, ay: float, eta: float) -> Any:
    """Mitsuba's."""
    widths = {"distribution": kind, "alpha_u": ax, "alpha_v": ay}
    return mi.load_dict({"type": "roughdielectric", **widths, "int_ior": eta, "ext_ior": 1.0})


def directions(count: int, seed: int) -> np.ndarray:
    """Directions (count, 3) all over the sphere, in single precision."""
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)


def evaluated(mi: Any, bsdf: Any, wi: np.ndarray, wo: np.ndarray, mode: Any) -> tuple[np.ndarray, np.ndarray]:
    """Mitsuba's f |cos_i| and pdf; its wi is the direction that paths come from, gonio's wo."""
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(mode), si, mi.Vector3f(np.ascontiguousarray(wi.T)))
    return np.array(value)[0].astype(float), np.array(pdf).astype(float)


def spread(found: np.ndarray, true: np.ndarray, floor: float) -> float:
    """The relative difference that 99.9 % of values stay below, of those above this share of the largest."""
    used = true > floor * true.max()
    return float(np.quantile(np.abs(found - true)[used] / true[used], 0.999))


def agreement(mi: Any) -> Iterator[str]:
    """f and pdf beside Mitsuba's."""
    yield f"99.9 % of {PAIRS} pairs on the sphere differ by less, relative; of values above 1e-3 (1e-6) of the largest"
    yield f"{'material':<26}{'Mitsuba: f':>20}{'f, importance':>20}{'pdf':>20}{'gonio float32: f':>20}"
    wi, wo = directions(PAIRS, 1), directions(PAIRS, 2)
    exact_i, exact_o = (w / np.linalg.norm(w.astype(float), axis=-1, keepdims=True) for w in (wi, wo))
    for settings in MATERIALS:
        m, theirs = material(*settings), peer(mi, *settings)
        cos = np.abs(exact_i[:, 2])
        radiance, importance = m.f(exact_i, exact_o) * cos, m.f(exact_o, exact_i) * cos
        f, pdf = evaluated(mi, theirs, wi, wo, mi.TransportMode.Radiance)
        g, _ = evaluated(mi, theirs, wi, wo, mi.TransportMode.Importance)
        single = m.f(wi, wo).astype(float) * cos
        pairs = ((f, radiance), (g, importance), (pdf, m.pdf(exact_i, exact_o)), (single, radiance))
        cells = [f"{spread(a, b, 1e-3):.1e} ({spread(a, b, 1e-6):.1e})" for a, b in pairs]
        yield f"{name(settings):<26}" + "".join(f"{cell:>20}" for cell in cells)


def name(settings: tuple[str, float, float, float]) -> str:
    """A material in a few words."""
    kind, ax, ay, eta = settings
    return f"{kind} {ax:g}{'' if ax == ay else f'/{ay:g}'}, eta {eta:g}"


def sampling(mi: Any) -> Iterator[str]:
    """The variance of weights beside Mitsuba's, from in front (30, 70) and behind (110, 150 degrees)."""
    yield "variance of the weights of sample, over their squared mean: gonio / Mitsuba"
    u = np.random.default_rng(3).random((SAMPLES, 3), dtype=np.float32)
    angles = (30, 70, 110, 150)
    yield f"{'material':<26}" + "".join(f"{f'{angle} deg':>20}" for angle in angles)
    for settings in MATERIALS:
        m, theirs, cells = material(*settings), peer(mi, *settings), []
        for angle in angles:
            view = gn.direction(np.radians(angle), 0.4).astype(np.float32)
            ours = m.sample(np.broadcast_to(view, u.shape), u[:, :2].copy()).weight.astype(float)
            si = mi.SurfaceInteraction3f()
            si.wi = mi.Vector3f(*(mi.Float(np.full(SAMPLES, x, np.float32)) for x in view))
            point = mi.Point2f(np.ascontiguousarray(u[:, :2].T))
            _, weight = theirs.sample(mi.BSDFContext(), si, mi.Float(np.ascontiguousarray(u[:, 2])), point)
            other = np.array(weight)[0].astype(float)
            cells.append(" / ".join(f"{x.var() / x.mean() ** 2:.4f}" for x in (ours, other)))
        yield f"{name(settings):<26}" + "".join(f"{cell:>20}" for cell in cells)


def laws() -> Iterator[str]:
    """Reciprocity of f/n^2, and the light that is lost."""
    wi, wo = (directions(PAIRS, seed).astype(float) for seed in (1, 2))
    yield "f/n_o^2: largest relative difference on exchanging directions; largest |1 - R - T| at 22 angles"
    incidence = gn.direction(np.radians([*range(0, 90, 9), 89, 91, *range(99, 181, 9)]), 0.3)
    smooth = [gn.SmoothDielectric(eta) for eta in (1.33, 1.5, 2.4, 0.67)]
    rough = [gn.RoughDielectric(gn.GGX(alpha), eta) for alpha, eta in ((0.1, 1.5), (0.3, 1.5), (0.5, 2.4))]
    whole = [gn.KullaContyDielectric(alpha, eta) for alpha, eta in ((0.1, 1.5), (0.3, 1.5), (0.5, 2.4), (1.0, 1.33))]
    for m in (*smooth, *rough, *whole):
        n_i, n_o = (np.where(w[:, 2] < 0.0, m.index, 1.0) ** 2 for w in (wi, wo))
        there, back = m.f(wi, wo) / n_o, m.f(wo, wi) / n_i
        off = np.abs(there - back) / (0.5 * (there + back) + 1e-9 * there.max() + 1e-300)
        lost = float(np.abs(gn.absorptance(m, incidence, tolerance=1e-6 if m in rough else 1e-5)).max())
        yield f"{m!r:<64}{off.max():>10.1e}{lost:>10.1e}"


def speed() -> Iterator[str]:
    """Time per direction, on the sphere."""
    yield "ns per direction, float32, 1e6 directions, best of 7: f, pdf, sample"
    wi, wo = directions(1_000_000, 1), directions(1_000_000, 2)
    u = np.random.default_rng(3).random((len(wi), 2), dtype=np.float32)
    rough = gn.RoughDielectric(gn.GGX(0.2), 1.5), gn.KullaContyDielectric(0.2, 1.5)
    for m in (gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5)), *rough):
        calls = (lambda m=m: m.f(wi, wo), lambda m=m: m.pdf(wi, wo), lambda m=m: m.sample(wo, u))
        yield f"{type(m).__name__:<26}" + "".join(f"{best(call) / len(wi) * 1e9:>8.2f}" for call in calls)


def best(call: Any) -> float:
    """Seconds of the fastest of seven calls after one."""
    call()
    times = []
    for _ in range(7):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    gn.engine.threads(1)
    print("\n".join(timing.machine(7)[:3]), end="\n\n")
    for part in (agreement(mi), sampling(mi), laws(), speed()):
        print("\n".join(part), end="\n\n")


if __name__ == "__main__":
    main()
