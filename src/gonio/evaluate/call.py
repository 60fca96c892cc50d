"""Calls: a task for a material and arrays, as the ways of computing it (`batch.WAYS`) see it.

What kernels need of the material, its numbers and tables as arrays, is made here too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..arrays import LIBRARIES, AsStored, Fixed, Roomy, contiguous, ops
from ..arrays.kinds import MATRIX, SUMMED
from ..errors import ArrayTypeError, ParameterError, ShapeError, TraceError
from ..formula import tree
from ..formula.bounds import COMPILED
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum
from ..formula.texture import Texture
from .tracing import Task, Trace, content, sums_only, traced

UNROLLED = 8  # channels up to which each has its own copy of a formula, if it looks up no matrices; more are an axis


class Draft(NamedTuple):
    """What a plan is made of: the trace, the tables that it looks up, and whether channels are an axis of the batch."""

    trace: Trace
    tables: list[np.ndarray]
    as_axis: bool


@dataclass(eq=False)
class Call:
    """A task for a material and arrays of a library; how many channels there are (None: no such axis), the batch, and
    whether there may be a compiled kernel; whether nobody has looked for a plan yet.

    Where arrays have names, or are computed later, there is no library, nor anything else that follows from it.
    `out` takes the first result. `into`: arrays that results are added to, of a task that adds.
    """

    task: Task
    material: Parametrised
    inputs: Sequence[Any]
    lib: Any = None
    channels: int | None = None
    batch: tuple[int, ...] = ()
    compiles: bool = False
    is_new: bool = True
    out: np.ndarray | None = None
    into: Sequence[np.ndarray] | None = None

    @cached_property
    def draft(self) -> Draft | None:
        """What a plan is made of; None where the formula cannot be traced, or is too large to be compiled."""
        task, material, count = self.task, self.material, self.channels
        as_axis = count is not None and count > (1 if MATRIX in task.kinds and content(material).tables else UNROLLED)
        if not SUMMED.isdisjoint(task.kinds) and (task.by or task.adds or not sums_only(task.kinds)):
            as_axis = False  # sums run over the last axis of the batch, which the channels would be
        with suppress(TraceError):
            trace = traced(task, material, 1 if as_axis else count)
            if as_axis and trace.loops:  # channels share them
                as_axis, trace = False, traced(task, material, count)
            if trace.operations <= COMPILED:
                tables = tables_of(trace.looked_up, material, self.inputs[0].dtype)
                return Draft(trace, tables, as_axis) if not trace.reach or within(trace.reach, tables) else None
        return None

    def put(self, results: list[Any]) -> list[Any]:
        """The results of a way that stores them in arrays of its own, in those that the call brought."""
        if self.out is not None:
            self.out[...] = results[0]
            return [self.out, *results[1:]]
        if self.into is None:
            return results
        for total, result in zip(self.into, results, strict=True):
            total += result
        return list(self.into)


def stored(
    carry: Callable[..., list[np.ndarray]], plan: Any, inputs: Sequence[np.ndarray], out: np.ndarray
) -> list[np.ndarray]:
    """The results of `carry(plan, inputs, given)`, the first in an array: at once, if its layout and memory allow."""
    direct = out.flags.c_contiguous and not any(np.may_share_memory(out, x) for x in inputs)
    results = carry(plan, inputs, (out,) if direct else ())
    if not direct:
        out[...] = results[0]
    return [out, *results[1:]]


# The numbers and tables of a material, as kernels have them.


def tables_of(looked_up: Collection[int], material: Parametrised, dtype: np.dtype) -> list[np.ndarray]:
    """The tables in their order; those that are not looked up, which may take long to make, are left empty."""
    tables = content(material).tables
    if not tables:
        return []
    with np.errstate(all="ignore"):
        return [_table(t, dtype) if k in looked_up else np.zeros(2, dtype) for k, t in enumerate(tables)]


def within(reach: dict[int, int], tables: Sequence[np.ndarray]) -> bool:
    """Whether the constant places that are looked up are in the tables, and places that differ by constants can be:
    compiled code reads them as they are."""
    return all(place < len(tables[k]) - 1 for k, place in reach.items())


def _table(table: Fixed, dtype: np.dtype) -> np.ndarray:
    if isinstance(table, AsStored) and table.numbers.dtype.itemsize < dtype.itemsize:
        raise TraceError("a formula looks up a table that is too large to be converted to double precision")
    if isinstance(table, Roomy) and table.whole.dtype == dtype:
        return table.whole
    padded: np.ndarray = table.once(_padded, dtype)
    return padded


def _padded(numbers: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """A table with an entry more: kernels read two at a time."""
    padded = np.empty(len(numbers) + 1, dtype)
    padded[:-1], padded[-1] = numbers, 0.0
    return padded


def leaves_of(material: Parametrised, merged: bool) -> list[Any]:
    """The numbers of a material, and where they are wanted those with channels merged."""
    leaves = content(material).leaves
    return leaves + content(tree.merged(material, LIBRARIES["numpy"].merge_channels)).leaves if merged else leaves


def parameters(
    trace: Trace, material: Parametrised, dtype: np.dtype, as_axis: bool
) -> list[tuple[np.ndarray, int] | None]:
    """The arrays of the parameters, and of the merged ones, as far as they are read."""
    leaves, first = content(material).leaves, trace.inputs
    count = len(leaves)
    every = range(2 * count if trace.merged else count)
    if any(k >= first + count for k in trace.read):
        leaves = leaves_of(material, True)
    return [parameter(leaves[k], dtype, as_axis) if first + k in trace.read else None for k in every]


def parameter(value: Any, dtype: np.dtype, as_axis: bool) -> tuple[np.ndarray, int]:
    """A number of a material as an array, and the length of its last axis."""
    if isinstance(value, Fixed):
        array = value.once(contiguous, dtype)
    elif type(value) is float:
        array = np.array((value,), dtype)
    else:
        array = np.ascontiguousarray(value, dtype).reshape(np.shape(value) or 1)
    if as_axis:
        array = array[..., None]
    return array, array.shape[-1]


# Shapes, and what has none.


def check_number(value: Any, lib: ops.Library) -> ops.Library | None:
    """The library of a parameter's value, None for a plain number. Raises where it is none, or of a wrong library."""
    of_value: ops.Library | None = ops.library_of_type(type(value))
    if of_value is not None:
        _check_library(of_value, lib)
    elif isinstance(value, Texture):
        raise ParameterError(
            f"a parameter is a {value!r:.90}: it has no number until there is a place; write m.f(wi, wo, uv=uv), "
            f"or m.at(uv=uv) for a material with the numbers at places uv (..., 2)"
        )
    elif value is None or isinstance(value, Spectrum):
        what = "a wavelength is not known yet" if value is None else f"a parameter is a {value!r:.60}"
        raise ParameterError(
            f"{what}: there is no f until wavelengths are; write m.at([450.0, 550.0, 650.0]) for three "
            f"channels, or m.at(550.0) for one without a channel axis"
        )
    return of_value


def _check_library(of_value: ops.Library | None, lib: ops.Library) -> None:
    if of_value not in (None, lib, LIBRARIES["numpy"]):
        raise ArrayTypeError(
            f"a parameter is a {of_value.name} array but the directions are {lib.name} arrays; "
            f"expected {lib.name} or NumPy parameters"
        )


def batch_of(values: Iterable[Any], lib: ops.Library, inputs: Sequence[Any]) -> tuple[int | None, tuple[int, ...]]:
    """The number of channels (None without a channel axis) of parameters, and the batch that they and inputs make."""
    shapes = []  # by plain loops: torch.compile takes no assignments in comprehensions
    for value in values:
        of_value = check_number(value, lib)
        if of_value is not None:
            shapes.append(of_value.shape(value))
    batches = [lib.shape(x)[:-1] for x in inputs] + [shape[:-1] for shape in shapes if shape]
    return channels_of(shapes), ops.broadcast_shape(batches, "directions and parameters")


def channels_of(shapes: Sequence[tuple[int, ...]]) -> int | None:
    """The one number of channels of arrays of these shapes, some of one channel or without."""
    widths = {shape[-1] for shape in shapes if shape}
    if not widths:
        return None
    if widths - {1, max(widths)}:
        raise ShapeError(
            f"parameters have {sorted(widths)} channels (lengths of their last axes); expected 1 or one number"
        )
    return max(widths)
