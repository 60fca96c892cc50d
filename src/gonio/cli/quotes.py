"""What `gonio albedo` prints: albedos with their uncertainties, as data and as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..integrals.albedo import albedo
from ..laws._probes import channel
from ..uncertainty import Quoted, with_uncertainty
from ..uncertainty.quoted import rounded
from ..uncertainty.table import has_uncertainty
from .listing import table

ASSUMPTIONS = ("independent", "common")
"""What errors are taken to be where nothing else is asked for: the two ends of what may be."""


def angles(text: str, name: str, below: float = math.inf) -> list[float]:
    """Angles [degrees] of a list such as "0,8,45"."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = [math.nan]
    if not all(math.isfinite(x) and abs(x) < below and (x >= 0.0 or below == math.inf) for x in found):
        limits = "" if below == math.inf else f" of at least 0 and below {below:g}"
        raise ParameterError(f"--{name} {text!r:.60}: expected angles in degrees{limits}, such as 0,8,45")
    return found


def albedos(
    m: Reflectance,
    theta: Sequence[float],
    phi: Sequence[float],
    assumptions: Sequence[str] = (),
    scale: float | None = None,
) -> list[dict[str, Any]]:
    """A row for every direction of incidence [degrees] and channel: the albedo, and u under each assumption."""
    w = direction(np.radians(theta)[:, None], np.radians(phi)).reshape(-1, 3)
    found: dict[str, Quoted] = {}
    if assumptions or scale is not None or has_uncertainty(m):
        found = {
            name: with_uncertainty(albedo, m, w, correlation=name, scale=scale) for name in assumptions or ASSUMPTIONS
        }
    value = next(iter(found.values())).value if found else albedo(m, w)
    if value.ndim == 1:
        value = value[:, None]
    count = value.shape[1]
    names = list("RGB") if m.channel_names is None and count == 3 else [channel(m, c) for c in range(count)]
    rows = []
    for i, (t, p) in enumerate((t, p) for t in theta for p in phi):
        for c, number in enumerate(value[i]):
            u = {name: float(q.u.reshape(value.shape)[i, c]) for name, q in found.items()}
            of = {"channel": names[c]} if len(names) > 1 else {}
            rows.append({"theta_i": t, "phi_i": p, **of, "albedo": float(number), **({"u": u} if u else {})})
    return rows


def as_text(rows: Sequence[dict[str, Any]], k: float = 1.0) -> str:
    """The same for people; uncertainties are expanded by the coverage factor k."""
    first = rows[0]
    names = list(first.get("u", {}))
    header = ["theta_i", "phi_i", *(["channel"] if "channel" in first else [])]
    header += [f"albedo ± U (k = {k:g}), {name} errors" for name in names] or ["albedo"]
    cells = []
    for row in rows:
        own = [f"{row['theta_i']:g}°", f"{row['phi_i']:g}°", *([row["channel"]] if "channel" in row else [])]
        quoted = [rounded(row["albedo"], k * row["u"][name], " ± ") for name in names]
        cells.append([*own, *(quoted or [f"{row['albedo']:.4f}"])])
    return table(header, cells)
