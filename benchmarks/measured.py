"""How fast measurements are read and evaluated: python benchmarks/measured.py [--out FILE] [NAME ...]

Every format that can be written holds the same surface, at the format's usual resolution. Times of reading are beside
np.fromfile of the same bytes, speeds of f beside GGX, round by round; files are in the system's cache.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from models import COUNT, WI, WO
from timing import THREADS, Engine, limit, machine, measure

import gonio as gn
from gonio.errors import ParameterError
from gonio.formats import formats

ROUNDS = 7
REPEATS = 5
"""Of fresh processes."""
SURFACE = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
GRAY = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
SPECTRUM = gn.material("gold", wavelengths=[500.0, 525.0, 550.0, 575.0, 600.0])
NEEDED: dict[str, dict[str, Any]] = {"pab-opto": {"incident": (0.5, 0.0)}}
"""Options without which a format cannot be written."""
LARGE = {
    "MERL": (SURFACE, ".binary", {}),
    "RGL": (SURFACE, ".bsdf", {"resolution": 256}),
    "UTIA": (SURFACE, ".bin", {}),
    "WINDOW XML": (SPECTRUM, ".xml", {}),
    "WINDOW XML tree": (SURFACE, ".xml", {"tree": 3}),
}
"""Files whose memory is looked at: tables of some MB."""


class Subject(NamedTuple):
    """A file, or a folder."""

    name: str
    path: Path

    @property
    def files(self) -> list[Path]:
        return [p for p in self.path.rglob("*") if p.is_file()] if self.path.is_dir() else [self.path]

    @property
    def size(self) -> int:
        return sum(p.stat().st_size for p in self.files)


def written(folder: Path) -> Iterator[Subject]:
    """A file of every format that holds the surface, in colour if it can, or gray, or a metal at wavelengths."""
    for module in formats():
        if not hasattr(module, "write"):
            continue
        path = folder / f"{module.NAME.replace(' ', '-')}{module.SUFFIXES[0]}"
        for m in (SURFACE, GRAY, SPECTRUM):
            try:
                gn.save(m, path, module.NAME, **NEEDED.get(module.NAME, {}))
            except ParameterError:
                continue
            yield Subject(module.NAME, path)
            break


def raw_read(subject: Subject) -> None:
    for path in subject.files:
        np.fromfile(path, np.uint8)


def beside(name: str, own: Callable[[], Any], base: Callable[[], Any]) -> tuple[float, float, str]:
    """Seconds of a call, median, and how many times those of another it takes, in the same rounds; or why not."""
    a, b = measure([Engine(name, lambda: own), Engine("base", lambda: base)], ROUNDS)
    if a.failure:
        return float("nan"), float("nan"), a.failure
    return a.median, float(np.median(a.seconds / b.seconds)), ""


def child(*words: str) -> np.ndarray:
    """Medians of the numbers that fresh processes print."""
    command = [sys.executable, str(Path(__file__).with_name("child.py")), *words]
    search = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    told = [subprocess.run(command, env=search, capture_output=True, text=True, check=True) for _ in range(REPEATS)]
    return np.median([[float(x) for x in t.stdout.split()] for t in told], axis=0)


def row(subject: Subject) -> str:
    """Reading, and f, of one file."""
    seconds, ratio, failure = beside(subject.name, lambda: gn.load(subject.path), lambda: raw_read(subject))
    line = f"{subject.name:<22} {subject.size * 1e-6:8.3f} {1e3 * seconds:9.4g} {ratio:8.1f}"
    m, ggx = gn.load(subject.path), gn.Microfacet(gn.GGX(0.3))
    seconds, ratio, failure = beside(subject.name, lambda: m.f(WI, WO), lambda: ggx.f(WI, WO))
    if failure:
        return f"{line}  {failure}"
    steps = 1e3 * child("file", str(subject.path))
    return f"{line} {COUNT / seconds * 1e-6:9.4g} {1.0 / ratio:7.3f} {steps[1]:9.1f} {steps[2]:8.1f} {steps[3]:8.2f}"


def targets(folder: Path) -> Iterator[str]:
    """What was promised of single formats."""
    for name, (m, suffix, options) in LARGE.items():
        path = folder / f"large-{name.replace(' ', '-')}{suffix}"
        gn.save(m, path, name.removesuffix(" tree"), **options)
        subject = Subject(name, path)
        seconds, ratio, _ = beside(name, lambda: gn.load(path), lambda: raw_read(subject))  # noqa: B023  (called before the next turn)
        most = {"MERL": 0.3, "WINDOW XML": 0.5}.get(name)
        yield limit(f"{name}, {subject.size * 1e-6:.1f} MB: load", seconds, "s", most)
        yield limit("   beside np.fromfile", ratio, "times", None)
        table, allocated, grown = child("held", str(path))
        yield limit(f"   memory of load and first f, over a table of {table * 1e-6:.1f} MB", allocated / table, "", 3.0)
        yield limit("   what the process grew by, beside the table", grown / table, "times", None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", help="formats; all if none is named")
    parser.add_argument("--out", type=Path, help="file for the table")
    asked = parser.parse_args()
    gn.engine.threads(THREADS)
    lines = machine(ROUNDS)
    print("\n".join(lines), flush=True)

    def say(line: str) -> None:
        lines.append(line)
        print(line, flush=True)

    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as made:
        warnings.simplefilter("ignore")  # of the values, which are made up to be read quickly
        say("")
        for line in targets(Path(made)):
            say(line)
        say("")
        say(f"Files of one surface; f of {COUNT} float32 pairs, in millions per second, and beside GGX (alpha 0.3).")
        say("Load also as multiple of np.fromfile of the same bytes. A fresh process: load, first and second f [ms].")
        head = (
            ("MB", 8),
            ("load ms", 9),
            ("/bytes", 8),
            ("f", 9),
            ("/GGX", 7),
            ("load ms", 9),
            ("1st f", 8),
            ("2nd f", 8),
        )
        say(f"{'':<22} " + " ".join(f"{word:>{width}}" for word, width in head))
        for subject in written(Path(made)):
            if not asked.names or any(wanted in subject.name for wanted in asked.names):
                say(row(subject))
    if asked.out:
        asked.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
