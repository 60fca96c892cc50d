"""The materials that a page may name: those of the command line, dropped files, built-in ones, and expressions.

No text of a page opens another file: expressions are read without files, and a path is none of these.
"""

from __future__ import annotations

import contextlib
import re
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..base.reflectance import Reflectance
from ..catalogue import builtin
from ..catalogue.expressions import expression
from ..errors import NotFoundError, ParameterError
from ..facts.models import SHOWN
from ..facts.public import public
from ..formula import tree
from ..formula.fields import Option, Param
from ..formula.json_form import names
from ..formula.spectrum import Spectrum
from .given import Given

UPLOAD = re.compile(r"upload:([1-9][0-9]{0,8})/([A-Za-z0-9_-][A-Za-z0-9._-]{0,127})")
"""The text of a dropped file: its number and its name."""

KEPT = 8
"""Materials that are kept in memory."""


class Shelf:
    """Materials by text, the last few of them kept."""

    def __init__(self, given: Sequence[Given] = (), uploads: Path | None = None):
        self.given = {item.name: item for item in given}
        self.uploads = uploads
        self._kept: OrderedDict[str, Reflectance] = OrderedDict()
        self._lock = threading.Lock()
        self._turns: dict[str, threading.Lock] = {}
        self.told: dict[str, dict[str, Any]] = {}
        """Descriptions of materials of the command line, which are made before the page asks for them."""

    @contextlib.contextmanager
    def alone(self, what: str) -> Iterator[None]:
        """One thread at a time for each word."""
        with self._lock:
            turn = self._turns.setdefault(what, threading.Lock())
        try:
            with turn:
                yield
        finally:
            with self._lock:
                if not turn.locked():
                    self._turns.pop(what, None)

    def upload(self, text: str) -> Path | None:
        """The file of a text such as "upload:3/gold.binary"; None for other texts. NotFoundError where it is none."""
        if not text.startswith("upload:"):
            return None
        found = UPLOAD.fullmatch(text)
        path = self.uploads / found[1] / found[2] if found and self.uploads else None
        if path is None or not path.is_file():
            raise NotFoundError(f"{text!r:.90}: no dropped file of this session; drop it once more")
        return path

    def material(self, text: str, replaced: Mapping[str, Any]) -> Reflectance:
        """The material of a text, with numbers and words replaced by path."""
        with self.alone(f"read {text}"):
            with self._lock:
                m = self._kept.pop(text, None)
            if m is None:
                m = _at_wavelengths(self._read(text))
            with self._lock:
                self._kept[text] = m
                while len(self._kept) > KEPT:
                    self._kept.popitem(last=False)
        return _changed(m, replaced) if replaced else m

    def _read(self, text: str) -> Reflectance:
        if text in self.given:
            return self.given[text].material()
        if (path := self.upload(text)) is not None:
            return public("load")(path)
        if builtin.find(text) is not None:
            return builtin.material(text)
        if "(" in text or text in names():
            return expression(text)
        raise NotFoundError(
            f'{text!r:.90}: no built-in material and no expression such as "Lambertian(0.5)"{builtin.hint(text[:90])}; '
            f"drop a file onto the page, or name it on the command line: gonio view FILE"
        )


def _at_wavelengths(m: Reflectance) -> Reflectance:
    """A material with spectra for numbers at wavelengths, of which each is a channel."""
    return m.at(SHOWN) if any(isinstance(x, Spectrum) for x in tree.leaves(m)) else m


def _changed(m: Reflectance, replaced: Mapping[str, Any]) -> Reflectance:
    """A material with other numbers, and with other words where it has a choice of words; a page opens no files."""
    fields = {path: field for path, field, _ in tree.settable(m)}
    aliases = {
        path.removesuffix(field.name) + field.alias: field
        for path, field in fields.items()
        if isinstance(field, Param) and field.alias
    }
    changes = {}
    for name, value in replaced.items():
        path = tree.located(m, name)
        field = fields.get(path, aliases.get(path))
        if not isinstance(field, Option if isinstance(value, str) else Param):
            rule = "expected a number of a parameter, a list of one for each channel, or a word of an option"
            raise ParameterError(f"{name} = {value!r:.60}: {rule}")
        changes[path] = value
    return m.replace(changes)
