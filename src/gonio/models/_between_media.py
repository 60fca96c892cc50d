"""What all interfaces between two media share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..formula.direction import Direction


class BetweenMedia(Reflectance):
    """An interface with the index `eta` behind over that in front; seen from behind it is that of 1/eta."""

    sides = "both"
    eta: Any

    @property
    def index(self) -> Any:
        return self.eta

    def turned(self, back: Any) -> Reflectance:
        return self._changed({"eta": choose(back, 1.0 / self.eta, self.eta)})

    def formula(self, wi: Direction, wo: Direction) -> Any:
        raise self._lacks("formula")

    @abstractmethod
    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        """What is reflected, and what is transmitted."""
