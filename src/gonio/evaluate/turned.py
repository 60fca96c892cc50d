"""Sums over a short axis: the elements of the axes before it lie in the lanes, and the short axis is the outer loop.

A kernel sums along its inner axis, whose elements fill the lanes of vectors; of 8 elements most lanes are empty. Here
the axes are turned: each entry of the short axis is a pass over all others, which adds to doubles in memory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from ..arrays.kinds import SQUARE, SUMMED
from ..compile.llvm import machine
from ..compile.llvm.program import ADDED
from ..compile.plans import DTYPES, Plan, Result, carry_out, prepare
from .tracing import Task, Trace, brief

LEAST = 256
"""Elements of the axes before the short one, at least."""


class Turned(NamedTuple):
    """A plan whose outputs are the numbers of all results, each an array of the axes before the short one."""

    plan: Plan
    kinds: tuple[str, ...]
    elements: tuple[tuple[int, ...], ...]
    outputs: tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]  # as those of `Plan`; the first number is of no use


def pays(task: Task, batch: tuple[int, ...], dtype: np.dtype) -> bool:
    """Whether a task is of sums over an axis so short that the axes are better turned."""
    if not SUMMED.issuperset(task.kinds) or task.by or len(batch) < 2:
        return False
    lanes = 2 * machine.lanes(DTYPES[dtype])
    return batch[-1] < lanes and math.prod(batch[:-1]) >= LEAST


def turned(
    trace: Trace,
    task: Task,
    arrays: Sequence[tuple[np.ndarray, int] | None],
    tables: Sequence[np.ndarray],
    batch: tuple[int, ...],
    channels: int | None,
) -> Turned:
    """A plan for such a task; arrays and tables are those of `compile.plans.prepare`."""
    dtype = next(x[0].dtype for x in arrays if x is not None)
    results = [Result((node,), ADDED, ()) for nodes in trace.results for node in nodes]
    moved = [x and (_with_last_first(x[0], len(batch)), x[1]) for x in arrays]
    plan = prepare(trace.graph, results, moved, trace.inputs, tables, (batch[-1], *batch[:-1]), dtype, brief())
    elements = tuple(task.elements(() if channels is None else (channels,)))
    of_sums = np.dtype(float)
    shapes = [(*batch[:-1], *element) for element in elements]
    outputs = tuple((0, shape, of_sums, math.prod(shape) * of_sums.itemsize) for shape in shapes)
    return Turned(plan, task.kinds, elements, outputs)


def _with_last_first(array: np.ndarray, axes: int) -> np.ndarray:
    """The array with all axes of the batch, the last of them first: another view of the same numbers."""
    return np.moveaxis(array.reshape((1,) * (axes + 1 - array.ndim) + array.shape), -2, 0)


def carried_out(
    turned: Turned, inputs: Sequence[np.ndarray], given: Sequence[np.ndarray] | None = None
) -> list[np.ndarray]:
    """The results of a plan; `given` are those that it adds to."""
    totals = carry_out(turned.plan, inputs, [np.zeros(shape) for _, shape, _, _ in turned.plan.outputs])
    left, results = iter(totals), []
    for kind, element, (_, shape, _, _) in zip(turned.kinds, turned.elements, turned.outputs, strict=True):
        numbers = np.stack(list(islice(left, math.prod(element))), -1).reshape(shape)
        results.append(numbers * numbers if kind == SQUARE else numbers)
    if given is None:
        return results
    for total, result in zip(given, results, strict=True):
        total += result
    return list(given)
