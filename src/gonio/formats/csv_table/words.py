"""The words of the table: keys of options, names of columns of values, and the first line of our own files."""

from __future__ import annotations

import re

from ...tables.angle_systems import AZIMUTHS

OPTIONS = (
    "angle_unit",
    "mirrored",
    "interpolation",
    "outside",
    "isotropic",
    "phi_i",
    *(f"period_{n}" for n in AZIMUTHS),
)


MOST = 2**16
"""Largest number of columns."""

MARK = "# gonio measurement"
"""The first line of a file of `write`."""

VALUE = re.compile(r"(u_)?(f_cos_i|f_cos|f|brdf|dsf|brf)(?:_(.+))?", re.IGNORECASE)
KEY = re.compile(r"#\s*(\w[^:]*):\s*(.*)")
