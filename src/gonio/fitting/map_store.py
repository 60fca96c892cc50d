"""Fits of maps larger than memory: Zarr in, Zarr out, a tile at a time, on any number of workers."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Iterable
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..arguments import checked
from ..base.reflectance import Reflectance
from ..errors import DependencyError, NotFoundError, ParameterError, shown
from .cluster import each
from .maps import FLAGS, fit_map
from .unknowns import unknowns

if TYPE_CHECKING:
    import xarray

TILE = 16_384
"""Texels of a tile where the source has no chunks of its own that are larger."""

DONE = "done"
"""The array of the output that says which tiles are written."""


class _Tile(NamedTuple):
    """A tile: its number, where it is in the map, and what is done with it."""

    number: int
    at: tuple[tuple[int, int], ...]
    source: str
    output: str
    model: Reflectance
    options: dict[str, Any]


@checked
def fit_map_store(
    source: str | os.PathLike,
    model: Reflectance,
    output: str | os.PathLike,
    loss: str = "plain",
    *,
    by: Iterable[str] | None = None,
    per_channel: Any = None,
    tile: Any = None,
    scheduler: Any = None,
    progress: Callable[[int, int], None] | None = None,
) -> xarray.Dataset:
    """The fits of `fit_map` for a map in a Zarr store, written to another one: neither has to fit into memory.

    The source holds `f` (..., observation) or (..., observation, channel), whose dimension of observations is named
    observation and that of channels channel; `wi` and `wo` (observation, 3) or (..., observation, 3); and if there are
    any `u` and `mask`, as f. The output has a map (...) for each number, with its name, and its standard error, with
    " u" behind the name; `rms`, `used` and `flags`; its attributes say model and loss. It is read by
    `xarray.open_zarr`, which is what is returned.

    `tile`: lengths of a tile along each axis of the map; without it so many rows of the source's chunks that a tile has
    some 16 000 texels. A run that was killed goes on with the tiles that are not written: at most those in
    work are lost. `scheduler`: see `fit_many`; workers read and write the stores themselves, and need their paths.

    Raises NotFoundError and ParameterError for stores that do not hold what is needed, and for an output of other
    arguments; DependencyError without zarr.

    Example
    >>> import xarray
    >>> wi, wo = gn.direction([0.1, 0.5, 0.9], 0.0), gn.direction([0.3, 0.2, 0.1], 1.0)
    >>> f = np.multiply.outer(np.full((4, 4), 0.1), np.ones(3))
    >>> maps = {"f": (("y", "x", "observation"), f)}
    >>> maps |= {"wi": (("observation", "xyz"), wi), "wo": (("observation", "xyz"), wo)}
    >>> _ = xarray.Dataset(maps).to_zarr("map.zarr", consolidated=False)
    >>> print(gn.fit_map_store("map.zarr", gn.Lambertian(), "fits.zarr")["rho"].values.mean().round(4))
    0.3142
    """
    zarr = _zarr()
    group = _opened(zarr, source)
    shape, dims, channels = _layout(group, source)
    names = unknowns(model, channels or 1, by, per_channel).names
    lengths = _tile_lengths(group["f"], shape, tile)
    tiles = list(product(*(_cuts(n, k) for n, k in zip(shape, lengths, strict=True))))
    options = {"loss": loss, "by": None if by is None else sorted(by), "per_channel": per_channel}
    digest = hashlib.sha256(f"{model!r} {options} {shape} {lengths}".encode()).hexdigest()
    into = _prepared(zarr, Path(output), names, shape, dims, lengths, len(tiles), digest, model, loss)
    finished = np.asarray(into[DONE][:], bool)
    paths = os.path.abspath(source), os.path.abspath(output)
    jobs = [_Tile(k, at, *paths, model, options) for k, at in enumerate(tiles) if not finished[k]]
    already = len(tiles) - len(jobs)
    for count, (job, _, error) in enumerate(each(_fit_tile, jobs, scheduler), 1):
        if error is not None:
            raise ParameterError(f"{source}: tile {job.number}: {error}; what is written stays: run it again to go on")
        if progress is not None:
            progress(already + count, len(tiles))
    import xarray

    return xarray.open_zarr(os.fspath(output), consolidated=False).drop_vars(DONE)


def _zarr() -> Any:
    try:
        import zarr
    except ImportError:
        raise DependencyError('maps in stores need zarr; pip install "gonio[io]"') from None
    return zarr


def _opened(zarr: Any, source: str | os.PathLike) -> Any:
    if not os.path.exists(source):
        raise NotFoundError(f"{source}: no such store; expected a folder of Zarr with f, wi and wo")
    try:
        group = zarr.open_group(os.fspath(source), mode="r")
    except Exception as error:
        raise ParameterError(f"{source}: not a group of Zarr: {error}") from None
    missing = [name for name in ("f", "wi", "wo") if name not in group]
    if missing:
        held = ", ".join(sorted(group.array_keys())) or "nothing"
        raise ParameterError(f"{source}: has no {', '.join(missing)}, but {held:.200}; expected f, wi and wo")
    return group


def _dimensions(array: Any) -> tuple[str, ...]:
    """The names of an array's dimensions, as xarray writes them."""
    names = getattr(array.metadata, "dimension_names", None) or array.attrs.get("_ARRAY_DIMENSIONS")
    return tuple(map(str, names or ()))


def _layout(group: Any, source: Any) -> tuple[tuple[int, ...], tuple[str, ...], int | None]:
    """Shape and dimensions of the map, and the number of channels."""
    f = group["f"]
    dims = _dimensions(f)
    coloured = dims[-1:] == ("channel",)
    last = dims[-2:-1] if coloured else dims[-1:]
    if last != ("observation",) or len(dims) != f.ndim:
        rule = "expected (..., observation) or (..., observation, channel)"
        raise ParameterError(f"{source}: f has dimensions ({', '.join(dims)}); {rule}")
    end = -2 if coloured else -1
    if f.ndim + end < 1:
        raise ParameterError(f"{source}: f has no dimension beside {', '.join(dims)}; expected a map; gn.fit fits one")
    return f.shape[:end], dims[:end], f.shape[-1] if coloured else None


def _tile_lengths(f: Any, shape: tuple[int, ...], tile: Any) -> tuple[int, ...]:
    if tile is not None:
        lengths = (tile,) if isinstance(tile, int) else tuple(tile)
        if len(lengths) != len(shape) or not all(isinstance(k, int) and k > 0 for k in lengths):
            raise ParameterError(
                f"tile={shown(tile)}: expected {len(shape)} lengths from 1, one for each axis of the map"
            )
        return tuple(min(k, n) for k, n in zip(lengths, shape, strict=True))
    chunks = [min(k, n) for k, n in zip(f.chunks, shape, strict=False)]
    for axis in reversed(range(len(shape))):
        room = max(1, TILE // max(math.prod(chunks), 1))
        chunks[axis] = min(shape[axis], chunks[axis] * room)
    return tuple(chunks)


def _cuts(length: int, step: int) -> list[tuple[int, int]]:
    return [(start, min(start + step, length)) for start in range(0, length, step)]


def _prepared(
    zarr: Any,
    output: Path,
    names: tuple[str, ...],
    shape: tuple[int, ...],
    dims: tuple[str, ...],
    lengths: tuple[int, ...],
    tiles: int,
    digest: str,
    model: Reflectance,
    loss: str,
) -> Any:
    """The output, made if it is not there; of an earlier run with the same arguments as it is."""
    if output.exists():
        try:
            group = zarr.open_group(os.fspath(output), mode="r+")
            known = group.attrs.get("gonio_fit")
        except Exception:
            known = None
        if known != digest:
            rule = "expected a new name, or the output of an earlier run of the same arguments"
            raise ParameterError(f"{output}: is there already, and of something else; {rule}")
        return group
    group = zarr.open_group(os.fspath(output), mode="w-")
    for name in [x for n in names for x in (n, f"{n} u")] + ["rms"]:
        group.create_array(name, shape=shape, chunks=lengths, dtype="f8", fill_value=np.nan, dimension_names=dims)
    for name, dtype in (("used", "i4"), ("flags", "u1")):
        group.create_array(name, shape=shape, chunks=lengths, dtype=dtype, fill_value=0, dimension_names=dims)
    group["flags"].attrs["meaning"] = {str(bit): text for bit, text in FLAGS.items()}
    group.create_array(DONE, shape=(tiles,), chunks=(1,), dtype="u1", fill_value=0, dimension_names=("tile",))
    group.attrs.update({"model": repr(model), "loss": loss, "gonio_fit": digest})
    return group


def _fit_tile(job: _Tile) -> None:
    """Read, fit and write a tile; it counts as written when all of it is."""
    zarr = _zarr()
    source, output = zarr.open_group(job.source, mode="r"), zarr.open_group(job.output, mode="r+")
    at = tuple(slice(*cut) for cut in job.at)
    coloured = _dimensions(source["f"])[-1] == "channel"
    f = source["f"][at]
    axes = len(at)

    def read(name: str, plain: int) -> Any:
        array = source[name]
        return array[:] if array.ndim <= plain else array[at]

    more = {name: read(name, f.ndim - axes) for name in ("u", "mask") if name in source}
    if "mask" in more:
        more["mask"] = np.asarray(more["mask"], bool)
    found = fit_map(read("wi", 2), read("wo", 2), f, job.model, coloured=coloured, **more, **job.options)
    for name in found.values:
        output[name][at] = found.values[name]
        output[f"{name} u"][at] = found.stderr[name]
    for name in ("rms", "used", "flags"):
        output[name][at] = getattr(found, name)
    output[DONE][job.number] = 1
