"""Attributes beside fields: state that formulas decide by, notes that they do not see, derived values.

A declaration is one line of a class: `layout: tuple[Axis, ...] = state()`, `path: str = note("")`, `@derived`.
Dictionaries, lists and arrays in a value cannot be changed: `immutable` makes them so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import is_dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ..arrays import frozen

T = TypeVar("T")


class Beside:
    """A declared attribute that is no field: no argument of the constructor by itself, and not compared."""

    name = ""

    def __init__(self, default: Any):
        self.default = default

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, owner: Any, kind: type) -> Any:  # of values that hold none of their own
        return self.default


class State(Beside):
    """Formulas decide by it beside their fields: it is hashable, for materials of equal state share a trace."""


class Note(Beside):
    """A fact about a value. Formulas do not see it, so no trace depends on it."""

    def __get__(self, owner: Any, kind: type) -> Any:
        if owner is not None and owner._is_bound:
            raise AttributeError(
                f"{kind.__name__}.{self.name} is a note, which formulas do not see; declare a state(...)"
            )
        return self.default


class inferred(Note, Generic[T]):
    """Decorates a method: a note that follows from the value, until it is given."""

    def __init__(self, function: Callable[[Any], T]):
        super().__init__(None)
        self.function, self.__doc__ = function, function.__doc__

    def __get__(self, owner: Any, kind: type) -> T:
        super().__get__(owner, kind)
        if owner is None:
            return self  # type: ignore[return-value]  # asked of the class
        return self.function(owner)


class known(Beside):
    """Decorates a method: an attribute that follows from the fields and the notes. Formulas do not see it, and a class
    may have a field of its name."""

    def __init__(self, function: Callable[[Any], Any]):
        super().__init__(None)
        self.function, self.__doc__ = function, function.__doc__

    def __get__(self, owner: Any, kind: type) -> Any:
        if owner is not None and owner._is_bound:
            raise AttributeError(f"{kind.__name__}.{self.name} is nothing that formulas see; declare a field")
        return self if owner is None else self.function(owner)


class derived(Generic[T]):
    """Decorates a method: an attribute that is computed from the fields when it is first asked for.

    Copies with other fields, and pickles, compute it again.
    """

    def __init__(self, function: Callable[[Any], T]):
        self.function, self.__doc__ = function, function.__doc__

    def __get__(self, owner: Any, kind: type) -> T:
        if owner is None:
            return self  # type: ignore[return-value]  # asked of the class
        results: dict[Any, T] = owner._derived
        if self.function not in results:
            results[self.function] = self.function(owner)
        return results[self.function]


if TYPE_CHECKING:

    class attribute(Generic[T]):
        """`property` of a function that is defined elsewhere: of that one type checkers would not know the type."""

        def __init__(self, function: Callable[[Any], T]) -> None: ...

        def __get__(self, owner: Any, kind: type) -> T: ...

else:
    attribute = property


def state(default: Any = None) -> Any:
    """State by which formulas decide, such as the spacing of a grid. Constructors set it: `self._hold`."""
    return State(default)


def note(default: Any = None) -> Any:
    """A fact about a value, such as the file it is from; `tree.with_notes(m, ...)` is a copy with other facts."""
    return Note(default)


class Held(dict[Any, Any]):
    """A dictionary that cannot be changed."""

    def _refuse(self, *args: Any, **kwargs: Any) -> Any:
        raise AttributeError("what a value holds cannot be changed; make a new one: m.with_table(m.stored, axes=...)")

    __setitem__ = __delitem__ = __ior__ = update = pop = popitem = clear = setdefault = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)


class HeldList(list[Any]):
    """A list that cannot be changed."""

    __setitem__ = __delitem__ = __iadd__ = __imul__ = append = clear = extend = insert = pop = remove = Held._refuse
    reverse = sort = Held._refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (list(self),)


def immutable(data: Any) -> Any:
    """The same data, immutable all through: dictionaries and lists as `Held` and `HeldList`, arrays read-only."""
    if isinstance(data, dict):
        return Held({name: immutable(x) for name, x in data.items()})
    if isinstance(data, list):
        return HeldList(map(immutable, data))
    return freeze(data)


def freeze(data: Any) -> Any:
    """The same data, with all arrays in it read-only: in dictionaries, lists, tuples and records."""
    if isinstance(data, dict):
        inner: Iterable[Any] = data.values()
    elif is_dataclass(data):
        inner = vars(data).values()
    elif isinstance(data, (list, tuple)):
        inner = data
    else:
        return frozen(data)
    for x in inner:
        freeze(x)
    return data
