"""Values and names in messages and expressions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..errors import shown as shown
from ..errors import suggestion


def literal(value: Any) -> str:
    """A value in the notation of material expressions."""
    if isinstance(value, np.ndarray):
        return repr(value.tolist()) if value.size <= 64 else f"array{value.shape}"
    return repr(value)


def unknown(owner: str, name: Any, names: list[str], what: str = "parameter", near: Sequence[str] = ()) -> str:
    """The message that `owner` has nothing of this name, with the names that it has; `near`: others to suggest."""
    hint = suggestion(name[:60] if isinstance(name, str) else "", [*names, *near]) or "."
    return f"{owner} has no {what} {shown(name)}{hint} Known: {listed(names)}"


def listed(names: Sequence[str], most: int = 100) -> str:
    """Names in a message: the first so many."""
    rest = f" ... ({len(names)} in all)" if len(names) > most else ""
    return ", ".join(names[:most]) + rest


def few(names: Iterable[str]) -> str:
    """Names in a message, sorted; of 15 or more the first six."""
    ordered = sorted(names)
    return listed(ordered, len(ordered) if len(ordered) < 15 else 6)


def percent(x: float) -> str:
    """A share in percent, with two digits."""
    return f"{100.0 * x:.2g} %"


def labelled(label: str, texts: dict[str, str]) -> list[tuple[str, str]]:
    """A row for each text, the first one with the label."""
    return [("" if k else label, f"{name}: {text}") for k, (name, text) in enumerate(texts.items())]
