"""Short names of lights on the command line: "distant:45,-60". Lights declare them; see `words` of `Light`."""

from __future__ import annotations

import math

from .. import discover
from ..base.light import Light
from ..errors import ParameterError

_KINDS = discover.classes("gonio.lights", Light).values()

FORMS = {"FILE": "equirectangular environment map"} | {
    form: meaning for kind in _KINDS for form, meaning in kind.words.items() if meaning
}
"""What LIGHT may be -> what that is."""

LISTED = ", ".join(FORMS)

WORDS: dict[str, type[Light]] = {form.partition(":")[0].rstrip("["): kind for kind in _KINDS for form in kind.words}
"""Word -> class of the light."""


def named(text: str, word: str, numbers: str | None) -> Light:
    """The light that a word of WORDS names; `text`: all of it, for messages."""
    try:
        return WORDS[word].of_word([] if numbers is None else _read(numbers))
    except ParameterError as error:
        raise ParameterError(f"light {text!r:.90}: {error}") from None


def _read(numbers: str) -> list[float]:
    try:
        values = [float(part) for part in numbers.split(",")]
    except ValueError:
        raise ParameterError(f"{numbers!r:.60} is not a list of numbers; expected {LISTED}") from None
    if not all(map(math.isfinite, values)):
        raise ParameterError("NaN or infinite; expected finite numbers")
    return values
