"""Numbers and angles as people type them: an angle is a number, or has its unit, as 8deg, 8° and 0.14rad."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from ..errors import DirectionWarning, ParameterError, warn

UNITS = {
    **dict.fromkeys(("deg", "degree", "degrees", "°"), 1.0),
    **dict.fromkeys(("rad", "radian", "radians"), 180.0 / math.pi),
    "mrad": 0.18 / math.pi,
}
"""Units -> how many degrees they are."""

_WHOLE = re.compile(r"\d{1,15}", re.ASCII)
_NUMBER = re.compile(r"[-+]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?|inf(?:inity)?|nan)", re.ASCII | re.IGNORECASE)
_TYPED = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?)\s*([a-z°]*)\s*", re.IGNORECASE | re.ASCII)


def is_number(token: str) -> bool:
    """Whether a word is a number; nan and inf are; "1_0" and digits of other scripts, which float() takes, are not."""
    return _NUMBER.fullmatch(token) is not None


def is_whole(token: str) -> bool:
    """Whether a word is a whole number, of at most 15 of the digits 0 to 9."""
    return _WHOLE.fullmatch(token) is not None


def typed_angle(text: str) -> tuple[float, str]:
    """The number of a typed angle, and its unit, "" where it has none. Raises ParameterError for other texts."""
    found = _TYPED.fullmatch(text)
    unit = found[2].lower() if found else ""
    if not found or (unit and unit not in UNITS) or not math.isfinite(float(found[1])):
        raise ParameterError(
            f"{text!r:.40} is no angle; expected a number in degrees, or with its unit: 8, 8deg, 0.14rad"
        )
    return float(found[1]), unit


def in_degrees(text: str) -> float:
    """A typed angle [degrees]; without a unit it is in degrees."""
    number, unit = typed_angle(text)
    return _times(number, unit)


def all_in_degrees(text: str) -> list[float]:
    """Typed angles [degrees] with commas between. A unit after the last one alone holds for all of them."""
    typed = [typed_angle(part) for part in text.split(",")]
    units = {unit for _, unit in typed}
    if "" in units and len(units) > 1:
        if any(unit for _, unit in typed[:-1]):
            bare = next(number for number, unit in typed if not unit)
            raise ParameterError(f"{bare:g} has no unit, others have; expected {bare:g}deg or {bare:g}rad")
        typed = [(number, typed[-1][1]) for number, _ in typed]
    return [_times(number, unit) for number, unit in typed]


def suspect_radians(option: str, text: str, degrees: Sequence[float]) -> None:
    """Warn of polar angles without a unit that are taken for degrees and look like radians."""
    some = [x for x in degrees if x != 0.0]
    if not some or any(mark in text.lower() for mark in ("d", "°")):
        return
    if max(map(abs, some)) <= 0.5 * math.pi + 1e-3 and not any(float(x).is_integer() for x in some):
        largest = max(some, key=abs)
        taken = f"{option} {text}: taken as degrees, {largest:g} as {largest:g}°"
        warn(f"{taken}; radians? write {largest:g}rad, and to be rid of this {largest:g}deg", DirectionWarning)


def _times(number: float, unit: str) -> float:
    """A number of a unit in degrees; whole degrees typed in radians are whole."""
    if not unit or UNITS[unit] == 1.0:
        return number
    degrees = number * UNITS[unit]
    return float(np.round(degrees)) if abs(degrees - np.round(degrees)) < 1e-9 * max(abs(degrees), 1.0) else degrees
