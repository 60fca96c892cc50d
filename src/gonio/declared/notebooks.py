"""What notebooks show of objects: methods that classes take. `report/display` makes what they show."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

_MAKERS: list[Callable[[], Any]] = []


def shown_by(find: Callable[[], Any]) -> None:
    """Say where HTML and pictures are made: `find` imports the module, when something is first shown."""
    _MAKERS[:] = [find]


def repr_html(thing: Any) -> str | None:
    """HTML of an object; None, for which notebooks print the object, where there is none or it fails."""
    found: str | None = _made("html", thing)
    return found


def repr_png(thing: Any) -> bytes | None:
    """The bytes of a PNG picture of an object, or None."""
    found: bytes | None = _made("png", thing)
    return found


def _made(kind: str, thing: Any) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # nobody asked for what is shown
            return next((getattr(find(), kind)(thing) for find in _MAKERS), None)
    except Exception:  # whatever fails here, the object itself is to be seen
        return None
