"""The rooms of src/gonio, and what their modules import."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from places import PACKAGE

ROOMS = (
    *("", "machine", "declared", "files", "numerics", "radiometry", "arrays", "trace", "compile", "rays", "pictures"),
    *("formula", "evaluate", "base", "polarization"),
    *("surfaces", "distributions", "models", "lights", "tables", "integrals", "layers", "remote_sensing"),
    *("formats", "catalogue", "conversion", "repair", "uncertainty", "laws", "fitting", "reconstruction"),
    *("scenes", "interreflection", "instrument"),
    *("facts", "bridges", "figures", "explorer", "report", "cli"),
)
"""Folders, from the ground up; "" stands for the modules beside them."""


def _name(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}


DOORS = {name for name in MODULES if ("." not in name and MODULES[name].name != "__init__.py") or not name} - {"errors"}
"""The modules beside the rooms, by which users enter: these import from anywhere, but for the errors."""


def room(name: str) -> str:
    """The folder that a module is in."""
    return name.partition(".")[0] if "." in name or MODULES[name].name == "__init__.py" else ""


def _meant(name: str, level: int, module: str | None, names: Iterable[str]) -> set[str]:
    """Modules of the package that a relative import of one of them means."""
    package = [part for part in name.split(".") if part]
    package = package if MODULES[name].name == "__init__.py" else package[:-1]
    base = package[: len(package) - level + 1] + (module.split(".") if module else [])
    full = {".".join([*base, n]) for n in names}
    return {f if f in MODULES else ".".join(base) for f in full}


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """All statements of a module, without the expressions in them: imports are none."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        this = waiting.pop()
        yield this
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting += getattr(this, part, ())


@cache
def imported(name: str) -> tuple[set[str], set[str]]:
    """Modules of the package that a module imports anywhere in its text, and names of other packages.

    What only a type checker imports counts too.
    """
    own, others = set(), set()
    for node in _statements(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            others.update(a.name.partition(".")[0] for a in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            others.add((node.module or "").partition(".")[0])
        elif isinstance(node, ast.ImportFrom):
            own |= _meant(name, node.level, node.module, [a.name for a in node.names])
    return own - {""}, others


def part(name: str) -> str:
    """What is near or far as a whole: the room of a module; of those beside the rooms each by itself."""
    return room(name) or name


_IMPORT = re.compile(r"^[ \t]*from (\.+)([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
_NAMED = re.compile(r'"gonio\.(\w+)[\w.]*"')


@cache
def users() -> dict[str, set[str]]:
    """For every part of the package those that import it, or hold its name: packages are discovered by name.

    By lines, where `imported` reads the syntax, for a fiftieth of the time.
    """
    graph: dict[str, set[str]] = {}
    for name in set(MODULES) - DOORS:
        text = MODULES[name].read_text(encoding="utf-8")
        others = {n for n in _NAMED.findall(text) if n in MODULES}
        for dots, module, names in _IMPORT.findall(text):
            others |= _meant(name, len(dots), module, re.findall(r"\w+", re.sub(r" as \w+|#.*", "", names)))
        for other in others - {""}:
            graph.setdefault(part(other), set()).add(part(name))
    return graph


def above(parts: set[str], graph: dict[str, set[str]]) -> set[str]:
    """Parts of the package, and all that import them, directly or by others."""
    found: set[str] = set()
    waiting = list(parts)
    while waiting:
        this = waiting.pop()
        if this not in found:
            found.add(this)
            waiting += graph.get(this, ())
    return found


@cache
def _public() -> dict[str, str]:
    """Place of a public name, `albedo` or `fitting.fit_map` -> the part of the package it comes from, by the stubs."""
    places = {}
    for stub in PACKAGE.rglob("*.pyi"):
        namespace = _name(stub)
        lines = re.findall(
            r"^from \.+([\w.]*) import (\w+) as _?(\w+)$", stub.read_text(encoding="utf-8"), re.MULTILINE
        )
        places |= {f"{namespace}.{name}".lstrip("."): part(module or this) for module, this, name in lines}
    return places


def used(text: str) -> set[str]:
    """Parts of the package that a program names, as modules or by what is public of them."""
    modules = re.findall(r"\bgonio\.(\w+)|\bfrom gonio import (\w+)", text)
    names = {first or second for first, second in modules}
    written = re.findall(r"\bgn\.(\w+)(?:\.(\w+))?", text)
    places = {place for first, second in written for place in (first, f"{first}.{second}")}
    return {part(n) for n in names if n in MODULES} | {_public()[place] for place in places & _public().keys()}
