"""SSDD, libbsdf's format: a grid of a BRDF, with transmission and specular values beside it; text, or binary tables.

Entries `NAME value`: of the file (`VERSION` first), then of up to four blocks that begin with `DATA_TYPE` (brdf,
btdf, specular_reflectance, specular_transmittance) and end with `DATA ascii` or `binary` and the table: a line, or
float32 numbers, per colour, with PARAM0 fastest, then PARAM1, 2, 3. Parameters are degrees: theta and phi of wi, then
of wo (`spherical_coordinate_system`), of wo about the mirror direction (`specular_coordinate_system`), or theta_h,
phi_h, theta_d, phi_d (`half_difference_coordinate_system`). A btdf has wo mirrored at the surface, as in libbsdf, and
no side is named: a file with one holds for both alike. Follows the format's specification, version 0.2, and
libbsdf's reader for what that leaves open (float32, zero of azimuths). Checked against the specification's examples
and its own generator.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.measured import tristimulus
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError, held_by
from ..files import replacing
from ..formula import tree
from ..models.sheet import Sheet
from ..tables.angle_systems import SYSTEMS, angle_system
from ..tables.axes import fits
from ..tables.gridded import Gridded
from ..tables.nodes import f_at
from ..tables.rows import distinct, turned
from ..tables.scattered import Scattered
from ._layout import CHANNEL, FileAxis, Layout
from ._optical.angle_tables import as_lit
from ._reading import plain_text
from ._rows import libbsdf_grids
from ._rows.pairs_of_material import Resolution, table_of
from ._sides import SideOfReflection, joined, same_from_both, wanted

NAME = "SSDD"
SUFFIXES = (".ssdd",)
DESCRIPTION = "grids of angles of BRDF, BTDF and specular values (libbsdf, BSDF Processor)"
ORACLE = "examples of the specification"
TRANSMITS = True

DATA_TYPES = ("brdf", "btdf", "specular_reflectance", "specular_transmittance")
COLOURS: dict[str, tuple[str, ...] | None] = {"monochrome": None, "rgb": ("R", "G", "B"), "xyz": ("X", "Y", "Z")}


def _layout(system: str, *axes: FileAxis, **turned: FileAxis) -> Layout:
    """Of tables by PARAM3, 2, 1, 0; azimuths are written within a turn."""
    words = [f"PARAM{k}_LIST" for k in (3, 2, 1, 0)]
    return Layout(system, {**dict(zip(words, axes, strict=True)), "colour": CHANNEL}, turned, decimals=10)


_PHI_I, _THETA_I = FileAxis("phi_i", around=True), FileAxis("theta_i")
_PHI_H, _THETA_H = FileAxis("phi_h", around=True), FileAxis("theta_h")
LAYOUT = {
    "spherical_coordinate_system": _layout(
        "angles",
        FileAxis("phi", around=True),
        FileAxis("theta_o"),
        _PHI_I,
        _THETA_I,
        PARAM3_LIST=FileAxis("phi_o", around=True),
    ),
    # The azimuth about the mirror direction counts from the side of the normal, gonio's from the opposite side.
    "specular_coordinate_system": _layout(
        "specular", FileAxis("azimuth", 180.0, around=True), FileAxis("radial"), _PHI_I, _THETA_I
    ),
    "half_difference_coordinate_system": _layout(
        "half_difference", FileAxis("phi_d", around=True), FileAxis("theta_d"), _PHI_H, _THETA_H
    ),
}
OF_FILE = ("SOFTWARE", "API", "DATE")
OF_BLOCK = ("NAME", "SOURCE_TYPE", "DEVICE", "CREATION_DATE", "MEASUREMENT_DATE")
LISTS = ("WAVELENGTH_LIST", *(f"PARAM{k}_LIST" for k in range(5)))

_START = re.compile(r"\s*(?:#.*\n\s*)*VERSION[ \t]+[0-9]+\.[0-9]+")
_BINARY = re.compile(rb"^[ \t]*DATA[ \t]+binary", re.MULTILINE | re.IGNORECASE)
_TYPE = re.compile(r"^[ \t]*DATA_TYPE[ \t]+\w+", re.MULTILINE)


@dataclass(frozen=True, eq=False)
class _DataBlock:
    """A block of the file: its entries as written, its lists as numbers, and its table (PARAM3, 2, 1, 0, colour)."""

    entries: dict[str, str]
    lists: dict[str, np.ndarray]
    table: np.ndarray


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: VERSION, then a DATA_TYPE of theirs."""
    text = plain_text.start(head)
    return bool(_START.match(text)) and bool(_TYPE.search(text))


def read(path: Path, side: SideOfReflection = None) -> Gridded | Sheet:
    """The BRDF in a file, or a `Sheet` of it and of the BTDF. Blocks that are not read are in `about["other_blocks"]`,
    to be written again; `f` has none of them: no specular reflectance either.

    A grid about other directions than the mirror's (PARAM4_LIST) becomes `Scattered`. Raises FormatError where the file
    is damaged, with the line, or has neither.
    """
    lines = plain_text.read(path, comment="#", mixed=_BINARY)
    about: dict[str, Any] = {}
    blocks: dict[str, _DataBlock] = {}
    types: list[str] = []
    while (line := lines.peek()) is not None and not line.upper().startswith("DATA_TYPE"):
        lines.next()
        about.update([_entry(line, lines.mixed)])
    while lines.peek() is not None:
        block = _block(lines)
        types.append(block.entries["DATA_TYPE"])
        blocks[types[-1]] = block
    held = {quarter: blocks[data_type] for data_type, quarter in HELD.items() if data_type in blocks}
    if not held or len(blocks) < len(types):
        got = f"has blocks {types or 'none'}"
        raise FormatError(f"{path}: {got}, expected a brdf or a btdf, and at most one of each other type")
    names = wanted(held, side, path)
    about.pop("VERSION", None)
    parts: dict[str, Reflectance] = {}
    others = [vars(block) for data_type, block in blocks.items() if HELD.get(data_type) not in names]
    for name in names:
        entries = {k: v for k, v in held[name].entries.items() if k not in (*LISTS, *REQUIRED)}
        more = {"other_blocks": others} if others else {}
        part = _material(held[name], str(path), {**about, **entries, **more})
        parts |= {"front": part} if name == "front" else dict.fromkeys(("forward", "backward"), as_lit(part))
    if "forward" in parts and "front" in parts:
        parts["back"] = parts["front"]
    return joined(parts, side)


HELD = {"brdf": "front", "btdf": "forward"}
"""Blocks as parts of a `Sheet`."""

REQUIRED = ("DATA_TYPE", "COLOR_MODEL", "PARAM_TYPE", "REDUCTION_TYPE", "DATA")


def _entry(line: str, mixed: bool) -> tuple[str, str]:
    name, value = [*line.split(None, 1), ""][:2]
    return name.upper(), value.encode("latin-1").decode("utf-8", "replace") if mixed else value


def _block(lines: plain_text.Lines) -> _DataBlock:
    entries: dict[str, str] = {}
    lists: dict[str, np.ndarray] = {}
    while "DATA" not in entries:
        name, value = _entry(lines.take("DATA ascii or DATA binary, and a table"), lines.mixed)
        if name in entries:
            raise lines.fault(name, "each entry of a block once")
        if plain_text.is_number(name):
            raise lines.fault(name, "DATA_TYPE of the next block; the table before has more rows than its lists say")
        if name in LISTS:
            lists[name] = numbers = np.array(lines.floats(value, "a list of numbers"))
            rising = name == "PARAM4_LIST" or (np.diff(numbers) > 0.0).all()
            if not len(numbers) or not np.isfinite(numbers).all() or not rising:
                raise lines.fault(value, f"{name} with rising numbers")
        entries[name] = value if name in (*OF_BLOCK, *LISTS) else value.strip().lower()
    return _DataBlock(entries, lists, _table(lines, entries, lists))


def _table(lines: plain_text.Lines, entries: Mapping[str, str], lists: Mapping[str, np.ndarray]) -> np.ndarray:
    colour, data_type = entries.get("COLOR_MODEL", ""), entries.get("DATA_TYPE", "")
    if data_type not in DATA_TYPES or colour not in (*COLOURS, "spectrum"):
        got = f"DATA_TYPE {data_type:.40}, COLOR_MODEL {colour:.40}"
        raise lines.fault(got, f"one of {DATA_TYPES} and {(*COLOURS, 'spectrum')}")
    needed = ["PARAM0_LIST", *(["PARAM2_LIST", "PARAM3_LIST"] if data_type in ("brdf", "btdf") else [])]
    needed += ["WAVELENGTH_LIST"] if colour == "spectrum" else []
    if missing := [name for name in needed if name not in lists]:
        raise lines.fault(f"a {data_type} of {colour} without {', '.join(missing)}", "these lists before DATA")
    width = len(lists["WAVELENGTH_LIST"]) if colour == "spectrum" else len(COLOURS[colour] or "Y")
    shape = tuple(len(lists.get(f"PARAM{k}_LIST", (0,))) for k in (3, 2, 1, 0))
    count = math.prod(shape)
    if entries["DATA"] == "ascii":
        table = lines.rows(width, count, "a colour")
    elif entries["DATA"] == "binary":
        table = np.frombuffer(lines.bytes(4 * width * count, f"{count} colours of {width} float32 numbers"), "<f4")
    else:
        raise lines.fault(entries["DATA"], "DATA ascii or DATA binary")
    return table.reshape(*shape, width)


def _material(block: _DataBlock, path: str, about: Mapping[str, Any]) -> Gridded:
    system = block.entries.get("PARAM_TYPE", "")
    if system not in LAYOUT:
        raise FormatError(f"{path}: PARAM_TYPE {system!r:.60}: expected one of {', '.join(LAYOUT)}")
    layout, lists = LAYOUT[system], {word: block.lists.get(word, np.zeros(1)) for word in LISTS}
    kind, oriented = layout.system, len(lists["PARAM1_LIST"]) > 1 or bool(lists["PARAM1_LIST"][0])
    reduction = block.entries.get("REDUCTION_TYPE", "").split()
    if not set(reduction) <= {"bilateral_symmetry", "reciprocity"} or ("reciprocity" in reduction) > (kind[0] == "h"):
        got = f"REDUCTION_TYPE {reduction!s:.60}"
        raise FormatError(f"{path}: {got}: expected bilateral_symmetry, or reciprocity of half angles")
    mirrored, period = "bilateral_symmetry" in reduction, math.pi if "reciprocity" in reduction else 2.0 * math.pi
    if mirrored and oriented and (kind == "angles" or period < 2.0 * math.pi):
        raise FormatError(f"{path}: bilateral_symmetry and PARAM1_LIST: expected isotropic data of half a circle")
    channels: tuple[Any, ...] | None = COLOURS.get(block.entries["COLOR_MODEL"])
    if block.entries["COLOR_MODEL"] == "spectrum":
        channels = tuple(lists["WAVELENGTH_LIST"].tolist())
    axes, values, mirrored = layout.read(lists, block.table, mirrored, oriented)
    values = np.ascontiguousarray(values if channels is not None else values[..., 0])
    about = {k: v for k, v in about.items() if v != ""}
    theta, offsets = lists["PARAM0_LIST"], lists["PARAM4_LIST"]
    with held_by(path):
        if kind == "specular" and offsets.any():
            if len(offsets) != len(theta):
                raise FormatError(f"{path}: PARAM4_LIST: {len(offsets)} offsets, expected {len(theta)} as PARAM0_LIST")
            return libbsdf_grids.offset(axes, values, np.radians(theta + offsets), channels, path, about)
        periods = {"phi_d": period} if kind == "half_difference" else None
        named: dict[str, Any] = {"channels": channels, "mirrored": mirrored, "periods": periods}
        return Gridded(kind, axes, values, **named, path=path, about=about)


def write(
    m: Reflectance,
    path: Path,
    binary: Annotated[bool, Declared("tables of float32, to which values are rounded, in place of text")] = False,
    resolution: Resolution = None,
) -> None:
    """Write the BRDF on the grid of a measurement, else, and where `resolution` is given, on a grid of angles; and the
    other blocks of the file that it came from. What transmits, the same from both sides, gets a BTDF in the same way.

    Lost: uncertainties, and how to interpolate; of rows in no grid, all but the grid made of them. Raises
    ParameterError for delta lobes, maps, channels other than one, RGB, XYZ or rising wavelengths, and periods other
    than pi of phi_d.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.ssdd", resolution=(4, 4, 6))
    >>> print(gn.load("white.ssdd").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    parts = same_from_both(m, NAME)
    tables = {q: table_of(as_lit(part) if q == "forward" else part, resolution) for q, part in parts.items()}
    table = next(iter(tables.values()))
    blocks = [_block_of(part, data_type) for data_type, q in HELD.items() if (part := tables.get(q)) is not None]
    written = {block.entries["DATA_TYPE"] for block in blocks}
    others = [_DataBlock(**block) for block in table.about.get("other_blocks", [])]
    blocks += [block for block in others if block.entries["DATA_TYPE"] not in written]
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(b"VERSION 0.2\n")
        file.writelines(f"{k} {v}\n".encode() for k, v in _said(table, OF_FILE))
        for number, block in enumerate(blocks):
            entries = {**block.entries, **(dict(_said(table, OF_BLOCK)) if number < len(tables) else {})}
            entries.pop("DATA", None)
            file.writelines(f"{k} {v}\n".encode() for k, v in entries.items())
            file.write(f"DATA {'binary' if binary else 'ascii'}\n".encode())
            colours = block.table.reshape(-1, block.table.shape[-1])
            if binary:
                file.write(colours.astype("<f4").tobytes() + b"\n")
            else:
                file.writelines(line.encode() for line in plain_text.join(colours))


def _with_both_azimuths(m: Gridded) -> Gridded:
    """f of a relative table with an axis of phi_o in place of phi: all sums of its nodes of phi and phi_i."""
    theta_i, theta_o, phi, phi_i = m.axes.values()
    phi_o = distinct(turned(np.add.outer(phi, phi_i).reshape(-1)))
    axes = dict(zip(SYSTEMS["angles"].oriented, (theta_i, theta_o, phi_i, phi_o), strict=True))
    fits(math.prod(map(len, axes.values())), f"{m!r:.80} with {len(phi_o)} azimuths of wo")
    f = f_at(m, *SYSTEMS["angles"].directions(axes))
    return Gridded("angles", axes, f, channels=m.channel_names, about=m.about)


def _said(m: Gridded, names: Sequence[str]) -> list[tuple[str, str]]:
    return [(k, m.about[k]) for k in names if isinstance(m.about.get(k), str) and not re.search(r"[\r\n]", m.about[k])]


def _block_of(m: Gridded, kind_of_data: str) -> _DataBlock:
    oriented = tree.is_oriented(m)
    if m.parameterization == "relative" and oriented:
        m = _with_both_azimuths(m)
    coordinates, layout = next((c, x) for c, x in LAYOUT.items() if angle_system(x.system).axes(oriented) == (*m.axes,))
    plain = m.quantity == "brdf" and not isinstance(m, Scattered)
    values = m.stored if plain else m.brdf()
    names, values = tristimulus(m.channel_names, values if m.channel_names is not None else values[..., None])
    angles, table = layout.written(m.axes, values, m.is_mirrored)
    reduction = ["bilateral_symmetry"] if m.is_mirrored else []
    for axis, period in m.periods.items():
        if abs(period - math.pi) < 1e-12 and axis == "phi_d":
            reduction.append("reciprocity")
        elif abs(period - 2.0 * math.pi) > 1e-12:
            got = f"{axis} has the period {period:g}"
            raise ParameterError(f"{m!r:.80}: {got}, expected 2 pi, or pi for phi_d; tabulate it")
    entries = {"DATA_TYPE": kind_of_data, **_colour(m, names), "PARAM_TYPE": coordinates}
    if reduction:
        entries["REDUCTION_TYPE"] = " ".join(reduction)
    for word in LISTS[1:5]:
        if word != "PARAM1_LIST" or oriented:
            entries[word] = " ".join(map(plain_text.number, angles[word]))
    return _DataBlock(entries, {}, table)


def _colour(m: Gridded, names: tuple | None) -> dict[str, str]:
    for colour, channels in COLOURS.items():
        if names == channels:
            return {"COLOR_MODEL": colour}
    if names is None or any(isinstance(n, str) for n in names) or (np.diff(names) <= 0.0).any():
        rule = "expected one, R, G, B, X, Y, Z or rising wavelengths [nm]"
        raise ParameterError(f"{m!r:.80}: has channels {names}, {rule}")
    return {"COLOR_MODEL": "spectrum", "WAVELENGTH_LIST": " ".join(map(plain_text.number, names))}
