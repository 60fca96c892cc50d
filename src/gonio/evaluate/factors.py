"""What a formula's dependence on maps comes down to: the few numbers of a place on which f depends linearly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Fixed
from ..arrays.kinds import VALUE
from ..errors import TraceError
from ..formula.direction import Direction
from ..formula.parametrised import Parametrised
from ..trace.separate import separated
from .interpret import evaluate
from .tracing import Task, Trace, content, traced


def _formula(m: Any, mean: Any, wi: Any, wo: Any) -> tuple[Any]:
    return (m.formula(Direction(*wi), Direction(*wo)),)


_TASK = Task(_formula, (VALUE,), (3, 3))


def factors(material: Parametrised) -> list[np.ndarray] | None:
    """Numbers a (n,) or () of every place of a material with maps (n, 1), such that f = sum of a g at each place, with
    functions g of the directions that all places share. None where the formula is not written so, or not traced.
    """
    leaves = content(material).leaves
    try:
        trace = traced(_TASK, material, 1)
    except TraceError:
        return None
    mapped = tuple(trace.inputs + k for k, x in enumerate(leaves) if np.ndim(_numbers(x)) > 1)
    pairs = separated(trace.graph, trace.results[0][0], mapped, range(trace.inputs))
    if pairs is None:
        return None
    with np.errstate(all="ignore"):
        tables = [table.numbers for table in content(material).tables]
        return evaluate(trace.graph, [a for a, _ in pairs], _loading(trace, leaves), tables, np.dtype(float))


def _loading(trace: Trace, leaves: list[Any]) -> Callable[[int, int], Any]:
    def load(k: int, component: int) -> Any:
        numbers = _numbers(leaves[k - trace.inputs])
        return numbers[..., component] if np.ndim(numbers) else numbers

    return load


def _numbers(leaf: Any) -> Any:
    return leaf.numbers if isinstance(leaf, Fixed) else leaf
