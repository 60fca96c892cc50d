"""`gonio plan`: the directions in which to measure a material."""

from __future__ import annotations

import math
import os
from pathlib import Path

import click

from ..errors import ParameterError, visible
from . import completion, options
from .angles import Angle, Angles
from .terminal import echo, print_json

RANGE, STEP = Angles(count=2), Angle(1e-3, 360.0)


@click.command(short_help="Plan which directions to measure.")
@click.argument("material", shell_complete=completion.materials)
@click.argument("n", type=click.IntRange(1, 200))
@options.replace_option
@click.option("--criterion", default="D", show_default=True, help="D: least determinant; A: least relative errors.")
@click.option("--theta-i", type=RANGE, default="0,75", show_default=True, help="Least and largest angle of the light.")
@click.option("--theta-o", type=RANGE, default="0,75", show_default=True, help="Of the detector.")
@click.option(
    "--phi", type=RANGE, default="0,180", show_default=True, help="Of its azimuth from the light's; 180 is forwards."
)
@click.option("--phi-i", type=RANGE, help="Of the light's own azimuth, where the sample is turned.")
@click.option("--step", type=STEP, default="2.5", show_default=True, help="Between polar angles.")
@click.option("--step-phi", type=STEP, default="5", show_default=True, help="Between azimuths.")
@click.option("--in-plane", is_flag=True, help="Only the plane of incidence.")
@click.option(
    "--least-angle",
    type=Angle(0.0, 360.0),
    default="5",
    show_default=True,
    help="Between light and detector, which hide each other.",
)
@click.option("--noise", default=1.0, show_default=True, help="Standard uncertainty of a value [%].")
@click.option("--floor", default=0.0, show_default=True, help="Absolute standard uncertainty [1/sr].")
@click.option("--misfit", default=0.0, show_default=True, help="Error of the model itself, smooth in the angles [%].")
@click.option("--by", help="Parameters that will be fitted, with commas between.  [default: all]")
@click.option("--measured", type=click.Path(path_type=Path), help="File of what was measured already.")
@click.option("--repeats", is_flag=True, help="Directions may be taken more than once.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write: .csv, to be filled; .json.")
@options.json_option
def plan(
    material: str,
    n: int,
    replaced: tuple[str, ...],
    criterion: str,
    theta_i: list[float],
    theta_o: list[float],
    phi: list[float],
    phi_i: list[float] | None,
    step: float,
    step_phi: float,
    in_plane: bool,
    least_angle: float,
    noise: float,
    floor: float,
    misfit: float,
    by: str | None,
    measured: Path | None,
    repeats: bool,
    output: Path | None,
    as_json: bool,
) -> None:
    """Plan N directions of light and detector that tell most about the numbers of MATERIAL, a model.

    \b
    Examples:
      gonio plan "Lambertian(0.3) + Microfacet(GGX(0.2))" 12 -o plan.csv
      gonio plan fit.json 5 --measured first.csv --in-plane
    """
    from ..files import target
    from ..reconstruction.planning.directions import plan as plan_measurement
    from ..reconstruction.planning.goniometer import Goniometer

    if output is not None:
        if output.suffix.lower() not in (".csv", ".json"):
            raise ParameterError(f"{output}: expected a name that ends in .csv or .json")
        target(output)
    arm = Goniometer(
        theta_i=_radians(theta_i),
        theta_o=_radians(theta_o),
        phi=_radians(phi),
        phi_i=None if phi_i is None else _radians(phi_i),
        step_theta=math.radians(step),
        step_phi=math.radians(step_phi),
        in_plane=in_plane,
        least_angle=math.radians(least_angle),
    )
    planned = plan_measurement(
        options.read_material(material, replaced),
        n,
        criterion,
        goniometer=arm,
        noise=noise / 100.0,
        floor=floor,
        misfit=misfit / 100.0,
        by=None if by is None else [name.strip() for name in by.split(",")],
        repeats=repeats,
        measured=None if measured is None else os.fspath(measured),
    )
    if output is not None:
        planned.save(output)
    if as_json:
        print_json(planned.to_json())
        return
    for line in str(planned).split("\n"):
        echo(visible(line))
    if output is not None:
        echo(
            visible(
                f"{output}: fill the empty columns, then gonio fit reads it" if output.suffix == ".csv" else f"{output}"
            )
        )


def _radians(degrees: list[float]) -> tuple[float, float]:
    low, high = map(math.radians, degrees)
    return low, high
