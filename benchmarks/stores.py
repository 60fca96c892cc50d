"""Stores and tables of fits: changes that must be told apart, the same work that must be resumed, and what that takes.

    python benchmarks/stores.py > benchmarks/stores.txt

A change is of one number at random: of f, of u, of a direction, of a number, an array, a texture or a table of a model,
of an option, or of the version of gonio. It must be refused, and must not change the store; the same work, made anew,
must be resumed without a fit.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import xarray

import gonio as gn
from gonio.base import identity as identities
from gonio.fitting import many
from gonio.fitting.maps import map_chunks
from gonio.scenes import passes

COUNT, TEXELS = 6, (6, 4)


def work(random: np.random.Generator) -> dict[str, Any]:
    """What goes into fits, as plain arrays."""
    up = np.array([0.0, 0.0, 1.0])
    w = [gn.directions.normalize(random.normal(size=(*TEXELS, COUNT, 3)) * 0.4 + up) for _ in range(2)]
    return {
        "f": random.uniform(0.05, 0.2, (*TEXELS, COUNT)),
        "u": random.uniform(0.01, 0.02, (*TEXELS, COUNT)),
        "wi": w[0],
        "wo": w[1],
        "array": random.uniform(0.1, 0.2, 70),
        "table": random.uniform(0.01, 0.02, (3, 3, 5)).astype("f4"),
        "rho": np.array([0.3]),
        "texture": random.uniform(0.2, 0.8, (16, 16)).astype("f4"),
        "options": {"loss": "likelihood", "by": ["0.rho"]},
        "version": "1.0",
    }


def changed(given: dict[str, Any], part: str, random: np.random.Generator) -> dict[str, Any]:
    """The same with another number, in the last place that its kind has, or in any other."""
    if part == "options":
        new: Any = {"loss": "plain", "by": ["0.rho"]}
    elif part == "version":
        new = f"1.{random.integers(1, 1000)}"
    else:
        new = given[part].copy()
        at = int(random.integers(new.size))
        if part in ("wi", "wo"):
            new.reshape(-1, 3)[at // 3] = gn.directions.normalize(
                new.reshape(-1, 3)[at // 3] + 1e-9 * random.normal(size=3)
            )
        else:
            new.reshape(-1)[at] = np.nextafter(new.reshape(-1)[at], new.dtype.type(9.0))
        if np.array_equal(new, given[part]):
            return changed(given, part, random)
    return given | {part: new}


def model(given: dict[str, Any], by_channel: bool) -> Any:
    """A sum that is fitted by its first part alone; the others are fixed."""
    axes = {"theta_i": np.linspace(0, 1.5, 3), "theta_o": np.linspace(0, 1.5, 3), "phi": np.linspace(0, np.pi, 5)}
    m = gn.Lambertian(given["rho"][0]) + gn.Gridded("angles", axes, given["table"])
    return m + gn.Lambertian(given["array"]) if by_channel else m


class Fitted(Exception):
    """A fit that was not to be."""


def of_map(folder: Path, given: dict[str, Any]) -> Callable[[], Any]:
    """A map into a store, opened anew."""
    names = ("y", "x", "observation")
    arrays = {n: xarray.DataArray(given[n], dims=names).chunk(y=2, x=2) for n in ("f", "u")}
    for n in ("wi", "wo"):
        arrays[n] = xarray.DataArray(given[n], dims=(*names, "xyz"))
    return lambda: gn.fitting.fit_map_chunks(
        (arrays["wi"], arrays["wo"], arrays["f"], arrays["u"]), model(given, False), output=folder / "fits.zarr",
        **given["options"],
    )  # fmt: skip


def of_table(folder: Path, given: dict[str, Any]) -> Callable[[], Any]:
    """A material from a file, and another from memory, into a table."""
    axes = {"theta_i": [0.0, 0.5, 1.0], "theta_o": [0.0, 1.0], "phi": np.linspace(0, np.pi, 4)}
    values = np.resize(given["f"], (3, 2, 4, len(given["array"])))
    more = {"uncertainty": np.resize(given["u"], values.shape), "channels": [f"{k}" for k in range(values.shape[-1])]}
    gn.save(gn.Gridded("angles", axes, values, channels=more["channels"]), folder / "a.nc")
    sources = {"a": folder / "a.nc", "b": gn.Gridded("angles", axes, values, **more)}
    return lambda: gn.fitting.fit_many(
        sources, {"m": model(given, True)}, given["options"]["loss"].replace("likelihood", "log"), starts=1,
        output=folder / "fits.csv",
    )  # fmt: skip


def of_picture(folder: Path, given: dict[str, Any]) -> Callable[[], Any]:
    """A picture with a checkpoint."""
    m = gn.Lambertian(gn.Texture(given["texture"])) + gn.Lambertian(given["rho"][0]) + model(given, False)
    return lambda: gn.render(m, gn.ConstantLight(1.0), size=8, samples=32, checkpoint=folder / "light.npz")


PARTS = {
    of_map: ("f", "u", "wi", "wo", "table", "rho", "options", "version"),
    of_table: ("f", "u", "array", "table", "rho", "options", "version"),
    of_picture: ("texture", "table", "rho", "version"),
}


def results(folder: Path) -> dict[str, bytes]:
    """All that was written, by the names of files."""
    found = [p for name in ("fits*", "light*") for top in folder.glob(name) for p in (top, *top.rglob("*"))]
    return {str(p): p.read_bytes() for p in found if p.is_file()}


@contextlib.contextmanager
def version(of: dict[str, Any], fits: bool):
    """The version of gonio, and whether fits may be made."""

    def refused(*job: Any) -> Any:
        raise Fitted

    with mock.patch.object(identities, "__version__", of["version"]):
        if fits:
            yield
        else:
            with (
                mock.patch.object(map_chunks, "_fit_chunk", refused),
                mock.patch.object(many, "_rows", refused),
                mock.patch.object(passes, "share", refused),
            ):
                yield


def campaign(folder: Path, count: int) -> dict[str, int]:
    """How many of so many changes were told apart, and of so many repetitions resumed."""
    random = np.random.default_rng(0)
    found = {"told apart": 0, "resumed": 0}
    made: dict[Any, dict[str, Any]] = {}
    for kind in PARTS:
        (folder / kind.__name__).mkdir()
        made[kind] = work(random)
        with version(made[kind], True):
            kind(folder / kind.__name__, made[kind])()
    pairs = [(kind, part) for kind, parts in PARTS.items() for part in parts]
    for k in range(count):
        kind, part = pairs[k * 8 % len(pairs)]  # no common factor with 19: few of them are of all kinds
        at, given = folder / kind.__name__, made[kind]
        other = changed(given, part, random)
        with version(other, False):
            call, before = kind(at, other), results(at)
            try:
                call()
            except gn.errors.ParameterError:
                found["told apart"] += results(at) == before
            except Fitted:
                print("not told apart:", kind.__name__, part)
        again = {n: x.copy() if isinstance(x, np.ndarray) else x for n, x in given.items()}
        with version(again, False):
            table = kind(at, again)()
            found["resumed"] += not (kind is of_table and (table["status"] != "fitted").any())
    return found


def shares(folder: Path) -> None:
    """What it takes to look at what is done, beside its fits."""
    import scale_out

    scale_out.made(folder / "map.zarr")
    scan = xarray.open_zarr(folder / "map.zarr", consolidated=False)
    f = scan["f"].chunk(y=16, x=scale_out.SHAPE[1])
    for name, model, by, loss in (
        ("Lambertian + GGX, three numbers", scale_out.MODEL, scale_out.BY, "log"),
        ("Lambertian, one number", gn.Lambertian(), None, "plain"),
    ):
        times = []
        for _ in range(2):
            start = time.perf_counter()
            output = folder / f"{len(name)}.zarr"
            gn.fitting.fit_map_chunks((scan["wi"], scan["wo"], f), model, loss, by=by, output=output)
            times.append(time.perf_counter() - start)
        values = f.values
        hashed = time.perf_counter()
        identities.identity(values)
        hashed = (time.perf_counter() - hashed) / gn.engine.threads()
        texels = f.size // f.shape[-1]
        shares = [f"{100 * x / times[0]:.1f} %" for x in (hashed, times[1])]
        print(f"{texels} texels by {name}: fitted in {times[0]:.1f} s")
        print(f"  for the hash of f {hashed:.2f} s of that, {shares[0]}")
        print(f"  read, hashed and compared again in {times[1]:.1f} s, {shares[1]}")


def main() -> None:
    """Print what came of it."""
    import timing

    print("\n".join(timing.machine(3)))
    with tempfile.TemporaryDirectory() as name:
        print(f"100 changes and 100 repetitions: {campaign(Path(name), 100)}")
    with tempfile.TemporaryDirectory() as name:
        shares(Path(name))
    print(f"cores: {os.cpu_count()}")


if __name__ == "__main__":
    main()
