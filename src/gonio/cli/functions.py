"""Commands that are public functions: `gonio white-sky-albedo gold` prints
`gn.remote_sensing.white_sky_albedo(gn.material("gold"))`.

The first argument of such a function is a reflectance; the others are declared, or left to their defaults.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from ..declared.discover import docstring
from ..facts.public import function_of
from .command import Command, TypedArguments
from .options import TypedMaterial, json_option, material_argument
from .tables import table
from .terminal import print_json, say


def command_of(name: str) -> Command | None:
    """The command of a public function, by its name with - for _; None where it is no such function."""
    function = function_of(name.replace("-", "_"))
    return None if function is None else _made(name, function)


@cache
def _made(name: str, function: Callable) -> Command:
    @material_argument
    @json_option
    def run(material: TypedMaterial, as_json: bool, **more: Any) -> None:
        asked: TypedArguments = more.get("asked", TypedArguments({function.__name__: function}, {}, {}))
        result = function(material.read(), **asked.of(function.__name__))
        if as_json:
            print_json(_as_json(result))
        else:
            say(in_words(result))

    text = docstring(function).partition("\n\n")[0].replace("`", "")
    return Command(name=name, callback=run, params=run.__click_params__[::-1], help=text, asks=(function,))


def _as_json(value: Any) -> Any:
    """Data for JSON."""
    if hasattr(value, "to_json"):
        return value.to_json()
    if hasattr(value, "_asdict"):
        return {name: _as_json(x) for name, x in value._asdict().items()}
    if isinstance(value, dict):
        return {str(name): _as_json(x) for name, x in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_json(x) for x in value]
    return np.asarray(value).tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def in_words(value: Any) -> str:
    """A result for people: of named tuples a line for each field."""
    if hasattr(value, "_asdict") and type(value).__str__ is tuple.__str__:
        return table(("", ""), [(name, in_words(x)) for name, x in value._asdict().items()]).removeprefix("\n")
    if isinstance(value, (float, np.ndarray, np.generic)):
        return np.array2string(np.asarray(value), precision=6, suppress_small=False)
    return str(value)
