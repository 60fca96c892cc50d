"""A file that holds what has been computed so far, for work that goes on where it was ended."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..errors import FormatError, ParameterError
from ..files import replacing, target

OFTEN = 0.05
"""Share of the time that is spent on writing."""

ADVICE = "delete it, or name another file"


class WorkFile:
    """Arrays in a .npz file, of one work: `identity` tells it from others, whose files are refused.

    `noun`: what the work is; `what`: what must be the same for it to go on.
    """

    def __init__(self, path: str | os.PathLike[str], identity: str, noun: str, what: str):
        self.path, self.identity, self.noun, self.what = path, identity, noun, what
        self._next = 0.0
        target(path)

    def arrays(self, names: Iterable[str]) -> dict[str, np.ndarray] | None:
        """The arrays in the file, or None where there is none."""
        if not os.path.exists(self.path):
            return None
        try:
            with open(self.path, "rb") as file, np.load(file, allow_pickle=False) as held:
                stored = {name: held[name] for name in names}
                identity = str(held["identity"])
        except Exception as error:  # damage makes NumPy raise nearly every type there is
            raise FormatError(f"{self.path}: not a checkpoint of {self.noun} ({error}); {ADVICE}") from None
        if identity != self.identity:
            other = self.noun.replace("a ", "another ", 1)
            raise ParameterError(f"{self.path}: a checkpoint of {other}; expected the same {self.what}; {ADVICE}")
        return stored

    def write(self, arrays: Mapping[str, Any], is_last: bool) -> None:
        """Write the arrays, unless the last time was just now."""
        start = time.monotonic()
        if start < self._next and not is_last:
            return
        with replacing(self.path) as temporary, open(temporary, "wb") as file:
            np.savez(file, identity=np.array(self.identity), **arrays)
        now = time.monotonic()
        self._next = now + (now - start) / OFTEN
