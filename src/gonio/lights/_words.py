"""Words of the command line that stand for lights: declared as WORDS by the files of this folder, and found there."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

from ..base.angles import direction
from ..base.light import Light
from ..declared.discover import modules
from ..errors import ParameterError


class Word(NamedTuple):
    """A word, such as `distant` in distant:45,-60, and the light that it stands for.

    usage     the form typed: the word, a colon, the numbers that it needs, in brackets those that may follow
    meaning   the text of the help
    light     the light of the numbers; of a path for FILE
    example   an example for errors, after the usage
    aliases   other words for the same
    suffixes  of the files that it stands for, if it stands for files; FILE stands for all others
    """

    usage: str
    meaning: str
    light: Callable[..., Light]
    example: str = ""
    aliases: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return re.split(r"[:\[]", self.usage)[0]

    @property
    def needs(self) -> int:
        """How many numbers must follow."""
        return len(re.findall(r"[A-Z]+", self.usage.partition("[")[0].partition(":")[2]))

    def of(self, numbers: list[float]) -> Light:
        """The light of these numbers; raises ParameterError for too few, or for those that it does not take."""
        if len(numbers) < self.needs:
            raise ParameterError(f"expected {self.usage} {self.example}".rstrip())
        return self.light(numbers)


def words() -> list[Word]:
    """All words: files first, then by how much they need."""
    declared = [word for module in modules("gonio.lights") for word in getattr(module, "WORDS", ())]
    return sorted(declared, key=lambda word: (word.name[:4] != "FILE", word.needs, word.name != DEFAULT, word.name))


DEFAULT = "studio"
"""The light of a picture where no other is asked for."""


def spectrum(numbers: list[float], default: float) -> Any:
    """A number, or one per channel."""
    return default if not numbers else numbers[0] if len(numbers) == 1 else numbers


def towards(theta: float, phi: float) -> Any:
    """The direction of angles in degrees."""
    if not 0.0 <= theta <= 180.0:
        raise ParameterError(f"theta is {theta:g} degrees, expected 0 (up) to 180 (down)")
    return direction(math.radians(theta), math.radians(phi))
