"""Run as a program: reads all of an HDF5 file, and says what is in it or what is wrong with it, as JSON.

The HDF5 library may crash or never return on damaged files. Here it may: this is a process of its own, which is
stopped when it has used more processor time than reading takes.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from typing import Any

COMPRESSED = 1100
"""No file's arrays are more than this many times as long as the file: deflate's limit is 1032."""
SMALL = 2**20
"""Bytes of arrays that any file may hold, as of constants that were never stored."""
AT_ONCE = 2**24
"""Bytes that are read at a time."""


class Refused(Exception):
    """What is wrong with a file, in words."""


def main(path: str) -> dict[str, Any]:
    import h5py

    size = os.path.getsize(path)
    _limit_time(0.7 + size / 5e6)
    try:
        with h5py.File(path, "r") as file:
            found = list(_datasets(h5py, file))
            total = sum(_bytes(dataset) for dataset in found)
            if total > COMPRESSED * size + SMALL:
                raise Refused(f"says that it holds {total} bytes of numbers, which {size} bytes of file cannot")
            for dataset in found:
                _read(dataset)
            return {"names": [dataset.name.lstrip("/") for dataset in found]}
    except Refused as error:
        return {"refused": str(error)}
    except Exception as error:  # of a library that raises any, in a process that only says so
        return {"refused": f"HDF5 file that is damaged or cut short: {error}"}


def _limit_time(seconds: float) -> None:
    """Seconds of processor time from now on, where the system can count them; its signal ends the process."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _datasets(h5py: Any, file: Any) -> Iterator[Any]:
    """Every array of a file once, its own and not those of other files; all attributes are read on the way."""
    waiting, seen = [file], set()
    dict(file.attrs)
    while waiting:
        group = waiting.pop()
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise Refused(f"{name} is a link to elsewhere, expected the data itself")
            found = group[name]
            address = h5py.h5o.get_info(found.id).addr
            if address in seen:
                continue
            seen.add(address)
            dict(found.attrs)
            if isinstance(found, h5py.Group):
                waiting.append(found)
            elif isinstance(found, h5py.Dataset):
                if found.external or found.is_virtual:
                    raise Refused(f"{found.name} is kept in other files, expected the data itself")
                yield found


def _bytes(dataset: Any) -> int:
    """Memory that an array takes, or one of its chunks if that is more."""
    cells, chunk = 1 if dataset.shape is not None else 0, 1
    for n in dataset.shape or ():
        cells *= int(n)
    for n in dataset.chunks or ():
        chunk *= int(n)
    return max(cells, chunk) * int(dataset.dtype.itemsize)


def _read(dataset: Any) -> None:
    """Read an array by rows; and what its dimensions are, as netCDF has it."""
    for dimension in dataset.dims:
        len(dimension)
    if not dataset.shape:
        dataset[()]
        return
    row = max(1, _bytes(dataset) // max(1, dataset.shape[0]))
    step = max(1, AT_ONCE // row)
    for start in range(0, dataset.shape[0], step):
        dataset[start : start + step]


if __name__ == "__main__":
    json.dump(main(sys.argv[1]), sys.stdout)
