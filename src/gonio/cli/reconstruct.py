"""`gonio reconstruct`: a whole table from values at few pairs of directions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import ParameterError
from .command import TypedArguments, command
from .options import json_option, output_option
from .plan import check_plan
from .terminal import print_json, say


@command(
    *("reconstruction.reconstruct", "planning.plan_table", "planning.Goniometer"),
    *("reconstruction.reflectance_basis", "save"),
    options={"count": "--plan", "materials": "-b --basis"},
    repeated=("materials",),
    short_help="Make a whole table of few values.",
)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@output_option("File to write: the table; with --plan, .csv or .json.", required=False)
@json_option
def reconstruct(file: Path | None, output: Path | None, as_json: bool, asked: TypedArguments) -> None:
    """Reconstruct a whole isotropic BRDF, with its uncertainty, from the few values of FILE.

    What is not measured follows from what the materials of a basis have in common. With --plan: the directions to
    measure for it; with FILE too, those beside it.

    \b
    Examples:
      gonio reconstruct --plan 10 -o plan.csv
      gonio reconstruct plan.csv -o table.nc
    """
    from ..formats import save, target, writer

    planned = asked.of("planning.plan_table")
    if file is None and "count" not in planned:
        raise ParameterError("gonio reconstruct: expected a FILE of values, or --plan N")
    if "count" in planned:
        check_plan(output)
    elif output is not None:
        target(writer(output, **asked.of("save")), output)
    basis = asked.call("reconstruction.reflectance_basis")
    reconstructed = None if file is None else asked.call("reconstruction.reconstruct", str(file), basis)
    numbers: Any = reconstructed
    if "count" in planned:
        goniometer = asked.call("planning.Goniometer")
        numbers = asked.call("planning.plan_table", basis=basis, goniometer=goniometer, measured=reconstructed)
        if output is not None:
            numbers.save(output)
    elif reconstructed is not None and output is not None:
        save(reconstructed.reflectance, output, **asked.of("save"))
    if as_json:
        print_json(numbers.to_json())
        return
    say(str(numbers))
    if output is not None:
        say(str(output))
