"""pab-opto text: scattered light of one incident direction, rows of theta, phi and DSF or BSDF.

Lines that begin with `#` come first. Of these, `#intheta` and `#inphi` or `#incident_angle theta phi` say where the
light came from, `#format: theta phi DSF` (or BSDF, BRDF, BTDF) what the rows hold, `#colorimetry: CIE-XYZ` that there
are three values, `#upphi` which azimuth is up on the sample. DSF is BSDF times the cosine of the scattered direction.
All angles are in degrees, both directions point away from the sample, and theta above 90 is behind it; azimuths are
kept as they are, whatever `#upphi` says. This follows what Radiance's pabopto2bsdf and pabopto2xyz read. Checked
against its own generator only.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..models.sheet import Sheet
from ..numerics.unique_rows import unique_rows
from ..tables.gridded import Gridded
from . import _layout
from ._reading import plain_text
from ._rows import direction_pairs
from ._rows.direction_pairs import LEVEL, TURNS
from ._rows.pairs_of_material import Resolution, rows_of
from ._sides import Side, about_of, is_part

NAME = "pab-opto"
SUFFIXES = (".txt", ".dat")
SHARED_SUFFIX = True
DESCRIPTION = "rows of theta, phi and DSF or BSDF of one incident direction (pab goniophotometers, Radiance)"
ORACLE = "own generator only"
TRANSMITS = True

LAYOUT = _layout.columns("intheta", "inphi", "theta", "phi")
"""The first two are those of the whole file."""

QUANTITIES = {"dsf": "brdf * cos(theta_o)", "bsdf": "brdf", "brdf": "brdf", "btdf": "brdf"}
CHANNELS = ("X", "Y", "Z")

_FORMAT = re.compile(r"^[ \t]*#[ \t]*format:[ \t]*theta[ \t,]+phi[ \t,]+\S", re.IGNORECASE | re.MULTILINE)
_KEY = re.compile(r"#\s*(\w+)\s*:?\s*(.*)")


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: it says `#format: theta phi ...`."""
    return bool(_FORMAT.search(plain_text.start(head)))


def read(
    path: Path,
    side: Side = None,
    more: Annotated[Sequence[Path] | None, Declared("files of other incident directions, read with this one")] = None,
) -> Gridded | Sheet:
    """The measurement in a file, and in `more` files: a grid if its rows fill one, else `Scattered`; or a `Sheet`.

    Rows of another `side`, and of transmission, are kept in `about["other_pairs"]` to be written again, unless they are
    read too. Raises FormatError where a file is damaged, with the line, or holds something else than the first.
    """
    pairs, about = _one(path)
    for other in more or ():
        others, _ = _one(other)
        if (others.quantity, others.channels) != (pairs.quantity, pairs.channels):
            raise FormatError(f"{other}: holds {others.quantity} {others.channels or ''}, expected the same as {path}")
        pairs = direction_pairs.together([pairs, others])
    return direction_pairs.material(pairs, str(path), about, side)


def _one(path: str | os.PathLike) -> tuple[direction_pairs.Pairs, dict[str, Any]]:
    """The pairs of one file, of all sides, and the entries of its head."""
    lines = plain_text.read(path)
    about: dict[str, Any] = {}
    numbers: dict[str, list[float]] = {}
    quantity = ""
    while (line := lines.peek()) is not None and line.startswith("#"):
        lines.next()
        key, text = match.groups() if (match := _KEY.match(line)) else ("", "")
        if key.lower() in ("intheta", "inphi", "incident_angle"):
            numbers[key.lower()] = lines.floats(text, "an angle in degrees")
        elif key.lower() == "format":
            quantity = _quantity(lines, text)
        elif key and key.lower() != "datapoints_in_file":
            about[key] = text
    if not quantity:
        raise FormatError(f"{path}: has no line #format: theta phi DSF or BSDF; this is no BSDF measurement")
    theta_i, phi_i = _incident(lines, numbers)
    xyz = about.get("colorimetry", "").strip().upper() == "CIE-XYZ"
    rows = lines.rows(5 if xyz else 3, expected="numbers: theta, phi and values")
    angles = LAYOUT.pairs(np.insert(rows[:, :2], [0, 0], [theta_i, phi_i], axis=1))
    values, channels = (rows[:, 2:], CHANNELS) if xyz else (rows[:, 2], None)
    return direction_pairs.Pairs(angles, values, quantity, channels=channels), about


def _quantity(lines: plain_text.Lines, text: str) -> str:
    words = plain_text.split(text.lower())
    if len(words) < 3 or words[:2] != ["theta", "phi"] or words[2] not in QUANTITIES:
        raise lines.fault(text, "#format: theta phi, and DSF, BSDF, BRDF or BTDF; other quantities are no reflectances")
    return QUANTITIES[words[2]]


def _incident(lines: plain_text.Lines, numbers: dict[str, list[float]]) -> tuple[float, float]:
    """theta and phi [degrees] of the incident direction; where it is said twice, both must agree."""
    both = numbers.get("incident_angle", [])
    single = [x for key in ("intheta", "inphi") for x in numbers.get(key, [])]
    pairs = [x for x in (both, single) if x]
    if not pairs or any(len(x) != 2 for x in pairs):
        rule = "expected #intheta and #inphi, or #incident_angle with two numbers"
        raise FormatError(f"{lines.path}: no incident direction, {rule}")
    if not np.allclose(pairs[0], pairs[-1], atol=0.06) or not np.isfinite(pairs).all():
        raise FormatError(f"{lines.path}: #incident_angle is {both}, but #intheta, #inphi are {single}")
    theta, phi = pairs[-1]
    return theta, phi


def write(
    m: Reflectance,
    path: Path,
    incident: Annotated[
        tuple[Annotated[float, Declared("", 0.0, math.pi, "rad")], float] | None,
        Declared("theta_i and phi_i of the file, of a measurement of several or of a model", -TURNS, TURNS, "rad"),
    ] = None,
    resolution: Resolution = None,
) -> None:
    """Write the pairs of one incident direction, reflected and transmitted: a file holds no more.

    A measurement's own DSF stays DSF, other quantities become BSDF. Lost: uncertainties and nodes without data. Raises
    ParameterError where several directions, or none, are left, and for channels other than X, Y, Z.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.pab", format="pab-opto", incident=(0.5, 0.0))
    >>> print(gn.load("white.pab").f_angles(0.5, 0.0, 0.3, 1.0).round(4))
    0.1592
    """
    if incident is not None and incident[0] > LEVEL and is_part(m):
        raise ParameterError(f"incident={incident}: light from behind; expected theta_i of at most pi/2 = 1.5708")
    pairs = rows_of(m, resolution, (QUANTITIES["bsdf"], QUANTITIES["dsf"]), incident)
    if pairs.channels not in (None, CHANNELS):
        raise ParameterError(f"{m!r:.80}: has channels {pairs.channels}, expected one or X, Y, Z; write one of them")
    lit_from, _, _ = unique_rows(pairs.angles[:, :2])
    if len(lit_from) != 1:
        rule = "expected one; give incident=(theta_i, phi_i) in radians, and write a file of each"
        raise ParameterError(f"{m!r:.80}: has {len(lit_from)} incident directions there, {rule}")
    degrees = LAYOUT.columns(pairs.angles)
    theta, phi = (plain_text.number(x) for x in degrees[0, :2])
    lines = [f"#{key}{':' if key == 'colorimetry' else ''} {value}\n" for key, value in _heads(m).items()]
    lines += ["#colorimetry: CIE-XYZ\n"] if pairs.channels else []
    lines.append(f"#incident_angle {theta} {phi}\n#intheta {theta}\n#inphi {phi}\n")
    lines.append(f"#datapoints_in_file: {len(degrees)}\n")
    lines.append(f"#format: theta phi {'BSDF' if pairs.quantity == 'brdf' else 'DSF'}\n")
    plain_text.write(path, lines, np.concatenate([degrees[:, 2:], pairs.columns()], axis=1), "\t")


def _heads(m: Reflectance) -> dict[str, str]:
    """Keys and values in the head of the file that a measurement came from."""
    about = about_of(m)
    lines = {k: v for k, v in about.items() if isinstance(v, str) and "\n" not in v and re.fullmatch(r"\w+", k)}
    return {k: v for k, v in lines.items() if v.strip().upper() != "CIE-XYZ"}
