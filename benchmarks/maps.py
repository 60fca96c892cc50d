"""How fast maps are integrated, and tables run on PyTorch: python benchmarks/maps.py [--out FILE] [--data FOLDER]

Maps of 10^6 places are set beside the same integrals place by place: the mean time of some of them, times their number.
Seconds of the processor are those of all threads together: what a call takes at most where nothing else runs, and what
targets are compared with. Errors are the largest differences from integrals of 20 places to 1e-5.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from timing import machine

import gonio as gn
from gonio.formula import tree

COUNT = 1_000_000
ALONE = 20
"""Places that are integrated by themselves."""
SUN = gn.direction(0.6, 0.3)
TARGETS = {"Ross-Li, white-sky": 0.2, "Hapke, white-sky": 5.0}
"""Seconds."""
TABLES = ("rgl/cc_ibiza_sunset_rgb.bsdf", "nbrdf/gold-metallic-paint.h5")


def maps() -> dict[str, gn.Reflectance]:
    """Maps of random numbers in ranges that surfaces have."""
    rng = np.random.default_rng(0)

    def between(low: float, high: float) -> np.ndarray:
        return rng.uniform(low, high, (COUNT, 1))

    return {
        "Ross-Li": gn.RossLi(between(0.1, 0.4), between(0.0, 0.2), between(0.0, 0.08)),
        "RPV": gn.RPV(between(0.05, 0.4), between(0.6, 1.1), between(-0.3, 0.3)),
        "Hapke": gn.Hapke(
            between(0.1, 0.6),
            between(0.1, 0.4),
            between(0.0, 0.6),
            between(0.5, 1.0),
            between(0.03, 0.15),
            between(0.1, 0.5),
        ),
        "Lambertian + GGX": gn.Lambertian(between(0.1, 0.5))
        + gn.Microfacet(gn.GGX(between(0.2, 0.6)), gn.Dielectric(1.5)),
    }


def at(m: gn.Reflectance, k: int) -> gn.Reflectance:
    """The material at one place."""
    return tree.each(m, lambda x: x[k] if np.ndim(x) > 1 else x)


def timed(call: Callable[[], Any], rounds: int = 3) -> tuple[Any, float, float]:
    """The last result, and the least of seconds and of seconds of the processor; the first call is not counted."""
    call()
    seconds, spent = [], []
    for _ in range(rounds):
        began, used = time.perf_counter(), time.process_time()
        result = call()
        seconds.append(time.perf_counter() - began)
        spent.append(time.process_time() - used)
    return result, min(seconds), min(spent)


def of_maps() -> list[str]:
    integrals: dict[str, Callable[..., Any]] = {
        "white-sky": lambda m, **more: gn.reflectance(m, **more),
        "black-sky": lambda m, **more: gn.albedo(m, SUN, **more),
        "under ConstantLight": lambda m, **more: gn.reflected_radiance(m, gn.ConstantLight(1.0), SUN, **more),
    }
    lines = [f"{COUNT:,} places: seconds, of the processor; place by place over that; largest error", ""]
    for name, m in maps().items():
        for what, integral in integrals.items():
            found, seconds, spent = timed(lambda integral=integral, m=m: integral(m))
            places = np.linspace(0, COUNT - 1, ALONE).astype(int)
            integral(at(m, 0))
            began = time.process_time()
            for k in places:
                integral(at(m, k))
            alone = (time.process_time() - began) / ALONE * COUNT
            worst = max(
                abs(float(found[k, 0]) - float(np.ravel(integral(at(m, k), tolerance=1e-5))[0])) for k in places
            )
            target = TARGETS.get(f"{name}, {what}")
            verdict = "" if target is None else f"  <= {target} s {'ok' if spent <= target else 'short'}"
            times = f"{seconds:8.3f} s {spent:8.3f} s {alone / spent:10,.0f} times"
            lines.append(f"   {f'{name}, {what}':38s}{times}  {worst:.0e}{verdict}")
            print(lines[-1], flush=True)
    return lines


def of_tables(data: Path) -> list[str]:
    import torch

    lines = ["", "f on PyTorch, without gradients: microseconds a direction; beside NumPy", ""]
    rng = np.random.default_rng(0)
    for table in TABLES:
        m = gn.load(data / table)
        for count in (100, 10_000, 200_000):
            wi, wo = (gn.direction(rng.uniform(0.0, 1.4, count), rng.uniform(0.0, 6.0, count)) for _ in range(2))
            wi, wo = wi.astype(np.float32), wo.astype(np.float32)
            _, ours, _ = timed(lambda m=m, wi=wi, wo=wo: m.f(wi, wo), 20)
            a, b = torch.tensor(wi), torch.tensor(wo)
            _, theirs, _ = timed(lambda m=m, a=a, b=b: m.f(a, b), 20)
            micro = 1e6 / count
            lines.append(
                f"   {Path(table).name:28s}{count:8,} directions {theirs * micro:8.3f}, NumPy {ours * micro:8.3f}: "
                f"{theirs / ours:.1f} times"
            )
            print(lines[-1], flush=True)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--data", type=Path, help="folder of measurements; without it no tables are timed")
    arguments = parser.parse_args()
    lines = [*machine(5), "", *of_maps()]
    lines += of_tables(arguments.data) if arguments.data else []
    if arguments.out:
        arguments.out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
