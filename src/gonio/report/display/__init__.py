"""What notebooks show: HTML and PNG of every object of gonio, small and quick, in light and dark, without links."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...formula.value import Value
from ._html import frame
from ._things import html_of, png_of

PICTURES = ("pictures", "scenes", "interreflection")
"""Rooms of the classes that `pictures` shows; `materials` shows values, `results` the rest."""


def html(thing: Any) -> str:
    """HTML of an object: well-formed, with its styles in it."""
    _prepare(thing)
    return frame(html_of(thing))


def png(thing: Any) -> bytes | None:
    """A PNG picture of an object, or None of one that has none."""
    _prepare(thing)
    found: bytes | None = png_of(thing)
    return found


def _prepare(thing: Any) -> None:
    """Import what shows things of this class, and no more: the first picture is to come at once."""
    homes = [kind.__module__.split(".") for kind in type(thing).__mro__]
    rooms = {home[1] for home in homes if home[0] == "gonio" and len(home) > 1}
    module = "materials" if isinstance(thing, Value) else "pictures" if rooms & {*PICTURES} else "results"
    import_module(f".{module}", __name__)
