"""`gonio reconstruct`: a whole table from values at few pairs of directions."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import click

from ..errors import ParameterError, visible
from . import options
from .terminal import echo, print_json


@click.command(short_help="Make a whole table of few values.")
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option("--plan", "count", type=click.IntRange(1, 200), help="Plan so many directions instead, best for a table.")
@click.option(
    "-b",
    "--basis",
    multiple=True,
    metavar="MATERIAL",
    help="A material to learn from, four at least; may be repeated.  [default: the built-in fits of measurements]",
)
@click.option("--noise", default=1.0, show_default=True, help="Standard uncertainty of values without one [%].")
@click.option("--floor", default=0.0, show_default=True, help="Absolute standard uncertainty [1/sr].")
@options.theta_max_option("Rows beyond this angle are left out.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File to write: the table; with --plan, .csv or .json."
)
@click.option("--format", "format_", help="Format of the table.  [default: by the suffix]")
@options.json_option
def reconstruct(
    file: Path | None,
    count: int | None,
    basis: tuple[str, ...],
    noise: float,
    floor: float,
    theta_max: float,
    output: Path | None,
    format_: str | None,
    as_json: bool,
) -> None:
    """Reconstruct a whole isotropic BRDF, with its uncertainty, from the few values of FILE.

    What is not measured follows from what the materials of a basis have in common. With --plan: the directions to
    measure for it; with FILE too, those beside it.

    \b
    Examples:
      gonio reconstruct --plan 10 -o plan.csv
      gonio reconstruct plan.csv -o table.nc
    """
    from ..files import target
    from ..formats import save, writer
    from ..formats import target as target_of
    from ..reconstruction import reconstruct as tables

    if file is None and count is None:
        raise ParameterError("gonio reconstruct: expected a FILE of values, or --plan N")
    if output is not None:
        if count is None:
            target_of(writer(output, format_), output)
        elif output.suffix.lower() not in (".csv", ".json"):
            raise ParameterError(f"{output}: expected a name that ends in .csv or .json")
        else:
            target(output)
    learnt = tables.reflectance_basis(list(basis)) if basis else tables.reflectance_basis()
    found = None
    if file is not None:
        found = tables.reconstruct(
            os.fspath(file), learnt, noise=noise / 100.0, floor=floor, theta_max=math.radians(theta_max)
        )
    numbers: dict[str, Any]
    if count is not None:
        planned = tables.plan_table(count, learnt, noise=noise / 100.0, floor=floor, measured=found)
        if output is not None:
            planned.save(output)
        told, numbers = str(planned), planned.to_json()
    elif found is not None:
        if output is not None:
            save(found.reflectance, output, format_)
        told, numbers = str(found), found.to_json()
    if as_json:
        print_json(numbers)
        return
    for line in told.split("\n"):
        echo(visible(line))
    if output is not None:
        echo(visible(str(output)))
