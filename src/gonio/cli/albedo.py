"""`gonio albedo`: albedos with their uncertainties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Annotated, Any

import click
import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import BELOW_HORIZON, Declared
from .command import Asked, command
from .options import Material, json_option, material_argument
from .tables import table
from .terminal import echo, print_json

ALONE = "interpolation"
"""The assumption about errors of a table that states no uncertainties."""


def albedos(
    m: Reflectance,
    theta_i: Annotated[Sequence[float], Declared("polar angles of incidence", 0.0, BELOW_HORIZON, "rad")] = tuple(
        map(math.radians, (0.0, 45.0, 75.0))
    ),
    phi_i: Annotated[Sequence[float], Declared("azimuths of incidence", unit="rad")] = (0.0,),
    uncertainty: Annotated[
        Sequence[str],
        Declared(
            "what the errors of the values are taken to be",
            words=("independent", "common", "channel"),
            usual="independent,common",
        ),
    ]
    | None = None,
    **options: Any,
) -> list[dict[str, Any]]:
    """A row for every direction of incidence and channel: the albedo, and of tables the uncertainties, by the options
    of `with_uncertainty`.

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

    w = direction(np.array(theta_i)[:, None], np.array(phi_i)).reshape(-1, 3)
    names: Sequence[str] = ()
    if uncertainty or "scale" in options or isinstance(m, Gridded):
        names = uncertainty or (ASSUMPTIONS if "scale" in options or has_uncertainty(m) else (ALONE,))
    quoted = {
        name: with_uncertainty(albedo, m, w, correlation=None if name == ALONE else name, **options) for name in names
    }
    value = with_channels(quoted[names[0]].value if names else albedo(m, w), 1)
    count = value.shape[1]
    channels = list("RGB") if m.channel_names is None and count == 3 else [channel(m, c) for c in range(count)]
    rows = []
    for i, (t, p) in enumerate(product(map(_degrees, theta_i), map(_degrees, phi_i))):
        for c, number in enumerate(value[i]):
            of = {"channel": channels[c]} if count > 1 else {}
            row = {"theta_i": t, "phi_i": p, **of, "albedo": float(number)}
            for u in ("u", "u_noise", "u_interpolation") if names else ():
                row[u] = {name: float(getattr(q, u).reshape(value.shape)[i, c]) for name, q in quoted.items()}
            rows.append(row)
    return rows


@command(albedos, "with_uncertainty", short_help="Quote the albedo of MATERIAL, with its uncertainty.")
@material_argument
@json_option
@click.option("-k", "factor", metavar="X", default=1.0, help="Coverage factor of what is printed.  [default: 1]")
def albedo(material: Material, as_json: bool, factor: float, asked: Asked) -> None:
    """Quote the albedo of MATERIAL: its directional-hemispherical reflectance, by angle of incidence and channel.

    Of a measured table also the uncertainty: by noise, as far as the uncertainties of its values are stated (little if
    their errors are independent, most if one error is common to all), and by interpolation between what was measured.
    """
    m = material.read()
    rows = albedos(m, **asked.of("albedos"), **asked.of("with_uncertainty"))
    if as_json:
        print_json(rows)
    else:
        echo(as_text(rows, factor))
        if few := of_few(m):
            echo(few)


def _degrees(angle: float) -> float:
    """A typed angle, without what rounding adds."""
    return float(f"{math.degrees(angle):.12g}")


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
