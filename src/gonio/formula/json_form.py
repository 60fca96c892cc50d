"""Values of declared parameters, read from the JSON data that their `to_json` writes."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np

from ..errors import NotFoundError, ParameterError
from . import tree
from .blackbody import Blackbody
from .bounds import CHANNELS, EVALUATIONS, NESTED
from .dispersion import Dispersion
from .fields import CLASSES, Param
from .parametrised import Parametrised
from .spectrum import Spectrum
from .text import shown, unknown
from .texture import Texture


def names() -> dict[str, type[Parametrised]]:
    """The classes that a text may name: no abstract bases, tables and files."""
    return {name: kind for name, kind in CLASSES.items() if _may_be_named(kind)}


def kind_of(name: str) -> type[Parametrised] | None:
    """The class of this name that a text may name, or none."""
    kind = CLASSES.get(name)
    return kind if kind is not None and _may_be_named(kind) else None


def _may_be_named(kind: type[Parametrised]) -> bool:
    return kind._has_text and not kind._unwritten()


def from_json(data: Any, files: bool = False, depth: int = 1) -> Any:
    """The value that `to_json` described.

    `files`: whether the paths of pictures in it are opened; `depth`: of this value in another. Raises NotFoundError for
    an unknown type or parameter, ParameterError for a value that is nested too deep, too large or out of bounds.
    """
    if isinstance(data, list) and any(isinstance(x, dict) for x in data):
        return [from_json(x, files, depth) for x in data]
    return _of_object(data, files, depth) if isinstance(data, dict) else data


def _of_object(data: dict[str, Any], files: bool, depth: int) -> Any:
    name = data.get("type")
    if depth > NESTED:
        raise ParameterError(f"objects nested more than {NESTED} deep; write factors as one, a sum of sums as one sum")
    if isinstance(name, str) and name in SPECTRA:
        return _spectrum(SPECTRA[name], data)
    if name == "Texture":
        return _texture(data)
    kind = CLASSES.get(name) if isinstance(name, str) else None
    if kind is None and "module" in data:
        raise NotFoundError(_missing(name, data["module"]))
    if kind is None or not _may_be_named(kind):
        raise NotFoundError(unknown("material file", name, list(names()), what="type"))
    if isinstance(terms := data.get("terms"), list) and len(terms) > EVALUATIONS:
        raise ParameterError(f"{name}: a sum of {len(terms)} terms, expected at most {EVALUATIONS}; write fewer")
    head = {"type", "module"} - kind.fields.keys()
    named = {"channel_names"} - kind.fields.keys() if hasattr(kind, "with_channels") else set()
    arguments = {k: from_json(v, files, depth + 1) for k, v in data.items() if k not in head | named}
    if not files and (paths := tree.files_among(kind, [], arguments)):
        raise ParameterError(
            f"{name}: names the file {shown(paths[0])}, and a text opens no others; expected the pixels themselves"
        )
    terms = arguments.pop("terms", ()) if _takes_any_number(kind) else ()
    if not isinstance(terms, list | tuple):
        raise ParameterError(f"{name}: terms={shown(terms)}: expected a list of objects")
    try:
        value = kind(*terms, **arguments)
    except TypeError as error:  # of constructors that take no fields
        raise ParameterError(f"{name}: {error}") from None
    width = max(
        (np.shape(x)[-1] for _, field, x in value._free() if isinstance(field, Param) and np.ndim(x)), default=0
    )
    if width > CHANNELS:
        raise ParameterError(f"{name}: a parameter with {width} channels, expected at most {CHANNELS} in a text")
    return value.with_channels(data["channel_names"]) if named & data.keys() else value


def _takes_any_number(kind: type[Parametrised]) -> bool:
    """Whether the constructor takes any number of parts, as those of a sum and of a stack of films do."""
    return any(p.kind is p.VAR_POSITIONAL for p in inspect.signature(kind).parameters.values())


SPECTRA: dict[str, type[Spectrum]] = {
    "Spectrum": Spectrum,
    "Dispersion": Dispersion,
    "blackbody": Blackbody,
}
"""The spectra that a text may name."""


def _spectrum(kind: type[Spectrum], data: dict[str, Any]) -> Spectrum:
    names = list(inspect.signature(kind).parameters)
    if strange := sorted(map(str, data.keys() - {"type", *names})):
        raise NotFoundError(unknown(kind.__name__, strange[0], names))
    return kind(*(data.get(name, ()) for name in names))


def _texture(data: dict[str, Any]) -> Texture:
    known = ("image", "filter", "wrap", "colour")
    if strange := sorted(map(str, data.keys() - {"type", *known})):
        raise NotFoundError(unknown("Texture", strange[0], list(known)))
    if not isinstance(data.get("image"), list):
        rule = "expected the texels, a list of rows of texels; a text opens no files"
        raise ParameterError(f"Texture(image={shown(data.get('image'))}): {rule}")
    return Texture(**{name: data[name] for name in known if name in data})


def _missing(name: Any, module: Any) -> str:
    """The message about a class that JSON names with its module, and that is not defined here."""
    if module in ("__main__", "__mp_main__"):
        return f"the class {shown(name)} was defined in a script or notebook; define it here, and load again"
    return f"the class {shown(name)} is not gonio's but of the module {shown(module)}; import that, and load again"
