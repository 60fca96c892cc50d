"""Options that are angles: in degrees, or with their unit, as 8deg, 8° and 0.14rad."""

from __future__ import annotations

import math
from typing import Any

import click

from ..declared.typed import all_in_degrees, in_degrees, suspect_radians
from ..errors import ParameterError


class Angle(click.ParamType):
    """One angle [degrees], within bounds."""

    name = "angle"

    def __init__(self, low: float = -math.inf, high: float = math.inf, above: bool = False):
        self.low, self.high, self.above = low, high, above

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """The word of the help."""
        return "ANGLE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The angle of the text that was typed, or of a default."""
        option = _option(param)
        try:
            degrees = in_degrees(str(value))
        except ParameterError as error:
            raise ParameterError(f"{option} {value!s:.60}: {error}") from None
        if not self.low <= degrees <= self.high or (self.above and degrees == self.low):
            bounds = f"{'above' if self.above else 'from'} {self.low:g} to {self.high:g}"
            raise ParameterError(f"{option} {_taken(str(value), [degrees])}: expected degrees {bounds}")
        return degrees


class Angles(click.ParamType):
    """Several angles [degrees]; polar ones, of which the largest is below a bound, are at least 0."""

    name = "angles"

    def __init__(self, below: float = math.inf, count: int | None = None):
        self.below, self.count = below, count

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """The word of the help."""
        return "ANGLE,ANGLE" if self.count == 2 else "ANGLE,.."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> list[float]:
        """The angles of the text that was typed, or of a default."""
        if not isinstance(value, str):
            return list(value)
        option, is_polar = _option(param), self.below < math.inf
        try:
            degrees = all_in_degrees(value)
        except ParameterError as error:
            raise ParameterError(f"{option} {value!r:.60}: {error}") from None
        if self.count is not None and len(degrees) != self.count:
            raise ParameterError(f"{option} {value!r:.60}: expected {self.count} angles, such as 0,75")
        if is_polar and not all(0.0 <= x < self.below for x in degrees):
            limits = f"of at least 0 and below {self.below:g}"
            raise ParameterError(
                f"{option} {_taken(value, degrees)}: expected angles in degrees {limits}, such as 0,8,45"
            )
        if is_polar:
            suspect_radians(option, value, degrees)
        return degrees


def _option(param: click.Parameter | None) -> str:
    return "angle" if param is None else param.opts[-1]


def _taken(text: str, degrees: list[float]) -> str:
    """What was typed, and what it was taken for where it had a unit."""
    has_unit = any(mark in text.lower() for mark in ("d", "°"))
    meant = f", which is {', '.join(f'{x:.5g}°' for x in degrees)[:60]}" if has_unit else ""
    return f"{text!r:.60}{meant}"
