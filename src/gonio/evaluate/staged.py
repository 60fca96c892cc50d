"""Plans for many channels: what all of them share is computed first, then what each has of its own.

A plan with a channel as one more axis of the batch would compute the shared part for each direction alone, or, in sums
over the batch, once for each channel. Here it is one kernel over the batch, whose results a second kernel loads; both
work on blocks of the batch, whose results in between stay in the processor's cache.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from ..arrays import Fixed
from ..arrays.kinds import VALUE
from ..compile.llvm.program import EACH
from ..compile.llvm.program import TOTAL as SUMMED
from ..compile.plans import Data, KernelPlan, Result, carry_out, prepare, renewed
from ..compile.store import size
from ..machine import caches, memory
from ..trace.graph import Graph
from ..trace.stages import Stages, stages
from .call import Call, Draft, leaves_of, stored
from .interpret import evaluate
from .tracing import brief, content, sums_only
from .whole import PLAN

CACHED = 1 << 18
"""Bytes of results in between that a block of the batch may have."""

WORTH = 4
"""Operations that a result in between must save to be worth its way through memory."""

LEAST = 20_000
"""Operations, for all elements of a batch, that must be saved to be worth the call of a second kernel."""

BEHIND, BEFORE_LAST, FIRST = "behind", "before last", "first"
"""Where the axis of channels stands among the axes of the batch: the last one is the one that sums run over."""


class Parts(NamedTuple):
    """The two plans for a block of the batch; the first is missing where nothing is shared."""

    shared: KernelPlan | None
    own: KernelPlan


class Alone(NamedTuple):
    """Values that depend on the channel alone, computed with the plan; they come to its second stage as arrays."""

    graph: Graph
    nodes: tuple[int, ...]
    inputs: int  # of the graph, before the parameters
    place: int  # of the first among the arrays of the second stage

    def values(self, leaves: Sequence[Any], tables: Sequence[np.ndarray], dtype: np.dtype) -> list[np.ndarray]:
        """An array (C,) for each node, or one number."""

        def load(k: int, _: int) -> np.ndarray:
            return np.asarray(_numbers(leaves[k - self.inputs]), dtype)

        with np.errstate(all="ignore"):  # as kernels do
            return [np.atleast_1d(v) for v in evaluate(self.graph, self.nodes, load, tables, dtype)]


class Staged(NamedTuple):
    """A plan of two stages for calls with arrays of the same shapes and strides."""

    outputs: tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]  # as those of `_Plan`; the first number has no use
    blocks: tuple[tuple[int, int, Parts], ...]  # ends along the first axis of the batch, and the plans
    sliced: tuple[bool, ...]  # whether an input has that axis
    place: str  # of the channels' axis
    axes: int  # of the batch
    numbers: tuple[tuple[int, int, int], ...]  # number of a parameter, and its places in either plan, -1 for none
    alone: Alone | None  # None where there is but one stage

    @classmethod
    def of(cls, call: Call, draft: Draft) -> Self | None:
        """A plan of two stages for a task whose trace has one channel; None where one stage does as well."""
        trace, tables, task, inputs, batch = draft.trace, draft.tables, call.task, call.inputs, call.batch
        summed = sums_only(task.kinds)
        if call.channels is None or task.by or not (summed or task.kinds == (VALUE,)):
            return None
        dtype, first, own = inputs[0].dtype, trace.inputs, len(content(call.material).leaves)
        leaves = leaves_of(call.material, any(k >= first + own for k in trace.read))
        read = [k for k in range(len(leaves)) if first + k in trace.read]
        within = [first + k for k in read if np.shape(_numbers(leaves[k]))[-1:] not in ((), (1,))]
        around = [*range(first), *(first + k for k in read if np.ndim(_numbers(leaves[k])) > 1)]
        maps = len(around) > first
        two = stages(trace.graph, [n for nodes in trace.results for n in nodes], first, within, around, caches.made)
        size = math.prod(batch)
        shared = two.saved >= WORTH * len(two.first) > 0 and size * two.saved >= LEAST
        if not shared and not summed:
            return None
        row = math.prod(batch[1:]) * len(two.first) * dtype.itemsize if shared else 1
        count = batch[0] if batch else 1
        step = count if maps or not shared or len(batch) < 1 + summed else max(CACHED // row, 1)
        step = min(step, count)
        blocks = -(-count // step)
        place = BEHIND if not summed else BEFORE_LAST if math.prod(batch[:-1]) <= call.channels * blocks else FIRST
        sliced = tuple(x.ndim - 1 == len(batch) > 0 and x.shape[0] > 1 for x in inputs)
        alone = Alone(trace.graph, two.alone, first, first + len(two.first)) if shared else None
        used = [v if first + k in trace.read else None for k, v in enumerate(leaves)]
        of_channel = alone.values(leaves, tables, dtype) if alone else []
        making = _Making(draft, two if shared else None, of_channel, used, call.channels, place)
        made: dict[int, Parts] = {}
        parts = []
        for start in range(0, count, step):
            length = min(step, count - start)
            if length not in made:
                cut = [x[start : start + length] if cut else x for x, cut in zip(inputs, sliced, strict=True)]
                here = list(zip(cut, task.widths, strict=True))
                made[length] = making.parts(here, (length, *batch[1:]) if batch else batch)
            parts.append((start, start + length, made[length]))
        shape = (*(batch[:-1] if summed else batch), call.channels)
        of_result = np.dtype(np.float64) if summed else dtype
        outputs = tuple((0, shape, of_result, math.prod(shape) * of_result.itemsize) for _ in task.kinds)
        shift = first + len(two.first) + len(two.alone) if shared else first
        numbers = tuple((k, first + k if shared and first + k not in within else -1, shift + k) for k in read)
        return cls(outputs, tuple(parts), sliced, place, len(batch), numbers, alone)

    def with_numbers(self, leaves: Sequence[Any], tables: Sequence[np.ndarray], dtype: np.dtype) -> Self:
        """The plan with other parameters, of the same shapes, and other tables."""
        shared = [(_plain(leaves[k], dtype)[0], (at,)) for k, at, _ in self.numbers if at >= 0]
        placed = [(leaves[k], at) for k, _, at in self.numbers]
        if self.alone:
            placed += [(v, self.alone.place + i) for i, v in enumerate(self.alone.values(leaves, tables, dtype))]
        own = [(_of_channels(v, dtype, self.place, self.axes), (at,)) for v, at in placed]
        return self._each(lambda plan: renewed(plan, shared, tables), lambda plan: renewed(plan, own, tables))

    def bare(self) -> Self:
        """The plan without the arrays of parameters that it keeps."""
        return self._each(*[lambda plan: plan._replace(keeper=None)] * 2)

    def _each(self, shared: Callable[[KernelPlan], KernelPlan], own: Callable[[KernelPlan], KernelPlan]) -> Self:
        """With other plans of both stages."""
        new: dict[int, Parts] = {}
        for _, _, parts in self.blocks:
            if id(parts) not in new:
                new[id(parts)] = Parts(parts.shared and shared(parts.shared), own(parts.own))
        return self._replace(blocks=tuple((start, stop, new[id(parts)]) for start, stop, parts in self.blocks))

    def size(self) -> int:
        """Bytes, with the code, and with the graph of what is computed for each material."""
        plans = {id(p): p for _, _, parts in self.blocks for p in parts if p is not None}.values()
        of_graph = self.alone.graph.size() if self.alone else 0
        return of_graph + sum(PLAN + size(p.function) for p in plans)

    def stored(self, inputs: Sequence[np.ndarray], out: np.ndarray | None) -> list[Any]:
        """The results. `out` takes the first one."""
        return _carried_out(self, inputs) if out is None else stored(_carried_out, self, inputs, out)

    def added(self, inputs: Sequence[np.ndarray], into: Sequence[np.ndarray]) -> list[Any]:
        """Nothing: sums that add are no stages."""
        raise AssertionError("a plan of two stages adds to no arrays")


class _Making(NamedTuple):
    """What the plans of all blocks are made of."""

    draft: Draft
    two: Stages | None  # None: nothing is shared
    alone: Sequence[np.ndarray]
    leaves: Sequence[Any]  # the numbers of the material, then the merged ones; None for those that nothing reads
    channels: int
    place: str

    def parts(self, inputs: Sequence[tuple[np.ndarray, int]], batch: tuple[int, ...]) -> Parts:
        """The plans for a block; `inputs`: each with the length of its vectors."""
        (trace, tables, _), two, place = self.draft, self.two, self.place
        first, use, dtype = trace.inputs, EACH if place == BEHIND else SUMMED, inputs[0][0].dtype
        arrays: list[Any] = [x if k in trace.read else None for k, x in enumerate(inputs)]
        shared, between = None, []
        if two is not None:
            plain = [None if v is None else _plain(v, dtype) for v in self.leaves]
            results = [Result((node,), EACH, ()) for node in two.first]
            data = Data([*arrays, *plain], first, tables, batch, dtype)
            shared = prepare(trace.graph, results, data, brief())
            between = [(np.empty((*batch, 1), dtype), 1)] * len(two.first)
        brought = [x and (_with_axis(x[0], place), x[1]) for x in (*arrays, *between)]
        needed = [*self.alone, *self.leaves]
        own = [None if v is None else (_of_channels(v, dtype, place, len(batch)), 1) for v in needed]
        shape = {
            BEHIND: (*batch, self.channels),
            BEFORE_LAST: (*batch[:-1], self.channels, *batch[-1:]),
            FIRST: (self.channels, *batch),
        }[place]
        graph, nodes = (two.second, two.outputs) if two else (trace.graph, [n for r in trace.results for n in r])
        results = [Result((node,), use, ()) for node in nodes]
        single = brief() or (place == BEHIND and dtype == np.float32)
        data = Data([*brought, *own], len(brought), tables, shape, dtype)
        return Parts(shared, prepare(graph, results, data, single))


def _numbers(value: Any) -> Any:
    return value.numbers if isinstance(value, Fixed) else value


def _plain(value: Any, dtype: np.dtype) -> tuple[np.ndarray, int]:
    """A parameter without channels, or with one, for the batch."""
    array = np.asarray(_numbers(value), dtype)
    array = np.ascontiguousarray(array.reshape(array.shape or (1,))[..., :1])
    return array, 1


def _with_axis(array: np.ndarray, place: str) -> np.ndarray:
    """An input (..., n) with the axis of channels, of length 1."""
    if place == BEHIND:
        return array[..., None, :]
    return array[..., None, :, :] if place == BEFORE_LAST and array.ndim > 1 else array


def _of_channels(value: Any, dtype: np.dtype, place: str, axes: int) -> np.ndarray:
    """A parameter, a number or (..., C), as an array whose last axis has one component."""
    array = np.ascontiguousarray(_numbers(value), dtype)
    array = array.reshape(array.shape or (1,))
    if place == BEFORE_LAST:
        array = array[:, None] if array.ndim == 1 else np.ascontiguousarray(array.swapaxes(-1, -2))
    elif place == FIRST:
        array = array.reshape((1,) * (axes + 1 - array.ndim) + array.shape)
        array = np.ascontiguousarray(np.moveaxis(array, -1, 0))
    return array[..., None]


def _carried_out(
    plan: Staged, inputs: Sequence[np.ndarray], destinations: Sequence[np.ndarray] = ()
) -> list[np.ndarray]:
    """The results of a plan for these arrays; `destinations` are those that take the first."""
    results, several, out = [], len(plan.blocks) > 1, destinations[0] if destinations else None
    if plan.place == BEHIND and several:
        _, shape, dtype, _ = plan.outputs[0]
        out = memory.empty(shape, dtype) if out is None else out
    for start, stop, (shared, own) in plan.blocks:
        here = [x[start:stop] if cut else x for x, cut in zip(inputs, plan.sliced, strict=True)] if several else inputs
        between = carry_out(shared, here) if shared else []
        into = () if out is None else (out[start:stop] if several else out,)
        results.append(carry_out(own, [*here, *between], into))
    if plan.place == BEHIND:
        return results[0] if out is None else [out]
    if plan.place == FIRST:
        results = [[np.moveaxis(r, 0, -1) for r in block] for block in results]
    return [np.concatenate(block) if several else block[0] for block in zip(*results, strict=True)]
