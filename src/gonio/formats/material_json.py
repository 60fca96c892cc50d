"""gonio's own material files: a model or a sum of models with its parameters, as JSON."""

from __future__ import annotations

import json
from pathlib import Path

from ..base.reflectance import Reflectance
from ..errors import Error, FormatError
from ..formula.json_form import from_json
from . import bird_json, open_material
from ._reading import json_text, plain_text

NAME = "gonio JSON"
SUFFIXES = (".json",)
DESCRIPTION = "a model and its parameters"
TRANSMITS = True
FLUORESCES = True
ORACLE = "round trip: the format is gonio's own"
NO_LAYOUT = "parameters of models, no table"


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: JSON that names a type, and no measurement in JSON."""
    measured = bird_json.matches(head, size) or open_material.matches(head, size)
    return not measured and head.lstrip().startswith(b"{") and b'"type"' in head


def read(path: Path) -> Reflectance:
    """The material of a JSON file. No content makes it open another file."""
    data = json_text.read(path)
    try:
        m = from_json(data)
    except Error as error:
        raise FormatError(f"{path}: {error}") from None
    if not isinstance(m, Reflectance):
        raise FormatError(f"{path}: holds a {type(m).__name__}, expected a reflectance")
    return m


def write(m: Reflectance, path: Path) -> None:
    """Write a material as JSON.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.json")
    >>> print(gn.load("white.json"))
    Lambertian(rho=0.5)
    """
    plain_text.write(path, [json.dumps(m.to_json(), indent=2) + "\n"])
