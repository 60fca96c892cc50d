"""Calls with arrays of other libraries than NumPy, which differentiate and compile by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from ..arrays import Fixed, ops
from ..arrays.kinds import SQUARE, SUMMED, TERMS
from ..formula import tree
from ..formula.parametrised import Parametrised
from .blocks import result_shape
from .call import Call, batch_of, check_number


def at_once(call: Call) -> list[Any]:
    """The results of a library that computes the whole batch at once.

    Such a library may be compiling: nothing here or below may depend on the values of arrays, or touch those of NumPy
    but through `Library.fixed`.
    """
    lib, task, inputs = call.lib, call.task, call.inputs
    like = inputs[0]
    m = tree.bind(call.material, partial(_converted, lib=lib, like=like), partial(lib.fixed, like=like))
    channels, batch = batch_of(tree.leaves(m), lib, inputs)
    mean = tree.merged(m, lib.merge_channels) if channels else m
    parts = [lib.split(x, batch, channels is not None) for x in inputs]
    terms = [TERMS.get(kind, kind) for kind in task.kinds]
    results = lib.assemble(terms, [task.kernel(m, mean, *parts)], like, batch, channels is not None)
    shapes = [result_shape(kind, batch, channels) for kind in terms]
    full = [lib.module.broadcast_to(r, shape) for r, shape in zip(results, shapes, strict=True)]
    return _sums(lib, task.kinds, full, len(batch) - 1)


def by_channel(call: Call) -> list[Any]:
    """The results of a library whose arrays hold one component each: once per channel."""
    lib, (kernel, kinds, *_), material, inputs = call.lib, call.task, call.material, call.inputs
    like = inputs[0]
    channels, batch = batch_of(tree.leaves(material), lib, inputs)
    if 0 in batch:
        whole = [result_shape(kind, batch, channels) for kind in kinds]
        return [lib.empty(like, shape, len(shape) > len(batch)) for shape in whole]

    def bound(m: Parametrised, channel: int | None) -> Parametrised:
        def convert(value: Any) -> Any:
            return lib.convert(value.numbers if isinstance(value, Fixed) else value, like, channel, batch)

        return tree.bind(m, convert, lambda table: lib.fixed(table, like))

    runs = []
    for c in range(channels or 1):
        m = bound(material, c)
        mean = bound(tree.merged(material, lib.merge_channels), None) if channels else m
        runs.append(kernel(m, mean, *(lib.split(x, batch, channels is not None) for x in inputs)))
    terms = [TERMS.get(kind, kind) for kind in kinds]
    return _sums(lib, kinds, lib.assemble(terms, runs, like, batch, channels is not None), len(batch) - 1)


def _sums(lib: ops.Library, kinds: Sequence[str], results: Sequence[Any], axis: int) -> list[Any]:
    """The results, of which those that are terms of sums are summed over an axis."""
    summed = [lib.module.sum(r, axis) if kind in SUMMED else r for kind, r in zip(kinds, results, strict=True)]
    return [r * r if kind == SQUARE else r for kind, r in zip(kinds, summed, strict=True)]


def _converted(value: Any, lib: ops.Library, like: Any) -> Any:
    check_number(value, lib)
    return lib.convert(value, like)
