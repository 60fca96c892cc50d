"""ASTM E1392 text: rows of angles and BRDF, as Cornell University published its measurements.

Lines `KEY value`, of which the last is `VARS` with the names of the columns, separated by commas: `theta_i`, `phi_i`,
`theta_s`, `phi_s` [rad] in any order (a missing `phi_i` is 0), then channels: `R,G,B`, `X,Y,Z`, wavelengths like
`400nm`, or one name such as `Integrated 300-700nm`. Then `NUM_POINTS` rows of as many numbers, separated by commas.
theta_s, phi_s is the scattered direction, wo. The standard was not seen: this follows libbsdf's AstmReader and ALTA's
astm.cpp. Checked against its own generator only.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..base.reflectance import Reflectance
from ..errors import FormatError, ParameterError
from ..models.sheet import Sheet
from ..tables.gridded import Gridded
from . import _layout
from ._reading import channel_words, plain_text
from ._rows import direction_pairs
from ._rows.pairs_of_material import Resolution, rows_of
from ._sides import Side, about_of

NAME = "ASTM"
SUFFIXES = (".astm",)
DESCRIPTION = "rows of angles and BRDF with KEY value lines (ASTM E1392, Cornell)"
ORACLE = "own generator only"
TRANSMITS = True

LAYOUT = _layout.columns("theta_i", "phi_i", "theta_s", "phi_s", unit="rad")
ANGLES = tuple(LAYOUT.axes)

_VARS = re.compile(r"^[ \t]*VARS[ \t](?=.*theta_i)(?=.*theta_s)", re.IGNORECASE | re.MULTILINE)


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: it has a line VARS with the names of angles."""
    return bool(_VARS.search(plain_text.start(head)))


def read(path: Path, side: Side = None) -> Gridded | Sheet:
    """The measurement in a file: a grid if its rows fill one, else `Scattered`; or a `Sheet` of these.

    Rows of the other side, and of transmission, stay in `about["other_pairs"]` to be written again, unless they are
    read too. Raises FormatError, with the line, for a damaged file.
    """
    lines = plain_text.read(path)
    about: dict[str, str] = {}
    names: list[str] = []
    count: int | None = None
    while not names:
        key, value = [*lines.take("a line VARS with the names of the columns").split(None, 1), ""][:2]
        if key.upper() == "VARS":
            names = [name.strip() for name in value.split(",")]
        elif key.upper() == "NUM_POINTS":
            count = lines.count(value, "the number of rows")
        else:
            about[key] = value
    columns = {name.lower(): k for k, name in enumerate(names) if name.lower() in ANGLES}
    values = [k for k, name in enumerate(names) if name.lower() not in ANGLES]
    if len(columns) + len(values) != len(names) or not {*ANGLES} - {"phi_i"} <= columns.keys() or not values:
        raise lines.fault(", ".join(names), f"{', '.join(ANGLES)}, each once, and at least one channel")
    rows = lines.rows(len(names))
    if count not in (None, len(rows)):
        raise FormatError(f"{path}: NUM_POINTS says {count} rows, got {len(rows)}; fetch it again or correct it")
    angles = [rows[:, columns[name]] if name in columns else np.zeros(len(rows)) for name in ANGLES]
    channels = channel_words.of_names([names[k] for k in values])
    pairs = direction_pairs.Pairs(LAYOUT.pairs(np.stack(angles, axis=1)), rows[:, values], channels=channels)
    if len(channels) == 1 and isinstance(channels[0], str):
        about["channel"] = channels[0]
        pairs = pairs._replace(values=rows[:, values[0]], channels=None)
    return direction_pairs.material(pairs, str(path), about, side)


def write(m: Reflectance, path: Path, resolution: Resolution = None) -> None:
    """Write the BRDF at the pairs of a measurement; for others, and where `resolution` is given, at a grid of angles.

    Lost: uncertainties, and nodes without data. Values along the surface (a cosine of 0) too, if they are not BRDFs.
    Raises ParameterError for delta lobes, maps, and channels whose names have commas.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.astm", resolution=(4, 4, 6))
    >>> print(gn.load("white.astm").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    pairs = rows_of(m, resolution)
    about = {str(k): str(v) for k, v in about_of(m).items() if k != "other_pairs"}
    names = [about.pop("channel", "BRDF")] if pairs.channels is None else [*map(channel_words.name_of, pairs.channels)]
    if any(re.search(r"[,\r\n]", name) for name in names):
        raise ParameterError(f"channels {names}: expected names without commas and line ends; rename them")
    words = [(k, v) for k, v in about.items() if k.upper() not in ("VARS", "NUM_POINTS")]
    header = [f"{k} {v}\n" for k, v in words if re.fullmatch(r"\S+", k) and "\n" not in v]
    header.append(f"NUM_POINTS {len(pairs.angles)}\nVARS {','.join([*ANGLES, *names])}\n")
    rows = np.concatenate([LAYOUT.columns(pairs.angles), pairs.columns()], axis=1)
    plain_text.write(path, header, rows, ",")
