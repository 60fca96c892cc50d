"""What to write in the place of something that is no reflectance: where one is expected, messages end with it."""

from __future__ import annotations

import os
from typing import Any

from ..errors import shown
from ..formula.parametrised import Parametrised


def instead(value: Any) -> str:
    """What to write where a reflectance is expected and this value was given."""
    name = type(value).__name__
    if isinstance(value, type):
        return _of_class(value)
    if isinstance(value, Parametrised):
        return f"this is {value._noun}; write {value._reflects.format(f'gn.{shown(value)}')}"
    if isinstance(value, str):
        return _of_text(value)
    if isinstance(value, os.PathLike):
        return f"write gn.load({shown(os.fspath(value))})"
    if name in ("Dataset", "DataArray"):
        return "write gn.tables.from_dataset(ds)"
    if isinstance(value, (list, tuple)) and any(isinstance(x, Parametrised) for x in value):
        return "one at a time, or their sum: write m1 + m2"
    if callable(value):
        return "a function becomes one as `formula` of a subclass of gn.Reflectance"
    if value is None:
        return "write one, such as gn.Lambertian(0.5)"
    return "a number or an array of albedos: write gn.Lambertian(rho); measured values: gn.Gridded or gn.Scattered"


def _of_class(kind: type) -> str:
    if issubclass(kind, Parametrised):
        written = kind._reflects.format(f"gn.{kind.__name__}()")
        return f"this is a class, of which an instance is needed; write {written}"
    return f"this is the class {kind.__name__}; write an instance of a model, such as gn.Lambertian(0.5)"


def _of_text(text: str) -> str:
    if "(" in text:
        return f"write gn.expression({shown(text)})"
    if os.sep in text or "." in text:
        return f"write gn.load({shown(text)})"
    return f"write gn.material({shown(text)}) for a built-in material, or gn.load(path) for a file"
