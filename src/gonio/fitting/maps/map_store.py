"""The Zarr store that fits of maps go into: an array for each number, and a mark of each chunk that is done.

A mark stands in the array `done`, and is written last: a hash of the numbers that went into the fits of a chunk, and
one of the files that came out. A later run compares both. Where other numbers go in now, it is another work; where the
files are not those that came out, or the mark was cut off by a kill, the chunk is fitted again.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.identity import identity
from ...errors import Error, FormatError, ParameterError, WriteError
from ...formats._reading.zarr_tasks import finished

DONE, IDENTITY = "done", "gonio_fit"

BROKEN = (OSError, ValueError, RuntimeError, TypeError, LookupError)
"""What Zarr and its libraries raise where a store is damaged."""

KEPT, CHANGED, LOST = "kept", "changed", "lost"
"""What has become of a chunk that was done: nothing; other numbers would go in; its results are not there."""

Region = tuple[int, ...]
"""The number of a chunk along each axis of texels."""

Mark = tuple[int, int]
"""Hashes of what went into the fits of a chunk, and of the files that came out."""


@dataclass(frozen=True)
class MapStore:
    """Where it is, whose work it holds, and how it is laid out; sent to the workers that write it."""

    path: str
    identity: str
    kinds: Mapping[str, str]
    """The arrays, and their dtypes."""
    dims: Sequence[str]
    shape: tuple[int, ...]
    chunk: tuple[int, ...]

    @property
    def counts(self) -> tuple[int, ...]:
        """How many chunks there are along each axis."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    def places(self, region: Region) -> tuple[slice, ...]:
        """The texels of a chunk, along each axis."""
        return tuple(slice(k * c, min((k + 1) * c, n)) for k, c, n in zip(region, self.chunk, self.shape, strict=True))

    def size(self, region: Region) -> int:
        return math.prod(s.stop - s.start for s in self.places(region))

    def make(self, folder: Path, model: str, coordinates: Mapping[str, np.ndarray]) -> None:
        """An empty store in a new folder: NaN everywhere, and no chunk done."""
        import zarr

        with finished():
            group = zarr.create_group(folder, attributes={IDENTITY: self.identity, "model": model})
            self._complete(folder)
            for d, values in coordinates.items():
                group.create_array(d, shape=values.shape, dtype=values.dtype, dimension_names=[d])[:] = values

    def complete(self) -> None:
        """Write again the descriptions of arrays that were lost or damaged."""
        with self._written():
            self._complete(Path(self.path))

    def _complete(self, folder: Path) -> None:
        import zarr
        from zarr.codecs import Crc32cCodec, ZstdCodec

        group: Any = zarr.open_group(folder, mode="r+")
        of_texels = {"shape": self.shape, "chunks": self.chunk, "dimension_names": self.dims}
        arrays: dict[str, dict[str, Any]] = {name: {**of_texels, "dtype": kind} for name, kind in self.kinds.items()}
        one = {"shape": (*self.counts, 2), "chunks": (*(1 for _ in self.counts), 2), "dtype": "uint64"}
        arrays[DONE] = {**one, "dimension_names": [*(f"chunk_{d}" for d in self.dims), "hash"]}
        for name, as_made in arrays.items():
            try:
                same = (group[name].shape, str(group[name].dtype)) == (as_made["shape"], as_made["dtype"])
            except BROKEN:
                same = False
            if not same:
                (folder / name / "zarr.json").unlink(missing_ok=True)
                fill = math.nan if as_made["dtype"] == "float64" else 0
                group.create_array(name, **as_made, fill_value=fill, compressors=[ZstdCodec(level=0), Crc32cCodec()])

    def marks(self) -> dict[Region, Mark | None]:
        """The mark of each chunk, or None of those that are not done. Raises FormatError and ParameterError for what is
        no store of this work."""
        import zarr

        try:
            group = zarr.open_group(self.path, mode="r")
            found = group.attrs[IDENTITY]
        except (OSError, ValueError, KeyError, TypeError):
            raise FormatError(f"{self.path}: is no store of fits; choose another name, or remove it yourself") from None
        if found != self.identity:
            what = "another model, of other options, directions or uncertainties, of another map, or by another version"
            raise ParameterError(f"{self.path}: holds fits of {what} of gonio; choose another name")
        every = list(itertools.product(*map(range, self.counts)))
        try:
            marks: Any = group[DONE]
            with suppress(*BROKEN):  # read at once where none is damaged
                marks = marks[...]
        except BROKEN:
            return dict.fromkeys(every)
        return {region: _mark_of(marks, region) for region in every}

    def write(self, region: Region, went_in: Sequence[Any], results: Mapping[str, np.ndarray]) -> None:
        """The results of a chunk, by the names of arrays, and then its mark."""
        import zarr

        with self._written():
            group: Any = zarr.open_group(self.path, mode="r+")
            for name in self.kinds:
                group[name][self.places(region)] = results[name]
            group[DONE][region] = np.array([_hash(*went_in), self._came_out(region)], np.uint64)

    def state(self, region: Region, mark: Mark, goes_in: Sequence[Any]) -> str:
        """What has become of a chunk that was done."""
        went_in, came_out = mark
        if _hash(*goes_in) != went_in:
            return CHANGED
        try:
            return KEPT if self._came_out(region) == came_out else LOST
        except OSError:  # it cannot be read, and perhaps be written
            return LOST

    def _came_out(self, region: Region) -> int:
        """A hash of the files of a chunk; of numbers that are all NaN there is none."""
        files = [Path(self.path, name, "c", *map(str, region)) for name in self.kinds]
        return _hash(*(file.read_bytes() if file.exists() else None for file in files))

    @contextmanager
    def _written(self) -> Iterator[None]:
        """WriteError where the system refuses."""
        try:
            with finished():
                yield
        except Error:
            raise
        except OSError as error:
            reason = error.strerror or error
            raise WriteError(
                f"{self.path}: cannot be written: {reason}; make room: the same call goes on where this ended"
            ) from error


def opened(path: str | os.PathLike[str]) -> Any:
    """A store's results, as a Dataset."""
    import xarray

    return xarray.open_zarr(path, consolidated=False).drop_vars(DONE)


def _hash(*parts: Any) -> int:
    return int(identity(*parts)[:16], 16)


def _mark_of(marks: Any, region: Region) -> Mark | None:
    """The mark of a chunk; None where there is none, or what there is was cut off by a kill."""
    try:
        went_in, came_out = map(int, marks[region])
    except BROKEN:
        return None
    return (went_in, came_out) if went_in or came_out else None
