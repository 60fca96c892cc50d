"""Every public thing has an example in its docstring, which runs and prints what stands there.

Public are the names of `gn.__all__` and of the modules beside it, the classes that public functions return, and the
methods and properties of public classes and their bases that have a docstring. Not asked for: what subclasses write
without a docstring of their own (`formula`, `warp` ...), as it is written, not called, and what private classes and
modules hold.
"""

from __future__ import annotations

import doctest
import inspect
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
import pytest

import gonio as gn
from gonio import authoring, figures, radiometry, repair, surfaces, testing
from gonio.declared import discover
from gonio.formula.state import derived
from gonio.radiometry import roughness

BESIDE = (authoring, figures, radiometry, repair, roughness, surfaces, testing)
BASES = ("gonio.base.", "gonio.formula.")  # rooms where public classes have private bases, for shorter files
MEMBERS = (FunctionType, classmethod, staticmethod, property, derived)


def is_private(thing: Any) -> bool:
    return any(word[0] == "_" for word in (*thing.__module__.split("."), thing.__name__))


def names(module: ModuleType) -> list[str]:
    """Its `__all__`, or all that it and its files define."""
    homes = {n: str(getattr(x, "__module__", "")) for n, x in vars(module).items() if n[0] != "_"}
    defined = [n for n, home in homes.items() if f"{home}.".startswith(f"{module.__name__}.")]
    return list(getattr(module, "__all__", defined))


def public() -> Iterator[tuple[str, Any]]:
    """Name -> class or function of gonio."""
    for module in (gn, *BESIDE):
        for value in (getattr(module, name) for name in names(module)):
            known = isinstance(value, FunctionType) and vars(sys.modules[value.__module__])
            returned = known and known.get(value.__annotations__.get("return"))
            for each in (value, returned):
                if isinstance(each, (type, FunctionType)) and each.__module__.startswith("gonio"):
                    yield f"{each.__module__}.{each.__qualname__}", each


def members(kind: type) -> Iterator[tuple[str, Any]]:
    """Methods and properties with a docstring, which no subclass writes without one."""
    for name, value in vars(kind).items():
        inherited = any(value is vars(base).get(name) for base in kind.__mro__[1:])
        if name[0] == "_" or inherited or not isinstance(value, MEMBERS) or not text(value):
            continue
        below = (vars(each)[name] for each in subclasses(kind) if name in vars(each) and not is_private(each))
        if all(text(each) for each in below if isinstance(each, MEMBERS)):
            yield f"{kind.__module__}.{kind.__qualname__}.{name}", value


def subclasses(kind: type) -> Iterator[type]:
    for each in type.__subclasses__(kind):
        if each.__module__.startswith("gonio"):
            yield each
            yield from subclasses(each)


def text(thing: Any) -> str:
    """The docstring as it is written."""
    if isinstance(thing, (classmethod, staticmethod)):
        thing = thing.__func__
    if isinstance(thing, property):
        thing = thing.fget
    return inspect.cleandoc(thing.__doc__ or "") if isinstance(thing, derived) else discover.docstring(thing)


def example(thing: Any) -> str:
    return discover.labelled(text(thing), ["Example"]).get("Example", "")


def things() -> dict[str, Any]:
    every = dict(public())
    classes = [value for value in every.values() if isinstance(value, type)]
    for kind in dict.fromkeys(base for each in classes for base in each.__mro__):
        shown = kind.__module__.startswith(BASES) or not is_private(kind)
        if kind.__module__.startswith("gonio") and shown:
            every |= members(kind)
    return dict(sorted(every.items()))


def formats() -> dict[str, Any]:
    """What formats read and write with, where there is an example: some write nothing but what they have read."""
    pairs = ((m, verb) for m in gn.formats().values() for verb in ("read", "write") if hasattr(m, verb))
    return {f"{m.__name__}.{verb}": getattr(m, verb) for m, verb in pairs if example(getattr(m, verb))}


pytestmark = pytest.mark.texts
THINGS = things()


def test_every_public_thing_has_an_example():
    assert [name for name, thing in THINGS.items() if ">>> " not in example(thing)] == []


RUN = {name: thing for name, thing in THINGS.items() if example(thing)} | formats()


@pytest.mark.parametrize("name", RUN)
def test_example(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, uncompiled: None) -> None:
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTestParser().get_doctest(example(RUN[name]), {"gn": gn, "np": np}, name, None, 0)
    shown: list[str] = []
    doctest.DocTestRunner(verbose=False).run(test, out=shown.append)
    assert not shown, "".join(shown)
