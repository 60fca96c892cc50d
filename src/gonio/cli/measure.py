"""`gonio measure`: the reflectance of a surface that is described by its shape."""

from __future__ import annotations

import ast
import os
from pathlib import Path
from typing import Any

import click
import numpy as np

from ..errors import ExpressionError, NotFoundError, ParameterError, suggestion, visible
from .angles import Angles
from .options import json_option, output_option
from .terminal import bar, echo, print_json


@click.command(short_help="Measure a surface that is described by its shape.")
@click.argument("surface", metavar="SURFACE")
@output_option("File to write, in the format of its suffix.")
@click.option("--format", "format_", metavar="FORMAT", help="Format, where the suffix does not say which.")
@click.option("--facet", default="1", show_default=True, help="Facets: the reflectance of mirrors, or a MATERIAL.")
@click.option(
    "--theta", type=Angles(90.0), default="0,15,30,45,60,75", show_default=True, help="Polar angles of incidence."
)
@click.option(
    "--phi", type=Angles(), help="Azimuths of incidence, of surfaces that are not isotropic.  [default: every 30]"
)
@click.option("--cells", default="18,36", show_default=True, help="Rings and sectors that light is counted in.")
@click.option("--error", default=0.01, show_default=True, help="Relative error, of a cell on average, to go on until.")
@click.option("--bounces", default=16, show_default=True, help="How often light is followed.")
@click.option("--rays", default=1 << 18, show_default=True, help="Rays on each surface, from each direction.")
@click.option("--most", default=256, show_default=True, help="Independent surfaces at most.")
@click.option("--seed", default=0, type=click.IntRange(min=0), show_default=True, help="Of the random numbers.")
@click.option("--pixel", type=float, help="Distance of the heights of a map, in --unit.")
@click.option("--unit", default="um", show_default=True, help="Unit of --pixel and of the heights: nm, um, mm, m.")
@click.option("--scale", default=1.0, show_default=True, help="What a number of a map stands for, in --unit.")
@json_option
def measure(
    surface: str,
    output: Path,
    format_: str | None,
    facet: str,
    theta: list[float],
    phi: list[float] | None,
    cells: str,
    error: float,
    bounces: int,
    rays: int,
    most: int,
    seed: int,
    pixel: float | None,
    unit: str,
    scale: float,
    as_json: bool,
) -> None:
    """Measure a surface that is described by its shape, with rays: the virtual gonioreflectometer.

    SURFACE is a height map (.npy, rows of numbers, a gray picture; with --pixel; or .sdf), or one of gaussian(0.3),
    v_grooves(0.6), threads(), brushed(0.3), spheres(0.3), with their arguments: gaussian(0.3, 0.1, seed=1).

    \b
    Examples:
      gonio measure "gaussian(0.3)" -o rough.csv --theta 0,30,60
      gonio measure profile.npy --pixel 0.5 --facet gold -o gold.csv
    """
    from ..formats import save, target, writer
    from ..instrument.measure import gonioreflectometer

    module = writer(output, format_)
    target(module, output)
    shape = _map(surface, pixel, unit, scale) if os.path.exists(surface) else surface_of(surface)
    with bar("measuring") as progress:
        m = gonioreflectometer(
            shape,
            _facet(facet),
            np.radians(theta),
            None if phi is None else np.radians(phi),
            _numbers(cells),
            error,
            bounces=bounces,
            rays=rays,
            most=most,
            seed=seed,
            progress=progress,
        )
    save(m, output, module.NAME)
    if as_json:
        print_json(_as_json(m))
    else:
        echo(visible(f"{output}: {shape.title}, facets {facet}"))
        echo(str(m.report))


def surface_of(text: str) -> Any:
    """The surface of an expression such as gaussian(0.3, size=256): a function of `gn.surfaces` and plain values."""
    from .. import surfaces

    known = [name for name in surfaces.__all__ if name[0].islower() and name != "from_map"]
    expected = f'a height map, or one of {", ".join(known)}, such as "gaussian(0.3)"'
    try:
        call = ast.parse(text.strip(), mode="eval").body
        named = call.func if isinstance(call, ast.Call) else call
        name = named.id if isinstance(named, ast.Name) else ""
        values = [ast.literal_eval(x) for x in call.args] if isinstance(call, ast.Call) else []
        keywords = {str(k.arg): ast.literal_eval(k.value) for k in call.keywords} if isinstance(call, ast.Call) else {}
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError(f"{text!r:.90}: expected {expected}") from None
    if name not in known:
        raise NotFoundError(f"{text!r:.90}: no such file or surface{suggestion(name, known)}; expected {expected}")
    try:
        return getattr(surfaces, name)(*values, **keywords)
    except TypeError as error:
        raise ParameterError(f"{text!r:.90}: {error}") from None


def _map(path: str, pixel: float | None, unit: str, scale: float) -> Any:
    from ..surfaces import from_map

    if pixel is None and not path.lower().endswith(".sdf"):
        raise ParameterError(
            f"{path!r:.90}: expected --pixel, the distance of its heights, such as --pixel 0.5 --unit um"
        )
    return from_map(path, pixel, unit, scale=scale)


def _facet(text: str) -> Any:
    from .arguments import resolve

    try:
        return float(text)
    except ValueError:
        return resolve(text)


def _numbers(text: str) -> tuple[int, int]:
    try:
        rings, sectors = map(int, text.split(","))
    except ValueError:
        raise ParameterError(
            f"--cells {text!r:.60}: expected two whole numbers, rings and sectors, such as 18,36"
        ) from None
    return rings, sectors


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
