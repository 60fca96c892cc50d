"""Plans of calls: made once for a trace and for arrays of some shapes and strides, kept, and carried out.

To carry out the plan of a compiled kernel takes addresses alone; `available` says whether anything is compiled here.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from ..compile import elf
from ..compile.llvm import machine
from ..errors import DependencyError, EngineError, EngineWarning, ParameterError, TraceError, warn
from ..formula.parametrised import Parametrised
from ..machine.caches import Cache, Passing, made
from .call import Call, Draft, leaves_of, tables_of, within
from .tracing import Task, content
from .whole import PLAN

PLANS_KEPT = 64  # for a material

_GIVEN_UP: list[str] = []


class _Plan(Protocol):
    """A plan of any kind, for calls with arrays of the same shapes and strides."""

    @property
    def outputs(self) -> tuple[tuple[int, tuple[int, ...], np.dtype, int], ...]:
        """Of each result a number, its shape, its dtype and its bytes."""

    @classmethod
    def of(cls, call: Call, draft: Draft) -> Self | None:
        """The plan of a call; None where this kind does not pay."""

    def stored(self, inputs: Sequence[np.ndarray], out: np.ndarray | None) -> list[Any]:
        """The results; `out` takes the first one."""

    def added(self, inputs: Sequence[np.ndarray], into: Sequence[np.ndarray]) -> list[Any]:
        """The arrays `into`, with the results added."""

    def with_numbers(self, leaves: Sequence[Any], tables: Sequence[np.ndarray], dtype: np.dtype) -> Self:
        """The plan with other parameters, of the same shapes, and other tables."""

    def bare(self) -> Self:
        """The plan without the arrays of parameters that it keeps."""

    def size(self) -> int:
        """Bytes, with the code."""


def available() -> bool:
    """Whether formulas are compiled here: not with GONIO_ENGINE=numpy, nor on a processor without fused multiply-adds.

    Where llvmlite is missing or does not load, or memory may not be made executable, an EngineWarning says so, once.
    Raises ParameterError for another GONIO_ENGINE.
    """
    return not _GIVEN_UP and _possible()


@cache
def _possible() -> bool:
    asked = os.environ.get("GONIO_ENGINE", "")
    if asked not in ("", "numpy"):
        raise ParameterError(f"GONIO_ENGINE={asked!r}: expected numpy, which compiles nothing; or unset it")
    if asked:
        return False
    try:
        machine.compiler()
        if machine.lane_bits() == 0:
            return False
        elf.require_executable()
    except (DependencyError, EngineError) as error:
        _give_up(error)
        return False
    return True


def _give_up(error: Exception) -> None:
    if not _GIVEN_UP:
        _GIVEN_UP.append(str(error))
        text = f"formulas are computed by NumPy, about twenty times slower: {error}"
        warn(f"{text}; mend that, or set GONIO_ENGINE=numpy to silence this", EngineWarning)


def known(task: Task, material: Parametrised, inputs: Sequence[Any]) -> _Plan | None:
    """The plan of an earlier call of a task with such arrays, of this material or one of its structure and shapes."""
    key = task.plan_key(inputs)
    plans = material._derived.get(known)
    return (plans and plans.get(key)) or _of_pattern(key, task, material, inputs[0].dtype)


class _Pattern(NamedTuple):
    """A plan without arrays, for other numbers of the same structure and shapes."""

    plan: _Plan
    looked_up: frozenset[int]  # as those of its trace
    reach: dict[int, int]
    merged: bool  # whether any merged numbers are read


_PATTERNS: Cache[tuple[Any, ...], _Pattern] = Cache(lambda pattern: pattern.plan.size())


def _of_pattern(key: tuple[Any, ...], task: Task, material: Parametrised, dtype: np.dtype) -> _Plan | None:
    """A plan for the numbers of this material, if there was one for others of their shapes."""
    patterns = material._alike.get(known)
    if patterns is None:
        patterns = material._alike[known] = Passing()
    pattern = patterns.get(key)
    if pattern is None:
        whole = task.pattern_key(key, material)
        pattern = _PATTERNS.find(whole) if whole else None
        if pattern is None:
            return None
        if len(patterns) >= PLANS_KEPT:
            patterns.clear()
        patterns[key] = pattern
    tables = tables_of(pattern.looked_up, material, dtype)
    if pattern.reach and not within(pattern.reach, tables):
        return None
    return _remembered(key, material, pattern.plan.with_numbers(leaves_of(material, pattern.merged), tables, dtype))


def _remembered(key: tuple[Any, ...], material: Parametrised, plan: _Plan) -> _Plan:
    plans = material._derived.get(known)
    if plans is None:
        plans = material._derived[known] = Passing()
    elif len(plans) >= PLANS_KEPT:
        plans.clear()
    plans[key] = plan
    made(PLAN)
    return plan


# Ways of a call.


def again(call: Call) -> list[Any] | None:
    """The results by a plan that there is; None where there is none."""
    with suppress(TraceError, EngineError):
        plan = known(call.task, call.material, call.inputs)
        return _carried_out(plan, call) if plan is not None else None
    return None


def by(plan_class: type[_Plan]) -> Callable[[Call], list[Any] | None]:
    """The way that makes plans of a kind, and keeps them for further calls with such arrays."""

    def do(call: Call) -> list[Any] | None:
        with suppress(TraceError, EngineError):
            plan = new_plan(plan_class, call)
            return _carried_out(plan, call) if plan is not None else None
        return None

    return do


def new_plan(plan_class: type[_Plan], call: Call) -> _Plan | None:
    """A plan for calls with such arrays, kept for further ones; None where it does not pay, or cannot be made."""
    task, material, draft = call.task, call.material, call.draft
    assert draft is not None
    try:
        plan = plan_class.of(call, draft)
    except (DependencyError, EngineError) as error:
        _give_up(error)
        call.compiles = False
        return None
    if plan is None:
        return None
    trace, key = draft.trace, task.plan_key(call.inputs)
    if whole := task.pattern_key(key, material):
        merged = any(k >= trace.inputs + len(content(material).leaves) for k in trace.read)
        _PATTERNS.keep(whole, _Pattern(plan.bare(), trace.looked_up, trace.reach, merged))
    return _remembered(key, material, plan)


def _carried_out(plan: _Plan, call: Call) -> list[Any]:
    return plan.stored(call.inputs, call.out) if call.into is None else plan.added(call.inputs, call.into)
