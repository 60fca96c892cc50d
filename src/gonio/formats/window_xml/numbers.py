"""Numbers of WINDOW's XML and the braces of its trees, taken from text as it comes, so that no text is kept."""

from __future__ import annotations

import numpy as np

from ...errors import FormatError
from .._reading.plain_text import is_number

LONGEST = 1 << 16  # characters of a word that can still become a number

_BREAKS = " \t\r\n,{}"
_SEPARATOR = np.isin(np.arange(128), [ord(c) for c in _BREAKS])
_BLANK = str.maketrans(_BREAKS, " " * len(_BREAKS))


class NumberText:
    """Numbers separated by white space, commas and braces."""

    def __init__(self) -> None:
        self.count = 0
        self._rest = ""
        self._wrong = ""
        self._parts: list[np.ndarray] = []
        self._opens: list[np.ndarray] = []
        self._before: list[np.ndarray] = []

    def add(self, text: str) -> None:
        """Take in the next part of the text, which may end within a number."""
        if self._wrong:
            return
        text = self._rest + text
        end = max(map(text.rfind, _BREAKS)) + 1
        self._rest = text[end:]
        if len(self._rest) > LONGEST:
            self._wrong = self._rest
        self._take(text[:end])

    def _take(self, text: str) -> None:
        """Take in whole words."""
        words = text.translate(_BLANK).split()
        try:
            if "_" in text or not text.isascii():
                raise ValueError
            numbers = np.fromiter(map(float, words), float, len(words))
        except ValueError:
            self._wrong = next((w for w in words if not is_number(w)), "_")
            return
        if "{" in text or "}" in text:
            codes = np.frombuffer(text.encode("ascii"), np.uint8)
            inside = ~_SEPARATOR[codes]
            starts = np.flatnonzero(inside & ~np.concatenate([[False], inside[:-1]]))
            at = np.flatnonzero((codes == ord("{")) | (codes == ord("}")))
            self._opens.append(codes[at] == ord("{"))
            self._before.append(self.count + np.searchsorted(starts, at))
        self._parts.append(numbers)
        self.count += len(words)

    def __bool__(self) -> bool:
        return bool(self.count or self._opens or self._rest or self._wrong)

    def array(self, where: str) -> np.ndarray:
        """The numbers, in order. FormatError where there was anything else among them."""
        self._take(self._rest)
        self._rest = ""
        if self._wrong:
            raise FormatError(f"{where}: {self._wrong!r:.40} among the numbers; expected numbers only")
        self._parts = [np.concatenate(self._parts)]
        return self._parts[0]

    def braces(self) -> tuple[np.ndarray, np.ndarray]:
        """Of every brace whether it opens, and how many numbers come before it."""
        if not self._opens:
            return np.zeros(0, bool), np.zeros(0, int)
        return np.concatenate(self._opens), np.concatenate(self._before)
