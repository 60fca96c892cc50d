"""The options of readers and writers: the parameters of their `read` and `write` behind the first ones."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from types import ModuleType
from typing import Any

from ...errors import ParameterError
from . import plain_text


def options(function: Callable) -> dict[str, Any]:
    """Name -> default of the options that a module's `read(path)` or `write(m, path)` takes."""
    taken = list(inspect.signature(function).parameters.values())
    return {p.name: p.default for p in taken if p.name not in ("m", "path")}


def check(module: ModuleType, does: str, given: Mapping[str, Any]) -> None:
    """ParameterError where "read" or "write" of a format's module has no such option."""
    known = options(getattr(module, does))
    for name in given:
        if name not in known:
            listed = ", ".join(f"{n}={v!r}" for n, v in known.items())
            expected = f"expected some of {listed}" if known else "it has none"
            raise ParameterError(f"{name}={given[name]!r:.40}: no option to {does} {module.NAME} files; {expected}")


def parsed(module: ModuleType, does: str, texts: Iterable[str]) -> dict[str, Any]:
    """Options given as "name=value": numbers, lists of them (1,2,3), true, false, none, or words."""
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise ParameterError(f"--option {text!r:.60}: expected name=value, such as interpolation=linear")
        found[name.strip().replace("-", "_")] = _value(value.strip())
    check(module, does, found)
    return found


def _value(text: str) -> Any:
    words = {"true": True, "false": False, "none": None}
    if text.lower() in words:
        return words[text.lower()]
    if "," in text:
        return tuple(_value(part.strip()) for part in text.removesuffix(",").split(","))
    if not plain_text.is_number(text):
        return text
    try:
        return int(text)
    except ValueError:
        return float(text)
