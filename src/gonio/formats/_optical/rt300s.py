"""Tables of the RT-300S goniophotometer (J&C Technology): how its arms count angles, in whatever file they come.

Incidence I is theta_i. The receiver turns in a plane by Receive R (or Polar) from the normal, to either side; that
plane is turned about the normal by Azimuth A. theta_o = |R|, and phi = phi_o - phi_i is A + 270 degrees for R above 0
and A + 90 degrees below it, so that A = -90 is the plane of incidence and there R = +I the mirror direction.

Values are RT = pi f cos(theta_o), as the laboratory that published such files converts them; gonio keeps RT / pi,
"brdf * cos(theta_o)". Nothing is subtracted or masked: a measurement without light (blank), and the directions in which
the receiver shades the sample (R near -I about A = +-90), are for the user to take care of. The mean stands for
directions that were measured several times: both ends of the range of azimuths, and the normal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import FormatError
from ...tables.gridded import Gridded
from .angle_tables import from_rows


class Scan(NamedTuple):
    """Values (azimuth, receive) for one angle of incidence; angles in degrees."""

    name: str
    incidence: float
    azimuth: Sequence[float]
    receive: Sequence[float]
    values: np.ndarray


def measured(path: Path, incidence: Any, azimuth: Any, receive: Any, values: Any, about: dict[str, Any]) -> Gridded:
    """The reflectance of points (n,) in the instrument's angles [degrees]; FormatError where these are too large."""
    i, a, r, v = (np.asarray(x, dtype=float) for x in (incidence, azimuth, receive, values))
    if not np.isfinite(v).any():
        raise FormatError(f"{path}: no measured points, expected angles and values")
    within = (i >= 0.0) & (i <= 90.0) & (np.abs(r) <= 90.0) & (np.abs(a) <= 360.0)
    if not within.all():
        k = int(np.flatnonzero(~within)[0])
        raise FormatError(
            f"{path}: point {k + 1} has Incidence {i[k]:g}, Azimuth {a[k]:g}, Receive {r[k]:g}, "
            f"expected 0 to 90, -360 to 360 and -90 to 90 degrees of reflection"
        )
    phi = np.where(r < 0.0, a + 90.0, a + 270.0)
    return from_rows(
        i, 0.0 * i, np.abs(r), phi, v / math.pi, quantity="brdf * cos(theta_o)", path=str(path), about=about
    )


def of_scans(path: Path, scans: Sequence[Scan], measurement: int) -> Gridded:
    """The reflectance of scans of several angles of incidence.

    Where angles of incidence are repeated, another measurement begins; `measurement` says which one, -1 is the last.
    """
    if not scans:
        raise FormatError(f"{path}: no measured points, expected angles and values")
    sets: list[list[Scan]] = [[]]
    for scan in scans:
        if any(scan.incidence == other.incidence for other in sets[-1]):
            sets.append([])
        sets[-1].append(scan)
    if not -len(sets) <= measurement < len(sets):
        raise FormatError(f"{path}: holds {len(sets)} measurements, and measurement={measurement} was asked for")
    chosen = sets[measurement]
    grids = [np.meshgrid([s.incidence], s.azimuth, s.receive, indexing="ij") for s in chosen]
    incidence, azimuth, receive = np.concatenate([np.reshape(grid, (3, -1)) for grid in grids], axis=1)
    values = np.concatenate([s.values.reshape(-1) for s in chosen])
    about = {"samples": tuple(s.name for s in chosen), "measurements": len(sets)}
    return measured(path, incidence, azimuth, receive, values, {**about, "measurement": measurement % len(sets)})
