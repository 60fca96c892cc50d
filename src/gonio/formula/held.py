"""Containers that a value holds: dictionaries, lists and arrays that nobody changes any more."""

from __future__ import annotations

from dataclasses import is_dataclass
from typing import Any

from ..arrays import frozen


class Held(dict[Any, Any]):
    """What a value holds by name; it cannot be changed."""

    def _refuse(self, *args: Any, **kwargs: Any) -> Any:
        raise AttributeError("what a value holds cannot be changed; make a new one: m.with_table(m.stored, axes=...)")

    __setitem__ = __delitem__ = __ior__ = update = pop = popitem = clear = setdefault = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)


class HeldList(list[Any]):
    """What a value holds in order; it cannot be changed."""

    __setitem__ = __delitem__ = __iadd__ = __imul__ = append = clear = extend = insert = pop = remove = Held._refuse
    reverse = sort = Held._refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (list(self),)


def held(data: Any) -> Any:
    """The same data, unchangeable all through: dictionaries and lists as `Held` and `HeldList`, arrays read-only."""
    if isinstance(data, dict):
        return Held({name: held(x) for name, x in data.items()})
    if isinstance(data, list):
        return HeldList(map(held, data))
    return freeze(data)


def freeze(data: Any) -> Any:
    """The same, with all arrays in it read-only: in dictionaries, lists, tuples and records."""
    if isinstance(data, dict) or is_dataclass(data):
        for x in (data if isinstance(data, dict) else vars(data)).values():
            freeze(x)
    elif isinstance(data, (list, tuple)):
        for x in data:
            freeze(x)
    return frozen(data)
