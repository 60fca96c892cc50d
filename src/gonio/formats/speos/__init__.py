"""Ansys Speos' (OPTIS) `.brdf` and `.anisotropicbsdf`, as text: values by angles of wo, normalized by shares.

Rows of a `.brdf` (`OPTIS - brdf surface file v8.0`), one table for each angle of incidence and wavelength:

    0 (text)    comment    characters of the description, and that    has reflection, has transmission
    1: values of the BSDF, 0: of intensity (BSDF x cos(theta_o))    counts of incidences and wavelengths; both lists
    tables: share of light [%], counts of theta and phi, a row of phi, and rows of theta with values

Of an `.anisotropicbsdf` (`OPTIS - Anisotropic BSDF surface file v8.0`), one spectrum for all tables:

    as above, with the direction that counts as azimuth 0 before the two flags; then counts and lists of the angles of
    the sample and, for each, of incidence (for reflection, then transmission); for each the direction of light that the
    spectrum was measured with, a word, and a count of lines of wavelength [nm] and share [%]; tables without shares

Values are proportional only: f = number x share / integral of (number x cos(theta_o)) over the hemisphere; in an
`.anisotropicbsdf` share and integral are those of one direction of incidence, between two measured ones the weighted
mean of their integrals, for all tables. The mirror direction is phi = 0: phi_o - phi_i = phi + 180 degrees. The
sample's angle is that of the plane of incidence from the file's vector, along which light travels at 0: phi_i = angle
+ 180. Tables of transmission have theta from 90 degrees, the surface, to 180, straight behind the light; shares are
then integrals over that side. A file names no side of the sample: one with transmission holds for both alike.

Layout and rules are those of Ansys' manual ("Structure of BRDF files", "Structure of Anisotropic BSDF files") as far as
it was seen, and of Ansys' converters; the sense of the sample's angle is chosen here. Read without the file at hand:
parts of a file of Ansys' tests and of one of the University of Arizona. Checked against own files. Binary files, and
versions before 7, are refused: Ansys' viewer saves them as text of version 8.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ...base.angles import direction
from ...base.measured import Total
from ...base.reflectance import Reflectance
from ...declared.arguments import Declared
from ...errors import FormatError, ParameterError
from ...formula import tree
from ...models.sheet import Sheet
from .._layout import CHANNEL, FileAxis, Layout
from .._optical.angle_tables import (
    AngleList,
    Channel,
    Filed,
    Filing,
    GridRequest,
    IncidentAngles,
    OutgoingAngles,
    Step,
    as_filed,
    as_lit,
    asked_or_usual,
    at_azimuths,
    channel_named,
    mirrored_x,
    own_table,
    reflected,
    rising,
    values_at,
)
from .._reading import plain_text
from .._reading.channel_words import LONGEST, SHORTEST, Wavelengths
from .._sides import SideOfReflection, joined, same_from_both, wanted
from .contents import ANISOTROPIC, BRDF, START, AngleTable, ScatteredPart, SpeosFile, read_sheet, written

NAME = "Speos"
SUFFIXES = (".brdf", ".anisotropicbsdf")
SHARED_SUFFIX = True
DESCRIPTION = "Ansys Speos (OPTIS) text: .brdf by wavelength, .anisotropicbsdf by angle of the sample"
ORACLE = "own generator, written from Ansys' manual; parts of two real files"

TRANSMITS = True
LAYOUT = Layout(
    "angles",
    {
        "sample": FileAxis("phi_i", 180.0, usual=lambda usual: usual.turns),
        "incidence": FileAxis("theta_i", usual=lambda usual: usual.theta_i),
        "wavelength": CHANNEL,
        "theta": FileAxis("theta_o", usual=lambda usual: usual.to_grazing()),
        "phi": FileAxis("phi", 180.0, usual=lambda usual: [*usual.circle, 360.0]),
    },
)
SPECTRAL = 50  # largest growth, values over bytes of the file, by a spectrum that multiplies all tables


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is one of these; the RT-300S's export for Speos is another format."""
    words = b" ".join(head.replace(b"\0", b"")[:256].lower().split())
    return words.startswith(START.encode()) and b"surface file" in words and b"sampleid:" not in words


def read(
    path: str | os.PathLike,
    wavelengths: Annotated[
        Sequence[float] | None,
        Declared("channels of an .anisotropicbsdf, linear in its spectrum", SHORTEST, LONGEST, "nm"),
    ] = None,
    side: SideOfReflection = None,
) -> Filed | Sheet:
    """The reflectance of a file: `angles` axes theta_i, theta_o, phi; or with phi_i, phi_o where the sample was turned.

    Channels are wavelengths [nm], none where one spectrum is flat. Transmission that is not read is kept for writing.
    Raises FormatError where the file is damaged, binary, of an unknown version or without reflection, or where its
    tables have different angles.
    """
    path = Path(path)
    sheet = read_sheet(path)
    if wavelengths is not None and not sheet.is_anisotropic:
        raise ParameterError("wavelengths=: expected for .anisotropicbsdf only; a .brdf has a table for each")
    chosen = wanted([HELD[name] for name in sheet.parts], side, path)
    places: dict[str, tuple[str, ...]] = {"front": ("front", "back"), "forward": ("forward", "backward")}
    if chosen == ("front",):
        places["front"] = chosen
    read = tuple(place for name in chosen for place in places[name])
    tables = {name: _table(path, sheet, name, wavelengths, places[name], read) for name in chosen}
    return joined({place: tables[name] for name in chosen for place in places[name]}, side)


HELD = {"reflection": "front", "transmission": "forward"}
"""Parts of a file as those of a `Sheet`."""


def _table(
    path: Path,
    sheet: SpeosFile,
    quarter: str,
    wavelengths: Sequence[float] | None,
    places: tuple[str, ...],
    read: tuple[str, ...],
) -> Filed:
    """Reflection ("front"), or transmission as it is seen from the other side."""
    part = sheet.parts["reflection"] if quarter == "front" else _from_other_side(path, sheet.parts["transmission"])
    first, *others = part.tables
    if not all(np.array_equal(t.theta, first.theta) and np.array_equal(t.phi, first.phi) for t in others):
        raise FormatError(f"{path}: tables of different theta or phi, expected one grid; resample in Ansys' viewer")
    with np.errstate(over="ignore", invalid="ignore"):
        if sheet.is_anisotropic:
            axes, f, names = _anisotropic(path, sheet, part, wavelengths)
        else:
            axes, f, names = _isotropic(sheet, part)
    phi = axes.get("phi", np.zeros(1))
    half = len(phi) > 1 and bool(phi[0] >= -1e-9 and phi[-1] <= math.pi + 1e-9)
    totals = [] if wavelengths is not None else _totals(sheet, part, names)
    if quarter == "forward":
        axes, f = mirrored_x(axes, f, half)
        totals = [total._replace(phi_i=math.pi - total.phi_i if total.phi_i else 0.0) for total in totals]
    return Filed(
        "angles", axes, f, channels=names, mirrored=half,
        path=str(path), about={"comment": sheet.comment, "description": sheet.description, "start": sheet.start},
        filed=Filing(sheet, places, read), stated_totals=totals,
    )  # fmt: skip


def _from_other_side(path: Path, part: ScatteredPart) -> ScatteredPart:
    """Transmission with theta from the normal of the side that light goes to, and the other way round."""
    if any((table.theta < 90.0 - 1e-9).any() for table in part.tables):
        lowest = min(table.theta.min() for table in part.tables)
        raise FormatError(f"{path}: transmission with theta from {lowest:g} degrees, expected 90 to 180")
    return _turned_over(part)


def _turned_over(part: ScatteredPart) -> ScatteredPart:
    tables = [t._replace(theta=180.0 - t.theta[::-1], values=t.values[::-1]) for t in part.tables]
    return part._replace(tables=tables)


def _totals(sheet: SpeosFile, part: ScatteredPart, names: tuple[float, ...] | None) -> list[Total]:
    """The shares of a `.brdf`'s tables; of an `.anisotropicbsdf` those of the direction that its spectrum is of."""
    if sheet.is_anisotropic:
        theta_i, turn = np.radians([*part.lit, 0.0][:2]).tolist()
        shares = part.spectrum[:, 1] if names else part.spectrum[:1, 1]
        return [Total(theta_i, turn + math.pi if len(part.turns) > 1 else 0.0, tuple((shares / 100.0).tolist()))]
    shares = np.reshape([table.share for table in part.tables], (len(part.incidence[0]), -1)) / 100.0
    angles = np.radians(part.incidence[0]).tolist()
    return [Total(theta_i, 0.0, tuple(row)) for theta_i, row in zip(angles, shares.tolist(), strict=True)]


def _integral(sheet: SpeosFile, table: AngleTable) -> float:
    """Of f cos(theta_o), in the table's own unit."""
    theta = np.radians(table.theta)
    values = table.values * np.cos(theta)[:, None] if sheet.of_bsdf else table.values
    return reflected(theta, np.radians(table.phi), values)


def _unit(sheet: SpeosFile, part: ScatteredPart) -> np.ndarray:
    """The factor (theta, 1) that makes values the BRDF but for a scale."""
    cosine = np.cos(np.radians(part.tables[0].theta))[:, None]
    return np.ones_like(cosine) if sheet.of_bsdf else 1.0 / np.where(cosine > 1e-6, cosine, np.nan)


def _scale(share: float, integral: float) -> float:
    return share / 100.0 / integral if integral > 0.0 else math.nan


def _isotropic(sheet: SpeosFile, part: ScatteredPart) -> tuple[dict[str, np.ndarray], np.ndarray, tuple[float, ...]]:
    scales = [_scale(table.share, _integral(sheet, table)) for table in part.tables]
    tables = [s * t.values * _unit(sheet, part) for s, t in zip(scales, part.tables, strict=True)]
    f = np.array(tables).reshape(1, len(part.incidence[0]), len(part.spectrum), *tables[0].shape)
    return *_about_light(part, f), tuple(part.spectrum[:, 0].tolist())


def _about_light(part: ScatteredPart, f: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Axes [rad], and f (theta_i, theta_o, phi, C), of f with the axes of `LAYOUT`; one side stays one side."""
    phi = part.tables[0].phi
    angles: dict[str, Any] = {"incidence": part.incidence[0], "theta": part.tables[0].theta, "phi": phi}
    axes, f, _ = LAYOUT.read(angles, f, bool(phi[0] >= 0.0 and phi[-1] <= 180.0))
    return axes, f


def _anisotropic(
    path: Path, sheet: SpeosFile, part: ScatteredPart, wavelengths: Sequence[float] | None
) -> tuple[dict[str, np.ndarray], np.ndarray, tuple[float, ...] | None]:
    first = part.incidence[0]
    if any(incidence != first for incidence in part.incidence):
        raise FormatError(f"{path}: angles of incidence differ between angles of the sample, expected the same")
    tables = np.array([t.values for t in part.tables])
    grid = tables.reshape(len(part.turns), len(first), 1, *tables.shape[1:])
    base = grid * _unit(sheet, part) * _scale(100.0, _reference(sheet, part))
    shares, names = _shares(path, part, wavelengths, base.size)
    f = base * shares[:, None, None]
    axes, f = _about_light(part, f) if len(part.turns) == 1 else _oriented(path, part, f)
    return axes, f if names else f[..., 0], names


def _reference(sheet: SpeosFile, part: ScatteredPart) -> float:
    """Integral for the direction of light that the spectrum was measured with."""
    theta, turn = part.lit[0], part.lit[1] if len(part.lit) > 1 else 0.0
    row = int(np.abs(np.array(part.turns) - turn).argmin())
    incidence = part.incidence[row]
    before = sum(map(len, part.incidence[:row]))
    each = [_integral(sheet, table) for table in part.tables[before : before + len(incidence)]]
    return float(np.interp(theta, incidence, each))


def _shares(
    path: Path, part: ScatteredPart, wavelengths: Sequence[float] | None, size: int
) -> tuple[np.ndarray, tuple[float, ...] | None]:
    """Shares (C,) and wavelengths of the channels, or one share where they are all the same."""
    nm, shares = part.spectrum.T
    if wavelengths is not None:
        return np.interp(wavelengths, nm, shares) / 100.0, tuple(map(float, wavelengths))
    if (shares == shares[0]).all():
        return shares[:1] / 100.0, None
    if size * len(shares) > SPECTRAL * path.stat().st_size:
        many = f"{len(shares)} wavelengths would make {size * len(shares)} values"
        raise FormatError(f"{path}: {many}; name those you need: load(path, wavelengths=[450, 550, 650])")
    return shares / 100.0, tuple(nm.tolist())


def _oriented(path: Path, part: ScatteredPart, f: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Axes [rad] with phi_o for phi, and f (theta_i, theta_o, phi_i, phi_o, C): phi_o = phi + sample's angle."""
    phi = part.tables[0].phi
    around = phi[:-1] if len(phi) > 1 and abs(phi[-1] - phi[0] - 360.0) < 1e-9 else phi
    azimuths = [np.mod(np.round(around + turn, 9), 360.0) for turn in part.turns]
    phi_o = np.unique(np.concatenate(azimuths))
    if f[0].size * len(part.turns) * len(phi_o) > len(phi) * SPECTRAL * path.stat().st_size:
        raise FormatError(f"{path}: phi and angles of the sample make {len(phi_o)} azimuths; resample to one step")
    rows = [at_azimuths(phi_o, nodes, row) for nodes, row in zip(azimuths, np.moveaxis(f, 2, -1), strict=True)]
    phi_i = LAYOUT.axes["sample"].of_file(np.array(part.turns))
    axes = {"theta_i": part.incidence[0], "theta_o": part.tables[0].theta, "phi_i": phi_i, "phi_o": phi_o}
    return {name: np.radians(x) for name, x in axes.items()}, np.array(rows).transpose(1, 2, 0, 3, 4)


def write(
    m: Reflectance,
    path: str | os.PathLike,
    theta_i: IncidentAngles = None,
    theta_o: OutgoingAngles = None,
    phi: Annotated[AngleList, rising("azimuths of wo, 0 is the mirror direction", -360.0, 360.0)] = None,
    phi_i: Annotated[AngleList, rising("azimuths of wi", -360.0, 540.0)] = None,
    step: Step = None,
    channel: Channel = None,
    wavelengths: Wavelengths = None,
) -> None:
    """Write f by angles, as `.anisotropicbsdf` if the file is named so, else as `.brdf`; a material read from such a
    file is written with the same numbers, transmission too. What transmits must be the same from both sides.

    A table with three `angles` axes keeps its grid in a `.brdf`. Of others f is taken at the given angles, by default
    in steps up to theta_o = 85 and at 89 degrees, phi_i every 30 if the material is anisotropic. A `.brdf` is
    isotropic, with a table for each channel, which `wavelengths` names where they are not (RGB: give three). An
    `.anisotropicbsdf` has one channel, or the one named by `channel`. Shares are the integrals of the tables. No data
    becomes 0. Raises ParameterError for a delta lobe, maps, channels without wavelengths, or an anisotropic material in
    a `.brdf`.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.brdf", format="Speos")
    >>> print(gn.load("white.brdf").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    [0.1592]
    """
    path = Path(path)
    anisotropic = path.suffix.lower() == ".anisotropicbsdf"
    asked = GridRequest({"sample": phi_i, "incidence": theta_i, "theta": theta_o, "phi": phi}, step, channel)
    sheet = as_filed(m, SpeosFile, asked) if wavelengths is None else None
    if sheet is None or sheet.is_anisotropic != anisotropic:
        sheet = _new(m, anisotropic, asked, wavelengths)
    plain_text.write(path, written(sheet))


def _new(m: Reflectance, anisotropic: bool, asked: GridRequest, wavelengths: Sequence[float] | None) -> SpeosFile:
    """A new file of reflection, of transmission, or of both."""
    sheets = {}
    for quarter, part in same_from_both(m, NAME).items():
        seen = as_lit(part) if quarter == "forward" else part
        angles, values = _sampled(seen, anisotropic, asked)
        f, names = _spectrally(seen, np.moveaxis(values, 2, -1), asked.channel, wavelengths, anisotropic)
        sheets[quarter] = _made_of(np.moveaxis(f, -1, 2), angles, names, anisotropic)
    parts = {name: sheets[quarter].parts["reflection"] for name, quarter in HELD.items() if quarter in sheets}
    if len({(tuple(p.incidence[0]), p.spectrum[:, 0].tobytes()) for p in parts.values()}) > 1 and not anisotropic:
        raise ParameterError(
            f"{m!r:.80}: reflection and transmission have different incidences or wavelengths; give theta_i=[...]"
        )
    if "transmission" in parts:
        parts["transmission"] = _turned_over(parts["transmission"])._replace(word="Transmission Spectrum")
    return next(iter(sheets.values()))._replace(parts=parts)


def _sampled(m: Reflectance, anisotropic: bool, asked: GridRequest) -> tuple[dict[str, list[float]], np.ndarray]:
    """Angles of the file [degrees], and f with the axes of `LAYOUT`."""
    if (table := own_table(m, "angles", asked)) and not tree.is_oriented(table[0]):
        return LAYOUT.written(table[0].axes, table[1], table[0].is_mirrored)
    if not anisotropic and (asked.angles["sample"] is not None or not m.is_isotropic()):
        raise ParameterError(f"{m!r:.80}: is anisotropic, and a .brdf is not; name the file .anisotropicbsdf")
    angles, oriented = asked_or_usual(LAYOUT, [m], asked)
    turns = angles["sample"] if oriented else [180.0]  # phi_i, as callers give it
    nodes = np.meshgrid(turns, *(angles[word] for word in ("incidence", "theta", "phi")), indexing="ij")
    light, incidence, polar, away = (np.radians(x) for x in nodes)
    f = values_at(m, direction(incidence, light), direction(polar, away + light + math.pi))
    return {**angles, "sample": [np.round(x - 180.0, 9) for x in turns]}, np.moveaxis(f, -1, 2)


def _spectrally(
    m: Reflectance, f: np.ndarray, channel: Any, wavelengths: Sequence[float] | None, anisotropic: bool
) -> tuple[np.ndarray, list[float]]:
    """The channels that are written, and their wavelengths."""
    names, f = channel_named(m, f, channel)
    if anisotropic and f.shape[-1] > 1:
        raise ParameterError(f"{m!r:.80}: {f.shape[-1]} channels, an .anisotropicbsdf has one; choose it with channel=")
    of_m = [] if m.channel_names is None else [n for n in names if not isinstance(n, str)]
    nm = of_m if wavelengths is None else list(wavelengths)
    if f.shape[-1] == 1 and not nm:
        nm = [550.0]
    if len(nm) != f.shape[-1] or not (np.diff(nm) > 0.0).all():
        got = f"has channels {names!r:.60} and wavelengths {nm!r:.60}"
        raise ParameterError(f"{m!r:.80}: {got}; give one for each, increasing, in nm: wavelengths=[...]")
    return f, [float(n) for n in nm]


def _made_of(f: np.ndarray, angles: dict[str, list[float]], names: list[float], anisotropic: bool) -> SpeosFile:
    theta, phi = np.array(angles["theta"]), np.array(angles["phi"])
    by_table = np.nan_to_num(f).reshape(-1, len(theta), len(phi))
    sheet = SpeosFile(ANISOTROPIC if anisotropic else BRDF, "written by gonio", "", [1.0, 0.0, 0.0], True, {})
    shares = [100.0 * _integral(sheet, AngleTable(0.0, theta, phi, table)) for table in by_table]
    tables = [AngleTable(s, theta, phi, table) for s, table in zip(shares, by_table, strict=True)]
    spectrum = np.array([[380.0, shares[0]], [780.0, shares[0]]] if anisotropic else [[nm] for nm in names])
    turns, first = angles["sample"], angles["incidence"]
    part = ScatteredPart(turns, [first] * len(turns), [first[0], turns[0]], "Reflection Spectrum", spectrum, tables)
    return sheet._replace(parts={"reflection": part})
