"""What fluorescence costs: a matrix of 41 x 41 wavelengths for each pair of directions, and a material under a light.

    python benchmarks/fluorescence.py [--out FILE] [--rounds N]

One thread, results in the processor's cache (16, 64 and 256 pairs of directions). Each number is the best of the
rounds, in nanoseconds for an element of the matrix, or for a wavelength of the value. Rows take turns.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from timing import machine

import gonio as gn

NM = np.linspace(380.0, 780.0, 41)
EMISSION = np.exp(-(((NM - 560.0) / 30.0) ** 2))
DYE = gn.FluorescentLambertian(
    np.linspace(0.1, 0.9, 41),
    0.9 * np.exp(-(((NM - 450.0) / 40.0) ** 2)),
    EMISSION / EMISSION.sum(),
    0.9,
    wavelength=NM,
)
MEASURED = np.tril(np.full((41, 41), 0.01), -1) + np.diag(np.linspace(0.1, 0.6, 41))
MATERIALS = {
    "Donaldson's matrix, diffuse": gn.Donaldson(MEASURED, wavelengths=NM),
    "Donaldson's matrix, GGX": gn.Donaldson(MEASURED, gn.Microfacet(gn.GGX(0.3)), wavelengths=NM),
    "dye": DYE,
    "dye + dielectric GGX": DYE + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5)),
    "dye under a smooth surface": gn.Coated(DYE),
    "dye under a rough surface": gn.RoughCoated(DYE),
    "smooth, eta by wavelength": gn.Coated(DYE, eta=1.5 + 0.02 * (500.0 / NM) ** 2),
}
BATCHES = (16, 64, 256)


def directions(count: int, dtype: str) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions."""
    u = np.random.default_rng(1).random((count, 4))
    pairs = ((u[:, 0], u[:, 1]), (u[:, 2], u[:, 3]))
    wi, wo = (gn.direction(np.arccos(0.02 + 0.98 * a), 2.0 * np.pi * b).astype(dtype) for a, b in pairs)
    return wi, wo


def cost(function: Callable, *args: np.ndarray) -> float:
    """Nanoseconds for a number of the result, of calls that take a millisecond at least in all."""
    size = function(*args).size
    calls, start = 0, time.perf_counter()
    while time.perf_counter() - start < 1e-3:
        function(*args)
        calls += 1
    return (time.perf_counter() - start) / calls / size * 1e9


def rows(dtype: str, rounds: int) -> dict[str, list[float]]:
    """The best of some rounds, in which rows take turns: for each batch of the matrix, then of f under a light."""
    lit = {name: m.under(np.ones(41)) for name, m in MATERIALS.items()}
    best: dict[tuple[str, int], float] = {}
    for _ in range(rounds):
        for name, m in MATERIALS.items():
            for k, count in enumerate((*BATCHES, 256)):
                wi, wo = directions(count, dtype)
                function = m.reradiation if k < len(BATCHES) else lit[name].f
                best[name, k] = min(best.get((name, k), np.inf), cost(function, wi, wo))
    return {name: [best[name, k] for k in range(len(BATCHES) + 1)] for name in MATERIALS}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path)
    parser.add_argument("--rounds", type=int, default=40)
    options = parser.parse_args()
    gn.engine.threads(1)
    heads = [f"{count} pairs" for count in BATCHES]
    lines = [
        *machine(3)[:3],
        "41 x 41 wavelengths, one thread, in cache: ns for an element (goal: 2), best of the rounds;",
    ]
    lines.append("a light: ns for each of the 41 wavelengths of f under a light, which are sums over 41; 256 pairs.")
    for dtype, name in (("f4", "float32"), ("f8", "float64")):
        lines += ["", f"{name:<30}" + "".join(f"{head:>11}" for head in (*heads, "a light"))]
        for material, numbers in rows(dtype, options.rounds).items():
            lines.append(f"{material:<30}" + "".join(f"{x:>11.2f}" for x in numbers))
    text = "\n".join(lines) + "\n"
    sys.stdout.write(text)
    if options.out:
        options.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
