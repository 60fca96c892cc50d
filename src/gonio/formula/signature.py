"""The signature of a constructor and the end of its class's docstring, both made of the declared fields.

`inspect.signature`, `help`, completion in notebooks and the stub `__init__.pyi` read them here.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from inspect import Parameter
from typing import Any, Protocol, TypeAlias

from ..discover import docstring
from .fields import Channels, Field, Param, Table


class _HasArray(Protocol):
    """An array of NumPy, PyTorch, JAX, Dr.Jit ..."""

    def __array__(self) -> Any: ...


Array: TypeAlias = _HasArray | Sequence[float] | Sequence[Sequence[float]] | Sequence[Sequence[Sequence[float]]]
"""Numbers, to a type checker: an array of any library, or lists. No text, which NumPy's ArrayLike lets pass."""


def signature(kind: Any) -> inspect.Signature:
    """The fields as parameters; tables and aliases, which set several parameters at once, by keyword only."""
    parameters, optional = [], False
    for name, field in kind.fields.items():
        by_keyword = isinstance(field, (Table, Channels))
        optional = optional or field.default is not None
        default = field.default if optional or by_keyword else Parameter.empty
        place = Parameter.KEYWORD_ONLY if by_keyword else Parameter.POSITIONAL_OR_KEYWORD
        parameters.append(Parameter(name, place, default=default, annotation=field.accepts))
    for alias, names in aliases(kind).items():
        accepts = kind.fields[names[0]].accepts
        parameters.append(Parameter(alias, Parameter.KEYWORD_ONLY, default=..., annotation=accepts))
    return inspect.Signature(sorted(parameters, key=lambda p: p.kind))


def aliases(kind: Any) -> dict[str, list[str]]:
    """Keyword that sets several parameters -> their names."""
    fields = kind.fields.items()
    return {alias: [name, *(n for n, f in fields if f.default == name)] for alias, name in kind._aliases().items()}


def takes_fields(kind: type) -> bool:
    """Whether the constructor is the one that takes the declared fields, and none of the class's own."""
    return next("__signature__" in vars(k) for k in kind.__mro__ if "__init__" in vars(k))


class Signature:
    """`__signature__` of the classes whose constructor takes the declared fields."""

    def __get__(self, instance: object, owner: type) -> inspect.Signature:
        if instance is not None or not takes_fields(owner):
            raise AttributeError(f"{owner.__name__} has a constructor of its own")
        return signature(owner)


class Docstring:
    """`__doc__` of a class with parameters: the text in the source, and a line for each parameter."""

    def __init__(self, written: str | None):
        self.written = written

    def __get__(self, instance: object, owner: Any) -> str | None:
        rows = parameter_lines(owner) if takes_fields(owner) else []
        parameters = "\n    ".join(["Parameters", *rows]) if rows else ""
        return "\n\n".join(filter(None, (docstring(owner), parameters))) or None


def parameter_lines(kind: Any) -> list[str]:
    """Every parameter with its default, meaning, bounds and unit, aligned."""
    rows = [(f"{name}{_with_default(field)}", field.meaning) for name, field in kind.fields.items()]
    rows += [(alias, f"sets {' and '.join(names)}") for alias, names in aliases(kind).items()]
    width = min(36, max((len(left) for left, _ in rows), default=0))
    return [f"{left:<{width}}   {right}" for left, right in rows]


def _with_default(field: Field) -> str:
    tied = isinstance(field, Param) and isinstance(field.default, str)
    return "" if field.default is None else f" = {field.default if tied else repr(field.default)}"
