"""The pages of the reference: every public name, where it belongs; which names there are is nobody's list."""

from __future__ import annotations

import contextlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

from docstrings import as_rst, inline

import gonio as gn
from gonio.base.light import Light
from gonio.declared import discover
from gonio.declared.contents import Folder
from gonio.declared.namespace import namespaces, places_of, value_at
from gonio.facts.models import kinds
from gonio.formula.state import derived

DOORS = ("authoring", "testing")
"""Modules of the package for who writes models and tests: not in `gn`, but public."""

ROOM = re.compile(r"^\| `(\w+)/`[^|]*\| (.*) \|$", re.MULTILINE)
MEMBERS = (FunctionType, classmethod, staticmethod, property, derived)


class Group(NamedTuple):
    """A page: its title, what stands below it, and the module -> names that it shows."""

    title: str
    about: str
    module: str
    names: tuple[str, ...]


def rooms() -> dict[str, str]:
    """Folders of the package, in their order -> what is in them."""
    page = Path(__file__).resolve().parents[1] / "architecture.md"
    return dict(ROOM.findall(page.read_text(encoding="utf-8")))


def room(name: str) -> str:
    """The folder that a public name comes from; "errors" and the like for modules beside the folders."""
    home = gn._ON_USE.get(name) or getattr(getattr(gn, name), "__module__", "").removeprefix("gonio.")
    return home.split(".")[0] or name


def groups() -> dict[str, Group]:
    """File name -> page."""
    left, of, titles = set(gn.__all__), dict[str, list[str]](), dict[str, str]()
    lights = discover.classes("gonio.lights", Light)
    for title, classes in (kinds() | {"Lights": lights}).items():
        key = title.lower().replace(" ", "-")
        titles[key], of[key] = title, sorted(left & set(classes), key=str.lower)
        left -= set(classes)
    modules = {n for n in left if isinstance(getattr(gn, n), ModuleType) and not isinstance(getattr(gn, n), Folder)}
    for name in sorted(left - modules, key=str.lower):
        of.setdefault(room(name), []).append(name)
    texts, found = rooms(), dict[str, Group]()
    for key in [*titles, *sorted(set(of) - set(titles))]:
        title = titles.get(key, key.replace("_", " ").capitalize())
        found[key] = Group(title, sentence(texts.get(key, "")), "gonio", tuple(of[key]))
    named = {f"gonio.{place}": module for place, module in namespaces()} | {"gonio.errors": gn.errors}
    named |= {module.__name__: module for module in (*(import_module(f"gonio.{name}") for name in DOORS), *bridges())}
    for title, module in sorted(named.items(), key=lambda item: ("bridges" in item[0], item[0])):
        if names := tuple(public(module)):
            found[title] = Group(title, discover.docstring(module), module.__name__, names)
    return found


def sentence(text: str) -> str:
    """What a table says of a room, as a sentence."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def bridges() -> Iterator[ModuleType]:
    """Modules for other libraries, those that are installed."""
    for found in pkgutil.iter_modules(import_module("gonio.bridges").__path__):
        with contextlib.suppress(ImportError, gn.errors.DependencyError):
            if found.name[0] != "_":
                yield import_module(f"gonio.bridges.{found.name}")


def public(module: ModuleType) -> Iterator[str]:
    """Functions and classes of a public module, its own and those that it takes from its files."""
    listed = getattr(module, "__all__", sorted(vars(module)))
    for name in listed:
        value = getattr(module, name)
        if name[0] != "_" and isinstance(value, (FunctionType, type)):
            own = value.__module__.startswith(module.__name__)
            taken = hasattr(module, "__all__") and value.__module__.startswith("gonio")
            if (own or taken) and (isinstance(value, type) or "Example\n" in discover.docstring(value)):
                yield name


def members(kind: type) -> Iterator[str]:
    """Methods and properties with a docstring that are this class's: its own, and those of its private bases."""
    shown = {base for base in kind.__mro__[1:] if base.__name__ in gn.__all__}
    covered = {base for other in shown for base in other.__mro__}
    names: dict[str, None] = {}
    for base in kind.__mro__:
        if base is kind or (base.__module__.startswith("gonio") and base not in covered):
            names |= {n: None for n, x in vars(base).items() if n[0] != "_" and isinstance(x, MEMBERS)}
    for name in names:
        value = inspect.getattr_static(kind, name)
        value = getattr(value, "fget", None) or getattr(value, "__func__", value)
        if isinstance(value, derived) or getattr(value, "__doc__", None):
            yield name


def summary(thing: Any) -> str:
    """The first sentence of a docstring."""
    text = discover.docstring(thing.contents if isinstance(thing, Folder) else thing)
    first = " ".join((text or "").split("\n\n")[0].split())
    return re.split(r"(?<=[^.])\.(?= [A-Z`]|$)", first)[0].rstrip(".:")


def heading(text: str) -> list[str]:
    return [text, "=" * len(text), ""]


def home(module: str, name: str) -> str:
    """The module below which a name is explained: the first in which the same thing is public."""
    thing = getattr(import_module(module), name)
    places = (place.removeprefix("gn.") for place in places_of(name) if value_at(place) is thing)
    return next((f"gonio.{place}".rpartition(".")[0] for place in places), module)


def link(module: str, name: str) -> str:
    return f":py:obj:`{name} <{home(module, name)}.{name}>`"


def listing(group: Group) -> Iterator[str]:
    """A table of names and what they are."""
    module = import_module(group.module)
    yield from [".. list-table::", "   :class: names", "   :widths: auto", ""]
    for name in group.names:
        yield f"   * - {link(group.module, name)}"
        yield f"     - {inline(summary(getattr(module, name))).strip()}"
    yield ""


def entry(module: str, name: str) -> Iterator[str]:
    """The directive that shows a name."""
    thing = getattr(import_module(module), name)
    if isinstance(thing, Folder):
        yield from [f".. py:function:: {name}()", "", f"   {inline(discover.docstring(thing.contents)).strip()}", ""]
        return
    if not isinstance(thing, type):
        yield from [f".. autofunction:: {module}.{name}", ""]
        return
    yield f".. {'autoexception' if issubclass(thing, BaseException) else 'autoclass'}:: {module}.{name}"
    if names := list(members(thing)):
        yield f"   :members: {', '.join(names)}"
    yield ""
    if any(name in classes for classes in kinds().values()):
        yield from [f"   Picture and parameters: :doc:`/models/{name}`.", ""]


def page(group: Group) -> str:
    """A page of the reference."""
    lines = [*heading(group.title), *([f".. py:module:: {group.module}", ""] if group.module != "gonio" else [])]
    lines += [f".. py:currentmodule:: {group.module}", "", *as_rst(group.about)]
    lines += listing(group)
    for name in group.names:
        if home(group.module, name) == group.module:
            lines += entry(group.module, name)
    return "\n".join(lines) + "\n"


def index() -> str:
    """The page that lists all pages, with all names."""
    lines = [*heading("Reference"), "Every public name, by its place in the package: ``import gonio as gn``.", ""]
    lines += [".. py:module:: gonio", ""]
    every = groups()
    for key, group in every.items():
        about = as_rst(group.about.partition("\n\n")[0])
        names = ", ".join(link(group.module, n) for n in group.names)
        lines += [f":doc:`{key}`", *(f"   {line}" for line in about), f"   {names}", ""]
    lines += [".. toctree::", "   :hidden:", "", *(f"   {key}" for key in every), ""]
    return "\n".join(lines) + "\n"


def pages() -> dict[str, str]:
    """Every page, by its file."""
    return {"reference/index.rst": index()} | {f"reference/{key}.rst": page(g) for key, g in groups().items()}
