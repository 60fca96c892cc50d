"""All that is damaged and read, by name.

Minimal files of every format, whole ones where minimal ones are refused for their length, datasets of those that hold
datasets, and meshes.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from io import BytesIO
from pathlib import Path

import fuzzing_texts
import xarray
from fuzzing import mutated, outcome, outcome_of
from fuzzing_datasets import mutated_dataset
from mesh_files import MESHES
from picture_files import GRAYS, PICTURES
from seeds import SEEDS, mcd43, small_grid, small_rows

import gonio as gn
from gonio.formats.mcd43 import read_dataset
from gonio.pictures.image import read_gray
from gonio.surfaces.from_map import MOST


def _file(name: str, path: Path) -> Callable[[int], str]:
    seed, times = SEEDS[name](), 30 if name in WORKBOOKS else 64
    return lambda number: outcome(mutated(seed, number), path, evaluate=number % 16 == 0, times=times)


WORKBOOKS = ("Excel", "RT-300S workbook")
"""Files that are unpacked, or whose numbers share their strings: 30 times their size of memory are allowed."""


def _mesh(name: str, path: Path) -> Callable[[int], str]:
    seed = MESHES[name]()
    place = path.with_name(f"{path.name}{Path(f'a{name}').suffix}")

    def trial(number: int) -> str:
        place.write_bytes(data := mutated(seed, number))
        return outcome_of(lambda: gn.scenes.Mesh(place), len(data), times=30)

    return trial


def _whole_merl(path: Path) -> Callable[[int], str]:
    """A MERL file of full length, whose header and first numbers are damaged; the others are 0."""
    seed, size = SEEDS["MERL"](), 12 + 8 * 3 * 90 * 90 * 180

    def trial(number: int) -> str:
        path.write_bytes(mutated(seed, number))
        os.truncate(path, size)
        return outcome_of(lambda: gn.load(path), size, evaluate=number % 16 == 0)

    return trial


def _measurement(path: Path) -> Callable[[int], str]:
    seeds = [gn.tables.to_dataset(small_grid()), gn.tables.to_dataset(small_rows())]
    return lambda number: outcome_of(
        lambda: gn.tables.from_dataset(mutated_dataset(seeds[number % 2], number)), 1 << 16, evaluate=number % 16 < 2
    )


def _modis(path: Path) -> Callable[[int], str]:
    seed = xarray.load_dataset(BytesIO(mcd43()), engine="h5netcdf", decode_times=False, decode_coords=False)
    return lambda number: outcome_of(
        lambda: read_dataset(mutated_dataset(seed, number), str(path)), 1 << 16, evaluate=number % 16 == 0
    )


def _picture(name: str, path: Path) -> Callable[[int], str]:
    """A picture, or the heights of one."""
    seed = {**PICTURES, **GRAYS}[name]()

    def trial(number: int) -> str:
        data = mutated(seed, number)
        path.write_bytes(data)
        return outcome_of(lambda: read(path), len(data))

    def read(path: Path) -> object:
        if name in GRAYS:
            return read_gray(path, MOST)
        return gn.scenes.load_image(path, layer="albedo" if "OpenEXR" in name else None)

    return trial


TRIALS: dict[str, Callable[[Path], Callable[[int], str]]] = {
    **{name: partial(_file, name) for name in SEEDS},
    **{f"mesh {name}": partial(_mesh, name) for name in MESHES},
    "MERL whole": _whole_merl,
    **{name: partial(_picture, name) for name in (*PICTURES, *GRAYS)},
    "dataset": _measurement,
    "MCD43A1 dataset": _modis,
    **{name: partial(fuzzing_texts.trial, name) for name in fuzzing_texts.SEEDS},
}
"""Given a path to write damaged files to: what becomes of the mutation with a number, see `outcome`."""
