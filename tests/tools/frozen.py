"""Which arrays a value holds, and that nobody can write to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import gonio as gn
from gonio.arrays import Fixed
from gonio.evaluate import planning

WI, WO = gn.direction([0.2, 0.7, 1.2], [0.0, 1.0, 3.0]), gn.direction([0.9, 0.3, 0.6], [3.0, 4.0, 0.1])
U = np.array([[0.1, 0.3], [0.5, 0.6], [0.9, 0.2]])
PRIVATE = (planning.known,)
"""Compiled formulas, which hold addresses."""


def arrays(value: Any, path: str = "m", seen: set[int] | None = None) -> Iterator[tuple[str, np.ndarray]]:
    """Every array that can be reached from a value, with those that it is a view of, and the way to it."""
    seen = set() if seen is None else seen
    if id(value) in seen or isinstance(value, (type, str, bytes, int, float, Callable)):
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        yield path, value
        yield from arrays(value.base, f"{path}.base", seen)
    elif isinstance(value, dict):
        for name, x in value.items():
            if name not in PRIVATE:
                yield from arrays(x, f"{path}[{name!r}]", seen)
    elif isinstance(value, (list, tuple)):
        for k, x in enumerate(value):
            yield from arrays(x, f"{path}[{k}]", seen)
    elif isinstance(value, Fixed) or type(value).__module__.startswith("gonio"):
        yield from arrays(getattr(value, "__dict__", {}), f"{path}.__dict__", seen)


def assert_frozen(m: Any) -> None:
    found = dict(arrays(m))
    assert not [path for path, array in found.items() if array.flags.writeable]


def used(m: gn.Reflectance) -> gn.Reflectance:
    """The material, after all that makes tables."""
    m.f(WI, WO), m.sample(WO, U), m.pdf(WI, WO), m.f(WI.astype("f4"), WO.astype("f4"))
    return m
