"""What is public, by its place: `albedo`, `fitting.fit_map`, `figures.polar`."""

from __future__ import annotations

from collections.abc import Callable
from inspect import isfunction
from types import ModuleType
from typing import Any

import gonio as gn
from gonio.declared.namespace import namespaces


def public() -> dict[str, Any]:
    """Place -> what stands there: classes, functions, and folders, which list what they hold."""
    flat = {name: getattr(gn, name) for name in gn.__all__}
    inner = {f"{n}.{name}": getattr(module, name) for n, module in namespaces() for name in module.__all__}
    return {p: x for p, x in (flat | inner).items() if callable(x) or not isinstance(x, ModuleType)}


def functions() -> dict[str, Callable[..., Any]]:
    """Place -> public function."""
    return {place: value for place, value in public().items() if isfunction(value)}


def classes() -> dict[str, type[Any]]:
    """Place -> public class."""
    return {place: value for place, value in public().items() if isinstance(value, type)}
