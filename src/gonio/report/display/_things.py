"""What is shown by the class of an object; of a class that nobody says more of, its repr and its fields."""

from __future__ import annotations

import textwrap
from dataclasses import fields, is_dataclass
from functools import singledispatch
from typing import Any

import numpy as np

from ._html import Cut, block, code, table

SHORT = 100
"""Characters of a value in a table."""


@singledispatch
def html_of(thing: Any) -> Cut:
    """What is shown of an object."""
    names = list(getattr(thing, "_fields", ()))
    if is_dataclass(thing) and not isinstance(thing, type):
        names = [f.name for f in fields(thing) if f.repr]
    rows = [(name, short(getattr(thing, name))) for name in names if not name.startswith("_")]
    kind = type(thing).__name__
    shown = str(thing)
    if rows:
        has_words = type(thing).__str__ is not object.__str__ and shown != repr(thing)
        return Cut(kind, parts=(block(shown) if has_words else "", table(("", ""), rows)))
    return Cut(kind, parts=(block(shown) if "\n" in shown else code(shown),))


@singledispatch
def png_of(thing: Any) -> bytes | None:
    """A picture of an object; None where there is none."""
    return None


def short(value: Any) -> str:
    """A value in a few words."""
    if isinstance(value, np.ndarray) and value.size > 8:
        return f"array {' x '.join(map(str, value.shape))}{_span(value)}"
    if isinstance(value, float):
        return f"{value:.6g}"
    shown = np.array2string(value, precision=5, separator=", ") if isinstance(value, np.ndarray) else repr(value)
    shown = value if isinstance(value, str) else shown
    return textwrap.shorten(shown, SHORT, placeholder=" …")


def numbers(values: Any) -> str:
    """Numbers in a row."""
    return ", ".join(f"{x:.4g}" for x in np.atleast_1d(values))


def _span(value: np.ndarray) -> str:
    if value.dtype.kind not in "fiu" or not np.isfinite(value).any():
        return ""
    return f", {np.nanmin(value):.4g} to {np.nanmax(value):.4g}"
