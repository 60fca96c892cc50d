"""The registry of classes with parameters: by name, for texts and JSON; bridges hear of each as it is defined.

Classes of scripts and notebooks (module `__main__`) are in it, but no text can name those that begin with an
underscore, or whose module does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import ParameterError
from .fields import CLASSES, Field
from .text import shown

ON_NEW: list[Callable[[type[Any]], object]] = []
"""Functions that are called with each new class."""


def register(kind: type[Any]) -> None:
    """Register a class. Raises ParameterError where another one has its name; the same one, run again, replaces it."""
    place, name = _place(kind), kind.__name__
    hidden = [n for n, f in vars(kind).items() if isinstance(f, Field) and _is_inherited(kind, n)]
    if hidden:
        advice = "give the parameter another name"
        raise ParameterError(f"class {place}: {hidden[0]} is an attribute that the class inherits; {advice}")
    if not any(map(_is_private, (name, *kind.__module__.split(".")))):
        if _place(CLASSES.get(name, kind)) != place:
            raise ParameterError(
                f"class {place}: the name {name} is taken by {_place(CLASSES[name])}, and texts and JSON tell classes "
                f"apart by their names; give this one another name, or one that begins with an underscore"
            )
        CLASSES[name] = kind
    for tell in ON_NEW:
        tell(kind)


def json_name(kind: type[Any]) -> dict[str, str]:
    """The name of a class in JSON, with its module if that is not gonio's."""
    is_gonio = kind.__module__.partition(".")[0] == __name__.partition(".")[0]
    return {"type": kind.__name__} | ({} if is_gonio else {"module": kind.__module__})


def missing(name: Any, module: Any) -> str:
    """The message about a class that JSON names with its module, and that is not defined here."""
    if module in ("__main__", "__mp_main__"):
        return f"the class {shown(name)} was defined in a script or notebook; define it here, and load again"
    return f"the class {shown(name)} is not gonio's but of the module {shown(module)}; import that, and load again"


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")  # __main__ is nobody's secret


def _is_inherited(kind: type[Any], name: str) -> bool:
    """Whether a base has an attribute of this name that is no field."""
    return any(not isinstance(vars(base)[name], Field) for base in kind.__mro__[1:] if name in vars(base))


def _place(kind: type[Any]) -> str:
    return f"{kind.__module__}.{kind.__qualname__}".replace("__mp_main__", "__main__")
