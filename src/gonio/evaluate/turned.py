"""Sums over a short axis: the elements of the axes before it lie in the lanes, and the short axis is the outer loop.

A kernel sums along its inner axis, whose elements fill the lanes of vectors; of 8 elements most lanes are empty. Here
the axes are turned: each entry of the short axis is a pass over all others, which adds to doubles in memory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice
from typing import Any, NamedTuple, Self

import numpy as np

from ..arrays.kinds import SQUARE, SUMMED
from ..compile.llvm import machine
from ..compile.llvm.program import ADDED
from ..compile.plans import DTYPES, Data, Result, carry_out, prepare
from .call import Call, Draft
from .tracing import brief
from .whole import Whole, arrays_of

LEAST = 256
"""Elements of the axes before the short one, at least."""


class Turned(NamedTuple):
    """A plan whose outputs are the numbers of all results, each an array of the axes before the short one."""

    whole: Whole
    kinds: tuple[str, ...]
    elements: tuple[tuple[int, ...], ...]
    outputs: tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]  # as those of `_Plan`; the first number has no use

    @classmethod
    def of(cls, call: Call, draft: Draft) -> Self:
        """A plan of a call for which `pays` holds."""
        task, trace, batch, dtype = call.task, draft.trace, call.batch, call.inputs[0].dtype
        arrays, _ = arrays_of(call, draft)
        results = [Result((node,), ADDED, ()) for nodes in trace.results for node in nodes]
        moved = [x and (_with_last_first(x[0], len(batch)), x[1]) for x in arrays]
        data = Data(moved, trace.inputs, draft.tables, (batch[-1], *batch[:-1]), dtype)
        plan = prepare(trace.graph, results, data, brief())
        elements = tuple(task.elements(() if call.channels is None else (call.channels,)))
        of_sums = np.dtype(float)
        shapes = [(*batch[:-1], *element) for element in elements]
        outputs = tuple((0, shape, of_sums, math.prod(shape) * of_sums.itemsize) for shape in shapes)
        return cls(Whole.around(plan, trace), task.kinds, elements, outputs)

    def with_numbers(self, leaves: Sequence[Any], tables: Sequence[np.ndarray], dtype: np.dtype) -> Self:
        """The plan with other parameters, of the same shapes, and other tables."""
        return self._replace(whole=self.whole.with_numbers(leaves, tables, dtype))

    def bare(self) -> Self:
        """The plan without the arrays of parameters that it keeps."""
        return self._replace(whole=self.whole.bare())

    def size(self) -> int:
        """Bytes, with the code."""
        return self.whole.size()

    def stored(self, inputs: Sequence[np.ndarray], out: np.ndarray | None) -> list[Any]:
        """The results. `out` takes the first one."""
        totals = carry_out(self.whole.plan, inputs, [np.zeros(shape) for _, shape, _, _ in self.whole.outputs])
        left, results = iter(totals), list[np.ndarray]()
        for kind, element, (_, shape, _, _) in zip(self.kinds, self.elements, self.outputs, strict=True):
            numbers = np.stack(list(islice(left, math.prod(element))), -1).reshape(shape)
            results.append(numbers * numbers if kind == SQUARE else numbers)
        if out is not None:
            out[...], results[0] = results[0], out
        return results

    def added(self, inputs: Sequence[np.ndarray], into: Sequence[np.ndarray]) -> list[Any]:
        """The arrays `into`, with the results added."""
        for total, result in zip(into, self.stored(inputs, None), strict=True):
            total += result
        return list(into)


def pays(call: Call) -> bool:
    """Whether a call is of sums over an axis so short that the axes are better turned."""
    task, batch = call.task, call.batch
    if not SUMMED.issuperset(task.kinds) or task.by or len(batch) < 2:
        return False
    return batch[-1] < 2 * machine.lanes(DTYPES[call.inputs[0].dtype]) and math.prod(batch[:-1]) >= LEAST


def _with_last_first(array: np.ndarray, axes: int) -> np.ndarray:
    """The array with all axes of the batch, the last of them first: another view of the same numbers."""
    return np.moveaxis(array.reshape((1,) * (axes + 1 - array.ndim) + array.shape), -2, 0)
