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
from inspect import Parameter
from typing import Any

import numpy as np

from ..errors import ParameterError, shown, suggestion
from .calls import CALLS

MOST_BYTES = 1 << 22
"""The longest message of a page."""


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
        close = suggestion(name[:200], CALLS) if isinstance(name, str) else ""
        raise ParameterError(f"call {shown(name)}: no such call{close}; expected one of {', '.join(CALLS)}")
    values = {
        key: argument.checked(data.get(key), f"{name}({key}={shown(data.get(key))})")
        for key, argument in CALLS[name].arguments.items()
        if key in data or argument.default is Parameter.empty
    }
    whole = {"id": number_of(data), "call": name, "arguments": values}
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
