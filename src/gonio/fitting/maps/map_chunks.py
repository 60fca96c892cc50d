"""Fits of maps that are larger than memory: chunk by chunk, on any Dask scheduler, into a Zarr store.

Arrays of numbers are no part of what is sent to workers: they read their chunk from where Dask would, and write their
part of the result (`map_store`).
"""

from __future__ import annotations

import math
import os
import pickle
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays.labels import CHANNELS, COMPONENTS
from ...base.identity import identity
from ...base.reflectance import Reflectance
from ...declared.arguments import checked
from ...errors import ParameterError, ShapeError, needed
from ...files import replacing_folder, target
from ...files._unfinished import held
from ..asked import By, LossName, PerChannel, Scheduler
from ..cluster import workers
from ..unknowns import unknowns
from .map_store import CHANGED, LOST, MapStore, Mark, Region, opened
from .maps import FitMap, fit_map
from .texel_data import TexelValues

MOST_SENT = 1 << 20
"""Bytes of a job that is sent to another process, at most: more are numbers, not places where they are."""

TEXELS = 1 << 16
"""Texels of a chunk of an array that has no chunks."""


@checked
def fit_map_chunks(
    data: Any,
    model: Reflectance,
    loss: LossName | None = None,
    *,
    by: By | None = None,
    per_channel: PerChannel | None = None,
    observation: str = "observation",
    output: str | os.PathLike | None = None,
    scheduler: Scheduler | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Any:
    """`fit_map` of maps of any size, in the chunks of their arrays: an xarray.Dataset of the numbers of each texel.

    `data`: (wi, wo, f) or (wi, wo, f, u). f: a DataArray with the axis `observation` and others, a channel axis
    ("band", "channel" or "wavelength") among them or not, usually of a store: `xarray.open_zarr("scan.zarr")["f"]`.
    wi, wo: directions (N, 3) for all texels, or DataArrays with the axes `observation`, "xyz" and those of texels. u:
    as f, or a number.
    Without `output` nothing is computed yet: the variables are arrays of Dask. With it, a Zarr store, chunks are fitted
    on the `scheduler` (see `fit_many`) and each is written when it is done. A run that was stopped goes on with those
    that are not, or were lost or damaged since. What went into those that are done is compared, number by number:
    ParameterError where it is something else now. A second run into the same store waits for the first.
    `progress`: called with the numbers of texels that are done and of all.

    Variables: each number by its path, its standard error as "path.stderr", rms, used, flags; see `FitMap`.

    Shapes   f: axes of texels, `observation` and perhaps that of channels, in any order; results: those of texels.
    Units    f, u: 1/sr.
    Error    see `fit_map`, whose numbers these are.
    Source   as `fit_map`.

    Example
    >>> import xarray
    >>> wi, wo = gn.direction([0.1, 0.5, 0.9], 0.0), gn.direction([0.3, 0.2, 0.1], 1.0)
    >>> f = xarray.DataArray(np.outer([0.1, 0.2], np.ones(3)), dims=("texel", "observation")).chunk(texel=1)
    >>> print(gn.fitting.fit_map_chunks((wi, wo, f), gn.Lambertian())["rho"].compute().values.round(4))
    [0.3142 0.6283]
    """
    _require_dask()
    values = TexelValues.of(data)
    work = _Map(values, observation, (model, loss or values.usual_loss, _listed(by), _listed(per_channel)))
    if output is None:
        return work.lazily()
    path = Path(output)
    store = work.store(path)
    if path.exists():
        store.marks()  # nobody waits who will be refused
    with held(target(path.with_name(path.name + ".unfinished"))):
        if not path.exists():
            with replacing_folder(path, lambda _: "has appeared meanwhile") as new:
                store.make(new, repr(model), work.coordinates)
        work.fit_into(store, scheduler, progress)
    return opened(path)


class _Map:
    """What is fitted: labelled arrays in chunks of texels, and how."""

    def __init__(self, data: TexelValues, observation: str, how: tuple[Any, ...]):
        import xarray

        f, u = data.f, data.u
        if not isinstance(f, xarray.DataArray):
            raise ParameterError(
                f"f: a {type(f).__name__}; expected an xarray.DataArray with the axis {observation!r}: "
                f"xarray.open_zarr(path)['f'], or xarray.DataArray(array, dims=(..., {observation!r}))"
            )
        if observation not in f.dims:
            raise ShapeError(f"f: has the axes {', '.join(map(str, f.dims))}; expected {observation!r} among them")
        self.channel = [d for d in f.dims if d in CHANNELS]
        self.dims = [str(d) for d in f.dims if d != observation and d not in CHANNELS]
        if not self.dims:
            raise ShapeError(f"f: has the axes {', '.join(map(str, f.dims))}; expected axes of texels besides: gn.fit")
        self.core = [observation, *map(str, self.channel)]
        f = f.transpose(*self.dims, *self.core)
        if f.chunks is None:
            edge = max(1, round(TEXELS ** (1.0 / len(self.dims))))
            f = f.chunk(dict.fromkeys(self.dims, edge))
        f = f.chunk({d: max(f.chunksizes[d]) for d in self.dims} | dict.fromkeys(self.core, -1))
        self.f, self.how = f, how
        self.wi, self.wo = (self._directions(name, w, observation) for name, w in (("wi", data.wi), ("wo", data.wo)))
        self.u = u.transpose(*self.dims, *self.core) if isinstance(u, xarray.DataArray) else u
        channels = f.sizes[self.channel[0]] if self.channel else 1
        model, _, by, per_channel = how
        self.names = unknowns(model, channels, by, per_channel).names

    def _directions(self, name: str, w: Any, observation: str) -> Any:
        import xarray

        count = self.f.sizes[observation]
        if isinstance(w, xarray.DataArray):
            axes = [d for d in self.dims if d in w.dims]
            if {*w.dims} != {*axes, observation, COMPONENTS}:
                rule = f"expected {observation}, {COMPONENTS} and those of texels"
                raise ShapeError(f"{name}: has the axes {', '.join(map(str, w.dims))}; {rule}")
            w = w.transpose(*axes, observation, COMPONENTS)
            return (
                w.values
                if not axes
                else w.expand_dims([d for d in self.dims if d not in axes]).transpose(
                    *self.dims, observation, COMPONENTS
                )
            )
        w = np.asarray(w, dtype=float)
        if w.shape not in ((count, 3), (1, 3)):
            raise ShapeError(
                f"{name}: got shape {w.shape}; expected ({count}, 3), or a DataArray for directions by texel"
            )
        return w

    def lazily(self) -> Any:
        """A Dataset of Dask's arrays."""
        import xarray

        inputs, core = [self.f], [self.core]
        fixed: dict[str, Any] = {}
        for name, x in (("wi", self.wi), ("wo", self.wo), ("u", self.u)):
            if isinstance(x, xarray.DataArray):
                x = x.isel({d: 0 for d in self.dims if x.sizes[d] == 1 < self.f.sizes[d]}, drop=True)
                inputs.append(x.chunk({d: self.f.chunksizes[d] for d in self.dims if d in x.dims}))
                core.append([str(d) for d in x.dims if d not in self.dims])
                fixed[name] = len(inputs) - 1
        plain = {n: x for n, x in (("wi", self.wi), ("wo", self.wo), ("u", self.u)) if n not in fixed}

        def block(*arrays: np.ndarray) -> np.ndarray:
            given = plain | {name: arrays[k] for name, k in fixed.items()}
            return _stacked(_fit(given["wi"], given["wo"], arrays[0], given["u"], bool(self.channel), self.how))

        packed = xarray.apply_ufunc(
            block,
            *inputs,
            input_core_dims=core,
            output_core_dims=[["_number"]],
            dask="parallelized",
            output_dtypes=[float],
            dask_gufunc_kwargs={"output_sizes": {"_number": len(self.kinds)}},
        )
        return xarray.Dataset(
            {name: packed.isel(_number=k).astype(kind) for k, (name, kind) in enumerate(self.kinds.items())}
        )

    @property
    def kinds(self) -> dict[str, str]:
        """What is found for each texel, in the order of `_stacked`, and the dtypes."""
        numbers = dict.fromkeys([*self.names, *(f"{name}.stderr" for name in self.names), "rms"], "float64")
        return numbers | {"used": "int64", "flags": "uint8"}

    def store(self, path: Path) -> MapStore:
        """A store for this work, by all that goes into it but the numbers of its texels, which chunks compare."""
        import xarray

        shape = tuple(self.f.sizes[d] for d in self.dims)
        chunk = tuple(max(self.f.chunksizes[d], default=1) for d in self.dims)
        fixed = [x.dims if isinstance(x, xarray.DataArray) else x for x in (self.wi, self.wo, self.u)]
        whose = identity(self.how, self.names, self.dims, self.f.shape, chunk, fixed)
        return MapStore(os.path.abspath(path), whose, self.kinds, self.dims, shape, chunk)

    @property
    def coordinates(self) -> dict[str, np.ndarray]:
        """Numbers along the axes of texels."""
        found = {d: self.f[d].values for d in self.dims if d in self.f.indexes}
        return {d: x for d, x in found.items() if x.dtype.kind in "fiu"}

    def fit_into(self, store: MapStore, scheduler: Any, progress: Callable[[int, int], None] | None) -> None:
        """Fit all chunks that are not done, after all that are have been looked at."""
        marks = store.marks()
        store.complete()
        left = [region for region, mark in marks.items() if mark is None]
        marked = [region for region, mark in marks.items() if mark is not None]
        done, texels = sum(map(store.size, marked)), math.prod(store.shape)

        def told() -> None:
            if progress is not None:
                progress(done, texels)

        told()
        with workers(scheduler) as crew:
            jobs = (self.job(store, region, crew.are_far, marks[region]) for region in marked)
            for number, state, error in crew.results(_look, jobs):
                region = marked[number]
                if error is not None:
                    raise error
                if state == CHANGED:
                    places = zip(self.dims, store.places(region), strict=True)
                    where = ", ".join(f"{d} {s.start} to {s.stop - 1}" for d, s in places)
                    raise ParameterError(
                        f"{store.path}: holds fits of other values of f, u, wi or wo than these, as at {where}; "
                        f"nothing was changed; choose another name"
                    )
                if state == LOST:
                    left.append(region)
                    done -= store.size(region)
            told()
            jobs = (self.job(store, region, crew.are_far) for region in left)
            for number, _, error in crew.results(_fit_chunk, jobs):
                if error is not None:
                    raise error
                done += store.size(left[number])
                told()

    def job(self, store: MapStore, region: Region, is_far: bool, mark: Mark | None = None) -> Any:
        """What a worker is given for a chunk."""
        import dask
        import xarray

        at = dict(zip(self.dims, store.places(region), strict=True))
        parts = []
        for x in (self.f, self.wi, self.wo, self.u):
            if isinstance(x, xarray.DataArray):
                x = x.isel({d: s for d, s in at.items() if x.sizes[d] > 1}).data
                (x,) = dask.optimize(x)
            parts.append(x)
        f, wi, wo, u = parts
        whole = (store, region, (wi, wo, f, u), bool(self.channel), self.how, mark)
        if not is_far:
            return whole
        import cloudpickle

        sent = cloudpickle.dumps(whole)
        if len(sent) > MOST_SENT:
            raise ParameterError(
                f"f: a chunk of it is sent as {len(sent)} bytes, expected at most {MOST_SENT}: its numbers are in "
                f"memory here; write them to a Zarr store, f.to_dataset(name='f').to_zarr(path), and open that"
            )
        return sent


def _unpacked(job: Any) -> Any:
    """A job with the arrays of its chunk, read."""
    store, region, arrays, *rest = pickle.loads(job) if isinstance(job, bytes) else job
    arrays = [x.compute(scheduler="synchronous") if hasattr(x, "dask") else x for x in arrays]
    return store, region, arrays, *rest


def _look(job: Any) -> str:
    """What has become of a chunk that was done, in any process."""
    store, region, arrays, _, _, mark = _unpacked(job)
    return store.state(region, mark, arrays)


def _fit_chunk(job: Any) -> None:
    """Fit a chunk and write it, in any process."""
    store, region, arrays, coloured, how, _ = _unpacked(job)
    wi, wo, f, u = arrays
    found = _fit(wi, wo, f, u, coloured, how)
    results = {**found.values, **{f"{name}.stderr": x for name, x in found.stderr.items()}}
    results |= {name: getattr(found, name) for name in ("rms", "used", "flags")}
    store.write(region, arrays, results)


def _listed(names: Any) -> Any:
    """Names that can be read several times."""
    return list(names) if isinstance(names, Iterable) and not isinstance(names, str) else names


def _fit(wi: Any, wo: Any, f: Any, u: Any, coloured: bool, how: tuple[Any, ...]) -> FitMap:
    model, loss, by, per_channel = how
    return fit_map((wi, wo, f, u), model, loss, by=by, per_channel=per_channel, coloured=coloured)


def _stacked(found: FitMap) -> np.ndarray:
    """All numbers (..., 2 n + 3)."""
    parts = [*found.values.values(), *found.stderr.values(), found.rms, found.used, found.flags]
    return np.stack([np.asarray(x, dtype=float) for x in parts], axis=-1)


def _require_dask() -> None:
    with needed("fits of maps in chunks need Dask and Zarr", 'pip install "gonio[fit,io]"'):
        import cloudpickle  # noqa: F401  (whether it is there)
        import dask.array  # noqa: F401  (whether it is there)
        import zarr  # noqa: F401  (whether it is there)
