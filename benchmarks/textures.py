"""f of materials whose parameters are images: python benchmarks/textures.py [rounds]

Millions of f a second of processor time of one thread, out=, float32, 1024 x 1024 places: the best of the rounds, and
the median of the ratio to plain numbers within a round. Every round runs each line once, in an order drawn anew, so
that other work on the machine falls on all of them. "image order": neighbours look up neighbouring texels, as in a
picture; "scattered": places are drawn at random, so that every texel comes from wherever the cache keeps it. "arrays":
m.at(uv=uv).f(wi, wo), the lookups by NumPy. Mitsuba, where it is installed: eval of `diffuse` with a `bitmap`, whose f
has the cosine too, wall clock on one thread.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from timing import machine

import gonio as gn

SIDE = 1024
TARGET = 100.0
"""Millions a second that textures of 512 x 512 texels are asked for."""


def directions(rng: np.random.Generator) -> np.ndarray:
    z, phi = rng.uniform(0.1, 1.0, SIDE * SIDE), rng.uniform(0.0, 2.0 * np.pi, SIDE * SIDE)
    return gn.direction(np.arccos(z), phi).astype(np.float32)


def painted(size: int, rng: np.random.Generator) -> gn.Reflectance:
    colours = gn.Texture(rng.random((size, size, 3)).astype(np.float32))
    rough = gn.Texture(rng.uniform(0.1, 0.6, (size, size)).astype(np.float32))
    return gn.Lambertian(colours) + gn.Microfacet(gn.GGX(rough), gn.Dielectric(1.5))


def lines() -> dict[str, Callable[[], object]]:
    """What is timed, by its name; the first is what ratios are to."""
    rng = np.random.default_rng(1)
    wi, wo, out = directions(rng), directions(rng), np.empty((SIDE * SIDE, 3), np.float32)
    across = (np.arange(SIDE) + 0.5) / SIDE
    ordered = np.stack(np.meshgrid(across, across), -1).reshape(-1, 2).astype(np.float32)
    scattered = rng.random((SIDE * SIDE, 2)).astype(np.float32)
    plain = gn.Lambertian([0.5, 0.3, 0.1]) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
    found: dict[str, Callable[[], object]] = {"numbers": lambda: plain.f(wi, wo, out)}
    for size in (128, 512, 2048):
        m = painted(size, rng)
        found[f"{size} x {size}, image order"] = lambda m=m: m.f(wi, wo, out, uv=ordered)
        found[f"{size} x {size}, scattered"] = lambda m=m: m.f(wi, wo, out, uv=scattered)
    m = painted(512, rng)
    found["512 x 512, image order, arrays"] = lambda: m.at(uv=ordered).f(wi, wo, out)
    colours = gn.Lambertian(gn.Texture(rng.random((512, 512, 3)).astype(np.float32)))
    found["Lambertian, 512 x 512, image order"] = lambda: colours.f(wi, wo, out, uv=ordered)
    found["Lambertian, 512 x 512, scattered"] = lambda: colours.f(wi, wo, out, uv=scattered)
    return found | mitsuba(rng.random((512, 512, 3)).astype(np.float32), wi, wo, ordered, scattered)


def mitsuba(
    texels: np.ndarray, wi: np.ndarray, wo: np.ndarray, ordered: np.ndarray, scattered: np.ndarray
) -> dict[str, Callable[[], object]]:
    try:
        import drjit as dr
        import mitsuba as mi
    except ImportError:
        return {}
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    bitmap = {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True, "filter_type": "bilinear"}
    bsdf = mi.load_dict({"type": "diffuse", "reflectance": bitmap})

    def call(uv: np.ndarray) -> Callable[[], object]:
        hit = dr.zeros(mi.SurfaceInteraction3f, len(uv))
        hit.wi, hit.uv = mi.Vector3f(wo.T), mi.Point2f(uv.T)
        other = mi.Vector3f(wi.T)
        dr.eval(hit, other)

        def run() -> None:
            value = bsdf.eval(mi.BSDFContext(), hit, other)
            dr.eval(value)
            dr.sync_thread()

        return run

    return {"Mitsuba diffuse, image order": call(ordered), "Mitsuba diffuse, scattered": call(scattered)}


def main(rounds: int = 31) -> None:
    gn.engine.threads(1)
    print("\n".join(machine(3)), "\n")
    calls = lines()
    for call in calls.values():
        call()
    seconds = {name: np.empty(rounds) for name in calls}
    rng, names = np.random.default_rng(2), list(calls)
    for k in range(rounds):
        for name in rng.permutation(names):
            clock = time.perf_counter if name.startswith("Mitsuba") else time.process_time
            calls[name]()  # finds its own arrays in the caches
            start = clock()
            calls[name]()
            seconds[name][k] = clock() - start
    print(f"{'f, Lambertian + GGX':<38} {'M/s':>7} {'/numbers':>9}")
    for name, taken in seconds.items():
        speed, ratio = SIDE * SIDE / taken.min() * 1e-6, np.median(seconds["numbers"] / taken)
        verdict = f"  >= {TARGET:g}: {'ok' if speed >= TARGET else 'short'}" if name.startswith("512") else ""
        print(f"{name:<38} {speed:7.1f} {ratio:9.2f}{verdict if 'arrays' not in name else ''}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
