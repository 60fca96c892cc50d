"""Damaged datasets in gonio's own layout, by number: what valid netCDF or Zarr may hold that no writer wrote."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

import numpy as np
import xarray
from fuzzing import FLOATS, NUMBERS, WORDS, mutated

DTYPES = ("f2", "f4", "i1", "u8", "c16", "S3", "U5", "bool", "M8[ns]", "O")


def mutated_dataset(ds: xarray.Dataset, number: int) -> xarray.Dataset:
    """A dataset with one to four changes, always the same for the same number."""
    random = Random(number)
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        ds = random.choice(_CHANGES)(ds, random)
    return ds


def _one(ds: xarray.Dataset, random: Random) -> str | None:
    return random.choice(sorted(map(str, ds.variables))) if ds.variables else None


def _changed(change: Callable[[xarray.Variable, Random], Any]) -> Callable[[xarray.Dataset, Random], xarray.Dataset]:
    """The change of a dataset that changes one of its arrays; none where xarray cannot hold it."""

    def apply(ds: xarray.Dataset, random: Random) -> xarray.Dataset:
        if (name := _one(ds, random)) is None:
            return ds
        try:
            return ds.drop_indexes(name, errors="ignore").assign({name: change(ds[name].variable, random)})
        except (ValueError, TypeError, OverflowError, RuntimeError):
            return ds

    return apply


def _without(ds: xarray.Dataset, random: Random) -> xarray.Dataset:
    return ds.drop_vars(_one(ds, random) or [])


def _renamed(ds: xarray.Dataset, random: Random) -> xarray.Dataset:
    names = [_one(ds, random), random.choice(("values", "x", "", "theta_i", "phi", "wavelength", "uncertainty"))]
    return (
        ds if None in names or names[1] in ds.variables or names[1] in ds.dims else ds.rename_vars({names[0]: names[1]})
    )


def _cut(ds: xarray.Dataset, random: Random) -> xarray.Dataset:
    dims = sorted(str(d) for d, n in ds.sizes.items() if n)
    if not dims:
        return ds
    chosen = random.choice(dims)
    return ds.isel({chosen: random.choice((slice(0), slice(1), 0, slice(None, None, -1), [0, 0], slice(-1)))})


def _attribute(ds: xarray.Dataset, random: Random) -> xarray.Dataset:
    target = ds if random.random() < 0.7 or not ds.variables else ds[_one(ds, random)]
    name = random.choice([*map(str, target.attrs), "units", "scale_factor", "gonio_schema"])
    old = str(target.attrs.get(name, "")).encode()
    new = (
        mutated(old, random.randrange(10**6)).decode("latin-1"),
        random.choice(NUMBERS),
        random.choice(WORDS),
        random.choice(FLOATS),
        random.choice((0, -1, 2**31, 2**63 - 1)),
        np.array([1.0, np.nan]),
        np.array([], dtype=float),
        b"\xff",
    )
    ds = ds.copy()
    target = ds if target is not None and isinstance(target, xarray.Dataset) else ds[target.name]
    if random.random() < 0.2:
        target.attrs.pop(name, None)
    else:
        target.attrs[name] = random.choice(new)
    return ds


def _value(v: xarray.Variable, random: Random) -> xarray.Variable:
    values = np.array(v.values)
    if values.size:
        values.flat[random.randrange(values.size)] = random.choice(FLOATS)
    return v.copy(data=values)


def _as_type(v: xarray.Variable, random: Random) -> xarray.Variable:
    with np.errstate(all="ignore"):
        return v.copy(data=np.asarray(v.values).astype(random.choice(DTYPES)))


def _turned(v: xarray.Variable, random: Random) -> xarray.Variable:
    return v.transpose(*random.sample(v.dims, len(v.dims)))


def _flat(v: xarray.Variable, random: Random) -> Any:
    return random.choice(
        (((), 1.0), (("new",), np.ravel(v.values)), ((), "word"), ((*v.dims, "new"), v.values[..., None]))
    )


def _all(v: xarray.Variable, random: Random) -> xarray.Variable:
    return v.copy(data=np.full(v.shape, random.choice(FLOATS)))


_CHANGES = (
    *(_without, _renamed, _cut, _cut, _attribute, _attribute, _attribute),
    *map(_changed, (_value, _value, _value, _as_type, _turned, _flat, _all)),
)
