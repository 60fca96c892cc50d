"""FRED's tabulated scatter data (Photon Engineering): values by polar angle and azimuth of the scattered ray.

Text: `type bsdf_data`, then `format angles=deg bsdf=value scale=1`, then for each direction of incidence a line of two
numbers, theta_i and phi_i, and lines of three, theta_s, phi_s and f [1/sr].

Azimuths are those of rays as they travel: phi_s - phi_i = 0 is forward, so that the mirror direction is (theta_i,
phi_i); light then comes from phi_i + 180 degrees, and in gonio phi = phi_s - phi_i - 180 degrees. One phi_i stands for
an isotropic material, azimuths up to 180 degrees for both sides of the plane of incidence. f = number x scale.

No specification of the header's words was seen: angles are degrees or radians, values `bsdf=value`, all else is
refused. The geometry is that of the manual's pages and of the laboratory's converters; it was checked on a real file
against the same measurement in Zemax's format, and against its raw data.

Data in the plane of incidence alone are interpolated linearly in azimuth from one side to the other.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterator
from itertools import groupby
from typing import Annotated, NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..errors import FormatError, ParameterError
from ..formula import tree
from ..tables.gridded import Gridded
from ._layout import FileAxis, Layout
from ._optical.angle_tables import (
    AngleList,
    Channel,
    Filing,
    GridRequest,
    IncidentAngles,
    OutgoingAngles,
    Step,
    as_filed,
    asked_or_usual,
    channel_named,
    from_rows,
    own_table,
    rising,
    values_at,
)
from ._reading import plain_text

NAME = "FRED"
SUFFIXES = (".txt",)
SHARED_SUFFIX = True
DESCRIPTION = "FRED's tabulated scatter data: lists of directions and values"
ORACLE = "real file (University of Arizona), its raw data and its Zemax file"

FIRST = "type bsdf_data"
WORDS = {"angles": "deg", "bsdf": "value", "scale": "1"}


LAYOUT = Layout(
    "angles",
    {
        "theta_i": FileAxis("theta_i", usual=lambda usual: usual.theta_i),
        "phi_i": FileAxis("phi_i", 180.0, usual=lambda usual: usual.turns),
        "theta_s": FileAxis("theta_o", usual=lambda usual: usual.theta_o),
        "phi_s": FileAxis("phi_o", usual=lambda usual: usual.side),  # of models phi_s - phi_i
    },
)
TRAVELS = LAYOUT.axes["phi_i"].shift
"""From where light comes from to where it goes, and back [degrees]."""


class FredFile(NamedTuple):
    """A file: the words after `format`, and rows (n, 5) of theta_i, phi_i, theta_s, phi_s and the number."""

    format: dict[str, str]
    rows: np.ndarray


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is one of these."""
    return b"bsdf_data" in head.replace(b"\0", b"")[:512].lower()


def read(path: str | os.PathLike) -> Gridded:
    """The reflectance of a file: `angles` axes theta_i, theta_o, phi (phi_i, phi_o if there are several phi_i).

    Directions that are not listed are no data (NaN); lists that fill less than half of the grid of their angles become
    a `Scattered`. Raises FormatError for damaged files and unknown kinds.
    """
    lines = plain_text.read(path, ("#", "!", "//"))
    if " ".join(plain_text.split(lines.take(FIRST).lower())) != FIRST:
        raise lines.fault("another first line", FIRST)
    words = dict(word.partition("=")[::2] for word in plain_text.split(lines.take("format ..."))[1:])
    in_degrees = {"deg": True, "degrees": True, "rad": False, "radians": False}.get(words.get("angles", "deg").lower())
    if in_degrees is None or words.get("bsdf", "value").lower() != "value":
        raise lines.fault(" ".join(f"{k}={v}" for k, v in words.items()), "angles=deg bsdf=value")
    scale = lines.float(words.get("scale", "1"))
    sheet = FredFile(words, _rows(lines))
    theta_i, phi_i, theta_s, phi_s, number = sheet.rows.T
    if not in_degrees:
        theta_i, phi_i, theta_s, phi_s = np.degrees((theta_i, phi_i, theta_s, phi_s)).round(9)
    with np.errstate(over="ignore", invalid="ignore"):
        f = number * scale
    if not (np.abs(sheet.rows[:, [1, 3]]) <= 720.0).all() or not np.isfinite(f).any():
        raise FormatError(f"{path}: azimuths beyond -720 to 720 degrees, or no value that is a number")
    if not ((theta_i >= 0.0) & (theta_i <= 90.0) & (theta_s >= 0.0) & (theta_s <= 90.0)).all():
        raise FormatError(f"{path}: polar angles beyond 0 to 90 degrees, expected reflection only")
    about = {"format": words, "scale": scale}
    return from_rows(theta_i, phi_i + TRAVELS, theta_s, phi_s, f, path=str(path), about=about, filed=Filing(sheet))


def _rows(lines: plain_text.Lines) -> np.ndarray:
    out, incidence = array("d"), None
    for line in lines:
        numbers = lines.floats(line)
        if len(numbers) == 2:
            incidence = numbers
        elif len(numbers) == 3 and incidence is not None:
            out.extend((*incidence, *numbers))
        else:
            raise lines.fault(line, "two angles of incidence, then rows of two angles and a value")
    rows = np.array(out).reshape(-1, 5)
    if not len(rows) or not np.isfinite(rows[:, :4]).all():
        raise FormatError(f"{lines.path}: no values, or angles that are not finite")
    return rows


def write(
    m: Reflectance,
    path: str | os.PathLike,
    theta_i: IncidentAngles = None,
    theta_o: OutgoingAngles = None,
    phi: Annotated[AngleList, rising("phi_s - phi_i, 0 is forward", 0.0, 360.0)] = None,
    phi_i: Annotated[AngleList, rising("azimuths that light travels along", -360.0, 360.0)] = None,
    step: Step = None,
    channel: Channel = None,
) -> None:
    """Write f at lists of angles; a material read from such a file is written with the same rows.

    An `angles` table keeps its grid and numbers, without the nodes that have no data. For others f is taken at the
    given angles, by default in steps up to theta_o = 85 degrees; phi from 0 to 180 for isotropic materials, else to 360
    and phi_i every 30. FRED's table has one channel: give `channel` for materials with several. Raises ParameterError
    for a delta lobe, maps, and several channels.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.fred", format="FRED")
    >>> print(gn.load("white.fred").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    asked = GridRequest({"theta_i": theta_i, "phi_i": phi_i, "theta_s": theta_o, "phi_s": phi}, step, channel)
    plain_text.write(path, _lines(as_filed(m, FredFile, asked) or FredFile(WORDS, _tabulated(m, asked))))


def _lines(sheet: FredFile) -> Iterator[str]:
    yield f"{FIRST}\nformat {' '.join(f'{k}={v}' for k, v in sheet.format.items())}\n"
    for incidence, rows in groupby(sheet.rows.tolist(), key=lambda row: row[:2]):
        yield from plain_text.join([incidence, *(row[2:] for row in rows)], "\t")


def _tabulated(m: Reflectance, asked: GridRequest) -> np.ndarray:
    """Rows of a file."""
    if measured := own_table(m, "angles", asked):
        table, f = measured
        angles = [plain_text.degrees(x) for x in table.axes.values()]
        angles, f = (angles, f) if len(angles) == 4 else ([*angles[:2], np.zeros(1), angles[2]], f[:, :, None])
        incidence, polar, light, away = np.meshgrid(*angles, indexing="ij")
        if not tree.is_oriented(table):
            light, away = light + 180.0, 180.0 - away if table.is_mirrored else away + 180.0
        angles = [incidence, light + TRAVELS, polar, away]
    else:
        grid, _ = asked_or_usual(LAYOUT, [m], asked)
        incidence, light, polar, away = np.meshgrid(*grid.values(), indexing="ij")
        away = away + light
        angles = [incidence, light, polar, away]
        wi = direction(np.radians(incidence), np.radians(light + TRAVELS))
        f = values_at(m, wi, direction(np.radians(polar), np.radians(away)))
    names, f = channel_named(m, f, asked.channel)
    if len(names) > 1:
        raise ParameterError(f"{m!r:.80}: has channels {names!r:.80}, and FRED's table has one; choose it: channel=")
    return _sorted(angles, f)


def _sorted(angles: list[np.ndarray], f: np.ndarray) -> np.ndarray:
    """Rows sorted by direction of incidence, one of several along the normal, none without data."""
    theta_i, phi_i, theta_s, phi_s = (np.round(a, 9).reshape(-1) for a in angles)
    phi_i = np.mod(phi_i, 360.0)
    phi_s = np.where(np.abs(phi_s) == 360.0, phi_s, np.mod(phi_s, 360.0))
    rows = np.stack([theta_i, phi_i, theta_s, phi_s, f.reshape(-1)], axis=-1)
    rows = rows[np.isfinite(rows[:, 4])]
    rows = rows[np.lexsort(rows.T[3::-1])]
    repeats = (rows[1:, 2] == 0.0) & (rows[1:, [0, 1, 2, 4]] == rows[:-1, [0, 1, 2, 4]]).all(1)
    return rows[~np.concatenate([[False], repeats])]
