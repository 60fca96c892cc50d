"""Find what a folder of the package holds: a new file there is known without being listed anywhere."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from types import ModuleType


def modules(package: str) -> list[ModuleType]:
    """The modules of a subpackage, by name; files that start with an underscore are left out."""
    path = import_module(package).__path__
    names = sorted(m.name for m in pkgutil.iter_modules(path) if not m.name.startswith("_"))
    return [import_module(f"{package}.{name}") for name in names]
