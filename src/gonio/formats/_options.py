"""Options of readers and writers: those arguments of `read` and `write` that follow the path, all of them declared.

def write(m: Reflectance, path: Path, nodes: Annotated[int, Declared("cosines of either sign", 4, 2048)] = 64): ...
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from inspect import Parameter, signature
from types import ModuleType
from typing import Any

from ..declared.arguments import FunctionArgument, arguments
from ..errors import ParameterError, shown, suggestion
from ..tables.axes import fits

FLAGS = {"read": "-O", "write": "--option"}
"""What the command line calls an option to read a file with, and one to write it with."""

EXAMPLES = {"-O": "skip=12", "--option": "resolution=18,18,72"}
"""What is typed behind these."""


@cache
def options(function: Callable) -> dict[str, FunctionArgument]:
    """The options of a module's `read` or `write`, by name. Raises ParameterError for one without a declaration."""
    declared = arguments(function)
    first = {"read": 1, "write": 2}[function.__name__]
    for p in [*signature(function).parameters.values()][first:]:
        if p.name not in declared or not declared[p.name].declared.doc or p.default is Parameter.empty:
            raise ParameterError(
                f"{function.__module__}.{function.__name__}: the option {p.name} is not declared; expected "
                f'{p.name}: Annotated[type, Declared("what it means")] = default, with types that are imported'
            )
    return declared


def checked(module: ModuleType, verb: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of options, converted for a format's `verb`, "read" or "write".

    Raises ParameterError for an option that the format has not, or a value that is not allowed.
    """
    converted = {}
    for name, value in values.items():
        argument = f"{name}={shown(value)}"
        option = _option(module, verb, name, argument)
        converted[name] = _that_fits(option.checked(value, argument, _advice(module)), option, argument)
    return converted


def of_texts(module: ModuleType, verb: str, texts: Iterable[str]) -> dict[str, Any]:
    """The options typed as "name=value" on the command line, or "name.key=value" for one entry of an object, checked.

    An entry that is given again becomes a list.
    """
    converted: dict[str, Any] = {}
    entries: dict[str, dict[str, Any]] = {}
    for text in texts:
        name, key, value = _parts(text, FLAGS[verb])
        argument = f"{FLAGS[verb]} {text!r:.60}"
        option = _option(module, verb, name, argument)
        if name in converted or (name in entries and not key):
            raise ParameterError(f"{argument}: {name} is given twice, expected once")
        if key:
            of = entries.setdefault(name, {})
            of[key] = [*_several(of[key]), value] if key in of else value
        else:
            converted[name] = _that_fits(option.checked_text(value, argument, _advice(module)), option, argument)
    for name, of in entries.items():
        argument = f"{FLAGS[verb]} {name}.{next(iter(of))}"
        converted[name] = _option(module, verb, name, argument).checked(of, argument, _advice(module))
    return converted


def _option(module: ModuleType, verb: str, name: str, argument: str) -> FunctionArgument:
    """What a format declares of an option. Raises ParameterError for one that it has not."""
    declared = options(getattr(module, verb))
    if name not in declared:
        close, listed = suggestion(name, declared), ", ".join(declared)
        expected = f"expected one of {listed}{_advice(module)}" if declared else "expected none"
        raise ParameterError(f"{argument}: no option to {verb} {module.NAME} files{close}; {expected}")
    return declared[name]


def _advice(module: ModuleType) -> str:
    return f"; `gonio formats {shlex.quote(module.NAME)}` lists the options"


def _that_fits(value: Any, option: FunctionArgument, argument: str) -> Any:
    """The value; counts of nodes whose table fits into memory. Raises TooLargeError."""
    if option.declared.lengths and value is not None:
        fits(math.prod(value), argument)
    return value


def _several(entry: Any) -> list[Any]:
    return entry if isinstance(entry, list) else [entry]


def names_in(texts: Iterable[str]) -> set[str]:
    """The names of options to read a file with, as typed on the command line."""
    return {_parts(text, FLAGS["read"])[0] for text in texts}


def _parts(text: str, flag: str) -> tuple[str, str, str]:
    """Name, key and value of "name.key=value"; the key is "" in "name=value"."""
    name, equals, value = (part.strip() for part in text.partition("="))
    name, dot, key = name.partition(".")
    if not equals or not name or (dot and not key):
        raise ParameterError(f"{flag} {text!r:.60}: expected name=value, such as {EXAMPLES[flag]}")
    return name.replace("-", "_"), key, value
