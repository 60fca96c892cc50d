"""What an argument means, and which values it may have: `Annotated[type, Declared(...)]`, and types taken apart."""

from __future__ import annotations

import math
import sys
import typing
from collections.abc import Collection
from types import UnionType
from typing import Annotated, Any, NamedTuple

from ..errors import REFUSALS

ABOVE_ZERO, BELOW_ONE = sys.float_info.min, math.nextafter(1.0, 0.0)
"""Bounds of numbers that may not be 0, or 1."""

BELOW_HORIZON = math.nextafter(0.5 * math.pi, 0.0)
"""Bound of polar angles that may not be those of the horizon [rad]."""

BELOW = {math.nextafter(x, 0.0): x for x in (1.0, 0.5 * math.pi, 90.0, 100.0)}
"""Bounds of numbers that are below others -> the others; also as typed."""

LARGEST, LONGEST = 1 << 63, 1000
"""Bound below which declared whole numbers are; largest number of characters of a declared word."""

UNFIT = REFUSALS
"""Errors of conversions of unfit values."""

TYPED = {
    "rad": (180.0 / math.pi, "degrees"),
    "share": (100.0, "%"),
    "direction": (1.0, "polar angle and azimuth in degrees"),
}
"""Units of Python -> how many of the unit that people type they are, and its name."""


class Declared(NamedTuple):
    """The meaning and the bounds of an argument, in `Annotated[type, Declared(...)]`.

    low, high   bounds of every number, in the `unit`
    unit        "rad" is typed in degrees on the command line, "share" (a part of 1) in %, and "direction" as its
                polar angle and azimuth
    words       the only values; text in any case
    lengths     of a Sequence of node counts, one for each axis of a grid, which must fit into memory
    multiple    divisor of whole numbers
    rising      whether a Sequence increases
    longest     characters of a word, items of a list or a mapping; a text of more than 1000 characters may have lines
    usual       the meaning of a default of None
    """

    doc: str
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    words: Collection[Any] = ()
    lengths: tuple[int, ...] = ()
    multiple: int = 1
    rising: bool = False
    longest: int = 0
    usual: Any = None

    @property
    def typed(self) -> Declared:
        """The same, in the unit that people type."""
        factor, unit = TYPED.get(self.unit, (1.0, self.unit))
        low, high = (x if x == ABOVE_ZERO else float(f"{BELOW.get(x, x) * factor:.12g}") for x in (self.low, self.high))
        high = math.nextafter(high, 0.0) if self.high in BELOW else high
        return self if unit == self.unit else self._replace(low=low, high=high, unit=unit)


Seed = Annotated[int, Declared("of the random numbers: the same seed gives the same result", 0, LARGEST - 1)]
"""Where random numbers begin."""


class Real:
    """Marks `Numbers`."""


Numbers = Annotated[Any, Real]
"""A number, or an array or list of real numbers; the function gets a NumPy array."""


def alternatives(kind: Any) -> tuple[Any, ...]:
    """The kinds of `Annotated[A | B, ...]` and of `A | B`, else the kind alone."""
    inner = typing.get_args(kind)[0] if hasattr(kind, "__metadata__") and Real not in kind.__metadata__ else kind
    return typing.get_args(inner) if typing.get_origin(inner) in (UnionType, typing.Union) else (inner,)


def declared_in(kind: Any) -> Declared | None:
    """The declaration in a kind, or in one of its alternatives."""
    metadata = [x for of in (kind, *alternatives(kind)) for x in getattr(of, "__metadata__", ())]
    return next((x for x in metadata if isinstance(x, Declared)), None)
