"""`gonio measure`: the reflectance of a surface that is described by its shape."""

from __future__ import annotations

import ast
import inspect
import math
import os
from pathlib import Path
from typing import Any

import click
import numpy as np

from ..declared.arguments import Declared
from ..declared.typed import is_number
from ..errors import ExpressionError, NotFoundError, ParameterError, suggestion, visible
from ..facts.public import public
from .command import TypedArguments, command, option
from .options import json_option, output_option
from .terminal import bar, echo, print_json


@command(
    *("gonioreflectometer", "save", "surfaces.from_map"), short_help="Measure a surface that is described by its shape."
)
@click.argument("surface", metavar="SURFACE")
@output_option("File to write, in the format of its suffix.")
@option("--facet", means=Declared("facets: the reflectance of mirrors, or a MATERIAL"), default="1")
@json_option
def measure(surface: str, output: Path, facet: str, as_json: bool, asked: TypedArguments) -> None:
    """Measure a surface that is described by its shape, with rays: the virtual gonioreflectometer.

    SURFACE is a height map (.npy, rows of numbers, a gray picture; with --pixel; or .sdf), or one of gaussian(0.3),
    v_grooves(0.6), weave(), brushed(0.3), spheres(0.3), with their arguments: gaussian(0.3, 0.1, seed=1).

    \b
    Examples:
      gonio measure "gaussian(0.3)" -o rough.csv --theta-i 0,30,60
      gonio measure profile.npy --pixel 0.5 --facet gold -o gold.csv
    """
    from ..formats import save, target, writer

    module = writer(output, **asked.of("save"))
    target(module, output)
    shape = _map(surface, asked) if os.path.exists(surface) else _of_expression(surface, asked)
    with bar("measuring") as progress:
        m = asked.call("gonioreflectometer", shape, _facet(facet), progress=progress)
    save(m, output, module.NAME)
    if as_json:
        print_json(_as_json(m))
    else:
        echo(visible(f"{output}: {shape.title}, facets {facet}"))
        echo(str(m.report))


def _of_expression(text: str, asked: TypedArguments) -> Any:
    asked.refuse_others("beside a surface that is no map", "gonioreflectometer", "save")
    return surface_of(text)


def surface_of(text: str) -> Any:
    """The surface of an expression such as gaussian(0.3, size=256): a function of `gn.surfaces` and plain values."""
    surfaces = public("surfaces")

    makers = [name for name in surfaces.__all__ if name[0].islower() and name != "from_map"]
    expected = f'a height map, or one of {", ".join(makers)}, such as "gaussian(0.3)"'
    try:
        call = ast.parse(text.strip(), mode="eval").body
        named = call.func if isinstance(call, ast.Call) else call
        name = named.id if isinstance(named, ast.Name) else ""
        values = [ast.literal_eval(x) for x in call.args] if isinstance(call, ast.Call) else []
        keywords = {str(k.arg): ast.literal_eval(k.value) for k in call.keywords} if isinstance(call, ast.Call) else {}
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError(f"{text!r:.90}: expected {expected}") from None
    if name not in makers:
        raise NotFoundError(f"{text!r:.90}: no such file or surface{suggestion(name, makers)}; expected {expected}")
    make = getattr(surfaces, name)
    signature = inspect.signature(make)
    try:
        signature.bind(*values, **keywords)  # whose errors are the same in every Python
    except TypeError as error:
        unknown = next((keyword for keyword in keywords if keyword not in signature.parameters), "")
        close = suggestion(unknown, signature.parameters)
        expected = f"expected some of {', '.join(signature.parameters)}"
        raise ParameterError(f"{text!r:.90}: {error}{close}; {expected}") from None
    return make(*values, **keywords)


def _map(path: str, asked: TypedArguments) -> Any:
    how = asked.of("surfaces.from_map")
    if "pixel" not in how and not path.lower().endswith(".sdf"):
        raise ParameterError(
            f"{path!r:.90}: expected --pixel, the distance of its heights, such as --pixel 0.5 --unit um"
        )
    return asked.call("surfaces.from_map", path)


def _facet(text: str) -> Any:
    from .arguments import resolve

    return float(text) if is_number(text) and math.isfinite(float(text)) else resolve(text)


def _as_json(m: Any) -> dict[str, Any]:
    report = m.report
    rows = [
        {
            "theta_i": float(np.degrees(report.theta_i[i])),
            "phi_i": float(np.degrees(report.phi_i[j])),
            "reflected": float(report.reflected[i, j]),
            "unfinished": float(report.unfinished[i, j]),
            "error": float(report.error[i, j]),
            "surfaces": int(report.surfaces[i, j]),
            "bounces": np.mean(m.bounces[i, j], axis=-1).tolist(),
        }
        for i, j in np.ndindex(report.error.shape)
    ]
    return {"converged": m.converged, "rays_per_second": report.rays_per_second, "directions": rows}
