"""Values and names in messages and expressions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..errors import suggestion


def shown(value: Any) -> str:
    """The beginning of a value, in one line, for messages."""
    try:
        return f"{' '.join(repr(value[:60] if isinstance(value, (list, tuple)) else value).split()):.60}"
    except (ValueError, RecursionError):  # an integer of 5000 digits; a list in a list in a list ...
        return f"a {type(value).__name__}"


def literal(value: Any) -> str:
    """A value as it is written in a material expression."""
    if isinstance(value, np.ndarray):
        return repr(value.tolist()) if value.size <= 64 else f"array{value.shape}"
    return repr(value)


def unknown(owner: str, name: Any, known: list[str], what: str = "parameter") -> str:
    """The message that `owner` has nothing of this name."""
    hint = suggestion(name[:60] if isinstance(name, str) else "", known) or "."
    return f"{owner} has no {what} {shown(name)}{hint} Known: {listed(known)}"


def listed(known: Sequence[str]) -> str:
    """Names in a message, of very many the first."""
    return ", ".join(known) if len(known) <= 100 else f"{', '.join(known[:100])} ... ({len(known)} in all)"


def few(names: Iterable[str]) -> str:
    """Names in a message, of more than a dozen the first."""
    known = sorted(names)
    return ", ".join(known) if len(known) < 15 else f"{', '.join(known[:6])} ... ({len(known)} in all)"
