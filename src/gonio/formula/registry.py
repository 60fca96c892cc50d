"""Every class with parameters, as it is defined: by its name, for texts and JSON, and told to bridges that must know.

Classes of scripts and notebooks count (their module is `__main__`); those that begin with an underscore, or whose
module does, stay out of texts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..errors import ParameterError
from .fields import CLASSES, Field
from .text import shown

ON_NEW: list[Callable[[type[Any]], object]] = []
"""What is called with each class that is defined from now on."""


def register(kind: type[Any]) -> None:
    """Register a class. Raises ParameterError where another one has its name; the same one, run again, replaces it."""
    hidden = [n for n, f in vars(kind).items() if isinstance(f, Field) and _is_method(kind, n)]
    if hidden:
        raise ParameterError(
            f"class {_place(kind)}: {hidden[0]} is an attribute that the class inherits; give the parameter another "
            f"name"
        )
    if not any(_is_private(name) for name in (kind.__name__, *kind.__module__.split("."))):
        named = CLASSES.get(kind.__name__)
        if named is not None and _place(named) != _place(kind):
            raise ParameterError(
                f"class {_place(kind)}: the name {kind.__name__} is taken by {_place(named)}, and texts and JSON tell "
                f"classes apart by their names; give this one another name, or one that begins with an underscore"
            )
        CLASSES[kind.__name__] = kind
    for tell in ON_NEW:
        tell(kind)


def json_name(kind: type[Any]) -> dict[str, str]:
    """How JSON names a class: by its name, with the module if that is not gonio's."""
    own = kind.__module__.partition(".")[0] == __name__.partition(".")[0]
    return {"type": kind.__name__} if own else {"type": kind.__name__, "module": kind.__module__}


def missing(name: Any, module: Any) -> str:
    """What to say of a class that JSON names with the module it was in, and that nobody has defined here."""
    if module in ("__main__", "__mp_main__"):
        return f"the class {shown(name)} was defined in a script or notebook; define it here, and load again"
    return f"the class {shown(name)} is not gonio's but of the module {shown(module)}; import that, and load again"


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")  # __main__ is nobody's secret


def _is_method(kind: type[Any], name: str) -> bool:
    return any(not isinstance(vars(base)[name], Field) for base in kind.__mro__[1:] if name in vars(base))


def _place(kind: type[Any]) -> str:
    return f"{kind.__module__}.{kind.__qualname__}".replace("__mp_main__", "__main__")
