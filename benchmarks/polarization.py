"""What polarization costs: m.mueller beside m.f, one thread, in the caches: python benchmarks/polarization.py

Rounds take both in turn; the ratio is the median of the ratios of the rounds.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np

import gonio as gn

COUNT, ROUNDS, CALLS = 4000, 31, 20

MATERIALS = {
    "conductor": gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9)),
    "anisotropic conductor": gn.Microfacet(gn.GGX(0.3, 0.1), gn.Conductor(0.2, 3.9)),
    "dielectric": gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5)),
    "conductor, 3 channels": gn.Microfacet(gn.GGX(0.3), gn.Conductor([0.2, 0.5, 1.0], 3.9)),
    "varnish": gn.Coated(gn.Lambertian(0.5)),
    "Lambertian": gn.Lambertian(0.5),
}


def processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor()


def directions(dtype: str) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    theta, phi = np.arccos(rng.uniform(0.02, 1.0, (2, COUNT))), rng.uniform(0.0, 2.0 * np.pi, (2, COUNT))
    return tuple(gn.direction(t, p).astype(dtype) for t, p in zip(theta, phi, strict=True))


def seconds(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    for _ in range(CALLS):
        call()
    return (time.perf_counter() - began) / CALLS


def speed() -> list[str]:
    lines = [f"{'':24}{'f [ns]':>10}{'mueller [ns]':>15}{'ratio':>8}"]
    for dtype in ("float32", "float64"):
        wi, wo = directions(dtype)
        for name, m in MATERIALS.items():
            calls = [partial(m.f, wi, wo), partial(m.mueller, wi, wo)]
            for call in calls:
                call()
            rounds = np.array([[seconds(call) for call in calls] for _ in range(ROUNDS)])
            f, M = 1e9 * np.median(rounds, axis=0) / COUNT
            ratio = np.median(rounds[:, 1] / rounds[:, 0])
            lines.append(f"{f'{name}, {dtype}':34}{f:6.2f}{M:12.2f}{ratio:10.2f}")
    return lines


if __name__ == "__main__":
    gn.engine.threads(1)
    head = [
        f"{date.today()}; {processor()}; one thread; {COUNT} pairs; medians of {ROUNDS} rounds in turn",
        f"Python {platform.python_version()}, numpy {np.__version__}",
        "",
    ]
    text = "\n".join([*head, *speed()]) + "\n"
    print(text)
    Path(__file__).with_suffix(".txt").write_text(text, encoding="utf-8")
