"""Arrays with named axes: xarray's DataArray, pandas' Series. The names of axes are taken off, and put back.

Numbers are computed on plain arrays, whose axes are the named ones in one order, with the channel axis last. `Labels`
says which these are. Axes that two arrays share must have equal coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..errors import ArrayTypeError, Error
from . import LAZY, NAMED, library_of_type

CHANNELS = ("band", "channel", "wavelength")
"""Names of the channel axis."""
COMPONENTS = "xyz"
STOKES = "stokes_o", "stokes_i"
"""Name of the axis of a direction's components."""


def is_named(x: Any) -> bool:
    """Whether this is an array of xarray or pandas."""
    return library_of_type(type(x)) is NAMED


def is_lazy(x: Any) -> bool:
    """Whether this is an array of Dask."""
    return library_of_type(type(x)) is LAZY


class Labels:
    """The names and coordinates of axes: those of a batch, and the channel axis."""

    def __init__(self, frame: Any):
        """`frame`: a DataArray with them, of any numbers; the channel axis is last."""
        self.frame = frame
        channel = [d for d in frame.dims if d in CHANNELS]
        self.channel: str | None = channel[0] if channel else None
        self.dims: tuple[Any, ...] = tuple(d for d in frame.dims if d not in CHANNELS)

    @property
    def channel_names(self) -> list[Any] | None:
        """The coordinates of the channel axis that are names, or wavelengths."""
        if self.channel is None or self.channel not in self.frame.indexes:
            return None
        values = self.frame[self.channel].values
        words = values.dtype.kind == "U" or (values.dtype.kind == "O" and all(isinstance(x, str) for x in values))
        spectral = self.channel == "wavelength" and values.dtype.kind in "iuf"
        return values.tolist() if words or spectral else None

    def laid(self, array: Any, of: Labels) -> Any:
        """An array whose axes are `of` these, with mine: more of them, and in another order."""
        if not getattr(array, "ndim", 0):
            return array
        if not self.dims:
            return array
        if array.ndim == 1:
            return array
        order = [of.dims.index(d) for d in self.dims if d in of.dims]
        array = array.transpose(*order, array.ndim - 1)
        return array[(*(slice(None) if d in of.dims else None for d in self.dims), slice(None))]

    def wrapped(self, array: Any, channels: bool, names: Sequence[Any] | None = None) -> Any:
        """A result with my axes, and with `channels` the channel axis last, of these `names` where I know none."""
        import xarray

        frame = self.frame
        if not channels and self.channel is not None:
            frame = frame.isel({self.channel: 0}, drop=True)
        if not channels or self.channel is not None:
            return xarray.DataArray(array, coords=frame.coords, dims=frame.dims)
        if array.shape[-1] == 1:  # of maps without a channel axis of their own
            return xarray.DataArray(array[..., 0], coords=frame.coords, dims=frame.dims)
        result = xarray.DataArray(array, coords=frame.coords, dims=(*frame.dims, "channel"))
        return result if names is None else result.assign_coords(channel=list(names))

    def of_matrices(self, array: Any, channels: bool, names: Sequence[Any] | None = None) -> Any:
        """A result with my axes, with `channels` as `wrapped` has them, and two axes of Stokes components."""
        import xarray

        frame, named = self.frame, {axis: list("IQUV") for axis in STOKES}
        if self.channel is not None and not channels:
            frame = frame.isel({self.channel: 0}, drop=True)
        if channels and self.channel is None and array.shape[-3] == 1:  # of maps without a channel axis of their own
            array, channels = array[..., 0, :, :], False
        if channels and self.channel is None and names is not None:
            named["channel"] = list(names)
        dims = (*self.dims, *([self.channel or "channel"] if channels else []), *STOKES)
        return xarray.DataArray(array, coords=frame.coords, dims=dims).assign_coords(named)

    def of_pairs(self, array: Any, names: Sequence[Any] | None = None) -> Any:
        """A result with my axes, and two of channels: of the light that leaves, `_o`, and that arrives, `_i`."""
        import xarray

        frame, channel = self.frame, self.channel or "channel"
        if self.channel is not None:
            names = self.frame[channel].values if channel in self.frame.indexes else names
            frame = frame.isel({channel: 0}, drop=True)
        axes = [channel + end for end in ("_o", "_i")]
        result = xarray.DataArray(array, coords=frame.coords, dims=(*self.dims, *axes))
        return result if names is None else result.assign_coords({axis: list(names) for axis in axes})

    def of_map(self, array: Any) -> Any:
        """A map of a parameter (..., C), laid as mine, as a DataArray; axes of length 1 that it does not have are left
        out."""
        import xarray

        names = (*self.dims, self.channel or "channel")
        lengths = (*(self.frame.sizes[d] for d in self.dims), None)
        kept = [k for k, (n, whole) in enumerate(zip(array.shape, lengths, strict=True)) if n == whole or n > 1]
        array = array[tuple(slice(None) if k in kept else 0 for k in range(array.ndim))]
        dims = [names[k] for k in kept]
        return xarray.DataArray(array, dims=dims, coords={d: self.frame[d] for d in dims if d in self.frame.indexes})

    def with_axis(self, array: Any, name: str, coordinates: Sequence[Any]) -> Any:
        """A result with my axes, without channels, and one more."""
        import xarray

        return xarray.DataArray(array, coords=self.frame.coords, dims=(*self.dims, name)).assign_coords(
            {name: list(coordinates)}
        )


def data_array(x: Any, what: str, error: type[Error] = ArrayTypeError) -> Any:
    """The DataArray that a named array is, of numbers. `what`: it, in words."""
    import xarray

    kind = type(x).__name__
    if kind in ("Series", "DataFrame") and hasattr(x, "to_xarray"):
        if kind == "DataFrame":
            raise error(f"{what}: a DataFrame, expected one array; take a column: frame['name']")
        x = x if x.index.name is not None else x.rename_axis("row")
        x = xarray.DataArray(x)
    elif kind == "Variable":
        x = xarray.DataArray(x)
    if not isinstance(x, xarray.DataArray):
        advice = "; take a variable: dataset['name']" if kind == "Dataset" else ""
        raise error(f"{what}: a {kind}, expected an array of numbers{advice}")
    if x.dtype.kind not in "fiub":
        raise error(f"{what}: a {kind} of {x.dtype}, expected numbers")
    return x


def taken(x: Any, what: str, error: type[Error]) -> tuple[Any, Labels]:
    """A parameter with named axes as a plain array (..., C), a number where it has no axes, and their labels.

    Missing numbers, NaN, are masked. A map without a channel axis gets one of length 1.
    """
    x = data_array(x, what, error)
    channel = [d for d in x.dims if d in CHANNELS]
    if len(channel) > 1:
        raise error(f"{what}: has the axes {' and '.join(map(str, channel))}, expected one channel axis at most")
    x = x.transpose(*(d for d in x.dims if d not in CHANNELS), *channel)
    array = x.data
    if not is_lazy(array):
        array = np.asarray(array, dtype=float)
        if array.ndim and np.isnan(array).any():
            array = np.ma.masked_invalid(array)
    if x.ndim and not channel:
        array = array[..., None]
    return (float(array) if not x.ndim and not is_lazy(array) else array), Labels(_frame(x))


def _frame(x: Any) -> Any:
    """A DataArray with the axes of another one, that takes no memory."""
    import xarray

    return xarray.DataArray(np.broadcast_to(np.int8(0), x.shape), coords=x.coords, dims=x.dims)


def union(several: Iterable[Labels], what: str, error: type[Error] = ArrayTypeError) -> Labels:
    """All axes of these, the first one's first. Raises an error where they do not fit together."""
    import xarray

    frames = [labels.frame for labels in several]
    channel = {labels.channel: None for labels in map(Labels, frames) if labels.channel is not None}
    if len(channel) > 1:
        raise error(f"{what}: the channel axis is called {' and '.join(channel)}; rename one: x.rename(band='channel')")
    sizes: dict[Any, int] = {}
    for frame in frames:
        for dim, n in frame.sizes.items():
            if sizes.setdefault(dim, n) != n:
                raise error(f"{what}: the axis {dim} has lengths {sizes[dim]} and {n}; select or interpolate one first")
    try:
        merged = xarray.merge([f.coords.to_dataset() for f in frames], join="exact", compat="minimal")
    except ValueError as reason:
        first = str(reason).partition("\n")[0]
        rule = "axes of one name need equal coordinates: x.sel(...), x.reindex_like(other), xarray.align(a, b)"
        raise error(f"{what}: {rule} ({first:.200})") from None
    dims = (*(d for d in sizes if d not in channel), *channel)
    shape = tuple(sizes[d] for d in dims)
    return Labels(xarray.DataArray(np.broadcast_to(np.int8(0), shape), coords=merged.coords, dims=dims))
