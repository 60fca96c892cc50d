"""Albedos by direction of incidence and channel, with their uncertainties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Annotated, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.channel_names import channel
from ..base.reflectance import Reflectance
from ..declared.arguments import BELOW_HORIZON, Declared
from ..integrals.albedo import albedo
from ..tables.gridded import Gridded
from ..tables.half_planes import half_planes
from ..tables.half_planes import in_words as half_planes_in_words
from .material import ASSUMPTIONS

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
    from ..uncertainty import with_uncertainty  # late: SciPy takes 0.4 s, and formulas need none
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


def _degrees(angle: float) -> float:
    """A typed angle, without what rounding adds."""
    return float(f"{math.degrees(angle):.12g}")


def of_few(m: Reflectance) -> str:
    """What there is to say of a measurement in few half-planes, else ""."""
    return half_planes_in_words(half_planes(m)) if isinstance(m, Gridded) else ""


def in_words(row: dict[str, Any], assumption: str, k: float) -> str:
    """The albedo of a row with its expanded uncertainty under an assumption, and its components."""
    from ..uncertainty.quoted import components, rounded

    text = rounded(row["albedo"], k * row["u"][assumption], " ± ")
    if assumption == ALONE:
        return text
    return f"{text} ({components(k, row['u_noise'][assumption], row['u_interpolation'][assumption])})"
