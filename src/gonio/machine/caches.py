"""What is made once and kept for later calls in this process: caches, which have one lid in bytes.

A cache notes what it is given, never what it is asked for: a call that finds its plan does nothing else. So time is
counted in generations, which end when a quarter of the lid has been made, or found again, since the last one did. What
was not asked for in two generations is dropped. So caches take half of the lid; memory for results, which is used again
(`machine/memory.py`), takes the other. A kernel that runs is held by its call, whatever is dropped meanwhile.

What belongs to a value goes with it, under no lid: its numbers in the dtype of a call, and what follows from them.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from functools import cache, partial, wraps
from threading import RLock
from typing import Any, TypeVar
from weakref import ref

import numpy as np

from ..errors import ParameterError

K = TypeVar("K")
V = TypeVar("V")

LID = 1024
"""MiB that all caches take at most, and an eighth of the machine's memory, unless GONIO_KEEP says otherwise."""

ENTRY = 500
"""Bytes of an entry of a cache beside its value: those of a key, about."""

_LOCK = RLock()
if hasattr(os, "register_at_fork"):  # in the child nobody would release another thread's lock
    os.register_at_fork(before=_LOCK.acquire, after_in_parent=_LOCK.release, after_in_child=_LOCK.release)
_CACHES: list[ref[Passing[Any, Any]]] = []
_MADE = [0]  # bytes in this generation


@cache
def lid() -> int:
    """Bytes that all caches take at most: GONIO_KEEP (in MiB, as first found), or what `LID` says."""
    text = os.environ.get("GONIO_KEEP", "")
    if text and (not text.isdecimal() or not 1 <= int(text) <= 1 << 20):
        raise ParameterError(f"GONIO_KEEP={text!r}: expected MiB of memory, a whole number from 1; or unset it")
    return int(text) << 20 if text else int(min(LID << 20, physical() / 8))


def physical() -> float:
    """Bytes of memory of this machine; infinity where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def made(size: int) -> None:
    """Note that so many bytes are kept, in a cache or with what is in one; a generation may end by them."""
    _MADE[0] += size
    if _MADE[0] > lid() // 4:
        _end()


def _end() -> None:
    with _LOCK:
        _MADE[0] = 0
        for known in [one for one in (weak() for weak in _CACHES) if one is not None]:
            known.age()
        _CACHES[:] = [weak for weak in _CACHES if weak() is not None]


class Passing(dict[K, V]):
    """A cache for one generation, of what takes little time to be made again."""

    __slots__ = ("__weakref__",)

    def __init__(self) -> None:
        with _LOCK:  # not while `_end` takes out those that are gone
            _CACHES.append(ref(self))

    def age(self) -> None:
        """Drop what no later generation is to find."""
        self.clear()


class Cache(Passing[K, V]):
    """A cache whose values are found as long as each generation asks for them; `size`: bytes of a value."""

    __slots__ = ("before", "size")

    def __init__(self, size: Callable[[V], int]):
        super().__init__()
        self.before: dict[K, V] = {}
        self.size = size

    def find(self, key: K) -> V | None:
        """The value of a key; None where it was dropped, or never made."""
        value = self.get(key)
        if value is None:
            value = self.before.get(key)
            if value is not None:
                self.keep(key, value)
        return value

    def keep(self, key: K, value: V) -> None:
        """Note a value."""
        self[key] = value
        made(ENTRY + self.size(value))

    def age(self) -> None:
        self.before = self.copy()
        super().clear()

    def clear(self) -> None:
        """Drop everything."""
        self.before = {}
        super().clear()


_ENDS: dict[int, list[ref[Any]]] = {}
"""By the numbers of objects, what calls when they go."""


def at_end(owner: Any, function: Callable[..., Any], *arguments: Any) -> None:
    """Call a function of C when an object goes, with these arguments and a weak reference behind them.

    An exception of a signal's handler that arrives in a finalizer is lost, and handlers run between the instructions of
    Python alone: finalizers and weak dictionaries of the standard library consist of these, and nothing here does.
    """
    ends = ref(owner, partial(function, *arguments)), ref(owner, partial(_ENDS.pop, id(owner)))
    _ENDS.setdefault(id(owner), []).extend(ends)


F = TypeVar("F", bound=Callable[..., Any])


def kept(function: F) -> F:
    """Decorates a function of hashable arguments that gives arrays: they are kept under the lid."""
    results: Cache[Any, Any] = Cache(_bytes)

    @wraps(function)
    def found(*args: Any, **named: Any) -> Any:
        key = (args, *named.items()) if named else args
        result = results.find(key)
        if result is None:
            result = function(*args, **named)
            results.keep(key, result)
        return result

    return found  # type: ignore[return-value]  # of the same signature


def _bytes(result: Any) -> int:
    """Bytes of an array, or of several."""
    if isinstance(result, np.ndarray):
        return result.nbytes
    return sum(map(_bytes, result)) if isinstance(result, (tuple, list)) else 0
