"""Zemax OpticStudio's tabular `.bsdf` ("BSDF Data Interchange", Radiant Imaging): values about the mirror direction.

Text; a line that begins with # is a comment. Words and counts, with the angles [degrees] on the following line,

    Source Measured    Symmetry PlaneSymmetrical | ASymmetrical | ASymmetrical4D
    SpectralContent Monochrome | XYZ    ScatterType BRDF | BTDF
    SampleRotation n    AngleOfIncidence n    ScatterAzimuth n    ScatterRadial n

then `Monochrome` (or `TristimulusX`, `Y`, `Z` in turn), `DataBegin`, and for each rotation and each angle of incidence
`TIS share` and n azimuths of n radial values of f [1/sr]; `DataEnd`.

Geometry. Radial is the angle between wo and the mirror direction s of wi, azimuth 0 points from s to the normal, and
azimuths grow counterclockwise seen against s. The rule is that of the format's description (Zemax knowledge base,
R. Rykowski). Checked on two real files: no value above 0 lies below the horizon, and no 0 more than 10 degrees above
it; the other way round 443 of 2996 values would lie below. And against the same measurement in FRED's format, which its
laboratory processed in another way: 7 % median difference, 16 % at the 90th percentile, 65 % the other way round.
Of transmission s is straight behind the light, and the viewer's side that which it goes to; such a file is read as a
`Sheet` that is the same from both sides, for it names none (chosen here: no file of transmission was seen).
PlaneSymmetrical files hold azimuths 0 to 180, mirrored. In a table of rotations the sample is turned
counterclockwise by SampleRotation, and at 0 the plane of incidence is at right angles to its x axis, light from +y:
phi_i = 90 degrees - rotation. The description seen tells only of the right angle; the sense is that of the converters
of the University of Arizona (bsdf-tools), the side is chosen here.

Beyond the outermost nodes the outermost values hold. Zeros below the horizon are no data (NaN), so that values above it
are not pulled down by them; a zero above it is a measured 0, though some tools write it where nothing was measured.

Source   Rykowski 2008, "BSDF Data Interchange File Format Specification", Zemax knowledge base.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..base.measured import Total
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..models._quarters import sheet_of
from ..models.sheet import Sheet
from ._layout import CHANNEL, FileAxis, Layout
from ._optical import bsdf_text
from ._optical.angle_tables import (
    AngleList,
    Angles,
    Channel,
    Filed,
    Filing,
    GridRequest,
    IncidentAngles,
    Step,
    as_filed,
    increasing,
    own_table,
    rising,
    spectral,
    steps,
    tabulated,
    totals,
    without_ground,
)
from ._reading import plain_text
from ._sides import same_from_both

NAME = "Zemax"
SUFFIXES = (".bsdf",)
SHARED_SUFFIX = True
DESCRIPTION = "Zemax OpticStudio's tabular BSDF: about the mirror direction"
ORACLE = (
    "real files (BrownVinyl, as shipped with OpticStudio; University of Arizona), the latter's FRED file and raw data"
)

TRANSMITS = True
KINDS = ("BRDF", "BTDF")
SYMMETRIES = ("PlaneSymmetrical", "ASymmetrical", "ASymmetrical4D")
CHANNELS = {"monochrome": 0, "tristimulusx": 0, "tristimulusy": 1, "tristimulusz": 2}
FINE = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.25, 1.5, 1.75)
"""Steps from the mirror direction that models are written at beside whole ones."""


def _about_mirror(usual: Angles) -> list[float]:
    return sorted({*(usual.step * x for x in FINE), *steps(min(180.0, 90.0 + usual.theta_i[-1]), usual.step)})


LAYOUT = Layout(
    "specular",
    {
        "channel": CHANNEL,
        "SampleRotation": FileAxis("phi_i", 90.0, -1.0, (-360.0, 360.0), usual=lambda usual: usual.turns),
        "AngleOfIncidence": FileAxis("theta_i", bounds=(0.0, 90.0), usual=lambda usual: usual.theta_i),
        "ScatterAzimuth": FileAxis(
            "azimuth", 180.0, bounds=(-360.0, 720.0), around=True, usual=lambda usual: [*usual.circle, 360.0]
        ),
        "ScatterRadial": FileAxis("radial", bounds=(0.0, 180.0), usual=_about_mirror),
    },
)
SEEN_FROM_BEHIND = {"SampleRotation": LAYOUT.axes["SampleRotation"]._replace(sign=1.0)}
LAYOUTS = dict(zip(KINDS, (LAYOUT, LAYOUT._replace(axes={**LAYOUT.axes, **SEEN_FROM_BEHIND})), strict=True))


class ZemaxFile(NamedTuple):
    """A file: angles as written [degrees], and values with the axes of `LAYOUT`.

    tis  total integrated scatter as written (channel, rotation, incidence)
    """

    symmetry: str
    angles: dict[str, list[float]]
    values: np.ndarray
    tis: np.ndarray
    comments: tuple[str, ...] = ()
    source: str = "Measured"
    kind: str = "BRDF"

    @property
    def is_half(self) -> bool:
        return self.symmetry == SYMMETRIES[0]

    def turns(self) -> list[float]:
        """phi_i [degrees] of the tables, in their order; of transmission as it is seen from the other side."""
        rotation = self.angles["SampleRotation"]
        return [LAYOUTS[self.kind].axes["SampleRotation"].of_file(x) for x in rotation] if len(rotation) > 1 else [0.0]


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is one of these."""
    words = head.replace(b"\0", b"").lower()
    return b"angleofincidence" in words and (b"scatterazimuth" in words or b"scattertype" in words)


def read(path: str | os.PathLike) -> Filed | Sheet:
    """The reflectance of a file: `specular` axes theta_i, radial, azimuth, and phi_i where the sample was turned; of
    transmission a `Sheet` of it, both ways.

    `about` has TIS, the total integrated scatter that the file states, (channel, rotation, incidence). Raises
    FormatError where the file is damaged or contradicts itself.
    """
    sheet = _sheet(Path(path))
    is_turned = len(sheet.angles["SampleRotation"]) > 1
    axes, values, mirrored = LAYOUTS[sheet.kind].read(sheet.angles, sheet.values, sheet.is_half, is_turned)
    values = without_ground("specular", axes, values)
    about = {"Source": sheet.source, "Symmetry": sheet.symmetry, "comments": sheet.comments, "TIS": sheet.tis}
    f, names = (values, ("X", "Y", "Z")) if len(sheet.values) > 1 else (values[..., 0], None)
    places = ("front",) if sheet.kind == KINDS[0] else ("forward", "backward")
    m = Filed(
        "specular", axes, f, channels=names, mirrored=mirrored, path=str(path), about=about,
        filed=Filing(sheet, places, places), stated_totals=_totals(sheet),
    )  # fmt: skip
    return sheet_of(dict.fromkeys(places, m))


def _totals(sheet: ZemaxFile) -> Iterator[Total]:
    incidence = np.radians(sheet.angles["AngleOfIncidence"])
    for phi_i, tables in zip(sheet.turns(), sheet.tis.transpose(1, 2, 0), strict=True):
        for theta_i, shares in zip(incidence, tables, strict=True):
            yield Total(float(theta_i), math.radians(phi_i), tuple(shares.tolist()))


def _sheet(path: Path) -> ZemaxFile:
    lines, comments = bsdf_text.opened(path)
    lists = {word: axis.bounds for word, axis in LAYOUT.axes.items() if word != "channel"}
    words, angles = bsdf_text.header(lines, lists, ("databegin", "tis", *CHANNELS))
    symmetry = bsdf_text.one_of(lines, words, "symmetry", SYMMETRIES)
    colour = bsdf_text.one_of(lines, words, "spectralcontent", ("Monochrome", "XYZ")) == "XYZ"
    scatter_type = bsdf_text.one_of(lines, words, "scattertype", KINDS)
    for name, (low, high) in lists.items():
        if name not in angles:
            raise FormatError(f"{path}: no {name} before the data, expected it and its angles")
        half = name == "ScatterAzimuth" and symmetry == SYMMETRIES[0]
        increasing(path, name, angles[name], *((0.0, 180.0) if half else (low, high)))
    angles = {name: angles[name] for name in lists}
    values, tis = _blocks(lines, tuple(map(len, angles.values())), 3 if colour else 1)
    return ZemaxFile(symmetry, angles, values, tis, comments, words.get("source", ""), scatter_type)


def _blocks(lines: plain_text.Lines, shape: tuple[int, ...], channels: int) -> tuple[np.ndarray, np.ndarray]:
    """Values (channel, rotation, incidence, azimuth, radial) and TIS (channel, rotation, incidence)."""
    rotations, incidences, azimuths, radials = shape
    wanted = rotations * incidences
    tables: list[list[np.ndarray]] = [[] for _ in range(channels)]
    tis: list[list[float]] = [[] for _ in range(channels)]
    at = 0
    for line in lines:
        key, rest = bsdf_text.key_and_words(line)
        if key in CHANNELS:
            at = CHANNELS[key]
            if at >= channels or tables[at]:
                raise lines.fault(line, "each channel that SpectralContent promises, once")
        elif key == "tis" and len(tables[at]) < wanted:
            tis[at].append(lines.float(rest[0] if len(rest) == 1 else line, "TIS and a number"))
            tables[at].append(bsdf_text.table(lines, azimuths, radials))
        elif key not in ("databegin", "dataend"):
            raise lines.fault(line, f"{wanted} tables that begin with TIS, then DataEnd")
    if (least := min(map(len, tables))) < wanted:
        raise lines.cut_short(f"{wanted} tables (rotations x angles of incidence) in each channel, got {least}")
    grid = (channels, rotations, incidences)
    return np.array(tables).reshape(*grid, azimuths, radials), np.array(tis).reshape(grid)


def write(
    m: Reflectance,
    path: str | os.PathLike,
    aoi: IncidentAngles = None,
    radial: Annotated[AngleList, rising("angles from the mirror direction", 0.0, 180.0)] = None,
    azimuth: Annotated[
        AngleList, rising("azimuths about the mirror direction, 0 is towards the normal", 0.0, 360.0)
    ] = None,
    rotation: Annotated[AngleList, rising("turns of the sample, counterclockwise", -360.0, 360.0)] = None,
    step: Step = None,
    channel: Channel = None,
    kind: Annotated[
        str | None,
        Declared("which of reflection and transmission is written, of a material with both", words=(*KINDS,)),
    ] = None,
) -> None:
    """Write f about the mirror direction; a material read from such a file is written with the same numbers. What
    transmits must be the same from both sides; a file holds reflection or transmission.

    A `specular` table keeps its grid and its numbers. Of others f is taken at the given angles, by default in steps,
    ten times denser at the mirror direction. PlaneSymmetrical if f is the same on both sides of the plane of incidence;
    ASymmetrical4D, every 30 degrees of rotation, if the material is anisotropic. RGB becomes XYZ (linear sRGB, D65);
    one `channel` is Monochrome. TIS is integrated (`angle_tables.totals`). Lost: the difference between 0 and no data.
    Raises ParameterError for a delta lobe, maps, and channels other than one, RGB or XYZ.

    Example
    >>> gn.save(gn.Lambertian([0.6, 0.1, 0.05]), "red.bsdf", format="Zemax")
    >>> print(gn.load("red.bsdf").channel_names)
    ('X', 'Y', 'Z')
    """
    if azimuth is not None and azimuth[-1] <= 180.0:
        azimuth = [*azimuth, *(360.0 - x for x in azimuth[::-1] if 0.0 < x < 180.0)]
    angles = {"SampleRotation": rotation, "AngleOfIncidence": aoi, "ScatterAzimuth": azimuth, "ScatterRadial": radial}
    asked = GridRequest(angles, step, channel)
    sheet = as_filed(m, ZemaxFile, asked)
    if sheet is None or kind not in (None, sheet.kind):
        sheet = _of_material(*_one_kind(m, kind), asked)
    plain_text.write(path, _written(sheet))


def _one_kind(m: Reflectance, kind: str | None) -> tuple[Reflectance, str]:
    """The reflection or the transmission of a material. Raises ParameterError where it has not that, or both."""
    there = {KINDS[name == "forward"]: part for name, part in same_from_both(m, NAME).items()}
    kind = kind or (next(iter(there)) if len(there) == 1 else None)
    if kind not in there:
        rule = "expected one of them: kind='BRDF' or kind='BTDF'" if kind is None else f"expected {' or '.join(there)}"
        raise ParameterError(f"{m!r:.80}: has {' and '.join(there) or 'neither'}, got {kind=}; {rule}")
    return there[kind], kind


def _of_material(m: Reflectance, scatter_type: str, asked: GridRequest) -> ZemaxFile:
    layout = LAYOUTS[scatter_type]
    axes, f, half = tabulated(layout, m, asked)
    _, f = spectral(m, f, asked.channel)
    f = np.nan_to_num(f, nan=0.0, posinf=np.nan, neginf=np.nan)
    if np.isnan(f).any():
        raise ParameterError(f"{m!r:.80}: has infinite values, which the format cannot hold; choose other angles")
    angles, values = layout.written(axes, f, half)
    if len(axes) == 3 and own_table(m, "specular", asked) is None:
        angles, values, half = _as_half(angles, values)
    symmetry = SYMMETRIES[2] if len(axes) == 4 else SYMMETRIES[0] if half else SYMMETRIES[1]
    sheet = ZemaxFile(symmetry, angles, values, np.empty(0), kind=scatter_type)
    _, tis = spectral(m, totals(m, angles["AngleOfIncidence"], sheet.turns()), asked.channel)
    return sheet._replace(tis=tis.transpose(2, 0, 1))


def _as_half(angles: dict[str, list[float]], values: np.ndarray) -> tuple[dict[str, list[float]], np.ndarray, bool]:
    """One side of the plane of incidence where the other is its mirror image; and whether it is."""
    azimuth = np.array(angles["ScatterAzimuth"])
    half = np.flatnonzero((azimuth >= 0.0) & (azimuth <= 180.0))
    if not {*np.round(360.0 - azimuth[azimuth > 180.0], 9)} <= {*azimuth[half]}:
        return angles, values, False
    for k in half:
        twin = np.flatnonzero(azimuth == 360.0 - azimuth[k])
        if len(twin) and not np.allclose(values[..., k, :], values[..., twin[0], :], rtol=1e-6, atol=1e-12):
            return angles, values, False
    return {**angles, "ScatterAzimuth": azimuth[half].tolist()}, values[..., half, :], True


def _written(sheet: ZemaxFile) -> Any:
    yield from (f"#{comment}\n" for comment in sheet.comments)
    colour = len(sheet.values) > 1
    yield f"Source\t{sheet.source or 'Measured'}\nSymmetry\t{sheet.symmetry}\n"
    yield f"SpectralContent\t{'XYZ' if colour else 'Monochrome'}\nScatterType\t{sheet.kind}\n"
    for name, angles in sheet.angles.items():
        yield from bsdf_text.listed(name, angles)
    for k, (values, tis) in enumerate(zip(sheet.values, sheet.tis, strict=True)):
        yield f"\n{'Tristimulus' + 'XYZ'[k] if colour else 'Monochrome'}\nDataBegin\n"
        for table, share in zip(values.reshape(-1, *values.shape[2:]), tis.reshape(-1), strict=True):
            yield f"TIS\t{plain_text.number(share)}\n"
            yield from plain_text.join(table, "\t")
        yield "DataEnd\n"
