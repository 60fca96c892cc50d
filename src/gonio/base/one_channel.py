"""One channel of a light with several, as a light."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..formula import tree
from ..formula.fields import Channels, Field, part
from ..formula.state import state
from .light import ORIGIN, Light, _OfLight


class OneChannel(_OfLight):
    """A light of which one channel is left, whose number formulas know.

    `own`: the paths of numbers that channels do not share.

    Source   the light that it is of.
    """

    number: int = state(0)
    own: frozenset[str] = state(frozenset())

    def sharing(self, other: OneChannel) -> OneChannel:
        """The channel with the very numbers of another one that both share: what follows from them is computed once."""
        shared = zip(tree.leaf_paths(other), tree.leaves(other), strict=True)
        return tree.with_values(self, {path: value for path, value in shared if path not in self.own})

    @property
    def _shining(self) -> Light:
        number = float(self.number)
        light: Light = tree.rebuilt(
            self.light, lambda _, field, value: number if isinstance(field, Channels) else value
        )
        return light


class _OfArrays(Light, has_text=False):
    """A channel of a light that is a function of arrays."""

    of = part(Light, None, "the light")
    number: int = state(0)

    def incident(self, w: Any, position: Any = ORIGIN) -> Any:
        return self.of.incident(w, position)[..., self.number : self.number + 1]


def of_channel(light: Light, number: int) -> Light:
    """One channel of a light: the last one, where it has fewer."""
    if not light.is_formula():
        one = _OfArrays(light)
        one._hold(number=number)
        return one
    own: list[str] = []

    def chosen(path: str, field: Field, value: Any) -> Any:
        if not np.ndim(value):
            return value
        own.append(f"light.{path}")
        one = value[..., min(number, np.shape(value)[-1] - 1)]
        return float(one) if isinstance(value, np.ndarray) else one

    only = OneChannel(tree.rebuilt(light, chosen))
    only._hold(number=number, own=frozenset(own))
    return only
