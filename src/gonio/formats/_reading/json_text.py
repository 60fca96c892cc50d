"""JSON files of measurements: strictly read, their lists of numbers as arrays, written without loss."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError, ParameterError
from . import plain_text

LIMIT = 2**28
"""Longest file that is read, in bytes: numbers in lists take ten times their text."""

DEEPEST = 100
"""Deepest nesting of lists and objects: they must be copied and written again."""


def read(path: Path) -> dict[str, Any]:
    """The object in a file.

    Raises FormatError for a file that is too long, no JSON, no object, or names a member twice.
    """
    size = path.stat().st_size
    if size > LIMIT:
        raise FormatError(f"{path}: {size} bytes, expected JSON of at most {LIMIT}; keep so much in netCDF or Zarr")
    try:
        document = json.loads(plain_text.text(path, LIMIT), object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        raise FormatError(f"{path}, line {error.lineno}: not JSON, or cut short: {error.msg}") from None
    except RecursionError:
        raise FormatError(f"{path}: not JSON that can be read: nested more than {DEEPEST} deep") from None
    except ValueError as error:
        raise FormatError(f"{path}: not JSON that can be read: {error}") from None
    if not isinstance(document, dict):
        raise FormatError(f"{path}: holds a {type(document).__name__}, expected an object {{...}}")
    level: list[Any] = [document]
    for _ in range(DEEPEST):
        inside = (x for of in level for x in (of.values() if isinstance(of, dict) else of))
        level = [x for x in inside if isinstance(x, (dict, list))]
    if level:
        raise FormatError(f"{path}: lists and objects nested more than {DEEPEST} deep")
    return document


def _object(members: list[tuple[str, Any]]) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for name, value in members:
        if name in content:
            raise ValueError(f"{name!r:.60} is given twice in one object, expected once")
        content[name] = value
    return content


def member(of: dict[str, Any], name: str, kind: type, where: str) -> Any:
    """A member of an object. Raises FormatError if it is missing or of another kind."""
    value = of.get(name)
    if not isinstance(value, kind):
        got = "is missing" if name not in of else f"is {value!r:.40}"
        expected: dict[type, str] = {dict: "an object {...}", list: "a list [...]", str: "text"}
        raise FormatError(f"{where}: {name!r} {got}, expected {expected[kind]}")
    return value


def numbers(value: Any, where: str, hole: bool = False) -> np.ndarray:
    """A list of numbers (n,), or of lists of numbers (n, m); a number alone (1,). With `hole`, null is NaN.

    Raises FormatError for anything else.
    """
    rows = value if isinstance(value, list) else [value]
    flat = [x for row in rows for x in (row if isinstance(row, list) else [row])]
    if not {type(x) for x in flat} <= ({int, float, type(None)} if hole else {int, float}):
        odd = next(x for x in flat if type(x) not in (int, float))
        raise FormatError(f"{where}: got {odd!r:.40} among numbers, expected numbers only")
    try:
        return np.array(rows, np.float64)
    except (ValueError, OverflowError):
        raise FormatError(f"{where}: expected numbers within 1e308 in rows of one length") from None


def write(path: Path, data: dict[str, Any]) -> None:
    """Write an object. Raises ParameterError for values that JSON cannot hold."""
    try:
        text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{path}: what is known about the material cannot be written as JSON: {error}") from None
    plain_text.write(path, [text + "\n"])
