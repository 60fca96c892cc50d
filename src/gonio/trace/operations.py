"""All operations of graphs: the elementary functions of `ops`, and those that passes know by their algebra."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

from ..arrays.operation import Builder, Operation, Terms
from ..arrays.ops import ELEMENTARY


def _quotient(do: Builder, number: Builder, slope: int, r: int, x: int, y: int) -> Terms:
    part = do("div", slope, y)
    return part, do("neg", do("mul", part, r))


def _choice(do: Builder, number: Builder, slope: int, r: int, condition: int, *_: int) -> Terms:
    zero = number(0.0)
    return None, do("select", condition, slope, zero), do("select", condition, zero, slope)


STRUCTURAL = (
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

OPERATIONS: Mapping[str, Operation] = {row.name: row for row in STRUCTURAL} | ELEMENTARY

OPERATORS: dict[str, Callable[..., Any]] = {
    row.name: getattr(operator, f"__{row.operator}__") for row in STRUCTURAL if row.operator
}
"""What Python's operators do with arrays of any library."""
