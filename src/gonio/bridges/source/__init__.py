"""`gn.engine.shader_source`: the formula of a material as source text of C, CUDA, GLSL, HLSL, OSL and WGSL."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from ...base.calls import require_one_direction
from ...base.reflectance import Reflectance
from ...base.textured import require_numbers
from ...compile.source.language import Language
from ...compile.source.names import identifier, is_prefix
from ...declared import discover
from ...declared.arguments import Declared, checked
from ...errors import ParameterError, shown
from ...formula import tree
from .functions import FUNCTIONS
from .result import Argument as Argument
from .result import ShaderSource as ShaderSource
from .result import SourceTable as SourceTable
from .writing import SourceWriter

LANGUAGES: dict[str, Language] = {
    name: module.LANGUAGE for name, module in discover.by_name("gonio.compile.source.languages").items()
}
"""The languages by name, one file each in `compile/source/languages`."""

PARAMETERS = ("constants", "arguments")
"""What becomes of the numbers of a material."""


@checked
def shader_source(
    m: Reflectance,
    language: Annotated[str, Declared("language; glsl is that of WebGL 2, too", words=(*LANGUAGES,))] = "glsl",
    function: Annotated[
        Sequence[str],
        Declared(
            "what the text computes, all with the same helpers and tables; f_cos is f |cos(theta_i)|, jacobian f and "
            "its derivative by each parameter",
            words=(*FUNCTIONS,),
        ),
    ] = ("f",),
    name: Annotated[
        str, Declared("letters, digits and single _ that begin all global names", usual="a word for the material")
    ]
    | None = None,
    parameters: Annotated[
        str,
        Declared(
            "constants, numbers at the top of the text; or arguments, each follows the directions, so that one text "
            "serves all materials of the kind",
            words=PARAMETERS,
        ),
    ] = "constants",
) -> ShaderSource:
    """The formula of a material as source text that another program compiles: the graph that gonio itself compiles.

    Directions are unit vectors in the local frame, z the normal; both leave the surface. Values are RGB or whatever the
    channels of the material are: a number, a vector of two to four, else an array. What is used twice is computed once.
    Tables of up to 256 numbers stand in the text; larger ones are textures, buffers or pointers, see
    `ShaderSource.tables`. Of fluorescence f has the light that keeps its wavelength; `m.under(E)` has the other too,
    under a spectrum E.

    Units   f: 1/sr; angles of parameters: radians.
    Error   of float32: against `m.f` of float32 arrays about 1e-6 of the value; docs/source.md has the measured sizes.
            NaN is not kept: directions and numbers must be finite. Where a measurement has no value, f is NaN, or 0 in
            OSL and WGSL, which cannot write NaN.
    Raises  ParameterError for another language or function, for a map, for missing parameters, and for a
            formula of more than 60 000 operations; TraceError for one that cannot be taken apart.

    Example
    >>> print(gn.engine.shader_source(gn.Lambertian(0.5), "c", name="paper").text.splitlines()[-1])
    }
    """
    if len(set(function)) < len(function):
        raise ParameterError(
            f"shader_source(function={function!r}): expected one of each function, such as ('f', 'pdf')"
        )
    if name and not is_prefix(name):
        raise ParameterError(
            f"shader_source(name={name!r:.60}): expected a word of letters, digits and single _ between them, which "
            f"does not begin with gl_ or webgl_; such as gold"
        )
    if "sample" in function:
        require_one_direction(m)
    require_numbers(m, "source")
    _require_no_maps(m)
    if any(True for _ in tree.holed(m)):
        raise ParameterError(
            "source: some numbers of the material are missing (NaN); expected none; give them by m.replace"
        )
    return SourceWriter(m, LANGUAGES[language], name or _word(m), parameters == "arguments").written(tuple(function))


def _require_no_maps(m: Reflectance) -> None:
    """Raises ParameterError for a material with maps: a text is for the numbers of one place."""
    for path, _, value, _ in tree.numbers(m):
        if np.ndim(value) > 1:
            at = tuple(np.reshape(value, (-1, value.shape[-1]))[0].tolist())
            raise ParameterError(
                f"source: {path} is a map of shape {np.shape(value)[:-1]}; expected the numbers of one place: "
                f"m.replace(**{{{path!r}: {shown(at)}}}); with parameters='arguments' the program brings all others"
            )


def _word(m: Reflectance) -> str:
    """A word for a material: its class in small letters."""
    word = identifier(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(m).__name__).lower())
    return word if is_prefix(word) else "material"
