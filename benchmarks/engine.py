"""How fast gonio is: against Mitsuba, Dr.Jit, PyTorch, JAX and plain NumPy, and against the speed of memory.

    python benchmarks/engine.py [RGL_FILE.bsdf] [--out FILE] [--quick] [--rounds N] [--only ROW ...] [--large]

Every row says what is timed. Engines of one row take turns in one process (`timing.py`), on two threads, with the same
number of channels, and all results are stored. Peers that are not installed are reported as such. The last column is
the relative difference of results that 99 % of them keep to: the proof that the work is equal.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import others
from timing import HEAD, Case, Engine, copy_engine, first_line, limit, machine, measure, table

import gonio as gn
from gonio.formats.merl import MERL, SCALE

ETA, K = (0.18, 0.42, 1.37), (3.42, 2.35, 1.77)  # about gold, for red, green, blue
ALPHA = 0.3
WARM = 0.005
"""Seconds of calls before one that is timed as warm."""


@dataclass
class Settings:
    """What was asked for on the command line."""

    rounds: int
    quick: bool
    file: str | None
    large: bool

    def count(self, n: float) -> int:
        return int(n * (0.1 if self.quick else 1.0))


def directions(n: int, seed: int) -> np.ndarray:
    """n unit vectors (n, 3) float32, uniform over the hemisphere above a cosine of 0.02."""
    random = np.random.default_rng(seed)
    z, phi = random.uniform(0.02, 1.0, n), random.uniform(0.0, 2.0 * np.pi, n)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1).astype(np.float32)


def pairs(n: int) -> tuple[np.ndarray, np.ndarray]:
    """wi and wo."""
    return directions(n, 1), directions(n, 2)


# Materials, and the plugins of Mitsuba that are the same.


def conductor(distribution: Any, rgb: bool = False) -> gn.Reflectance:
    """A rough metal with the masking that Mitsuba's `roughconductor` has, as its values show: separable."""
    return gn.Microfacet(distribution, gn.Conductor(*((ETA, K) if rgb else (ETA[0], K[0]))), "separable")


def roughconductor(distribution: str, rgb: bool = False, alpha: float = ALPHA) -> dict:
    def spectrum(values: tuple) -> Any:
        return {"type": "rgb", "value": list(values)} if rgb else values[0]

    about = {"distribution": distribution, "alpha": alpha, "sample_visible": True}
    return {"type": "roughconductor", **about, "eta": spectrum(ETA), "k": spectrum(K)}


def plastic(rgb: bool) -> gn.Reflectance:
    return gn.Lambertian((0.6, 0.3, 0.1) if rgb else 0.6) + gn.Microfacet(gn.GGX(ALPHA), gn.Dielectric(1.5))


def roughplastic(rgb: bool) -> dict:
    diffuse = {"type": "rgb", "value": [0.6, 0.3, 0.1]} if rgb else 0.6
    return {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": ALPHA,
        "int_ior": 1.5,
        "diffuse_reflectance": diffuse,
    }


def synthetic_merl() -> MERL:
    """0.1/pi + 0.9 GGX on MERL's grid, a different colour in every channel; no data below the horizon, as there."""
    i, phi = np.arange(90) + 0.5, np.radians(np.arange(180) + 0.5)
    h, d, phi = np.meshgrid(np.radians(i * i / 90.0), np.radians(i), phi, indexing="ij")
    along, across, mean = np.sin(d) * np.cos(phi), np.sin(d) * np.sin(phi), np.cos(d)
    s, c = np.sin(h), np.cos(h)
    wi = np.stack([c * along + s * mean, across, c * mean - s * along], axis=-1)
    wo = np.stack([s * mean - c * along, -across, c * mean + s * along], axis=-1)
    f = (gn.Lambertian(0.1) + 0.9 * gn.Microfacet(gn.GGX(ALPHA))).f(wi, wo)
    f = np.where((wi[..., 2] > 0.0) & (wo[..., 2] > 0.0), f, -1.0)
    return MERL(np.stack([f * tint / scale for tint, scale in zip((1.0, 0.7, 0.4), SCALE, strict=True)]))


def _channels(rgb: bool) -> str:
    return "3 channels" if rgb else "1 channel"


# gonio's own engines.


def gonio_f(m: gn.Reflectance, wi: np.ndarray, wo: np.ndarray) -> list[Engine]:
    """m.f as a user calls it, and into an array that is there."""

    def into() -> Callable[[], Any]:
        out = m.f(wi, wo)
        return lambda: m.f(wi, wo, out=out)

    return [Engine("gonio f", lambda: lambda: m.f(wi, wo), values=np.asarray), Engine("gonio f, out=", into)]


def traffic(channels: int) -> int:
    """Bytes of one evaluation of f in float32: two directions read, the channels written."""
    return 4 * (2 * 3 + channels)


# Rows. Each yields lines, as soon as it has them.


def row_1(settings: Settings) -> Iterator[str]:
    """f of rough metals, NumPy to NumPy, against Mitsuba's eval on its own arrays"""
    n = settings.count(1e6)
    wi, wo = pairs(n)
    for name, distribution, targets in (("ggx", gn.GGX, (1.1, 1.2)), ("beckmann", gn.Beckmann, (1.1, 1.1))):
        for rgb, target in zip((False, True), targets, strict=True):
            m, variant = conductor(distribution(ALPHA), rgb), "llvm_ad_rgb" if rgb else "llvm_ad_mono"
            peer = others.mitsuba_eval(variant, roughconductor(name, rgb), wo, wi, target)
            note = "Mitsuba's Beckmann masking is a rational fit, to 6e-3" if name == "beckmann" else ""
            title = f"{distribution.__name__} conductor, {_channels(rgb)}, {variant}, N = {n:,}"
            yield from table(
                Case(title, n, traffic(3 if rgb else 1), gonio_f(m, wi, wo), [peer], note), settings.rounds
            )
    n = settings.count(1e5)
    wi, wo = wi[:n], wo[:n]
    m, peer = conductor(gn.GGX(ALPHA)), others.mitsuba_eval("llvm_ad_mono", roughconductor("ggx"), wo, wi, 0.9)
    title = f"GGX conductor, 1 channel, llvm_ad_mono, N = {n:,}, right after a pause of 10 ms"
    yield from table(Case(title, n, traffic(1), gonio_f(m, wi, wo), [peer], rested=True), 10 * settings.rounds)


def row_2(settings: Settings) -> Iterator[str]:
    """f of rough metals, one channel, against array libraries running gonio's own formula, from NumPy arrays"""
    n = settings.count(1e6)
    wi, wo = pairs(n)
    for distribution, targets in ((gn.GGX, (2.0, 4.0, 8.0)), (gn.Beckmann, (1.2, 4.0, 3.0))):
        m = conductor(distribution(ALPHA))
        peers = [
            others.drjit_f(m, wi, wo, targets[0], "TensorXf"),
            others.drjit_f(m, wi, wo, targets[0], "Array3f"),
            others.torch_f(m, wi, wo, targets[1]),
            others.jax_f(m, wi, wo, targets[2]),
            others.numpy_f(m, wi, wo, None, blocks=True),
            others.numpy_f(m, wi, wo, None, blocks=False),
        ]
        title = f"{distribution.__name__} conductor, 1 channel, N = {n:,}"
        yield from table(Case(title, n, traffic(1), gonio_f(m, wi, wo), peers), settings.rounds)


def row_3(settings: Settings) -> Iterator[str]:
    """f of sums and of Phong's lobe against a copy of memory, in bytes per second"""
    n = settings.count(1e6)
    wi, wo = pairs(n)
    for rgb in (False, True):
        variant = "llvm_ad_rgb" if rgb else "llvm_ad_mono"
        other = others.mitsuba_eval(variant, roughplastic(rgb), wo, wi, None, "Mitsuba roughplastic (unlike)")
        other.values = None
        title = f"Lambertian + GGX dielectric, {_channels(rgb)}, N = {n:,}"
        ours = gonio_f(plastic(rgb), wi, wo)
        yield from table(Case(title, n, traffic(3 if rgb else 1), ours, [copy_engine(0.5), other]), settings.rounds)
    ours = gonio_f(gn.ModifiedPhong(0.5, 20.0), wi, wo)
    yield from table(
        Case(f"ModifiedPhong, 1 channel, N = {n:,}", n, traffic(1), ours, [copy_engine(0.5)]), settings.rounds
    )


def row_4(settings: Settings) -> Iterator[str]:
    """f of a MERL table, trilinear, RGB, at random directions, against the same lookup elsewhere"""
    n = settings.count(1e6)
    wi, wo = pairs(n)
    m = synthetic_merl()
    peers = [
        others.numpy_f(m, wi, wo, 15.0, blocks=False),
        others.numpy_f(m, wi, wo, None, blocks=True),
        others.drjit_f(m, wi, wo, 2.5, "Array3f"),
    ]
    title = f"MERL (3, 90, 90, 180), trilinear, 3 channels, N = {n:,}; GB/s without the table"
    yield from table(Case(title, n, traffic(3), gonio_f(m, wi, wo), peers), settings.rounds)


def row_5(settings: Settings) -> Iterator[str]:
    """RGL: f, sample and pdf of a measured file against Mitsuba's `measured`"""
    if settings.file is None:
        yield "no file given: name an RGL .bsdf on the command line"
        return
    m = gn.load(settings.file)
    if m.channel_names != ("R", "G", "B"):
        yield f"{settings.file}: not an RGB file; Mitsuba carries another number of wavelengths, the work is not equal"
        return
    plugin = {"type": "measured", "filename": settings.file}
    n = settings.count(1e6)
    wi, wo = pairs(n)
    name = f"{Path(settings.file).name[:30]}, 3 channels, llvm_ad_rgb, N = {n:,}"
    # The plugin's si.wi is the direction that the sample was lit from.
    peer = others.mitsuba_eval("llvm_ad_rgb", plugin, wi, wo, 2.0)
    yield from table(Case(f"f of {name}", n, traffic(3), gonio_f(m, wi, wo), [peer]), settings.rounds)
    yield from _sampling(m, "llvm_ad_rgb", plugin, 3, (1.6, 1.5), name, n, settings.rounds)
    yield "   densities differ, as gonio mixes a cosine lobe into the file's; mean weights too, as Mitsuba takes the wo"
    yield "   that it samples for for the direction that the file is lit from"


def row_6(settings: Settings) -> Iterator[str]:
    """sample (visible normals) and pdf of GGX and Beckmann against Mitsuba's"""
    n = settings.count(1e6)
    m, plugin = conductor(gn.GGX(ALPHA)), roughconductor("ggx")
    name = f"GGX conductor, 1 channel, llvm_ad_mono, N = {n:,}"
    yield from _sampling(m, "llvm_ad_mono", plugin, 1, (1.2, 1.4), name, n, settings.rounds)
    m, plugin = conductor(gn.Beckmann(ALPHA)), roughconductor("beckmann")
    name = f"Beckmann conductor, 1 channel, llvm_ad_mono, N = {n:,}"
    yield from _sampling(m, "llvm_ad_mono", plugin, 1, (None, None), name, n, settings.rounds)


def _sampling(
    m: gn.Reflectance, variant: str, plugin: dict, channels: int, targets: tuple, name: str, n: int, rounds: int
) -> Iterator[str]:
    """pdf and sample; the results compared are the densities and the mean weight."""
    of_pdf, of_sample = targets
    wi, wo = pairs(n)
    u = np.random.default_rng(3).random((n, 2), np.float32)
    ours = Engine("gonio pdf", lambda: lambda: m.pdf(wi, wo), values=np.asarray)
    peer = others.mitsuba_pdf(variant, plugin, wo, wi, of_pdf)
    yield from table(Case(f"pdf of {name}", n, traffic(1), [ours], [peer]), rounds)
    ours = Engine("gonio sample", lambda: lambda: m.sample(wo, u), values=_mean_weight)
    peer = others.mitsuba_sample(variant, plugin, wo, u, of_sample)
    moved = 4 * (3 + 2 + 3 + channels + 1) + 1
    yield from table(Case(f"sample of {name}; compared: mean weights", n, moved, [ours], [peer]), rounds)


def _mean_weight(sample: gn.results.Sample) -> np.ndarray:
    return sample.weight.reshape(len(sample.pdf), -1).mean(axis=0, dtype=np.float64)


def row_7(settings: Settings) -> Iterator[str]:
    """memory traffic: f of GGX against a copy, in bytes per second, at four times the directions"""
    n = settings.count(4e6)
    wi, wo = pairs(n)
    ours = gonio_f(conductor(gn.GGX(ALPHA)), wi, wo)
    title = f"GGX conductor, 1 channel, N = {n:,}"
    yield from table(Case(title, n, traffic(1), ours, [copy_engine(0.85)]), settings.rounds)


def row_8(settings: Settings) -> Iterator[str]:
    """latency: one call of f, median of many, GGX, float32"""
    m = conductor(gn.GGX(ALPHA))
    wi, wo = pairs(1000)
    for label, a, b, most in (("1 direction", wi[0], wo[0], 4.0), ("1000 directions", wi, wo, 6.0)):
        yield limit(f"f of {label}", _call_time(partial(m.f, a, b), 300 * settings.rounds) * 1e6, "us", most)


def _call_time(call: Callable[[], Any], times: int) -> float:
    seconds = []
    for _ in range(times + times // 10):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds[times // 10 :]))


def row_9(settings: Settings) -> Iterator[str]:
    """start: first f (GGX, 1000 directions) of fresh processes, with an empty and a filled GONIO_CACHE_DIR"""
    cold, warm = [], []
    _child("first")  # Python compiles what it imports
    for _ in range(settings.rounds):
        with tempfile.TemporaryDirectory() as folder:
            cold.append(_child("first", GONIO_CACHE_DIR=folder))
            warm.append(_child("first", GONIO_CACHE_DIR=folder))
    ms = 1e3 * np.median([*cold, *warm], axis=0)
    yield limit("import numpy", ms[0], "ms", None)
    yield limit("import gonio, after numpy", ms[1], "ms", None)
    yield limit("first f, nothing on disk", 1e3 * np.median(cold, axis=0)[2], "ms", 80.0)
    yield limit("first f, compiled by an earlier process", 1e3 * np.median(warm, axis=0)[2], "ms", 5.0)
    yield limit("second f", ms[3], "ms", None)


def _child(*arguments: str, **environment: str) -> list[float]:
    """The numbers that child.py prints."""
    command = [sys.executable, str(others.CHILD), *arguments]
    env = {**os.environ, **environment}
    env.pop("PYTHONDONTWRITEBYTECODE", None)  # installed packages are not compiled anew in each process
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"child.py {' '.join(arguments)}: {done.stderr.strip().splitlines()[-1]}")
    return [float(x) for x in done.stdout.split()]


def row_10(settings: Settings) -> Iterator[str]:
    """albedo at 64 angles to 1e-4 (GGX conductor, float64), against Mitsuba's sampling to an RMS of 1e-4"""
    theta = (np.arange(64) + 0.5) * (np.pi / 128.0)
    wi, samples = gn.direction(theta, 0.7), settings.count(1 << 14)
    for alpha in (0.02, 0.8) if settings.quick else (0.01, 0.02, 0.05, 0.1, 0.3, 0.8):
        m = conductor(gn.GGX(alpha))
        exact = gn.albedo(m, wi, 1e-6)
        yield limit(f"alpha = {alpha:g}: gonio, error", np.abs(gn.albedo(m, wi) - exact).max(), "", 1e-4)
        estimates: list[np.ndarray] = []
        ours = Engine("gonio", lambda m=m: lambda: gn.albedo(m, wi))
        peer = Engine("Mitsuba", partial(_estimating, roughconductor("ggx", alpha=alpha), wi, samples, estimates))
        own, other = measure([ours, peer], settings.rounds)
        yield limit("gonio", own.median * 1e3, "ms", None)
        if other.failure:
            yield f"   Mitsuba {other.failure}"
            continue
        error = float(np.sqrt(np.mean((np.array(estimates) - exact) ** 2)))
        more = (error / 1e-4) ** 2
        yield limit(f"Mitsuba, {samples} samples an angle: RMS error {error:.1e}", other.median * 1e3, "ms", None)
        yield limit(f"Mitsuba, scaled to 1e-4 by {more:.3g}", other.median * more * 1e3, "ms", None)
        ratio = float(np.median(more * other.seconds / own.seconds))
        yield f"   gonio/it {ratio:.3g}, target >= 20 {'ok' if ratio >= 20.0 else 'short'}"


def _estimating(plugin: dict, wi: np.ndarray, samples: int, kept: list[np.ndarray]) -> Callable[[], Any]:
    estimate = others.mitsuba_albedo("llvm_ad_mono", plugin, wi, samples)
    return lambda: kept.append(estimate())


def row_11(settings: Settings) -> Iterator[str]:
    """value and derivatives by 5 parameters per sample, stored, against the value alone"""
    n = settings.count(1e6)
    wi, wo = pairs(n)
    m = 0.9 * gn.Microfacet(gn.GGX(0.2, 0.35), gn.Conductor(ETA[0], K[0]))
    if not hasattr(m, "jacobian"):
        yield "no m.jacobian in this gonio"
        return
    value = Engine("gonio f", lambda: lambda: m.f(wi, wo))
    both = Engine("gonio jacobian", lambda: lambda: m.jacobian(wi, wo))
    alone, full = measure([value, both], settings.rounds)
    for t in (alone, full):
        yield limit(t.engine.name, t.median * 1e3, "ms", None) if not t.failure else f"   {t.engine.name} {t.failure}"
    if not (alone.failure or full.failure):
        yield limit("jacobian over f", float(np.median(full.seconds / alone.seconds)), "times", 5.0)


def row_12(settings: Settings) -> Iterator[str]:
    """scaling: nanoseconds per evaluation of GGX, 1 channel, over N, warm; and how much memory one f takes"""
    counts = [settings.count(n) for n in (1e5, 1e6, 1e7)] + ([100_000_000] if settings.large else [])
    m = conductor(gn.GGX(ALPHA))
    wi, wo = pairs(counts[-1])
    plain = [gonio_f(m, wi[:n], wo[:n])[0] for n in counts]
    into = [gonio_f(m, wi[:n], wo[:n])[1] for n in counts]
    timed = measure([*plain, *into], settings.rounds, warm=WARM)
    for label, part in (("f", timed[: len(counts)]), ("f, out=", timed[len(counts) :])):
        ns = [t.median / n * 1e9 for t, n in zip(part, counts, strict=True)]
        for n, each in zip(counts, ns, strict=True):
            yield limit(f"gonio {label}, N = {n:,}", each, "ns", None)
        yield limit(f"gonio {label}, largest over smallest", max(ns) / min(ns), "times", 1.3)
    grown, needed = _child("memory", str(counts[-1]))
    yield limit("memory of the largest over inputs and outputs", grown / needed, "times", None)


ROWS = dict(enumerate((row_1, row_2, row_3, row_4, row_5, row_6, row_7, row_8, row_9, row_10, row_11, row_12), 1))


LEGEND = (
    "{rounds} rounds: speed is the median, best that of the fastest round: far apart, others used the cores meanwhile.",
    "gonio/it is the median of the rounds' ratios of speed. GB/s: inputs and outputs.",
    "Target met by f as called plainly: ok; only with an array for the results: out=; else: short.",
    "99%: relative difference of the peer's results from gonio's that 99 % of them keep to.",
)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("file", nargs="?", metavar="RGL_FILE", help="RGB .bsdf file for row 5")
    parser.add_argument("--out", type=Path, help="write the same text to this file")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="7 rounds, a tenth of the directions: shows that all works, says little about speed",
    )
    parser.add_argument("--rounds", type=int, help="15, or 7 with --quick; more where others use the machine")
    parser.add_argument("--only", type=int, nargs="+", choices=sorted(ROWS), metavar="ROW", help="1 to 12")
    parser.add_argument("--large", action="store_true", help="row 12 up to 1e8 directions (2.8 GB)")
    return parser.parse_args()


def main() -> None:
    asked = arguments()
    others.use_two_threads()
    settings = Settings(asked.rounds or (7 if asked.quick else 15), asked.quick, asked.file, asked.large)
    lines: list[str] = []

    def say(line: str = "") -> None:
        lines.append(line)
        print(line, flush=True)

    for line in machine(settings.rounds):
        say(line)
    for line in LEGEND:
        say(line.format(rounds=settings.rounds))
    say(HEAD)
    for i in asked.only or ROWS:
        say(f"\n{i}. {ROWS[i].__doc__} [load {os.getloadavg()[0]:.1f}]")
        try:
            for line in ROWS[i](settings):
                say(line)
        except Exception as error:  # one row that fails costs only itself
            say(f"   failed: {first_line(error)}")
    if asked.out:
        asked.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
