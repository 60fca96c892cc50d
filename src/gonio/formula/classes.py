"""Classes with parameters, as they are defined: registered by name, with a signature and a docstring.

Texts and JSON name classes; bridges hear of each. Classes of scripts and notebooks (module `__main__`) are registered,
but not those that begin with an underscore, or whose module does. Signatures and docstrings are made of the declared
fields: `inspect.signature`, `help`, completion in notebooks and the stub `__init__.pyi` read them here.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from inspect import Parameter
from typing import Any, Protocol, TypeAlias

from ..declared.discover import docstring
from ..errors import ParameterError
from .fields import CLASSES, Channels, Field, Param, Table, Wavelengths
from .state import derived, known

ON_NEW: list[Callable[[type[Any]], object]] = []
"""Functions that are called with each new class."""


def register(cls: type[Any]) -> None:
    """Register a class. Raises ParameterError where another one has its name; the same one, run again, replaces it."""
    place, name = _place(cls), cls.__name__
    hidden = [n for n, f in vars(cls).items() if isinstance(f, Field) and _is_inherited(cls, n)]
    if hidden:
        advice = "give the parameter another name"
        raise ParameterError(f"class {place}: {hidden[0]} is an attribute that the class inherits; {advice}")
    if not any(map(_is_private, (name, *cls.__module__.split(".")))):
        if _place(CLASSES.get(name, cls)) != place:
            raise ParameterError(
                f"class {place}: the name {name} is taken by {_place(CLASSES[name])}, and texts and JSON tell classes "
                f"apart by their names; give this one another name, or one that begins with an underscore"
            )
        CLASSES[name] = cls
    for tell in ON_NEW:
        tell(cls)


def json_name(cls: type[Any]) -> dict[str, str]:
    """The name of a class in JSON, with its module if that is not gonio's."""
    is_gonio = cls.__module__.partition(".")[0] == __name__.partition(".")[0]
    return {"type": cls.__name__} | ({} if is_gonio else {"module": cls.__module__})


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")  # __main__ is nobody's secret


def _is_inherited(cls: type[Any], name: str) -> bool:
    """Whether a base has an attribute of this name that no field may stand for."""
    return any(
        not isinstance(vars(base)[name], (Field, derived, known)) for base in cls.__mro__[1:] if name in vars(base)
    )


def _place(cls: type[Any]) -> str:
    return f"{cls.__module__}.{cls.__qualname__}".replace("__mp_main__", "__main__")


class _HasArray(Protocol):
    """An array of NumPy, PyTorch, JAX, Dr.Jit ..."""

    def __array__(self) -> Any: ...


class _HasTexels(Protocol):
    """A texture."""

    @property
    def texels(self) -> Any: ...


_Listed: TypeAlias = Sequence[float] | Sequence[Sequence[float]] | Sequence[Sequence[Sequence[float]]]

Array: TypeAlias = _HasArray | _HasTexels | _Listed
"""Numbers, to a type checker: an array of any library, a texture, or lists. No text, which NumPy's ArrayLike takes."""


def signature(cls: Any) -> inspect.Signature:
    """The fields as parameters; tables and aliases, which set several parameters at once, by keyword only."""
    parameters, optional = [], False
    for name, field in cls.fields.items():
        by_keyword = isinstance(field, (Table, Channels, Wavelengths))
        optional = optional or field.default is not None
        default = field.default if optional or by_keyword else Parameter.empty
        place = Parameter.KEYWORD_ONLY if by_keyword else Parameter.POSITIONAL_OR_KEYWORD
        parameters.append(Parameter(name, place, default=default, annotation=field.accepts))
    for alias, names in aliases(cls).items():
        accepts = cls.fields[names[0]].accepts
        parameters.append(Parameter(alias, Parameter.KEYWORD_ONLY, default=..., annotation=accepts))
    for name, accepts in cls._declares.items():
        if name not in cls.fields:
            parameters.append(Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=accepts))
    return inspect.Signature(sorted(parameters, key=lambda p: p.kind))


def aliases(cls: Any) -> dict[str, list[str]]:
    """Keyword that sets several parameters -> their names."""
    fields = cls.fields.items()
    return {alias: [name, *(n for n, f in fields if f.default == name)] for alias, name in cls._aliases().items()}


def takes_fields(cls: type) -> bool:
    """Whether the constructor is the one that takes the declared fields, and none of the class's own."""
    return next("__signature__" in vars(k) for k in cls.__mro__ if "__init__" in vars(k))


class ConstructorSignature:
    """`__signature__` of the classes whose constructor takes the declared fields."""

    def __get__(self, instance: object, owner: type) -> inspect.Signature:
        if instance is not None or not takes_fields(owner):
            raise AttributeError(f"{owner.__name__} has a constructor of its own")
        return signature(owner)


class Docstring:
    """`__doc__` of a class with parameters: the text in the source, and a line for each parameter."""

    def __init__(self, written: str | None):
        self.written = written

    def __get__(self, instance: object, owner: Any) -> str | None:
        rows = parameter_lines(owner) if takes_fields(owner) else []
        parameters = "\n    ".join(["Parameters", *rows]) if rows else ""
        return "\n\n".join(filter(None, (docstring(owner), parameters))) or None


def parameter_lines(cls: Any) -> list[str]:
    """Every parameter with its default, meaning, bounds and unit, aligned."""
    rows = [(f"{name}{_with_default(field)}", field.meaning) for name, field in cls.fields.items()]
    rows += [(alias, f"sets {' and '.join(names)}") for alias, names in aliases(cls).items()]
    width = min(36, max((len(left) for left, _ in rows), default=0))
    return [f"{left:<{width}}   {right}" for left, right in rows]


def _with_default(field: Field) -> str:
    tied = isinstance(field, Param) and isinstance(field.default, str)
    return "" if field.default is None else f" = {field.default if tied else repr(field.default)}"


def to_write(cls: type, method: str) -> str:
    """What to write in a class: "write def formula(self, wi, wo) in it: f [1/sr] for directions above ..."."""
    function = getattr(cls, method, None)
    if not inspect.isfunction(function):
        return f"write {method} in the class"
    arguments, doc = ", ".join(inspect.signature(function).parameters), (function.__doc__ or "").partition("\n\n")[0]
    return f"write def {method}({arguments}) in the class: {' '.join(doc.split())}"
