"""`gonio albedo`: albedos with their uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from .angles import Angles
from .options import json_option, material_argument, read_material, replace_option
from .tables import table
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..base.reflectance import Reflectance

ALONE = "interpolation"
"""The assumption about errors of a table that states no uncertainties."""


@click.command(short_help="Quote the albedo of MATERIAL, with its uncertainty.")
@material_argument
@replace_option
@json_option
@click.option("--theta", type=Angles(90.0), default="0,45,75", show_default=True, help="Polar angles of incidence.")
@click.option("--phi", type=Angles(), default="0", show_default=True, help="Azimuths of incidence.")
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
    theta: list[float],
    phi: list[float],
    assumed: tuple[str, ...],
    scale: float | None,
    factor: float,
) -> None:
    """Quote the albedo of MATERIAL: its directional-hemispherical reflectance, by angle of incidence and channel.

    Of a measured table also the uncertainty: by noise, as far as the uncertainties of its values are stated (little if
    their errors are independent, most if one error is common to all), and by interpolation between what was measured.
    """
    m = read_material(material, replaced)
    rows = albedos(m, theta, phi, assumed, scale)
    if as_json:
        print_json(rows)
    else:
        echo(as_text(rows, factor))
        if few := of_few(m):
            echo(few)


def albedos(
    m: Reflectance,
    theta: Sequence[float],
    phi: Sequence[float],
    assumptions: Sequence[str] = (),
    scale: float | None = None,
) -> list[dict[str, Any]]:
    """A row for every direction of incidence [degrees] and channel: the albedo, and of tables the uncertainties.

    "u", "u_noise" and "u_interpolation" hold a number for each assumption; `ALONE` where no uncertainties are stated.
    """
    from ..arrays.kinds import with_channels
    from ..base.angles import direction
    from ..facts.material import ASSUMPTIONS
    from ..integrals.albedo import albedo
    from ..laws._probes import channel
    from ..tables.gridded import Gridded
    from ..uncertainty import with_uncertainty
    from ..uncertainty.table import has_uncertainty

    w = direction(np.radians(theta)[:, None], np.radians(phi)).reshape(-1, 3)
    names: Sequence[str] = ()
    if assumptions or scale is not None or isinstance(m, Gridded):
        names = assumptions or (ASSUMPTIONS if scale is not None or has_uncertainty(m) else (ALONE,))
    quoted = {
        name: with_uncertainty(albedo, m, w, correlation=None if name == ALONE else name, scale=scale) for name in names
    }
    value = with_channels(quoted[names[0]].value if names else albedo(m, w), 1)
    count = value.shape[1]
    channels = list("RGB") if m.channel_names is None and count == 3 else [channel(m, c) for c in range(count)]
    rows = []
    for i, (t, p) in enumerate((t, p) for t in theta for p in phi):
        for c, number in enumerate(value[i]):
            of = {"channel": channels[c]} if count > 1 else {}
            row = {"theta_i": t, "phi_i": p, **of, "albedo": float(number)}
            for u in ("u", "u_noise", "u_interpolation") if names else ():
                row[u] = {name: float(getattr(q, u).reshape(value.shape)[i, c]) for name, q in quoted.items()}
            rows.append(row)
    return rows


def of_few(m: Reflectance) -> str:
    """What there is to say of a measurement in few half-planes, else ""."""
    from ..tables.gridded import Gridded
    from ..tables.half_planes import half_planes, in_words

    return in_words(half_planes(m)) if isinstance(m, Gridded) else ""


def as_text(rows: Sequence[dict[str, Any]], k: float = 1.0) -> str:
    """The same for people; uncertainties are expanded by the coverage factor k."""
    from ..uncertainty.quoted import components, rounded

    first = rows[0]
    names = list(first.get("u", {}))
    header = ["theta_i", "phi_i", *(["channel"] if "channel" in first else [])]
    header += [f"albedo ± U (k = {k:g}), {_of(name)}" for name in names] or ["albedo"]
    cells = []
    for row in rows:
        place = [f"{row['theta_i']:g}°", f"{row['phi_i']:g}°", *([row["channel"]] if "channel" in row else [])]
        quoted = []
        for name in names:
            text = rounded(row["albedo"], k * row["u"][name], " ± ")
            if name != ALONE:
                text += f" ({components(k, row['u_noise'][name], row['u_interpolation'][name])})"
            quoted.append(text)
        cells.append([*place, *(quoted or [f"{row['albedo']:.4f}"])])
    return table(header, cells)


def _of(assumption: str) -> str:
    return "by interpolation alone" if assumption == ALONE else f"{assumption} errors"
