"""Messages between page, server and worker: requests are checked, answers hold JSON and arrays of float32.

A request is JSON: {"id": 1, "call": "material", "text": "gold"}. An answer is one binary message: the length of its
header (uint32, little-endian), the header as JSON, padded with spaces to a multiple of 4, and float32 numbers; an array
stands in the header as {"offset": bytes, "length": numbers, "shape": [...]}.
"""

from __future__ import annotations

import json
import math
import struct
from base64 import b64encode
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..errors import ParameterError, shown, suggestion
from ..formula.bounds import CHANNELS, MAX_LENGTH

MOST_BYTES = 1 << 22
"""The longest message of a page."""

PAIRS = 1 << 14
"""The most pairs of directions of "f"."""

REPLACED = 1000
"""The most numbers that a message replaces."""

WORD = 200
"""Characters of a name or a path."""


class Call(NamedTuple):
    """What a page may ask for: the seconds after which the worker is ended, and its arguments with their checks."""

    seconds: float
    arguments: dict[str, Callable[[Any], Any]]


def _text(value: Any, most: int = MAX_LENGTH) -> str:
    if not isinstance(value, str) or not value.strip() or len(value) > most:
        raise ParameterError(f"got {shown(value)}, expected a text of 1 to {most} characters")
    return value


def _word(value: Any) -> str:
    return _text(value, WORD)


def _words(value: Any) -> str | list[str]:
    if isinstance(value, list) and 0 < len(value) <= 8:
        return [_word(x) for x in value]
    return _word(value)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ParameterError(f"got {shown(value)}, expected a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ParameterError(f"got {shown(value)}, expected a finite number")
    return number


def _numbers(value: Any, most: int) -> list[float]:
    if not isinstance(value, list) or not 0 < len(value) <= most:
        raise ParameterError(f"got {shown(value)}, expected a list of 1 to {most} numbers")
    return [_number(x) for x in value]


def _replaced(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict) or len(value) > REPLACED:
        raise ParameterError(f"got {shown(value)}, expected at most {REPLACED} numbers by the path of the parameter")
    return {_word(path): _replacement(x) for path, x in value.items()}


def _replacement(value: Any) -> float | list[float] | str:
    if isinstance(value, str):
        return _word(value)
    return _numbers(value, CHANNELS) if isinstance(value, list) else _number(value)


def _directions(value: Any) -> list[list[float]]:
    if not isinstance(value, list) or not 0 < len(value) <= PAIRS:
        raise ParameterError(f"got {shown(value)}, expected a list of 1 to {PAIRS} directions [x, y, z]")
    found = [_numbers(w, 3) for w in value]
    if any(len(w) != 3 for w in found):
        raise ParameterError("got a direction without three numbers, expected [x, y, z]")
    return found


_MATERIAL: dict[str, Callable[[Any], Any]] = {"text": _text, "replaced": _replaced}

CALLS = {
    "names": Call(60.0, {}),
    "material": Call(120.0, _MATERIAL),
    "check": Call(180.0, _MATERIAL),
    "fit": Call(600.0, {**_MATERIAL, "model": _text}),
    "albedo": Call(180.0, _MATERIAL),
    "source": Call(120.0, {**_MATERIAL, "language": _word, "function": _words, "parameters": _word}),
    "data": Call(120.0, {**_MATERIAL, "theta_i": _number, "phi_i": _number}),
    "f": Call(120.0, {**_MATERIAL, "wi": _directions, "wo": _directions}),
}
"""Name -> what a page may ask for."""

DEFAULTS: dict[str, Any] = {"replaced": {}, "function": "f", "parameters": "constants", "phi_i": 0.0}
"""Arguments that a request may leave out."""


def decoded(message: str) -> Any:
    """The JSON of a request. Raises ParameterError for text that is none."""
    try:
        return json.loads(message, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else error
        raise ParameterError(f"a message that is no JSON: {reason}; expected an object with id and call") from None


def _no_number(name: str) -> Any:
    raise ValueError(f"{name} is no number of JSON")


def number_of(data: Any) -> int | None:
    """The id of a request, None where it has no usable one."""
    number = data.get("id") if isinstance(data, dict) else None
    return number if isinstance(number, int) and not isinstance(number, bool) and abs(number) < 1 << 53 else None


def request(data: Any) -> tuple[str, bytes]:
    """The call of a request, and the request as the worker gets it. Raises ParameterError where it is none."""
    if not isinstance(data, dict):
        raise ParameterError(f"a message {shown(data)}: expected an object with id and call")
    name = data.get("call")
    if not isinstance(name, str) or name not in CALLS:
        close = suggestion(name[:WORD], CALLS) if isinstance(name, str) else ""
        raise ParameterError(f"call {shown(name)}: no such call{close}; expected one of {', '.join(CALLS)}")
    arguments = {}
    for argument, check in CALLS[name].arguments.items():
        value = data.get(argument, DEFAULTS.get(argument))
        try:
            arguments[argument] = check(value)
        except ParameterError as error:
            raise ParameterError(f"{name}: {argument}: {error}") from None
    whole = {"id": number_of(data), "call": name, "arguments": arguments}
    return name, json.dumps(whole, allow_nan=False).encode()


def plain(value: Any, put: Callable[[np.ndarray], Any]) -> Any:
    """A value as JSON data: `put` says what stands for an array, None stands for NaN and infinity."""
    if isinstance(value, np.ndarray):
        return put(value)
    if isinstance(value, dict):
        return {str(name): plain(x, put) for name, x in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(x, put) for x in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


def answer(header: dict[str, Any]) -> bytes:
    """An answer, with the arrays in its header as float32."""
    arrays: list[bytes] = []
    place = 0

    def put(array: np.ndarray) -> dict[str, Any]:
        nonlocal place
        entry = {"offset": place, "length": int(array.size), "shape": list(array.shape)}
        arrays.append(np.ascontiguousarray(array, "<f4").tobytes())
        place += 4 * array.size
        return entry

    text = json.dumps(plain(header, put), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *arrays])


def refusal(number: int | None, words: str) -> bytes:
    """The answer to a request that failed."""
    return answer({"id": number, "ok": False, "error": words})


def in_base64(value: Any) -> Any:
    """A value as JSON data for a page that stands alone: arrays as {"base64": float32, "shape": [...]}."""

    def put(array: np.ndarray) -> dict[str, Any]:
        packed = b64encode(np.ascontiguousarray(array, "<f4").tobytes()).decode()
        return {"base64": packed, "shape": list(array.shape)}

    return plain(value, put)
