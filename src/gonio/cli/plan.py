"""`gonio plan`: the directions in which to measure a material."""

from __future__ import annotations

import math
import os
from pathlib import Path

import click

from ..errors import ParameterError, visible
from . import options
from .terminal import echo, print_json


@click.command(short_help="Plan which directions to measure.")
@click.argument("material")
@click.argument("n", type=click.IntRange(1, 200))
@options.replace_option
@click.option("--criterion", default="D", show_default=True, help="D: least determinant; A: least relative errors.")
@click.option("--theta-i", default="0,75", show_default=True, help="Least and largest angle of the light [degrees].")
@click.option("--theta-o", default="0,75", show_default=True, help="Of the detector.")
@click.option("--phi", default="0,180", show_default=True, help="Of its azimuth from the light's; 180 is forwards.")
@click.option("--phi-i", help="Of the light's own azimuth, where the sample is turned.")
@click.option("--step", default=2.5, show_default=True, help="Between polar angles [degrees].")
@click.option("--step-phi", default=5.0, show_default=True, help="Between azimuths [degrees].")
@click.option("--in-plane", is_flag=True, help="Only the plane of incidence.")
@click.option(
    "--least-angle", default=5.0, show_default=True, help="Between light and detector, which hide each other."
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
    theta_i: str,
    theta_o: str,
    phi: str,
    phi_i: str | None,
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
    from ..planning.directions import plan as plan_measurement
    from ..planning.goniometer import Goniometer

    if output is not None:
        if output.suffix.lower() not in (".csv", ".json"):
            raise ParameterError(f"{output}: expected a name that ends in .csv or .json")
        target(output)
    arm = Goniometer(
        theta_i=_range("--theta-i", theta_i),
        theta_o=_range("--theta-o", theta_o),
        phi=_range("--phi", phi),
        phi_i=None if phi_i is None else _range("--phi-i", phi_i),
        step_theta=_radians("--step", step),
        step_phi=_radians("--step-phi", step_phi),
        in_plane=in_plane,
        least_angle=_radians("--least-angle", least_angle, least=0.0),
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


def _radians(option: str, degrees: float, least: float = 1e-3) -> float:
    if not least <= degrees <= 360.0:
        raise ParameterError(f"{option} {degrees:g}: expected degrees from {least:g} to 360")
    return math.radians(degrees)


def _range(option: str, text: str) -> tuple[float, float]:
    """Two angles [rad] from two in degrees."""
    try:
        low, high = (math.radians(float(part)) for part in text.split(","))
    except ValueError:
        raise ParameterError(f"{option} {text!r:.40}: expected two angles in degrees, such as 0,75") from None
    return low, high
