"""Sweeps: one case tries many values, such as all draws of a model, and a failure says with which it was.

A case costs more than what most values take; and a process that has a model's kernels tries all of its draws.
"""

from __future__ import annotations

import functools
import inspect
import itertools
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from materials import OBEDIENT, Draw


def grouped(cells: Iterable[tuple[Any, ...]], default: Callable[..., bool]) -> list[Any]:
    """Parameters, a case for what cells begin with: those of them that are tried by default, or with `full` the others.

    A case costs more than most cells do.
    """
    groups: dict[str, list[tuple[Any, ...]]] = {}
    for cell in cells:
        full = "" if default(*cell) else "-full"
        groups.setdefault(f"{cell[0]}{full}", []).append(cell)
    return [
        pytest.param(own, id=f"{name}-{len(own)}-cells", marks=pytest.mark.full if name.endswith("-full") else ())
        for name, own in groups.items()
    ]


def one_in(count: int, *names: str) -> bool:
    """Whether a case of these names is among one in so many."""
    return not zlib.crc32(" ".join(names).encode()) % count


def one_of(several: Iterable[str], *names: str) -> str:
    """One of several words, for a case of these names."""
    words = sorted(several)
    return words[zlib.crc32(" ".join(names).encode()) % len(words)]


@contextmanager
def trying(**what: Any) -> Iterator[None]:
    """What fails inside says with what it was tried."""
    try:
        yield
    except Exception as error:
        error.add_note("with " + ", ".join(f"{name} = {value!r}" for name, value in what.items()))
        raise


def every(**values: Iterable[Any]) -> Callable[[Any], Any]:
    """The test runs with each of the values, and of several names with each combination, in one case."""
    tried = {name: list(some) for name, some in values.items()}
    return lambda test: _looped(test, [*tried], [], lambda: itertools.product(*tried.values()))


def each_draw(drawn: Iterable[Draw]) -> Callable[[Any], Any]:
    """A case a model: the test runs with each `draw` of it."""
    models = by_model(drawn)
    marked = pytest.mark.parametrize("drawn", models.values(), ids=models)
    return lambda test: marked(_looped(test, ["draw"], ["drawn"], lambda drawn: ((draw,) for draw in drawn)))


def each_draw_both_ways(drawn: Iterable[Draw]) -> Callable[[Any], Any]:
    """The same for each `evaluation`."""
    marked = pytest.mark.parametrize(("drawn", "evaluation"), both_ways(drawn), indirect=["evaluation"])
    return lambda test: marked(_looped(test, ["draw"], ["drawn"], lambda drawn: ((draw,) for draw in drawn)))


def _looped(test: Any, names: list[str], asks: list[str], values: Callable[..., Iterable[tuple]]) -> Any:
    """The test with these names tried here, from what pytest gives for the names that it asks for instead."""

    @functools.wraps(test)
    def run(**fixtures: Any) -> None:
        given = [fixtures.pop(name) for name in asks]
        for chosen in values(*given):
            with trying(**dict(zip(names, chosen, strict=True))):
                test(**fixtures, **dict(zip(names, chosen, strict=True)))

    signature = inspect.signature(test)
    left = [p for name, p in signature.parameters.items() if name not in names]
    more = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in asks]
    run.__signature__ = signature.replace(parameters=[*left, *more])  # type: ignore[attr-defined]  # pytest reads it
    return run


def by_model(drawn: Iterable[Draw]) -> dict[str, list[Draw]]:
    """The draws of each model, by its name."""
    return {name: list(own) for name, own in itertools.groupby(drawn, lambda draw: draw.model.__name__)}


def each_model(drawn: Iterable[Draw], evaluation: str, full: bool = False) -> list[Any]:
    """Parameters, a case a model: its draws, and how they are evaluated."""
    end, marks = ("-full", pytest.mark.full) if full else ("", ())
    return [
        pytest.param(own, evaluation, id=f"{name}-{evaluation}{end}", marks=marks)
        for name, own in by_model(drawn).items()
    ]


def both_ways(drawn: Iterable[Draw]) -> list[Any]:
    """A case a model on arrays, and one compiled: of few draws; of all others with `full`."""
    some = list(drawn)
    return [
        *each_model(some, "uncompiled"),
        *each_model([draw for draw in some if draw in OBEDIENT], "compiled"),
        *each_model([draw for draw in some if draw not in OBEDIENT], "compiled", full=True),
    ]
