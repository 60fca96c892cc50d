"""`gonio plan`: the directions in which to measure a material."""

from __future__ import annotations

from pathlib import Path

from ..errors import ParameterError
from .command import TypedArguments, command
from .options import TypedMaterial, json_option, material_argument, output_option
from .terminal import print_json, say


@command("planning.plan", "planning.Goniometer", short_help="Plan which directions to measure.")
@material_argument
@output_option("File to write: .csv, to be filled; .json.", required=False)
@json_option
def plan(material: TypedMaterial, output: Path | None, as_json: bool, asked: TypedArguments) -> None:
    """Plan N directions of light and detector that tell most about the numbers of MATERIAL, a model.

    \b
    Examples:
      gonio plan "Lambertian(0.3) + Microfacet(GGX(0.2))" 12 -o plan.csv
      gonio plan fit.json 5 --measured first.csv --in-plane
    """
    check_plan(output)
    planned = asked.call("planning.plan", material.read(), goniometer=asked.call("planning.Goniometer"))
    if output is not None:
        planned.save(output)
    if as_json:
        print_json(planned.to_json())
        return
    say(str(planned))
    if output is not None:
        filled = output.suffix.lower() == ".csv"
        say(f"{output}: fill the empty columns, then gonio fit reads it" if filled else str(output))


def check_plan(output: Path | None) -> None:
    """Raise the errors of a file that a plan cannot be written to."""
    from ..files import target

    if output is not None:
        if output.suffix.lower() not in (".csv", ".json"):
            raise ParameterError(f"{output}: expected a name that ends in .csv or .json")
        target(output)
