"""LightTools' `.bsdf` (Synopsys): values by polar angle and azimuth of wo, a table for each direction of incidence.

Text; a line that begins with # is a comment. A header,

    Symmetry PlaneSymmetrical | Asymmetric    SpectralContent Monochrome | XYZ
    ScatterAzimuth n  angles    ScatterRadial n  angles    DataBegin

then blocks of `AOI`, `POI` [degrees], `Side Front | Back`, `Wavelength` [nm], `ScatterType BRDF | BTDF`,
`TristimulusValue TrisX | TrisY | TrisZ` (XYZ only), `TIS share`, and n azimuths of n values f [1/sr]; `DataEnd`.

Radial is theta_o. If all POI are the same, the material is isotropic and light comes from azimuth 90 degrees, as in
libbsdf: phi = ScatterAzimuth - 90 degrees, and PlaneSymmetrical files hold one side of that plane. If they differ, POI
is phi_i, and ScatterAzimuth phi_o (chosen here: no reader was seen that uses POI). Light on the back has an AOI above
90 degrees or Side Back. A BTDF has theta_o from the normal of the side that light leaves, and azimuths of the front, as
libbsdf has them.

No specification and no real file was seen: the layout is that of libbsdf's reader; checked against own files only.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from ..base.measured import Total
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..formula.text import shown
from ..models._quarters import quarters
from ..models.sheet import Sheet
from ._layout import CHANNEL, FileAxis, Layout
from ._optical import bsdf_text
from ._optical.angle_tables import (
    AngleList,
    Channel,
    Filed,
    Filing,
    GridRequest,
    IncidentAngles,
    OutgoingAngles,
    Step,
    as_filed,
    asked_or_usual,
    increasing,
    mirrored_x,
    on_grid,
    own_table,
    rising,
    spectral,
    totals,
)
from ._reading import channel_words, plain_text
from ._sides import Side, joined, wanted

NAME = "LightTools"
SUFFIXES = (".bsdf",)
SHARED_SUFFIX = True
DESCRIPTION = "LightTools' BSDF: by angles of wo, for each direction of incidence"
ORACLE = "own generator, written from libbsdf's reader"

TRANSMITS = True
TRISTIMULUS = {"trisx": 0, "trisy": 1, "trisz": 2}
KEYS = ("aoi", "poi", "side", "wavelength", "scattertype", "tristimulusvalue", "tis")
LIGHT = 90.0
"""Azimuth [degrees] of the light in files of isotropic materials."""

LAYOUT = Layout(
    "angles",
    {
        "AOI": FileAxis("theta_i", usual=lambda usual: usual.theta_i),
        "POI": FileAxis("phi_i", alone=LIGHT, usual=lambda usual: usual.turns),
        "channel": CHANNEL,
        "ScatterAzimuth": FileAxis("phi", -LIGHT, bounds=(-360.0, 720.0), usual=lambda usual: usual.side),
        "ScatterRadial": FileAxis("theta_o", bounds=(0.0, 90.0), usual=lambda usual: usual.to_grazing()),
    },
    turned={"ScatterAzimuth": FileAxis("phi_o", usual=lambda usual: usual.side)},
)
LISTS = {word: axis.bounds for word, axis in LAYOUT.axes.items() if word.startswith("Scatter")}
"""Those that all tables share."""


AS_SEEN = ("front", "backward")
"""The quarters of a `Sheet` whose azimuths are those of the file: wo is seen from the front."""


class _IncidenceTable(NamedTuple):
    """A table (azimuth, radial) and its keys as written."""

    aoi: float
    poi: float
    side: str
    wavelength: float
    kind: str
    tristimulus: str
    tis: float
    values: np.ndarray


class LightToolsFile(NamedTuple):
    """A file; `angles` of `LISTS` [degrees]."""

    symmetry: str
    content: str
    angles: dict[str, list[float]]
    blocks: tuple[_IncidenceTable, ...]
    comments: tuple[str, ...] = ()


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is one of these."""
    words = head.replace(b"\0", b"").lower()
    marks, others = (b"scatterazimuth", b"scatterradial", b"spectralcontent"), (b"angleofincidence", b"samplerotation")
    return all(mark in words for mark in marks) and not any(mark in words for mark in others)


def read(path: str | os.PathLike, side: Side = None) -> Filed | Sheet:
    """The reflectance of one side: `angles` axes theta_i, theta_o, phi, or theta_i, theta_o, phi_i, phi_o; or a `Sheet`
    of such tables.

    Blocks that are not read are kept for writing. Channels: X, Y, Z, or wavelengths [nm] (above 0). Raises FormatError
    where the file is damaged, contradicts itself, or has no reflection on this side.
    """
    path = Path(path)
    sheet = _sheet(path)
    blocks: dict[str, list[_IncidenceTable]] = {}
    for b in sheet.blocks:
        blocks.setdefault(_quarter(b), []).append(b)
    names = wanted(blocks, side, path)
    return joined({name: _material(path, sheet, name, blocks[name], names) for name in names}, side)


def _material(
    path: Path, sheet: LightToolsFile, quarter: str, blocks: list[_IncidenceTable], read: tuple[str, ...]
) -> Filed:
    """The table of a quarter of a `Sheet`, as seen from its own side."""
    theta_i, phi_i, channels = (sorted(set(x)) for x in zip(*(_place(b, sheet) for b in blocks), strict=True))
    grid = np.full((len(theta_i), len(phi_i), len(channels), *map(len, sheet.angles.values())), np.nan)
    tis = np.empty(grid.shape[:3])
    for b in blocks:
        at = tuple(nodes.index(x) for nodes, x in zip((theta_i, phi_i, channels), _place(b, sheet), strict=True))
        if not np.isnan(grid[at]).all():
            raise FormatError(f"{path}: two tables for AOI {b.aoi:g}, POI {b.poi:g} and the same channel, expected one")
        grid[at], tis[at] = b.values, b.tis
    if len(blocks) != tis.size:
        raise FormatError(f"{path}: {len(blocks)} tables, expected one for each AOI, POI and channel: {tis.shape}")
    half, angles = sheet.symmetry.lower() == "planesymmetrical", {"AOI": theta_i, "POI": phi_i, **sheet.angles}
    axes, values, half = LAYOUT.read(angles, grid, half, len(phi_i) > 1)
    axes, values = _turned(quarter, axes, values, half)
    tis = tis if quarter in AS_SEEN else tis[:, ::-1]
    names: tuple[str | float, ...] | None = None if channels == [0.0] else tuple(channels)
    if sheet.content == "XYZ":
        names = tuple("XYZ"[int(k)] for k in channels)
    side = blocks[0].side.lower() if quarter in ("forward", "backward") else quarter
    about = {"Symmetry": sheet.symmetry, "side": side, "comments": sheet.comments, "TIS": [b.tis for b in blocks]}
    f, azimuths = values if names else values[..., 0], axes.get("phi_i", np.zeros(1)).tolist()
    incidence = product(axes["theta_i"].tolist(), azimuths)
    totals = [Total(*wi, tuple(x)) for wi, x in zip(incidence, tis.reshape(-1, len(channels)).tolist(), strict=True)]
    return Filed(
        "angles", axes, f, channels=names, mirrored=half, path=str(path), about=about,
        filed=Filing(sheet, (quarter,), read), stated_totals=totals,
    )  # fmt: skip


def _turned(
    quarter: str, axes: dict[str, np.ndarray], values: np.ndarray, half: bool
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """A table, turned half a turn about the y axis if seen from behind."""
    return (axes, values) if quarter in AS_SEEN else mirrored_x(axes, values, half)


def _quarter(block: _IncidenceTable) -> str:
    """The part of a `Sheet` that a block belongs to."""
    reflected, back = block.kind.lower() == "brdf", block.side.lower() == "back" or block.aoi > 90.0
    return ("back" if back else "front") if reflected else ("backward" if back else "forward")


def _place(block: _IncidenceTable, sheet: LightToolsFile) -> tuple[float, float, float]:
    """theta_i and phi_i [degrees] and the channel of a block."""
    theta_i = 180.0 - block.aoi if block.aoi > 90.0 else block.aoi
    colour = sheet.content == "XYZ"
    return theta_i, block.poi, TRISTIMULUS[block.tristimulus.lower()] if colour else block.wavelength


def _sheet(path: Path) -> LightToolsFile:
    lines, comments = bsdf_text.opened(path)
    words, angles = bsdf_text.header(lines, LISTS, ("databegin",))
    if lines.next() is None:
        raise lines.cut_short("DataBegin")
    symmetry = bsdf_text.one_of(lines, words, "symmetry", ("PlaneSymmetrical", "Asymmetric", "Asymmetrical"))
    content = bsdf_text.one_of(lines, words, "spectralcontent", ("Monochrome", "XYZ"))
    angles = {name: angles.get(name, []) for name in LISTS}
    for name, bounds in LISTS.items():
        increasing(path, name, angles[name], *bounds)
    azimuth = angles["ScatterAzimuth"]
    if symmetry == "PlaneSymmetrical" and not any(
        low <= azimuth[0] and azimuth[-1] <= low + 180.0 for low in (-LIGHT, LIGHT, LIGHT + 180.0)
    ):
        raise FormatError(
            f"{path}: PlaneSymmetrical, with azimuths from {azimuth[0]:g} to {azimuth[-1]:g}, expected one side of the "
            f"plane that light comes from at {LIGHT:g} degrees: -90 to 90, or 90 to 270"
        )
    blocks = tuple(_blocks(lines, content, tuple(map(len, angles.values()))))
    return LightToolsFile(words["symmetry"], content, angles, blocks, comments)


def _blocks(lines: plain_text.Lines, content: str, shape: tuple[int, ...]) -> Iterator[_IncidenceTable]:
    words: dict[str, str] = {}
    for line in lines:
        key, rest = bsdf_text.key_and_words(line)
        if key == "dataend":
            if lines.next() is not None:
                raise lines.fault("more lines", "nothing after DataEnd; keep several files apart")
            break
        if key not in KEYS or len(rest) != 1:
            raise lines.fault(line, f"one of {', '.join(KEYS)} and its value")
        words[key] = rest[0]
        if key == "tis":
            yield _block(lines, words, content, shape)
            words = {}
    if words:
        raise lines.cut_short("TIS and a table")


def _block(lines: plain_text.Lines, words: dict[str, str], content: str, shape: tuple[int, ...]) -> _IncidenceTable:
    side, scatter_type = words.get("side", "Front"), words.get("scattertype", "")
    tristimulus = words.get("tristimulusvalue", "")
    if scatter_type.lower() not in ("brdf", "btdf"):
        raise lines.fault(scatter_type, "ScatterType BRDF or BTDF before TIS")
    if side.lower() not in ("front", "back"):
        raise lines.fault(side, "Side Front or Back")
    if content == "XYZ" and tristimulus.lower() not in TRISTIMULUS:
        raise lines.fault(tristimulus, "TristimulusValue TrisX, TrisY or TrisZ")
    aoi = lines.float(words.get("aoi", ""), "AOI before TIS")
    if not 0.0 <= aoi <= 180.0:
        raise lines.fault(words["aoi"], "AOI from 0 to 180 degrees")
    poi, wavelength, tis = (lines.float(words.get(key, "0")) for key in ("poi", "wavelength", "tis"))
    return _IncidenceTable(aoi, poi, side, wavelength, scatter_type, tristimulus, tis, bsdf_text.table(lines, *shape))


def write(
    m: Reflectance,
    path: str | os.PathLike,
    theta_i: IncidentAngles = None,
    theta_o: OutgoingAngles = None,
    phi: Annotated[AngleList, rising("phi_o - phi_i, from 0; phi_o of anisotropic materials", -360.0, 360.0)] = None,
    phi_i: Annotated[AngleList, rising("azimuths of wi", -360.0, 360.0)] = None,
    step: Step = None,
    channel: Channel = None,
    wavelength: Annotated[
        float,
        Declared(
            "wavelength of a channel that does not say its own", channel_words.SHORTEST, channel_words.LONGEST, "nm"
        ),
    ] = 550.0,
) -> None:
    """Write f by angles; a material read from such a file is written with the same numbers, all blocks of it. What has
    two sides gets blocks of both, reflection and transmission.

    A table with `angles` axes keeps its grid. For others f is taken at the given angles, by default in steps up to
    theta_o = 85 and at 89 degrees, phi_i of anisotropic materials every 30. RGB becomes XYZ (linear sRGB, D65),
    wavelengths stay. No data becomes 0. TIS is integrated.
    Raises ParameterError for a delta lobe, maps, and channels with other names.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.bsdf", format="LightTools")
    >>> print(gn.load("white.bsdf").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    [0.1592]
    """
    angles = {"AOI": theta_i, "POI": phi_i, "ScatterAzimuth": phi, "ScatterRadial": theta_o}
    asked = GridRequest(angles, step, channel)
    plain_text.write(path, _lines(as_filed(m, LightToolsFile, asked) or _tabulated(m, asked, wavelength)))


def _tabulated(m: Reflectance, asked: GridRequest, wavelength: float) -> LightToolsFile:
    parts = quarters(m)
    one = next(iter(parts.values()))
    axes, half, tables = _own_tables(parts, asked) or _sampled(parts, asked)
    names = one.channel_names or ()
    own_names = asked.channel is None and bool(names) and all(isinstance(n, (int, float)) for n in names)
    labels = names if own_names else spectral(one, tables[next(iter(parts))], asked.channel)[0]
    blocks: list[_IncidenceTable] = []
    for quarter, part in parts.items():
        if (part.channel_names or ()) != names:
            raise ParameterError(f"{m!r:.80}: its parts have different channels; expected the same")
        f = tables[quarter] if labels == names else spectral(part, tables[quarter], asked.channel)[1]
        angles, values = LAYOUT.written(axes, np.nan_to_num(f), half)
        lit = [180.0 - x if quarter in ("back", "forward") else x for x in angles["POI"]] if "phi_i" in axes else [0.0]
        tis = totals(part, angles["AOI"], lit)
        tis = tis if labels == names else spectral(part, tis, asked.channel)[1]
        side = "Back" if quarter.startswith("back") else "Front"
        scatter_type = "BTDF" if quarter.endswith("ward") else "BRDF"
        for (a, theta), (b, turn), (c, label) in product(*map(enumerate, (angles["AOI"], angles["POI"], labels))):
            nm = wavelength if _in_colour(labels) or label is None else float(label)
            tristimulus = f"Tris{label}" if _in_colour(labels) else ""
            blocks.append(
                _IncidenceTable(theta, turn, side, nm, scatter_type, tristimulus, tis[b, a, c], values[a, b, c])
            )
    symmetry, content = "PlaneSymmetrical" if half else "Asymmetric", "XYZ" if _in_colour(labels) else "Monochrome"
    return LightToolsFile(symmetry, content, {name: angles[name] for name in LISTS}, tuple(blocks))


def _in_colour(labels: tuple) -> bool:
    return labels == ("X", "Y", "Z")


def _own_tables(
    parts: Mapping[str, Reflectance], asked: GridRequest
) -> tuple[dict[str, np.ndarray], bool, dict[str, np.ndarray]] | None:
    """The grid and the tables of measurements as they are, where they share one, with the azimuths of the front."""
    by_quarter = {quarter: own_table(part, "angles", asked) for quarter, part in parts.items()}
    grids = []
    tables = {}
    for quarter, table in by_quarter.items():
        if table is None:
            return None
        half = table[0].is_mirrored
        axes, tables[quarter] = _turned(quarter, table[0].axes, table[1], half)
        grids.append((axes, half))
    axes, half = grids[0]
    same = all(h == half and list(a) == list(axes) and all(_same(a[n], axes[n]) for n in a) for a, h in grids)
    return (axes, half, tables) if same else None


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and bool(np.allclose(a, b, rtol=0.0, atol=1e-12))


def _sampled(
    parts: Mapping[str, Reflectance], asked: GridRequest
) -> tuple[dict[str, np.ndarray], bool, dict[str, np.ndarray]]:
    """Nodes [rad], whether they are on one side of the plane of incidence, and f there."""
    angles, oriented = asked_or_usual(LAYOUT, [*parts.values()], asked)
    phi = angles["ScatterAzimuth"]  # gonio's, as callers give it
    if not oriented and phi[0] < 0.0:
        azimuths = shown(asked.angles["ScatterAzimuth"])
        raise ParameterError(f"phi={azimuths}: expected angles from 0 to 360 degrees, for an isotropic material")
    axes = {axis.name: np.radians(angles[word]) for word, axis in LAYOUT.grid(oriented).items()}
    half = not oriented and phi[-1] <= 180.0
    tables = {}
    for quarter, part in parts.items():
        seen, _ = _turned(quarter, axes, np.empty(tuple(map(len, axes.values()))), half)
        _, tables[quarter] = _turned(quarter, seen, on_grid(part, "angles", seen), half)
    return axes, half, tables


def _lines(sheet: LightToolsFile) -> Iterator[str]:
    yield from (f"#{comment}\n" for comment in sheet.comments)
    yield f"Symmetry\t{sheet.symmetry}\nSpectralContent\t{sheet.content}\n"
    for name, angles in sheet.angles.items():
        yield from bsdf_text.listed(name, angles)
    yield "DataBegin\n"
    for b in sheet.blocks:
        number = plain_text.number
        yield f"AOI\t{number(b.aoi)}\nPOI\t{number(b.poi)}\nSide\t{b.side}\nWavelength\t{number(b.wavelength)}\n"
        yield f"ScatterType\t{b.kind}\n"
        yield f"TristimulusValue\t{b.tristimulus}\n" if b.tristimulus else ""
        yield f"TIS\t{number(b.tis)}\n"
        yield from plain_text.join(b.values, "\t")
    yield "DataEnd\n"
