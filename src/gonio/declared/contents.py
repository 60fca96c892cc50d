"""Tables of contents, by name: `gn.models()`, `gn.lights()`, `gn.formats()` ... print as tables."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Iterable, Iterator, Mapping
from types import ModuleType
from typing import Any, Generic, TypeVar

from ..errors import NotFoundError, suggestion
from .discover import docstring
from .notebooks import repr_html

T = TypeVar("T")
WIDTH = 110
"""Characters of a line."""


def columns(rows: Iterable[tuple[str, str]]) -> str:
    """Names and descriptions, aligned, cut at WIDTH."""
    rows = list(rows)
    start = max((len(name) for name, _ in rows), default=0) + 2
    lines = [f"{name:<{start}}{text}" for name, text in rows]
    return "\n".join(line if len(line) <= WIDTH else line[: WIDTH - 4] + " ..." for line in lines)


class _NotThere(NotFoundError, KeyError):
    """As dictionaries raise it: `in` and `get` of a mapping wait for it."""


class Contents(Mapping[str, T], Generic[T]):
    """Name -> class, or module of a format; it cannot be changed, and prints with a line for each."""

    _repr_html_ = repr_html

    def __init__(self, things: Mapping[str, T]):
        self._things = dict(sorted(things.items(), key=lambda item: item[0].lower()))

    def __getitem__(self, name: str) -> T:
        if name not in self._things:
            raise _NotThere(f"no {name!r:.60} here{suggestion(str(name), self._things)}")
        return self._things[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._things)

    def __len__(self) -> int:
        return len(self._things)

    def __repr__(self) -> str:
        return columns((name, summary(thing)) for name, thing in self.items())


def summary(thing: object) -> str:
    """The beginning of a class's docstring, up to its formula; of a file format the description and suffixes."""
    if isinstance(thing, ModuleType):
        return f"{thing.DESCRIPTION} ({', '.join(thing.SUFFIXES)}){'' if hasattr(thing, 'write') else ', read only'}"
    text = " ".join(docstring(thing).partition("\n\n")[0].split()) if isinstance(thing, type) else ""
    return re.split(r"[:,] \S+ = |(?<=\S)\. (?=[A-Z])", text)[0].rstrip(".")


class Folder(ModuleType):
    """A folder of the package whose files are discovered; called, it lists their contents."""

    def __repr__(self) -> str:
        return f"<module {self.__name__!r}; {self.__name__}() lists what it holds>"

    def __dir__(self) -> list[str]:
        files = {file.name for file in pkgutil.iter_modules(self.__path__)}
        own = {name for name, value in vars(self).items() if getattr(value, "__module__", "") == self.__name__}
        return sorted(name for name in files | own if name[0] != "_")

    def __call__(self) -> Contents[Any]:
        listed: Contents[Any] = self.contents()
        return listed
