"""Saving that is killed: copies of a warmed-up process save without end, until kill -9 at a random time."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from pathlib import Path

import matplotlib
import numpy as np

import gonio as gn
from gonio.figures._drawing import new_figure
from gonio.pictures.image import Image

Save = Callable[[Path, int], None]
"""Save one of two contents, 0 or 1, under a name."""


def table(k: int) -> gn.Reflectance:
    """A measurement of 40 x 3 numbers and more, which `k` tells from another."""
    nodes = {"theta_i": [0.1, 0.9, 1.2], "theta_o": [0.0, 0.3, 0.8, 1.1], "phi": np.linspace(0.0, np.pi, 12 + k)}
    values = np.random.default_rng(k).uniform(0.1, 0.9, (3, 4, 12 + k, 3)).astype("f4")
    return gn.Gridded("angles", nodes, values, mirrored=True, channels=("R", "G", "B"))


TABLES = [table(0), table(1)]
PLAIN = [gn.Lambertian([0.1, 0.2, 0.3]), gn.Microfacet(gn.GGX(0.3), gn.Conductor([0.2, 0.9, 1.1], 3.9))]
PICTURES = [Image(np.random.default_rng(k).uniform(size=(96, 96 + k, 3)).astype("f4")) for k in (0, 1)]


def saving(of: list[gn.Reflectance], **options: object) -> Save:
    return lambda path, k: gn.save(of[k], path, **options)


def picture(path: Path, k: int) -> None:
    PICTURES[k].save(path)


def figure(path: Path, k: int) -> None:
    os.environ["SOURCE_DATE_EPOCH"], matplotlib.rcParams["svg.hashsalt"] = "0", "gonio"  # or every file is another
    with new_figure(path, (2.0, 2.0), "") as made:
        made.add_subplot().plot([0.0, 1.0, k])


GROUPS: dict[str, dict[str, Save]] = {
    "text": {"a.csv": saving(TABLES), "a.json": saving(PLAIN)},
    "binary": {
        "a.binary": saving(PLAIN, format="CSAIL", resolution=(4, 4, 4, 8)),
        "a.bin": saving(PLAIN, format="UTIA"),
    },
    "gzip and zip": {"a.scatter.gz": saving(PLAIN, format="SCATFUN", nodes=8, orders=32), "a.zip": saving(TABLES)},
    "netCDF": {"a.nc": saving(TABLES)},
    "Zarr folder": {"a.zarr": saving(TABLES)},
    "pictures": {"a.png": picture, "a.exr": picture, "a.hdr": picture, "a.svg": figure, "a.pdf": figure},
}


@dataclass
class Outcome:
    """Numbers of kills, of what they found half-written or gone, and left: at once, and after the next save."""

    kills: int = 0
    damaged: int = 0
    missing: int = 0
    left: int = 0
    unswept: int = 0

    def __iadd__(self, other: Outcome) -> Outcome:
        return Outcome(*map(sum, zip(astuple(self), astuple(other), strict=True)))


def content(path: Path) -> object:
    """The bytes of a file, or of the files in a folder; None where there is none."""
    if path.is_dir():
        return {p.relative_to(path).as_posix(): p.read_bytes() for p in sorted(path.rglob("*")) if p.is_file()}
    return path.read_bytes() if path.exists() else None


def campaign(save: Save, path: Path, kills: int, seed: int = 0) -> Iterator[Outcome]:
    """The outcome of each kill of a process that saves under a name, where both contents are in turn."""
    whole, took = [], 0.0
    for k in (1, 0, 1, 0):
        start = time.perf_counter()
        save(path, k)
        took = time.perf_counter() - start
        whole.append(content(path))
    same = whole[0] == whole[2] and whole[1] == whole[3]
    assert same and whole[0] != whole[1], f"{path.name}: what is written changes from one save to the next"
    times, parent = random.Random(seed), os.getpid()
    for _ in range(kills):
        child = os.fork()
        if not child:
            try:
                k = 0
                while os.getppid() == parent:
                    save(path, k := 1 - k)
            finally:
                os._exit(1)
        time.sleep(times.uniform(0.0, 2.0 * took))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        assert os.WIFSIGNALED(status), f"{path.name}: the child ended by itself"
        found = content(path)
        others = len(os.listdir(path.parent)) - (found is not None)
        outcome = Outcome(1, found is not None and found not in whole, found is None, others > 0)
        save(path, 0)
        outcome.unswept = len(os.listdir(path.parent)) > 1
        yield outcome
