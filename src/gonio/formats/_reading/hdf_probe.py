"""Run as a program: reads an HDF file, and says what is in it or what is wrong with it, as JSON.

python hdf_probe.py hdf5 PATH NEEDED                     arrays of an HDF5 file, from its first to its last number
python hdf_probe.py hdf4 PATH FOLDER ASKED               arrays of an HDF4 file, which it writes into a folder

NEEDED is JSON: names of arrays, and what they may begin with. The libraries may crash or never return on damaged files.
Here they may: this is a process of its own, which is stopped when it has used more processor time than reading takes.
"""

from __future__ import annotations

import json
import math
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
STARTED = "gonio reads\n"
"""What a program says first: another than Python does not."""


class Refused(Exception):
    """A fault of a file, in words."""


def main(kind: str, path: str, *more: str) -> dict[str, Any]:
    """The content of a file, or its fault under "refused"."""
    size = os.path.getsize(path)
    try:
        if kind == "hdf5":
            return _hdf5(path, size, *json.loads(more[0]))
        folder, asked = more
        return _hdf4(path, size, folder, **json.loads(asked))
    except Refused as error:
        return {"refused": str(error)}
    except MemoryError:
        return {"refused": f"{kind.upper()} file that takes more memory to read than there is"}
    except Exception as error:  # of libraries that raise any, in a process that only says so
        return {"refused": f"{kind.upper()} file that is damaged or cut short: {error}"}


def _hdf5(path: str, size: int, names: list[str], prefixes: list[str]) -> dict[str, Any]:
    """The names of all arrays, of which those were read that are called or begin so."""
    import h5py

    _limit_time(size)
    with h5py.File(path, "r") as file:
        found = list(_datasets(h5py, file))
        called = {dataset: dataset.name.rpartition("/")[2] for dataset in found}
        needed = [x for x, name in called.items() if name in names or name.startswith(tuple(prefixes))]
        _refuse_promises(sum(map(_bytes, found)), size)
        _limit_time(size, sum(map(_bytes, needed)))
        for dataset in needed:
            _read(dataset)
        return {"names": [dataset.name.lstrip("/") for dataset in found]}


def _hdf4(
    path: str, size: int, folder: str, prefixes: list[str], window: list[list[int] | None], most: int
) -> dict[str, Any]:
    """The arrays whose names begin so, written as files NUMBER.npy, and attributes, theirs and the file's.

    window   first and last + 1 of the rows, and of the columns, the first two axes; all where it is None
    most     numbers that may be read: where there are more, or no such rows, none are
    """
    import numpy as np
    from pyhdf.SD import SD, SDC

    _limit_time(size)
    file = SD(path, SDC.READ)
    shapes = {name: list(held[1]) for name, held in file.datasets().items() if name.startswith(tuple(prefixes))}
    parts: dict[str, list[tuple[int, int]]] = {}
    for name, shape in shapes.items():
        if len(shape) < 2 or min(shape) < 1:
            raise Refused(f"{name} has shape {shape}, expected rows and columns")
        asked = [*window, *[None] * (len(shape) - 2)]
        parts[name] = [(0, n) if ends is None else (ends[0], ends[1]) for n, ends in zip(shape, asked, strict=True)]
    count = sum(math.prod(max(b - a, 0) for a, b in part) for part in parts.values())
    found: dict[str, Any] = {"shapes": shapes, "count": count, "arrays": {}, "attributes": file.attributes()}
    if count > most or not all(
        0 <= a < b <= n for name, part in parts.items() for (a, b), n in zip(part, shapes[name], strict=True)
    ):
        return found
    _refuse_promises(8 * count, size)
    _limit_time(size, 8 * count)
    for number, (name, part) in enumerate(parts.items()):
        dataset = file.select(name)
        values = np.asarray(dataset.get([a for a, _ in part], [b - a for a, b in part]))
        np.save(os.path.join(folder, f"{number}.npy"), values.reshape([b - a for a, b in part]), allow_pickle=False)
        found["arrays"][name] = dataset.attributes()
    return found


def _refuse_promises(total: int, size: int) -> None:
    """Arrays that take more memory than what a file of this size can have been unpacked to."""
    if total > COMPRESSED * size + SMALL:
        raise Refused(f"says that it holds {total} bytes of numbers, which {size} bytes of file cannot")


def _limit_time(size: int, total: int = 0) -> None:
    """End the process after more time than a slow processor takes for this many bytes of file, and of numbers.

    Processor time from now on, where the system can count it.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, 0.7 + size / 5e6 + total / 1e7)


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
    rows = dataset.chunks[0] if dataset.chunks else 1  # of chunks, which are unpacked as a whole
    step = max(1, AT_ONCE // (row * rows)) * rows
    for start in range(0, dataset.shape[0], step):
        dataset[start : start + step]


if __name__ == "__main__":
    print(STARTED, end="", flush=True)
    json.dump(main(*sys.argv[1:]), sys.stdout)
