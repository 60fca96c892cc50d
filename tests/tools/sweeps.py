"""Sweeps: a case tries all draws of a model, and a failure says with which, so that it can be repeated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import groupby
from typing import Any

import pytest
from materials import OBEDIENT, Draw


@contextmanager
def trying(**what: Any) -> Iterator[None]:
    """What fails inside says with what it was tried."""
    try:
        yield
    except Exception as error:
        error.add_note("with " + ", ".join(f"{name} = {value!r}" for name, value in what.items()))
        raise


def by_model(drawn: Iterable[Draw]) -> dict[str, list[Draw]]:
    """The draws of each model, by its name."""
    return {name: list(own) for name, own in groupby(drawn, lambda draw: draw.model.__name__)}


def each_model(drawn: Iterable[Draw], evaluation: str, full: bool = False) -> list[Any]:
    """A case a model: `drawn`, its draws, and `evaluation`, the way in which they are evaluated."""
    end, marks = ("-full", pytest.mark.full) if full else ("", ())
    return [
        pytest.param(own, evaluation, id=f"{name}-{evaluation}{end}", marks=marks)
        for name, own in by_model(drawn).items()
    ]


def both_ways(drawn: Iterable[Draw]) -> list[Any]:
    """A case a model on arrays, and one compiled: of few draws; of all others with `full`."""
    every = list(drawn)
    return [
        *each_model(every, "uncompiled"),
        *each_model([draw for draw in every if draw in OBEDIENT], "compiled"),
        *each_model([draw for draw in every if draw not in OBEDIENT], "compiled", full=True),
    ]


def swept(cases: list[Any]) -> Any:
    """Runs a test on such cases."""
    return pytest.mark.parametrize(("drawn", "evaluation"), cases, indirect=["evaluation"])
