"""Find what a folder of the package holds, and docstrings: a new file there is known without being listed anywhere."""

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
    """The modules of a subpackage, by name; files that start with an underscore are left out."""
    path = import_module(package).__path__
    names = sorted(m.name for m in pkgutil.iter_modules(path) if not m.name.startswith("_"))
    return [import_module(f"{package}.{name}") for name in names]


def by_name(package: str) -> dict[str, ModuleType]:
    """The same by their own names, without the package's."""
    return {module.__name__.rpartition(".")[2]: module for module in modules(package)}


def functions(package: str) -> dict[str, Callable[..., Any]]:
    """The function that each file of a subpackage is named after."""
    return {name: getattr(module, name) for name, module in by_name(package).items()}


def classes(package: str, kind: type[Any]) -> dict[str, type[Any]]:
    """The public classes of a kind that a subpackage's files define, by name; without the kind itself."""
    defined = {
        name: value
        for module in modules(package)
        for name, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__ and name == value.__name__
    }
    chosen = {name: c for name, c in defined.items() if issubclass(c, kind) and c is not kind and name[0] != "_"}
    return dict(sorted(chosen.items()))


def labelled(text: str, labels: Sequence[str]) -> dict[str, str]:
    """A docstring cut at its labels ("Source   ..."): label -> text; what stands before the first is under ""."""
    parts, label = {"": ""}, ""
    for line in text.splitlines():
        head = re.match(rf"({'|'.join(labels)}) +(.*)", line)
        if head:
            label, line = head[1], head[2]
        parts[label] = parts.get(label, "") + "\n" + (line.strip() if label else line)
    return {name: part.strip() for name, part in parts.items()}


def docstring(of: ModuleType | type | Callable[..., Any]) -> str:
    """The docstring of a module, a class or a function, without indentation (Python 3.13 takes that away itself); ""
    for none; where Python left it out (-OO), as the source has it."""
    composed: Any = vars(of).get("__doc__")
    written = composed.written if hasattr(composed, "written") else of.__doc__  # `Docstring` of formula/signature.py
    if written is not None or sys.flags.optimize < 2:
        return inspect.cleandoc(written or "")
    if isinstance(of, ModuleType):
        return _written(of.__name__).get("", "")
    return _written(of.__module__).get(of.__qualname__, "")


@cache
def _written(module: str) -> dict[str, str]:
    """The docstrings in the source of a module by qualified names, its own under ""."""
    from importlib.abc import InspectLoader  # which imports half the standard library

    spec = find_spec(module) if module != "__main__" else None
    loader = spec.loader if spec else None
    source = loader.get_source(module) if isinstance(loader, InspectLoader) else None
    found: dict[str, str] = {}

    def collect(node: ast.Module | ast.ClassDef | ast.FunctionDef, name: str) -> None:
        text = ast.get_docstring(node)
        if text is not None:
            found[name] = text
        for inner in node.body:
            if isinstance(inner, (ast.ClassDef, ast.FunctionDef)):
                collect(inner, f"{name}.{inner.name}".removeprefix("."))

    if source is not None:
        collect(ast.parse(source), "")
    return found
