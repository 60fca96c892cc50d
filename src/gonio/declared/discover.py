"""Finding the modules in a folder of the package, so that new files need no list, and docstrings."""

from __future__ import annotations

import ast
import inspect
import pkgutil
import re
import sys
from collections.abc import Callable, Sequence
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any


def modules(package: str) -> list[ModuleType]:
    """The modules of a subpackage, in the order of their names; files that start with an underscore are left out."""
    return list(by_name(package).values())


def by_name(package: str) -> dict[str, ModuleType]:
    """The same by their own names, without the package's."""
    names = sorted(m.name for m in pkgutil.iter_modules(import_module(package).__path__) if m.name[0] != "_")
    return {name: import_module(f"{package}.{name}") for name in names}


def functions(package: str) -> dict[str, Callable[..., Any]]:
    """The function that each file of a subpackage is named after."""
    return {name: getattr(module, name) for name, module in by_name(package).items()}


def classes(package: str, kind: type[Any]) -> dict[str, type[Any]]:
    """The public classes of a kind that a subpackage's files define, by name; without the kind itself."""
    defined = {
        name: c
        for module in modules(package)
        for name, c in vars(module).items()
        if isinstance(c, type) and issubclass(c, kind) and (c.__module__, c.__name__) == (module.__name__, name)
    }
    return {name: defined[name] for name in sorted(defined) if name[0] != "_" and defined[name] is not kind}


def labelled(text: str, labels: Sequence[str]) -> dict[str, str]:
    """A docstring cut at its labels ("Source   ..."): label -> text; the text before the first is under "".

    What follows a label on a line of its own ("Example") keeps its indentation.
    """
    parts, label, keeps = {"": ""}, "", True
    for line in text.splitlines():
        head = re.match(rf"({'|'.join(labels)})(?: +(.*)|$)", line)
        if head:
            label, line, keeps = head[1], head[2] or "", head[2] is None
        parts[label] = parts.get(label, "") + "\n" + (line if keeps else line.strip())
    return {name: part.strip() for name, part in parts.items()}


def docstring(of: ModuleType | type | Callable[..., Any]) -> str:
    """The docstring of a module, a class or a function, without indentation (Python 3.13 removes that itself), or "";
    where Python left it out (-OO), from the source."""
    composed: Any = vars(of).get("__doc__")
    written = composed.written if hasattr(composed, "written") else of.__doc__  # `Docstring` of formula/classes.py
    if written is not None or sys.flags.optimize < 2:
        return inspect.cleandoc(written or "")
    module, name = (of.__name__, "") if isinstance(of, ModuleType) else (of.__module__, of.__qualname__)
    return _written(module).get(name, "")


@cache
def _written(module: str) -> dict[str, str]:
    """The docstrings in the source of a module by qualified names, its own under ""."""
    spec = find_spec(module) if module != "__main__" else None
    get_source = getattr(spec and spec.loader, "get_source", lambda _: None)  # not all loaders have sources
    docstrings: dict[str, str] = {}

    def collect(node: ast.Module | ast.ClassDef | ast.FunctionDef, name: str) -> None:
        if (text := ast.get_docstring(node)) is not None:
            docstrings[name] = text
        for inner in node.body:
            if isinstance(inner, (ast.ClassDef, ast.FunctionDef)):
                collect(inner, f"{name}.{inner.name}".removeprefix("."))

    collect(ast.parse(get_source(module) or ""), "")
    return docstrings
