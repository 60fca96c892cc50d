"""`gn.source`: the formula of a material as source text of C, CUDA, GLSL, HLSL, OSL and WGSL."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ...base.textured import require_numbers
from ...compile.source.language import Language
from ...compile.source.names import identifier, is_prefix
from ...declared import discover
from ...declared.arguments import checked
from ...errors import NotFoundError, ParameterError, shown, suggestion
from .functions import FUNCTIONS
from .result import Argument as Argument
from .result import Source as Source
from .result import SourceTable as SourceTable
from .writing import Writer


def languages() -> dict[str, Language]:
    """The languages by name, one file each in `compile/source/languages`."""
    found = discover.by_name("gonio.compile.source.languages")
    return {name: module.LANGUAGE for name, module in found.items()}


@checked
def source(
    m: Reflectance,
    language: str = "glsl",
    function: str | Sequence[str] = "f",
    name: str = "",
    parameters: str = "constants",
) -> Source:
    """The formula of a material as source text that another program compiles: the graph that gonio itself compiles.

    language    "c", "cuda", "glsl" (WebGL 2 and desktop), "hlsl", "osl" or "wgsl"
    function    "f", "f_cos" (f |cos(theta_i)|), "pdf", "sample", "mueller", "jacobian" (f and its derivative by each
                parameter); several at once share helpers and tables
    name        begins all global names of the text; by default a word for the material
    parameters  "constants": the numbers of the material stand at the top of the text. "arguments": each follows the
                directions as an argument, so that one text serves all materials of the kind

    Directions are unit vectors in the local frame, z the normal; both leave the surface. Values are RGB or whatever the
    channels of the material are: a number, a vector of two to four, else an array. What is used twice is computed once.
    Tables of up to 256 numbers stand in the text; larger ones are textures, buffers or pointers, see `Source.tables`.
    Of fluorescence f has the light that keeps its wavelength; `m.under(E)` has the other too, under a spectrum E.

    Units   f: 1/sr; angles of parameters: radians.
    Error   of float32: against `m.f` of float32 arrays about 1e-6 of the value; docs/source.md has the measured sizes.
            NaN is not kept: directions and numbers must be finite. Where a measurement has no value, f is NaN, or 0 in
            OSL and WGSL, which cannot write NaN.
    Raises  NotFoundError for another language or function, ParameterError for a map, for missing parameters, and for a
            formula of more than 60 000 operations; TraceError for one that cannot be taken apart.

    Example
    >>> print(gn.source(gn.Lambertian(0.5), "c", name="paper").text.splitlines()[-1])
    }
    """
    speaks = languages()
    if language not in speaks:
        raise NotFoundError(_unknown("language", language, speaks))
    wanted = (function,) if isinstance(function, str) else tuple(function)
    for word in wanted:
        if word not in FUNCTIONS:
            raise NotFoundError(_unknown("function", word, FUNCTIONS))
    if not wanted or len(set(wanted)) < len(wanted):
        raise ParameterError(f"source(function={function!r}): expected one of each function, such as ('f', 'pdf')")
    if parameters not in ("constants", "arguments"):
        raise NotFoundError(_unknown("parameters", parameters, ("constants", "arguments")))
    if name and not is_prefix(name):
        raise ParameterError(
            f"source(name={name!r:.60}): expected a word of letters, digits and single _ between them, which does not "
            f"begin with gl_ or webgl_; such as gold"
        )
    if "sample" in wanted:
        m._require_one_direction()
    require_numbers(m, "source")
    _require_no_maps(m)
    if any(True for _ in m.holed()):
        raise ParameterError(
            "source: some numbers of the material are missing (NaN); expected none; give them by m.replace"
        )
    return Writer(m, speaks[language], name or _word(m), parameters == "arguments").written(wanted)


def _require_no_maps(m: Reflectance) -> None:
    """Raises ParameterError for a material with maps: a text is for the numbers of one place."""
    for path, _, value, _ in m._numbers():
        if np.ndim(value) > 1:
            at = tuple(np.reshape(value, (-1, value.shape[-1]))[0].tolist())
            raise ParameterError(
                f"source: {path} is a map of shape {np.shape(value)[:-1]}; expected the numbers of one place: "
                f"m.replace(**{{{path!r}: {shown(at)}}}); with parameters='arguments' the program brings all others"
            )


def _unknown(what: str, got: str, expected: Any) -> str:
    listed = ", ".join(map(repr, expected))
    return f"source({what}={got!r}): expected one of {listed}{suggestion(got, list(expected))}"


def _word(m: Reflectance) -> str:
    """A word for a material: its class in small letters."""
    word = identifier(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(m).__name__).lower())
    return word if is_prefix(word) else "material"
