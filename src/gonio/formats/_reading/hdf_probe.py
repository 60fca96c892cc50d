"""A program that reads an HDF file and reports its content, or its fault, as JSON.

python hdf_probe.py hdf5 PATH NEEDED          reads arrays of an HDF5 file, from its first to its last number
python hdf_probe.py hdf4 PATH FOLDER ASKED    writes arrays of an HDF4 file into a folder

NEEDED is JSON: names of arrays, and beginnings of names. ASKED is JSON: the arguments of `_hdf4`. On damaged files the
libraries may crash or never return. In a process of its own they may: it is stopped when it has used more processor
time than reading takes.
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
"""Largest ratio of a file's arrays to its length: deflate's limit is 1032."""
SMALL = 2**20
"""Bytes of arrays that any file may hold, such as constants that were never stored."""
AT_ONCE = 2**24
"""Bytes that are read at a time."""
SPARE = 2**25
"""Bytes of memory that reading takes beside what comes of it, and beside what unpacks it."""
STARTED = "gonio reads\n"
"""First line of the output, which a program other than Python does not print."""


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
    """The names of all arrays; those called or beginning so have been read."""
    import h5py

    _limit_time(size)
    with h5py.File(path, "r") as file:
        datasets = list(_datasets(h5py, file))
        short = {dataset: dataset.name.rpartition("/")[2] for dataset in datasets}
        needed = [x for x, name in short.items() if name in names or name.startswith(tuple(prefixes))]
        _refuse_promises(sum(map(_bytes, datasets)), size)
        total = sum(map(_bytes, needed))
        _limit_time(size, total)
        _limit_memory(size, total)
        for dataset in needed:
            _read(dataset)
        return {"names": [dataset.name.lstrip("/") for dataset in datasets]}


def _hdf4(
    path: str, size: int, folder: str, prefixes: list[str], window: list[list[int] | None], most: int
) -> dict[str, Any]:
    """The arrays whose names begin so, written as files NUMBER.npy, and attributes, theirs and the file's.

    window   first and last + 1 of the rows, and of the columns, the first two axes; None for all
    most     numbers that may be read: no array is read if there are more, or no such rows
    """
    import numpy as np
    from pyhdf.SD import SD, SDC

    _limit_time(size)
    file = SD(path, SDC.READ)
    shapes = {name: list(entry[1]) for name, entry in file.datasets().items() if name.startswith(tuple(prefixes))}
    starts, lengths, inside = {}, {}, True
    for name, shape in shapes.items():
        if len(shape) < 2 or min(shape) < 1:
            raise Refused(f"{name} has shape {shape}, expected rows and columns")
        parts = [*window, *[None] * (len(shape) - 2)]
        ends = [(0, n) if part is None else part for n, part in zip(shape, parts, strict=True)]
        starts[name], lengths[name] = [a for a, _ in ends], [max(b - a, 0) for a, b in ends]
        inside = inside and all(0 <= a < b <= n for n, (a, b) in zip(shape, ends, strict=True))
    count = sum(map(math.prod, lengths.values()))
    report: dict[str, Any] = {"shapes": shapes, "count": count, "arrays": {}, "attributes": file.attributes()}
    if count > most or not inside:
        return report
    _refuse_promises(8 * count, size)
    _limit_time(size, 8 * count)
    _limit_memory(size, 8 * count)
    for number, name in enumerate(shapes):
        dataset = file.select(name)
        values = np.asarray(dataset.get(starts[name], lengths[name])).reshape(lengths[name])
        np.save(os.path.join(folder, f"{number}.npy"), values, allow_pickle=False)
        report["arrays"][name] = dataset.attributes()
    return report


def _refuse_promises(total: int, size: int) -> None:
    """Raises Refused for arrays that are larger than anything a file of this size unpacks to."""
    if total > COMPRESSED * size + SMALL:
        raise Refused(f"says that it holds {total} bytes of numbers, which {size} bytes of file cannot")


def _limit_time(size: int, total: int = 0) -> None:
    """End the process after more processor time than a slow one takes for these bytes of file, and of numbers.

    Counted from now on, if the system can.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, 0.7 + size / 5e6 + total / 1e7)


def _limit_memory(size: int, total: int) -> None:
    """Refuse more memory than these bytes of file, and of numbers, take, if the system can: HDF5 unpacks all that a
    chunk holds, far beyond what it says."""
    try:
        import resource

        with open("/proc/self/status", encoding="ascii") as status:
            has = next(int(line.split()[1]) for line in status if line.startswith("VmData:")) << 10
    except (ImportError, OSError, StopIteration):
        return
    most = has + size + 4 * total + SPARE
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if soft == resource.RLIM_INFINITY or most < soft:
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def _datasets(h5py: Any, file: Any) -> Iterator[Any]:
    """Every array of a file once, none of other files; all attributes are read on the way."""
    waiting, seen = [file], set()
    dict(file.attrs)
    while waiting:
        group = waiting.pop()
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise Refused(f"{name} is a link to elsewhere, expected the data itself")
            item = group[name]
            address = h5py.h5o.get_info(item.id).addr
            if address in seen:
                continue
            seen.add(address)
            dict(item.attrs)
            if isinstance(item, h5py.Group):
                waiting.append(item)
            elif isinstance(item, h5py.Dataset):
                if item.external or item.is_virtual:
                    raise Refused(f"{item.name} is kept in other files, expected the data itself")
                yield item


def _bytes(dataset: Any) -> int:
    """Memory of an array, or of one of its chunks if that is more."""
    cells = 0 if dataset.shape is None else math.prod(map(int, dataset.shape))
    return max(cells, math.prod(map(int, dataset.chunks or ()))) * int(dataset.dtype.itemsize)


def _read(dataset: Any) -> None:
    """Read an array by rows; and its dimensions, as netCDF does."""
    for dimension in dataset.dims:
        len(dimension)
    if not dataset.shape:
        dataset[()]
        return
    row = max(1, _bytes(dataset) // max(1, dataset.shape[0]))
    rows = dataset.chunks[0] if dataset.chunks else 1  # chunks are unpacked as a whole
    step = max(1, AT_ONCE // (row * rows)) * rows
    for start in range(0, dataset.shape[0], step):
        dataset[start : start + step]


if __name__ == "__main__":
    print(STARTED, end="", flush=True)
    json.dump(main(*sys.argv[1:]), sys.stdout)
