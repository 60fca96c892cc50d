"""How fast each model is beside GGX: python benchmarks/models.py [--out FILE] [NAME ...]

f, pdf and sample of every model at its default parameters, and of a microfacet surface with each distribution of
normals, float32 NumPy arrays (N, 3), two threads. Ratios are GGX's time over the model's, round by round.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from timing import THREADS, Engine, machine, measure

import gonio as gn
from gonio.base.reflectance import Reflectance
from gonio.declared import discover
from gonio.formula.distribution import Distribution

COUNT = 1 << 18
ROUNDS = 7


def classes(kind: type, package: str) -> list[Any]:
    """The public classes of a kind in a folder of the package."""
    modules = discover.modules(package)
    found = {v for m in modules for v in vars(m).values() if isinstance(v, type) and v.__module__ == m.__name__}
    return sorted((v for v in found if issubclass(v, kind) and v.__name__[0] != "_"), key=lambda v: v.__name__)


def subjects() -> dict[str, Reflectance]:
    """Name -> material."""
    models = {c.__name__: c() for c in classes(Reflectance, "gonio.models")}
    return models | {
        f"Microfacet({c.__name__})": gn.Microfacet(c()) for c in classes(Distribution, "gonio.distributions")
    }


def directions(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.05, 1.0, COUNT), rng.uniform(-np.pi, np.pi, COUNT)
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).astype(np.float32)


WI, WO = directions(1), directions(2)
U = np.random.default_rng(3).random((COUNT, 2), dtype=np.float32)
METHODS: dict[str, Callable[[Any], Callable[[], Any]]] = {
    "f": lambda m: lambda: m.f(WI, WO),
    "pdf": lambda m: lambda: m.pdf(WI, WO),
    "sample": lambda m: lambda: m.sample(WO, U),
}


def row(name: str, m: Reflectance) -> str:
    """Millions per second of each method, and how fast that is beside GGX's in the same rounds."""
    ggx = gn.Microfacet(gn.GGX(0.3))
    cells = []
    for build in METHODS.values():
        own, base = measure([Engine(name, lambda: build(m)), Engine("GGX", lambda: build(ggx))], ROUNDS)  # noqa: B023  (called before the next turn)
        if own.failure:
            cells.append(f"{own.failure:<18}")
            continue
        ratio = float(np.median(base.seconds / own.seconds))
        cells.append(f"{COUNT / own.median * 1e-6:8.4g} {ratio:7.2f}  ")
    return f"{name:<34}" + "".join(cells).rstrip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", help="models; all if none is named")
    parser.add_argument("--out", type=Path, help="file for the table")
    asked = parser.parse_args()
    gn.engine.threads(THREADS)
    lines = [*machine(ROUNDS), "", f"Millions per second, and beside GGX with F = 1 (alpha 0.3); N = {COUNT}, float32."]
    lines.append(f"{'':<34}" + "".join(f"{method:>8} {'/GGX':>7}  " for method in METHODS).rstrip())
    print("\n".join(lines), flush=True)
    for name, m in subjects().items():
        if not asked.names or any(wanted in name for wanted in asked.names):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of parameters far out, which take as long
                lines.append(row(name, m))
            print(lines[-1], flush=True)
    if asked.out:
        asked.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
