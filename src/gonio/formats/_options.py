"""Options of readers and writers: those arguments of `read` and `write` that follow the path, all of them declared.

def write(m: Reflectance, path: Path, nodes: Annotated[int, Declared("cosines of either sign", 4, 2048)] = 64): ...
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from inspect import Parameter, signature
from types import ModuleType
from typing import Any

from ..declared.arguments import Argument, arguments
from ..errors import ParameterError, shown
from ..tables.axes import fits


@cache
def options(function: Callable) -> dict[str, Argument]:
    """The options of a module's `read` or `write`, by name. Raises ParameterError for one without a declaration."""
    declared = arguments(function)
    first = {"read": 1, "write": 2}[function.__name__]
    for p in [*signature(function).parameters.values()][first:]:
        if p.name not in declared or not declared[p.name].declared.doc or p.default is Parameter.empty:
            raise ParameterError(
                f"{function.__module__}.{function.__name__}: the option {p.name} is not declared; expected "
                f'{p.name}: Annotated[type, Declared("what it means")] = default'
            )
    return declared


def checked(module: ModuleType, verb: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of options, converted for a format's `verb`, "read" or "write".

    Raises ParameterError for an option that the format has not, or a value that is not allowed.
    """
    declared = options(getattr(module, verb))
    advice = f"; `gonio formats {module.NAME}` lists the options"
    for name in values:
        if name not in declared:
            expected = f"expected one of {', '.join(declared)}{advice}" if declared else "expected none"
            raise ParameterError(f"{name}={shown(values[name])}: no option to {verb} {module.NAME} files; {expected}")
    converted = {name: declared[name].checked(value, advice) for name, value in values.items()}
    for name, value in converted.items():
        if declared[name].declared.lengths and value is not None:
            fits(math.prod(value), f"{name}={shown(values[name])}")
    return converted


def of_texts(module: ModuleType, verb: str, texts: Iterable[str]) -> dict[str, Any]:
    """The options typed as "name=value" on the command line, or "name.key=value" for one entry of an object, checked.

    An entry that is given again becomes a list.
    """
    declared = options(getattr(module, verb))
    values: dict[str, Any] = {}
    for text in texts:
        name, key, value = _parts(text)
        if key:
            entries = values.setdefault(name, {})
            if not isinstance(entries, dict):
                raise ParameterError(f"--option {text!r:.60}: {name} is given twice, expected once")
            entries[key] = [*_several(entries[key]), value] if key in entries else value
            continue
        if name in values:
            raise ParameterError(f"--option {text!r:.60}: {name} is given twice, expected once")
        values[name] = declared[name].of_text(value) if name in declared else value
    return checked(module, verb, values)


def _several(entry: Any) -> list[Any]:
    return entry if isinstance(entry, list) else [entry]


def names_in(texts: Iterable[str]) -> set[str]:
    """The names of options typed on the command line."""
    return {_parts(text)[0] for text in texts}


def _parts(text: str) -> tuple[str, str, str]:
    """Name, key and value of "name.key=value"; the key is "" in "name=value"."""
    name, equals, value = (part.strip() for part in text.partition("="))
    name, dot, key = name.partition(".")
    if not equals or not name or (dot and not key):
        raise ParameterError(f"--option {text!r:.60}: expected name=value, such as interpolation=linear")
    return name.replace("-", "_"), key, value
