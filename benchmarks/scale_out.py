"""Fits on several workers: texels of a map in a Zarr store, and what a tile costs beside its fits.

    python benchmarks/scale_out.py > benchmarks/scale_out.txt

Every worker is a process of one thread on a cluster of Dask on this machine. Times are those of the whole call, without
the start of the cluster.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import dask
import numpy as np
import timing
import xarray
from distributed import Client, LocalCluster

import gonio as gn
from gonio.fitting.samples import spread_pairs

SHAPE, COUNT, IDLE = (1024, 1024), 32, 2000
MODEL, BY = gn.Lambertian() + 1.0 * gn.Microfacet(gn.GGX(), gn.Schlick(0.04)), ["rho", "weight", "alpha"]
SETTINGS = {
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "GONIO_THREADS"), "1"),
    **dict.fromkeys(("MALLOC_TRIM_THRESHOLD_", "MALLOC_MMAP_THRESHOLD_"), str(2**28)),
}


def made(path: Path) -> None:
    """A map of Lambertian + GGX, seen 32 times with 1 % of noise."""
    random = np.random.default_rng(0)
    wi, wo = spread_pairs(4000)
    half = wi + wo
    near = (half[:, 2] / np.linalg.norm(half, axis=1) > np.cos(0.6)) & (np.minimum(wi[:, 2], wo[:, 2]) > 0.2)
    rows = random.choice(np.flatnonzero(near), COUNT, replace=False)
    wi, wo = wi[rows], wo[rows]
    f = np.empty((*SHAPE, COUNT), np.float32)
    for y in range(0, SHAPE[0], 64):
        shape = (64, SHAPE[1], 1, 1)
        alpha = np.exp(random.uniform(np.log(0.08), np.log(0.5), shape))
        m = gn.Lambertian(random.uniform(0.05, 0.8, shape)) + random.uniform(0.05, 1.0, shape) * gn.Microfacet(
            gn.GGX(alpha), gn.Schlick(0.04)
        )
        values = m.f(wi, wo)[..., 0]
        f[y : y + 64] = values * (1.0 + 0.01 * random.standard_normal(values.shape))
    maps = {"f": (("y", "x", "observation"), f)}
    maps |= {name: (("observation", "xyz"), w) for name, w in (("wi", wi), ("wo", wo))}
    xarray.Dataset(maps).to_zarr(path, consolidated=False, encoding={"f": {"chunks": (16, SHAPE[1], COUNT)}})


def seconds(folder: Path, tile: tuple[int, int], scheduler: object) -> float:
    """Of fits of the whole map."""
    output = folder / f"fits{time.time_ns()}.zarr"
    start = time.perf_counter()
    scan = xarray.open_zarr(folder / "map.zarr", consolidated=False)
    f = scan["f"].chunk(y=tile[0], x=tile[1])
    gn.fitting.fit_map_chunks((scan["wi"], scan["wo"], f), MODEL, "log", by=BY, output=output, scheduler=scheduler)
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    print("\n".join(timing.machine(3)))
    texels = SHAPE[0] * SHAPE[1]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made(folder / "map.zarr")
        times = {}
        for fixed in (True, False):
            environ = (
                SETTINGS
                if fixed
                else {k: SETTINGS[k] for k in list(SETTINGS)[:3]} | {"MALLOC_TRIM_THRESHOLD_": "65536"}
            )
            for workers in (1, 2) if fixed else (2,):
                with (
                    dask.config.set({"distributed.nanny.pre-spawn-environ": environ}),
                    LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
                    Client(cluster) as client,
                ):
                    seconds(folder, (16, SHAPE[1]), client)
                    best = min(seconds(folder, (16, SHAPE[1]), client) for _ in range(2))
                    times[workers, fixed] = best
                    told = "" if fixed else ", with the allocator as Dask sets it"
                    print(f"{workers} workers{told}: {texels / best:.0f} texels a second, {best:.1f} s")
                    if fixed and workers == 2:
                        jobs = [client.submit(abs, -k, pure=False) for k in range(IDLE)]
                        client.gather(jobs)
                        start = time.perf_counter()
                        client.gather([client.submit(abs, -k, pure=False) for k in range(IDLE)])
                        each = (time.perf_counter() - start) / IDLE
                        print(f"  {IDLE} jobs that do nothing: {1e3 * each:.2f} ms each, scheduler and client")
        print(f"2 workers beside 1: {times[1, True] / times[2, True]:.2f} times as fast")
        rate = texels / times[1, True]
        per_tile = 16 * SHAPE[1] / rate
        print(
            f"1000 workers: a chunk of 16 384 texels keeps a worker busy for {per_tile:.2f} s; at {1e3 * each:.2f} ms "
            f"a job the scheduler serves {per_tile / each:.0f} workers, and 1000 with chunks of "
            f"{16384 * max(1.0, 1000 * each / per_tile):.0f} texels"
        )
    print(f"cores: {os.cpu_count()}")


if __name__ == "__main__":
    main()
