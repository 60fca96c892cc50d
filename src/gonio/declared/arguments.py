"""Arguments of public functions, readers and writers: declared in the signature, checked before the function runs.

    @checked
    def plan(m: Reflectance, n: Annotated[int, Declared("how many pairs of directions", 1, 200)]) -> Plan: ...

The annotation is a type (bool, int, float, str, a path, a class), a sequence, a mapping or a tuple of such, or several
with `|`; `Numbers` is a number, an array or a list; `Any` is left to the function. `Declared` holds what an argument
means, its bounds and its unit. The errors of the function, its help, its option on the command line and its field in
the explorer are made from it.
"""

from __future__ import annotations

import functools
import inspect
import typing
from collections.abc import Callable
from contextlib import suppress
from operator import attrgetter
from types import NoneType
from typing import Any, NamedTuple, TypeVar, cast

from ..errors import ParameterError, TooLargeError, shown
from .declaration import ABOVE_ZERO as ABOVE_ZERO
from .declaration import BELOW as BELOW
from .declaration import BELOW_HORIZON as BELOW_HORIZON
from .declaration import BELOW_ONE as BELOW_ONE
from .declaration import LARGEST as LARGEST
from .declaration import UNFIT, Real, alternatives, declared_in
from .declaration import Declared as Declared
from .declaration import Numbers as Numbers
from .declaration import Seed as Seed
from .values import fit, of_text, scalar_of
from .wording import advised, as_typed, in_words, suspected, suspected_text, swapped, taken

F = TypeVar("F", bound=Callable[..., Any])


class FunctionArgument(NamedTuple):
    """An argument of a function; `kinds`: the types of its value, None aside."""

    name: str
    kinds: tuple[Any, ...]
    default: Any
    declared: Declared

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return ", or ".join(in_words(hint, self.declared) for hint in self.kinds)

    @property
    def expected_typed(self) -> str:
        """The allowed values in words, in the units of the command line."""
        return ", or ".join(in_words(hint, self.declared.typed, typed=True) for hint in self.kinds)

    @property
    def usual(self) -> str:
        """The default value, as typed on the command line; "" for none."""
        value = self.declared.usual if self.default is None else self.default
        return "" if value is inspect.Parameter.empty else as_typed(value, self.declared.unit)

    @property
    def words(self) -> list[str]:
        """The only values, where there are a few."""
        return [str(word).lower() for word in self.declared.words or ((True, False) if self.kinds == (bool,) else ())]

    @property
    def is_typed(self) -> bool:
        """Whether people can type its values, and none of them names a file."""
        typeable = (int, float, *((Any,) if self.declared.unit else ()))
        return bool(self.words) or all(scalar_of(hint) in typeable for hint in self.kinds)

    def checked(self, value: Any, given: str = "", advice: str = "") -> Any:
        """The value, converted. Raises ParameterError, which begins with what was `given`: "plan(n=0)"."""
        if value is None and self.default is None:
            return None
        for hint in self.kinds:
            with suppress(*UNFIT):
                return fit(hint, value, self.declared)
        given = given or f"{self.name}={shown(value)}"
        advice = suspected(value, self.declared) + advice
        raise ParameterError(f"{given}: expected {self.expected}: {self.declared.doc}{advice}")

    def checked_text(self, text: str, given: str, advice: str = "") -> Any:
        """The value of a text; the error begins with what was `given`, "--theta-i '95'", and is in units of people."""
        if text.lower() == "none" and self.default is None:
            return None
        for hint in self.kinds:
            with suppress(*UNFIT):
                return fit(hint, of_text(hint, text, self.declared), self.declared)
        advice = suspected_text(text, self.declared) + advice
        given += taken(text, self.declared)
        raise ParameterError(f"{given}: expected {self.expected_typed}: {self.declared.doc}{advice}")

    def to_json(self) -> dict[str, str]:
        return {"expected": self.expected, "default": self.usual, "doc": self.declared.doc}


@functools.cache
def arguments(function: Callable) -> dict[str, FunctionArgument]:
    """The declared arguments of a function, or of the constructor of a class, by name."""
    hinted = hints(function)
    by_name = {p.name: _argument(p, hinted[p.name]) for p in inspect.signature(function).parameters.values()}
    return {name: argument for name, argument in by_name.items() if argument is not None}


def hints(function: Callable) -> dict[str, Any]:
    """The types of the parameters of a function, or of the constructor of a class, with what they declare, by name;
    `Any` where only a type checker sees them."""
    signed = inspect.unwrap(attrgetter("__init__")(function) if isinstance(function, type) else function)
    return {p.name: _kind(p.annotation, signed.__globals__) for p in inspect.signature(function).parameters.values()}


def check_fields(value: Any) -> None:
    """Check the declared fields of a frozen dataclass, for its `__post_init__`. Raises ParameterError."""
    cls: Callable = type(value)
    for name, argument in arguments(cls).items():
        one = getattr(value, name)
        object.__setattr__(value, name, argument.checked(one, f"{cls.__name__}({name}={shown(one)})"))


def _argument(parameter: inspect.Parameter, hint: Any) -> FunctionArgument | None:
    """A parameter, where it is declared; None in its type stands for its absence."""
    declared = declared_in(hint)
    if declared is None:
        return None
    kinds = tuple(one for of in alternatives(hint) for one in alternatives(of) if one is not NoneType)
    return FunctionArgument(parameter.name, kinds, parameter.default, declared)


def checked(function: F) -> F:
    """The function, with arguments checked by its annotations: a ParameterError names the one that does not fit."""
    parameters = inspect.signature(function).parameters
    names = [name for name, p in parameters.items() if p.kind is p.POSITIONAL_OR_KEYWORD]
    scope = getattr(function, "__globals__", {})
    kinds = {name: _kind(p.annotation, scope) for name, p in parameters.items() if p.kind is not p.VAR_KEYWORD}
    held = {name: _taken_apart(hint) for name, hint in kinds.items()}
    defaults = {name: p.default for name, p in parameters.items()}
    title = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    def fitting(name: str, value: Any, args: tuple[Any, ...], named: dict[str, Any]) -> Any:
        inner, declared = held.get(name, (Any, None))
        if inner is Any or value is defaults.get(name):
            return value
        with suppress(*UNFIT):
            return fit(inner, value, declared)
        hint = kinds[name]
        advice = swapped(name, hint, dict(zip(names, args, strict=False)) | named) or advised(hint, value)
        raise ParameterError(f"{title}({name}={shown(value)}): expected {in_words(hint)}{advice}")

    @functools.wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        rest = args[len(names) :]
        fitted = tuple([fitting(name, value, args, named) for name, value in zip(names, args, strict=False)])
        named = {name: fitting(name, value, args, named) for name, value in named.items()}
        try:
            return function(*fitted, *rest, **named)
        except TooLargeError:
            raise
        except MemoryError as error:
            raise TooLargeError(f"{title}: {str(error) or 'not enough memory'}; ask for less at a time") from None
        except RuntimeError as error:
            if "allocate memory" not in str(error):  # PyTorch's words
                raise
            raise TooLargeError(f"{title}: not enough memory; ask for less at a time") from None

    return cast(F, call)


def _taken_apart(hint: Any) -> tuple[Any, Declared | None]:
    """The type of `Annotated[type, Declared(...)]`, and the declaration; of another kind itself."""
    if hasattr(hint, "__metadata__") and Real not in hint.__metadata__:
        return typing.get_args(hint)[0], next((x for x in hint.__metadata__ if isinstance(x, Declared)), None)
    return hint, None


def _kind(annotation: Any, scope: dict[str, Any]) -> Any:
    """The type that an annotation means; `Any` where only a type checker sees it."""
    if not isinstance(annotation, str):
        return Any if annotation is inspect.Parameter.empty else annotation
    try:
        return eval(annotation, scope)
    except NameError:
        return Any
