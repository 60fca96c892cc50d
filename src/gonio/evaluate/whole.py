"""Plans of one kernel: each channel has its own copy of the formula, or is an element of the batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from ..arrays.kinds import COUNT, MATRIX, SQUARE, TOTAL, VALUE
from ..compile.llvm.program import EACH, ONCE, SQUARED
from ..compile.llvm.program import TOTAL as ADDED_UP
from ..compile.plans import Data, KernelPlan, Result, carry_out, prepare, renewed
from ..compile.store import size
from .call import Call, Draft, parameter, parameters, stored
from .tracing import Trace, brief

PLAN = 3000
"""Bytes of memory that a plan takes, about: the arrays of its numbers belong to the material, but for single ones."""

_USES = {VALUE: EACH, MATRIX: EACH, TOTAL: ADDED_UP, COUNT: ADDED_UP, SQUARE: SQUARED}


class Whole(NamedTuple):
    """A plan of one kernel, and where the numbers of other materials of the same structure go in it."""

    plan: KernelPlan
    outputs: tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]
    as_axis: bool
    numbers: tuple[int, ...]  # those of the material's leaves, then of the merged ones, that are read
    places: tuple[int, ...]  # the arrays of the plan that they are

    @classmethod
    def of(cls, call: Call, draft: Draft) -> Self:
        """A plan of a call."""
        trace, as_axis, task, dtype = draft.trace, draft.as_axis, call.task, call.inputs[0].dtype
        arrays, shape = arrays_of(call, draft)
        elements = task.elements(() if as_axis or call.channels is None else (call.channels,))
        uses = [_USES.get(kind, ONCE if as_axis else EACH) for kind in task.kinds]
        uses += uses[:1] * (len(elements) - len(uses))
        results = [Result(*parts) for parts in zip(trace.results, uses, elements, strict=True)]
        data = Data(arrays, trace.inputs, draft.tables, shape, dtype)
        return cls.around(prepare(trace.graph, results, data, brief(), task.adds), trace, as_axis)

    @classmethod
    def around(cls, plan: KernelPlan, trace: Trace, as_axis: bool = False) -> Self:
        """The plan that was prepared for a trace, of all its inputs and parameters."""
        places = tuple(sorted(k for k in trace.read if k >= trace.inputs))
        return cls(plan, plan.outputs, as_axis, tuple(k - trace.inputs for k in places), places)

    def with_numbers(self, leaves: Sequence[Any], tables: Sequence[np.ndarray], dtype: np.dtype) -> Self:
        """The plan with other parameters, of the same shapes, and other tables."""
        arrays, row, numbered = list[tuple[np.ndarray, tuple[int, ...]]](), [], []
        for k, place in zip(self.numbers, self.places, strict=True):
            value = leaves[k]
            if type(value) is float:
                row.append(value)
                numbered.append(place)
            else:
                arrays.append((parameter(value, dtype, self.as_axis)[0], (place,)))
        arrays.append((np.array(row, dtype), tuple(numbered)))  # numbers side by side: one array for all
        return self._replace(plan=renewed(self.plan, arrays, tables))

    def bare(self) -> Self:
        """The plan without the arrays of parameters that it keeps."""
        return self._replace(plan=self.plan._replace(keeper=None))

    def size(self) -> int:
        """Bytes, with the code."""
        return PLAN + size(self.plan.function)

    def stored(self, inputs: Sequence[np.ndarray], out: np.ndarray | None) -> list[Any]:
        """The results; those of a single direction as numbers. `out` takes the first one."""
        if out is not None:
            return stored(carry_out, self.plan, inputs, out)
        results = carry_out(self.plan, inputs)
        return [r if r.ndim else r[()] for r in results] if self.plan.scalar else results

    def added(self, inputs: Sequence[np.ndarray], into: Sequence[np.ndarray]) -> list[Any]:
        """The arrays `into`, with the results added."""
        return carry_out(self.plan, inputs, into)


def arrays_of(call: Call, draft: Draft) -> tuple[list[tuple[np.ndarray, int] | None], tuple[int, ...]]:
    """The arrays of `compile.plans.prepare`, None for those that nothing reads, and the shape of its batch."""
    trace, as_axis, count, batch = draft.trace, draft.as_axis, call.channels, call.batch
    inputs = [x[..., None, :] for x in call.inputs] if as_axis else call.inputs
    pairs = enumerate(zip(inputs, call.task.widths, strict=True))
    arrays: list[tuple[np.ndarray, int] | None] = [(x, w) if k in trace.read else None for k, (x, w) in pairs]
    arrays += parameters(trace, call.material, inputs[0].dtype, as_axis)
    return arrays, (*batch, count) if as_axis and count is not None else batch
