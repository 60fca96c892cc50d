"""Public modules: what `dir` shows of them, names that are imported when they are first used, where a name is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import reduce
from importlib import import_module
from types import ModuleType
from typing import Any

PACKAGE = __name__.partition(".")[0]


class _NoSuchName(AttributeError):
    """A module has no attribute of this name. What it says is looked for when it is read: imports ask and go on."""

    def __init__(self, module: str, name: str, names: Iterable[str]):
        super().__init__(module, name)
        self.names = names

    def __str__(self) -> str:
        module, name = self.args
        return f"module {module!r} has no attribute {name!r}{'' if name[0] == '_' else self._advice(name)}"

    def _advice(self, name: str) -> str:
        """The place of the name; else of one that ends in it, or is nearly this."""
        from difflib import get_close_matches  # late: messages alone need it

        authoring = import_module(f"{PACKAGE}.authoring")
        places = {x: f"gonio.authoring.{x}" for x in authoring.__all__}
        for namespace, module in reversed([*namespaces()]):  # the first of several wins
            places |= {x: f"gn.{namespace}.{x}" for x in module.__all__}
        if place := next(places_of(name), places.get(name)):
            return f"; it is {place}"
        places |= {x: repr(x) for x in self.names}
        close = [x for x in places if x.endswith(f"_{name}")] or get_close_matches(name, places, n=1)
        return f"; did you mean {' or '.join(places[x] for x in close[:3])}?" if close else ""


def on_use(module: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a public module: name -> the module of gonio that defines it.

    "" where the name is a module's. A name that is elsewhere is told with its place: `gn.fitting.fit_map`.
    """
    names = sorted(homes)

    def attribute(name: str) -> Any:
        if name not in homes:
            raise _NoSuchName(module, name, dir(sys.modules[module]))
        value = import_module(f"{PACKAGE}.{homes[name] or name}")
        if homes[name]:
            value = getattr(value, name)
        setattr(sys.modules[module], name, value)
        return value

    return attribute, lambda: names, names


def own_names(attributes: Mapping[str, Any], *others: str) -> tuple[list[str], Callable[[], list[str]]]:
    """`__all__` and `__dir__` of a public module that imports or defines all it shows: functions and classes that are
    defined in its files, and `others`: constants, and modules of its folder."""
    own = f"{attributes['__name__']}."
    defined = {n for n, x in attributes.items() if f"{getattr(x, '__module__', '')}.".startswith(own) and n[0] != "_"}
    names = sorted(defined.union(others))
    return names, lambda: names


def namespaces() -> Iterator[tuple[str, ModuleType]]:
    """Public modules by their places: `fitting`, `radiometry.roughness`; `__all__` says what they hold."""
    gonio = sys.modules[PACKAGE]
    waiting = [(name, getattr(gonio, name)) for name in (*gonio.NAMESPACES, *gonio.ROOMS)]
    for place, module in waiting:
        if hasattr(module, "__all__"):
            yield place, module
            inner = (
                (name, getattr(module, name))
                for name in module.__all__
                if isinstance(vars(module).get(name), ModuleType)
            )
            waiting += [(f"{place}.{name}", x) for name, x in inner]


def places_of(name: str) -> Iterator[str]:
    """How what is public by this name is written: `gn.albedo`, `gn.scenes.radiosity`; of rooms that are not imported
    nothing is known."""
    gonio = sys.modules[PACKAGE]
    if name in gonio.__all__:
        yield f"gn.{name}"
    known = [*gonio.NAMESPACES, *(room for room in gonio.ROOMS if room in vars(gonio))]
    yield from (f"gn.{x}.{name}" for x in known if name in getattr(getattr(gonio, x), "__all__", ()))


def value_at(place: str) -> Any:
    """What is public at a place: `gn.albedo`, `gn.figures.albedo`."""
    return reduce(getattr, place.split(".")[1:], sys.modules[PACKAGE])
