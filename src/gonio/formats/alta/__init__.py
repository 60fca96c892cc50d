"""ALTA's data files, text or binary: rows of numbers of a parametrisation, values, and bounds of the values.

Lines `#KEY value` come first: `#DIM nX nY`, `#PARAM_IN` (the parametrisation, see `parametrisations`), `#PARAM_OUT`
(INV_STERADIAN is f, INV_STERADIAN_COSINE_FACTOR f cos(theta_o), RGB_COLOR and XYZ_COLOR f of three channels), `#VS`
(1: the values are given within plus or minus a bound, 2: within a lower and an upper one). Then rows x1 ... y1 ...
and bounds, of the first value or of all; in binary files, after `#BEGIN_STREAM`, `#SAMPLE_COUNT` rows of float64 in
the order that `#ENDIAN` says. Angles are radians, view first where it is so named (TV_TL) and in CARTESIAN. This
follows ALTA's data_storage.cpp and params.h. Checked against its own generator only.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ...base.reflectance import Reflectance
from ...declared.arguments import Declared
from ...errors import FormatError, ParameterError
from ...files import replacing
from ...tables.angle_systems import SYSTEMS
from ...tables.gridded import Gridded
from .._reading import plain_text
from .._rows import direction_pairs
from .._rows.pairs_of_material import Resolution, pairs_of
from .parametrisations import PARAMETERS

NAME = "ALTA"
SUFFIXES = (".alta", ".dat", ".data", ".txt")
SHARED_SUFFIX = True
DESCRIPTION = "rows of a parametrisation and values, text or binary (ALTA)"
ORACLE = "own generator only"
NO_LAYOUT = "columns are functions of all angles: `PARAMETERS` has them with their inverses"

QUANTITIES = {
    "INV_STERADIAN": "brdf",
    "INV_STERADIAN_COSINE_FACTOR": "brdf * cos(theta_o)",
    "RGB_COLOR": "brdf",
    "XYZ_COLOR": "brdf",
    "UNKNOWN_OUTPUT": "brdf",
}
"""PARAM_OUT -> quantity of the values; f where a file has none."""

WRITTEN = [name for name, parameters in PARAMETERS.items() if parameters.of_angles is not None]
"""Parametrisations that directions can be put into."""

ORIENTED = ("RUSIN_TH_PH_TD", "RUSIN_VH")
"""Parametrisations of three numbers of which one is an azimuth of the sample."""

_DIM = re.compile(r"^[ \t]*#[ \t]*DIM[ \t]+[0-9]+[ \t]+[0-9]+[ \t]*$", re.MULTILINE)
_FUNCTION = re.compile(r"^[ \t]*#[ \t]*FUNC\b", re.MULTILINE)
_STREAM = re.compile(rb"^[ \t]*#[ \t]*BEGIN_STREAM", re.MULTILINE)
_KEY = re.compile(r"#\s*([A-Z_]+)\s+(\S.*)")


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: it has a line #DIM, and no #FUNC as ALTA's functions have."""
    text = plain_text.start(head)
    return bool(_DIM.search(text)) and not _FUNCTION.search(text)


def read(
    path: Path,
    param_in: Annotated[str | None, Declared("parametrisation, in place of the file's", words=(*PARAMETERS,))] = None,
    param_out: Annotated[str | None, Declared("quantity, in place of the file's word", words=(*QUANTITIES,))] = None,
) -> Gridded:
    """The measurement in a file: a grid if its rows fill one, else `Scattered`.

    Bounds are intervals and no standard uncertainties: where all values have them, the uncertainty is that of a
    rectangular distribution, the width/sqrt(12) (GUM 4.3.7). The rows are kept in `about["alta"]` to be written again.
    Raises FormatError where the file is damaged, with the line.
    """
    lines = plain_text.read(path, mixed=_STREAM)
    header = _header(lines)
    header |= {key: word for key, word in (("PARAM_IN", param_in), ("PARAM_OUT", param_out)) if word}
    rows = _stream(lines, header) if lines.mixed else _rows(lines, header)
    if not len(rows):
        raise lines.cut_short("rows of numbers")
    return _material(header, rows, str(path))


def _header(lines: plain_text.Lines) -> dict[str, str]:
    header: dict[str, str] = {}
    while (line := lines.peek()) is not None and line.startswith("#"):
        lines.next()
        if re.fullmatch(r"#\s*BEGIN_STREAM", line):
            break
        if match := _KEY.fullmatch(line):
            header[match[1]] = match[2]
    return header


def _dimensions(path: str, header: Mapping[str, str]) -> tuple[int, int, int]:
    """Columns of x and y, and the number of #VS."""
    words = [*header.get("DIM", "").split(), *dict.fromkeys(header.get("VS", "0").split())]
    got = f"{path}: #DIM {header.get('DIM')!s:.60}, #VS {header.get('VS')!s:.60}"
    if len(words) != 3 or not all(re.fullmatch(r"[0-9]{1,4}", w) for w in words):
        raise FormatError(f"{got}: expected two numbers, and 0, 1 or 2")
    nx, ny, kind = map(int, words)
    name, out = header.get("PARAM_IN", "UNKNOWN_INPUT"), header.get("PARAM_OUT", "INV_STERADIAN")
    if name not in PARAMETERS:
        listed = ", ".join(PARAMETERS)
        raise FormatError(f"{path}: #PARAM_IN {name:.60}: expected one of {listed}; give param_in= if you know which")
    if out not in QUANTITIES:
        raise FormatError(f"{path}: #PARAM_OUT {out:.60}: is no BRDF, expected one of {', '.join(QUANTITIES)}")
    size = PARAMETERS[name].size
    if nx != size or ny < 1 or kind > 2:
        raise FormatError(f"{got}: expected {size} numbers for {name}, at least one value, and 0, 1 or 2")
    return nx, ny, kind


def _rows(lines: plain_text.Lines, header: Mapping[str, str]) -> np.ndarray:
    nx, ny, kind = _dimensions(lines.path, header)
    first = lines.peek()
    count = len(plain_text.split(first)) if first else 0
    if first and count not in (nx + ny + kind, nx + ny + kind * ny):
        lines.next()
        raise lines.fault(first, f"{nx} numbers, {ny} values and bounds of one or all of them, as #DIM and #VS say")
    lines.comment = "#"
    return lines.rows(max(count, 1))


def _stream(lines: plain_text.Lines, header: Mapping[str, str]) -> np.ndarray:
    nx, ny, kind = _dimensions(lines.path, header)
    order = {"little": "<f8", "big": ">f8"}.get(header.get("ENDIAN", "little").lower())
    precision, count = header.get("PRECISION", "ieee754-double"), header.get("SAMPLE_COUNT", "")
    if order is None or precision != "ieee754-double" or not plain_text.is_whole(count):
        got = f"#ENDIAN {header.get('ENDIAN')!s:.60}, #PRECISION {precision:.60}, #SAMPLE_COUNT {count:.60}"
        raise FormatError(f"{lines.path}: {got}: expected little or big, ieee754-double and a whole number")
    columns = nx + ny + kind * ny
    stream = lines.bytes(8 * columns * int(count), f"{count} rows of {columns} numbers")
    rest = lines.next()
    if rest is not None and not re.fullmatch(r"#\s*END_STREAM", rest):
        raise lines.fault(rest, f"#END_STREAM after {count} rows of {columns} numbers")
    return np.frombuffer(stream, order).astype(np.float64).reshape(int(count), columns)


def _material(header: Mapping[str, str], rows: np.ndarray, path: str) -> Gridded:
    nx, ny, kind = _dimensions(path, header)
    out = header.get("PARAM_OUT", "INV_STERADIAN")
    channels: tuple[str, ...] | None = None
    if ny > 1 or out in ("RGB_COLOR", "XYZ_COLOR"):
        channels = tuple("XYZ" if out == "XYZ_COLOR" else "RGB") if ny == 3 else tuple(map(str, range(ny)))
    values = rows[:, nx : nx + ny]
    spread = _uncertainty(rows[:, nx + ny :], ny, kind, "BEGIN_STREAM" in header or "SAMPLE_COUNT" in header)
    if channels is None:
        values, spread = values[:, 0], None if spread is None else spread[:, 0]
    about = {"alta": {"header": dict(header), "rows": rows}}
    pairs = direction_pairs.Pairs(rows[:, :0], values, QUANTITIES[out], spread, channels)
    x = rows[:, :nx].T
    if not np.isfinite(x).all():
        raise FormatError(f"{path}: row {np.argmin(np.isfinite(x).all(axis=0)) + 1} has no finite {header['PARAM_IN']}")
    with np.errstate(invalid="ignore"):
        grid = _half_difference(header["PARAM_IN"], x, pairs, path, about)
        if grid is not None:
            return grid
        angles = PARAMETERS[header["PARAM_IN"]].to_angles(*x)
    if isotropic := nx < 4 and header["PARAM_IN"] not in ORIENTED:
        angles = angles[0], 0.0 * angles[0], angles[2], angles[3] - angles[1]
    pairs = pairs._replace(angles=np.stack(np.broadcast_arrays(*angles), axis=1))
    return direction_pairs.material(pairs, path, about, isotropic=isotropic or None)


def _uncertainty(bounds: np.ndarray, ny: int, kind: int, blocks: bool) -> np.ndarray | None:
    """Of bounds of all values: half widths, or lower and upper ones, side by side in text and in blocks in a stream."""
    if not kind or bounds.shape[1] != kind * ny:
        return None
    if kind == 1:
        return np.abs(bounds) / math.sqrt(3.0)
    lower, upper = (bounds[:, :ny], bounds[:, ny:]) if blocks else (bounds[:, ::2], bounds[:, 1::2])
    return np.abs(upper - lower) / math.sqrt(12.0)


def _half_difference(
    name: str, x: np.ndarray, pairs: direction_pairs.Pairs, path: str, about: Mapping[str, Any]
) -> Gridded | None:
    """The grid of half and difference angles that the rows fill, or None. Angles that have no column are 0."""
    half = PARAMETERS[name].half
    if not half:
        return None
    angles = dict(zip(half, np.arccos(x) if name.startswith("COS") else x, strict=True))
    names = SYSTEMS["half_difference"].axes("phi_h" in half)
    columns = {axis: angles[axis] for axis in names if axis in angles}
    if any(((c < 0.0) | (c > 0.5 * math.pi + 1e-6)).any() for n, c in columns.items() if n.startswith("theta")):
        return None
    reduced = {}
    phi = columns.get("phi_d")
    if phi is not None and len(np.unique(phi)) > 1:
        if np.ptp(phi) > math.pi + 1e-6 or phi.min() < 0.0 or phi.max() > math.pi + 1e-6:
            columns["phi_d"] = phi + math.pi
        else:
            reduced = {"periods": {"phi_d": math.pi}, "mirrored": len(names) == 3 and phi.max() <= 0.5 * math.pi + 1e-6}
    filled = direction_pairs.grid_of(columns, pairs, path)
    if filled is None or any(np.ptp(a) > 2.0 * math.pi + 1e-6 for a in filled[0].values()):
        return None
    axes, order = filled
    whole_axes = {axis: axes.get(axis, np.zeros(1)) for axis in names}
    return direction_pairs.gridded("half_difference", whole_axes, order, pairs, path=path, about=about, **reduced)


def write(
    m: Reflectance,
    path: Path,
    param_in: Annotated[
        str | None,
        Declared("usually ISOTROPIC_TV_TL_DPHI, with several azimuths of wi SPHERICAL_TL_PL_TV_PV", words=(*WRITTEN,)),
    ] = None,
    binary: Annotated[bool, Declared("a stream of float64 in place of text")] = False,
    resolution: Resolution = None,
) -> None:
    """Write rows: those that `m` was read from, if `param_in` is not given; else the pairs of a measurement; of other
    materials those of a grid of angles.

    An uncertainty u becomes the bound sqrt(3) u. A cosine at wo stays, other quantities become f. Lost: nodes without
    data, names of channels. Raises ParameterError for delta lobes, maps, and parametrisations that lack an azimuth.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.alta", format="ALTA", resolution=(4, 4, 6))
    >>> print(gn.load("white.alta").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    filed = getattr(m, "about", {}).get("alta")
    if filed and param_in is None and _material(filed["header"], filed["rows"], "") == m:
        header, rows = filed["header"], filed["rows"]
    else:
        header, rows = _of_pairs(pairs_of(m, resolution, ("brdf", "brdf * cos(theta_o)")), param_in)
    with replacing(path) as temporary, temporary.open("wb") as file:
        stream = {"FORMAT", "VERSION", "PRECISION", "SAMPLE_COUNT", "ENDIAN"}
        lines = [f"#{key} {value}\n" for key, value in header.items() if key not in stream]
        if binary:
            lines.append(f"#FORMAT binary\n#VERSION 0\n#PRECISION ieee754-double\n#SAMPLE_COUNT {len(rows)}\n")
            lines.append("#ENDIAN little\n#BEGIN_STREAM\n")
        file.write("".join(lines).encode())
        if binary:
            file.write(rows.astype("<f8").tobytes() + b"\n#END_STREAM\n")
        else:
            file.writelines(line.encode() for line in plain_text.join(rows, "\t"))


def _of_pairs(pairs: direction_pairs.Pairs, param_in: str | None) -> tuple[dict[str, str], np.ndarray]:
    name = param_in or ("SPHERICAL_TL_PL_TV_PV" if pairs.angles[:, 1].any() else "ISOTROPIC_TV_TL_DPHI")
    of_angles = PARAMETERS[name].of_angles
    assert of_angles is not None
    if PARAMETERS[name].size < 4 and len(np.unique(pairs.angles[pairs.angles[:, 0] > 0.0, 1])) > 1:
        raise ParameterError(f"param_in={name!r}: holds no azimuth of wi, and there are several; leave param_in out")
    columns = [*of_angles(*pairs.angles.T), *pairs.columns().T]
    header = {"DIM": f"{PARAMETERS[name].size} {len(pairs.columns().T)}", "PARAM_IN": name}
    header["PARAM_OUT"] = "INV_STERADIAN" if pairs.quantity == "brdf" else "INV_STERADIAN_COSINE_FACTOR"
    if pairs.uncertainty is not None:
        header["VS"] = "1"
        columns += [*(math.sqrt(3.0) * pairs.uncertainty.reshape(len(pairs.angles), -1).T)]
    return header, np.stack(columns, axis=1)
