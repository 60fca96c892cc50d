"""Parts of a report that may have nothing to say: the reason takes their place, and warnings are kept."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...errors import Error, visible


@dataclass
class Guarded:
    """Parts by name, reasons for those that are missing, and what was warned of."""

    parts: dict[str, Any] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    notes: dict[str, list[str]] = field(default_factory=dict)

    def add(self, name: str, made: Callable[[], Any]) -> None:
        """Add a part, or the reason why there is none."""
        with warnings.catch_warnings(record=True) as said, np.errstate(all="ignore"):
            warnings.simplefilter("always")
            try:
                self.parts[name] = made()
            except Error as error:
                self.parts[name] = None
                self.left_out[name] = in_a_line(error)
        told = dict.fromkeys(in_a_line(w.message) for w in said if not _of_python(w))
        if told:
            self.notes[name] = list(told)


def in_a_line(message: Warning | Error | str) -> str:
    """What an error or a warning says."""
    return visible(" ".join(str(message).split()))


def _of_python(warning: Any) -> bool:
    return issubclass(warning.category, (DeprecationWarning, ResourceWarning, RuntimeWarning))
