"""The interface of light sources: delta lights arrive from one direction, the others are radiance over directions.

Directions point **to** the light and are in the world frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple, Self

from ..arrays import ops
from ..formula.parametrised import Parametrised


class Arrival(NamedTuple):
    """Light of a delta source at a position: unit directions to it (..., 3), and the irradiance [W m-2] it causes on
    a plane perpendicular to them, with a channel axis: (..., 1) or (..., C)."""

    w: Any
    irradiance: Any


class Light(Parametrised):
    """Base of the lights. A subclass is a delta light with `arrival`, or gives `incident`, and `sample` and `pdf` if
    it can be sampled."""

    is_delta: ClassVar[bool] = False
    can_sample: ClassVar[bool] = False
    words: ClassVar[dict[str, str]] = {}
    """How the command line may name it, with its numbers ("constant[:L]") -> what that is; "" for a synonym."""

    @classmethod
    def of_word(cls, numbers: Sequence[float]) -> Self:
        """The light that one of its `words` names. Raises ParameterError where it takes other numbers."""
        raise NotImplementedError

    def arrival(self, position: Any) -> Arrival:
        """What a delta light sends to `position` (..., 3)."""
        raise NotImplementedError

    def incident(self, w: Any) -> Any:
        """Radiance [W m-2 sr-1] from unit world directions w (..., 3), with a channel axis: (..., 1) or (..., C)."""
        raise NotImplementedError

    def sample(self, u: Any) -> tuple[Any, Any]:
        """World directions (..., 3) for uniform numbers u (..., 2), and their density per solid angle [1/sr] (...)."""
        raise NotImplementedError

    def pdf(self, w: Any) -> Any:
        """Density [1/sr] (...) of `sample` at world directions w (..., 3)."""
        raise NotImplementedError


def spectrum(numbers: Sequence[float], default: float) -> Any:
    """Numbers behind a light's word: one for all channels, one for each, or none for the default."""
    return default if not numbers else numbers[0] if len(numbers) == 1 else list(numbers)


def channel_vector(value: Any, like: Any) -> Any:
    """A light's spectrum as (..., C) in the library and dtype of `like`; a number becomes one channel."""
    lib = ops.library(like)
    array = lib.convert(value, like)
    return array[None] if array.ndim == 0 else array
