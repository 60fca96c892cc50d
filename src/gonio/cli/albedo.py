"""`gonio albedo`: albedos with their uncertainties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from ..errors import ParameterError
from .options import json_option, material_argument, read_material, replace_option
from .tables import table
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..base.reflectance import Reflectance


@click.command(short_help="Quote the albedo of MATERIAL, with its uncertainty.")
@material_argument
@replace_option
@json_option
@click.option("--theta", default="0,45,75", show_default=True, help="Polar angles of incidence [degrees].")
@click.option("--phi", default="0", show_default=True, help="Azimuths of incidence [degrees].")
@click.option(
    "--uncertainty",
    "assumed",
    type=click.Choice(["independent", "common", "channel"]),
    multiple=True,
    help="What the errors of the values are taken to be; may be repeated.  [default: independent, common]",
)
@click.option("--scale", type=float, metavar="U", help="Relative standard uncertainty of all values together.")
@click.option("-k", "factor", default=1.0, show_default=True, help="Coverage factor of what is printed.")
def albedo(
    material: str,
    replaced: tuple[str, ...],
    as_json: bool,
    theta: str,
    phi: str,
    assumed: tuple[str, ...],
    scale: float | None,
    factor: float,
) -> None:
    """Quote the albedo of MATERIAL: its directional-hemispherical reflectance, by angle of incidence and channel.

    Of a measurement that states the uncertainty of its values also the uncertainty that follows: little if their errors
    are independent, most if one error is common to all.
    """
    at = angles(theta, "theta", below=90.0), angles(phi, "phi")
    rows = albedos(read_material(material, replaced), *at, assumed, scale)
    if as_json:
        print_json(rows)
    else:
        echo(as_text(rows, factor))


def angles(text: str, name: str, below: float = math.inf) -> list[float]:
    """Angles [degrees] of a list such as "0,8,45"."""
    try:
        degrees = [float(part) for part in text.split(",")]
    except ValueError:
        degrees = [math.nan]
    if not all(math.isfinite(x) and abs(x) < below and (x >= 0.0 or below == math.inf) for x in degrees):
        limits = "" if below == math.inf else f" of at least 0 and below {below:g}"
        raise ParameterError(f"--{name} {text!r:.60}: expected angles in degrees{limits}, such as 0,8,45")
    return degrees


def albedos(
    m: Reflectance,
    theta: Sequence[float],
    phi: Sequence[float],
    assumptions: Sequence[str] = (),
    scale: float | None = None,
) -> list[dict[str, Any]]:
    """A row for every direction of incidence [degrees] and channel: the albedo, and u under each assumption."""
    from ..arrays.kinds import with_channels
    from ..base.angles import direction
    from ..integrals.albedo import albedo
    from ..laws._probes import channel
    from ..report.facts import ASSUMPTIONS
    from ..uncertainty import with_uncertainty
    from ..uncertainty.table import has_uncertainty

    w = direction(np.radians(theta)[:, None], np.radians(phi)).reshape(-1, 3)
    uncertain = assumptions or scale is not None or has_uncertainty(m)
    names = (assumptions or ASSUMPTIONS) if uncertain else ()
    quoted = {name: with_uncertainty(albedo, m, w, correlation=name, scale=scale) for name in names}
    value = with_channels(quoted[names[0]].value if names else albedo(m, w), 1)
    count = value.shape[1]
    channels = list("RGB") if m.channel_names is None and count == 3 else [channel(m, c) for c in range(count)]
    rows = []
    for i, (t, p) in enumerate((t, p) for t in theta for p in phi):
        for c, number in enumerate(value[i]):
            u = {name: float(q.u.reshape(value.shape)[i, c]) for name, q in quoted.items()}
            of = {"channel": channels[c]} if count > 1 else {}
            rows.append({"theta_i": t, "phi_i": p, **of, "albedo": float(number), **({"u": u} if u else {})})
    return rows


def as_text(rows: Sequence[dict[str, Any]], k: float = 1.0) -> str:
    """The same for people; uncertainties are expanded by the coverage factor k."""
    from ..uncertainty.quoted import rounded

    first = rows[0]
    names = list(first.get("u", {}))
    header = ["theta_i", "phi_i", *(["channel"] if "channel" in first else [])]
    header += [f"albedo ± U (k = {k:g}), {name} errors" for name in names] or ["albedo"]
    cells = []
    for row in rows:
        place = [f"{row['theta_i']:g}°", f"{row['phi_i']:g}°", *([row["channel"]] if "channel" in row else [])]
        quoted = [rounded(row["albedo"], k * row["u"][name], " ± ") for name in names]
        cells.append([*place, *(quoted or [f"{row['albedo']:.4f}"])])
    return table(header, cells)
