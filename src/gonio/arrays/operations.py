"""Operations: what a row of the table says, and the rows of those that are no elementary functions (see `ops`)."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

Builder = Callable[..., int]
Terms = Sequence[int | None]
Rule = Callable[..., Terms]
"""(apply, constant, slope, result, *arguments) -> the slope times the derivative by each argument, as nodes of a graph;
None for an argument that has none."""

NOTHING: Mapping[str, Any] = {}


class Operation(NamedTuple):
    """An operation of graphs by its name there.

    `arguments`: their names, of an elementary function. `cost`: in products; that of a choice where it is None.
    `derivative`: 0 where it is None. `operator`: Python's for it. `function`: of `ops`, where that has another name;
    `shown`: its name in formulas that are shown, if again another.

    `bounded`: results are not large, however large the arguments are; `wide`: they may be as large as the dtype allows,
    or their reciprocals. `positive`: never below 0, and `zero` says where they may be 0. `multiplicative`: f(a b) is
    f(a) f(b).

    `libraries`: what array libraries call it, where that differs, or how they compute it: a function of (library,
    *arguments); by the library's name, "" for all others, "mitsuba" for Mitsuba's numbers. `special`: of the functions
    that libraries may have in a module apart the one that it is, or is made of.

    `languages`: what source languages call it: "c" is for C and CUDA, "cuda" for that alone, "shading" for all others.
    Those in `rough` have too few digits to be called but by the formula of `compile/source/elementary.py`, which also
    stands in where a language has none. `llvm`: the intrinsic of LLVM that computes it; else a function of
    `compile/llvm/elementary/` does.
    """

    name: str
    arguments: tuple[str, ...] = ()
    cost: float | None = None
    derivative: Rule | None = None
    operator: str = ""
    function: str = ""
    shown: str = ""
    bounded: bool = False
    wide: bool = False
    positive: bool = False
    zero: Literal["anywhere", "at 0", "nowhere"] = "anywhere"
    multiplicative: bool = False
    libraries: Mapping[str, Any] = NOTHING
    special: str = ""
    languages: Mapping[str, str] = NOTHING
    rough: tuple[str, ...] = ()
    llvm: str = ""


def chain(derivative: Callable[[Builder, Builder, int, int], int]) -> Rule:
    """A rule from the derivative of a function of one number: (apply, constant, argument, result) -> node."""
    return lambda do, number, slope, r, x: [do("mul", slope, derivative(do, number, x, r))]


def _quotient(do: Builder, number: Builder, slope: int, r: int, x: int, y: int) -> Terms:
    part = do("div", slope, y)
    return part, do("neg", do("mul", part, r))


def _choice(do: Builder, number: Builder, slope: int, r: int, condition: int, *_: int) -> Terms:
    zero = number(0.0)
    return None, do("select", condition, slope, zero), do("select", condition, zero, slope)


STRUCTURAL: tuple[Operation, ...] = (
    Operation("constant", cost=0.0),
    Operation("load", cost=0.0),
    Operation("take", cost=8.0, wide=True),
    Operation("state", wide=True),
    Operation("loop"),
    Operation("result", wide=True),
    Operation("rays", cost=300.0),
    Operation("stop", cost=0.0, function="stop_gradient"),
    Operation("to_index", shown="int"),
    Operation("to_real", shown="float"),
    # a sum costs less than a product, since most are fused with one
    Operation("add", cost=0.5, derivative=lambda do, number, slope, r, x, y: (slope, slope), operator="add"),
    Operation("sub", cost=0.5, derivative=lambda do, number, slope, r, x, y: (slope, do("neg", slope)), operator="sub"),
    Operation(
        "mul",
        cost=1.0,
        derivative=lambda do, number, slope, r, x, y: (do("mul", slope, y), do("mul", slope, x)),
        operator="mul",
    ),
    Operation("div", cost=3.0, derivative=_quotient, operator="truediv"),
    Operation("neg", cost=0.5, derivative=lambda do, number, slope, r, x: (do("neg", slope),), operator="neg"),
    Operation("select", derivative=_choice, function="where"),
    *(Operation(name, operator=name) for name in ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "xor")),
    Operation("shl", function="shift_left"),
    Operation("lshr", function="shift_right"),
)
"""What graphs are made of beside elementary functions: what passes and languages know by its algebra."""

OPERATORS: dict[str, Callable[..., Any]] = {
    row.name: getattr(operator, f"__{row.operator}__") for row in STRUCTURAL if row.operator
}
"""What Python's operators do with arrays of any library."""
