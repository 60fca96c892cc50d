"""`gonio albedo`: albedos with their uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..declared.arguments import ABOVE_ZERO, Declared
from ..facts.public import public
from .command import TypedArguments, command, option
from .options import TypedMaterial, json_option, material_argument
from .tables import table
from .terminal import echo, print_json


@command("facts.albedos.albedos", "with_uncertainty", short_help="Quote the albedo of MATERIAL, with its uncertainty.")
@material_argument
@json_option
@option("-k", "factor", kind=float, means=Declared("coverage factor of what is printed", ABOVE_ZERO, 1e3), default=1.0)
def albedo(material: TypedMaterial, as_json: bool, factor: float, asked: TypedArguments) -> None:
    """Quote the albedo of MATERIAL: its directional-hemispherical reflectance, by angle of incidence and channel.

    Of a measured table also the uncertainty: by noise, as far as the uncertainties of its values are stated (little if
    their errors are independent, most if one error is common to all), and by interpolation between what was measured.
    """
    m = material.read()
    rows = asked.call("facts.albedos.albedos", m, **asked.of("with_uncertainty"))
    if as_json:
        print_json(rows)
    else:
        echo(as_text(rows, factor))
        if few := public("facts.albedos.of_few")(m):
            echo(few)


def as_text(rows: Sequence[dict[str, Any]], k: float = 1.0) -> str:
    """The same for people; uncertainties are expanded by the coverage factor k."""
    from ..facts.albedos import ALONE, in_words

    first = rows[0]
    names = list(first.get("u", {}))
    header = ["theta_i", "phi_i", *(["channel"] if "channel" in first else [])]
    of = {name: "by interpolation alone" if name == ALONE else f"{name} errors" for name in names}
    header += [f"albedo ± U (k = {k:g}), {of[name]}" for name in names] or ["albedo"]
    cells = []
    for row in rows:
        place = [f"{row['theta_i']:g}°", f"{row['phi_i']:g}°", *([row["channel"]] if "channel" in row else [])]
        quoted = []
        for name in names:
            quoted.append(in_words(row, name, k))
        cells.append([*place, *(quoted or [f"{row['albedo']:.4f}"])])
    return table(header, cells)
