"""How long stacks take: python benchmarks/layers.py [--out FILE]

For each stack: the nodes and orders that a tolerance chooses, the seconds that its tables take (the second time: what
is compiled is kept), nanoseconds of one f, and f beside that of tolerance 1e-5: median and 99 % of relative errors.
Then the milliseconds of albedos: of the first, which integrates at some polar angles, and of more; and of a white sky.
"""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path

import numpy as np
from timing import machine

import gonio as gn

COUNT = 1 << 17
GOLD = gn.Microfacet(gn.GGX(0.2), 0.9)
STACKS = {
    "coat, paint, Lambertian": ([gn.Interface(1.5), gn.Medium(1.0, 0.9, 0.8)], gn.Lambertian(0.5)),
    "rough coat 0.1, metal 0.1": ([gn.RoughInterface(1.5, 0.1)], gn.Microfacet(gn.GGX(0.1), 0.9)),
    "rough coat 0.1, paint, metal 0.2": ([gn.RoughInterface(1.5, 0.1), gn.Medium(1.0, 0.9, 0.5)], GOLD),
    "two rough coats, paint": ([gn.RoughInterface(1.4, 0.2), gn.Medium(2.0, 1.0), gn.RoughInterface(1.2, 0.1)], GOLD),
    "haze, g = 0.9": ([gn.Medium(2.0, 0.99, 0.9)], gn.Lambertian(0.2)),
}

WHITE = gn.Lambertian(1.0)
LIT = {
    "coat, three channels": ([gn.Interface(1.5), gn.Medium(0.5, [0.9, 0.8, 0.7])], gn.Lambertian(0.5)),
    "medium, g = 0.95, on white": ([gn.Medium(1.0, 1.0, 0.95)], WHITE),
    "thinner medium on white": ([gn.Interface(1.0 / 1.5), gn.Medium(1.0, 1.0, 0.5)], WHITE),
    "pane with a medium, g = 0.9": ([gn.Interface(1.5), gn.Medium(1.0, 0.95, 0.9), gn.Interface(1.0 / 1.5)], None),
}


def directions(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.05, 1.0, COUNT), rng.uniform(-np.pi, np.pi, COUNT)
    return gn.direction(np.arccos(z), phi)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path)
    wi, wo = directions(1), directions(2)
    lines = [
        *machine(3),
        "",
        f"{'':34}{'tolerance':>10}{'nodes':>7}{'orders':>7}{'s':>8}{'ns':>7}{'median':>9}{'99 %':>9}",
    ]
    for name, (layers, base) in STACKS.items():
        exact = gn.Stack(layers, base, tolerance=1e-5).f(wi, wo)
        for tolerance in (1e-2, 1e-3, 1e-4):
            gn.Stack(layers, base, tolerance=tolerance).f(wi, wo)
            start = time.perf_counter()
            m = gn.Stack(layers, base, tolerance=tolerance)
            m.f(wi[:1], wo[:1])
            built, start = time.perf_counter() - start, time.perf_counter()
            off = np.abs(m.f(wi, wo) - exact) / exact
            each = (time.perf_counter() - start) / COUNT * 1e9
            median, most = np.percentile(off, [50.0, 99.0])
            row = f"{name:34}{tolerance:10g}{m.nodes:7d}{m.orders:7d}{built:8.2f}{each:7.0f}{median:9.0e}{most:9.0e}"
            lines.append(row)
            print(row, flush=True)
    lines += ["", f"{'albedos [ms]':34}{'first':>9}{'400':>9}{'1e5':>9}{'first sky':>11}{'sky':>9}"]
    steep = gn.direction(np.linspace(0.0, 1.55, 400), 0.0)
    for name, (layers, base) in LIT.items():
        m = gn.Stack(layers, base)
        m.f(wi[:1], wo[:1])
        gn.remote_sensing.white_sky_albedo(gn.Stack(layers, base, tolerance=0.1))  # compiles
        calls = [partial(gn.albedo, m, w) for w in (steep[:1], steep, wi[:100_000])]
        took = []
        for call in (*calls, *2 * [partial(gn.remote_sensing.white_sky_albedo, m)]):
            start = time.perf_counter()
            call()
            took.append((time.perf_counter() - start) * 1e3)
        row = f"{name:34}{took[0]:9.1f}{took[1]:9.1f}{took[2]:9.1f}{took[3]:11.1f}{took[4]:9.1f}"
        lines.append(row)
        print(row, flush=True)
    out = parser.parse_args().out
    if out is not None:
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
