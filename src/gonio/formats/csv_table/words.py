"""The words of the table: keys of options, names of columns of values, and the first line of our own files."""

from __future__ import annotations

import re

from ...tables.angle_systems import AZIMUTHS
from .._laboratory.names import OWN

OPTIONS = (
    "angle_unit",
    "mirrored",
    "interpolation",
    "outside",
    "isotropic",
    "phi_i",
    *(f"period_{n}" for n in AZIMUTHS),
)


MARK = "# gonio measurement"
"""The first line of a file of `write`."""

VALUE = re.compile(rf"(u_)?({OWN})(?:_(.+))?", re.IGNORECASE)
