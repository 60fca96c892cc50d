"""All that is damaged and read, by name: minimal files of every format, and datasets of those that hold datasets."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from io import BytesIO
from pathlib import Path

import xarray
from fuzzing import mutated, outcome, outcome_of
from fuzzing_datasets import mutated_dataset
from seeds import SEEDS, mcd43, small_grid, small_rows

import gonio as gn
from gonio.measured.mcd43 import read_dataset


def _file(name: str, path: Path) -> Callable[[int], str]:
    seed = SEEDS[name]()
    return lambda number: outcome(mutated(seed, number), path, evaluate=number % 16 == 0)


def _measurement(path: Path) -> Callable[[int], str]:
    seeds = [gn.to_dataset(small_grid()), gn.to_dataset(small_rows())]
    return lambda number: outcome_of(
        lambda: gn.from_dataset(mutated_dataset(seeds[number % 2], number)), 1 << 16, evaluate=number % 16 < 2
    )


def _modis(path: Path) -> Callable[[int], str]:
    seed = xarray.load_dataset(BytesIO(mcd43()), engine="h5netcdf", decode_times=False, decode_coords=False)
    return lambda number: outcome_of(
        lambda: read_dataset(mutated_dataset(seed, number), str(path)), 1 << 16, evaluate=number % 16 == 0
    )


TRIALS: dict[str, Callable[[Path], Callable[[int], str]]] = {
    **{name: partial(_file, name) for name in SEEDS},
    "dataset": _measurement,
    "MCD43A1 dataset": _modis,
}
"""Given a path to write damaged files to: what becomes of the mutation with a number, see `outcome`."""
