"""Exports of the RT-300S goniophotometer's software: `.jdv`, and texts for other programs.

Four dialects of the same tables, one record for each angle of incidence, one after the other:

    RT-300S   `DataType: BRDF(RT-300S)`, `SampleID:`, `Incidence:`, `Polar: first,last,step`, `Azimuth: ...`,
              `Raw data`, then a row of Polar and rows of Azimuth and values
    Raywiz    `DataType: BRDF(Raywiz)`, `SampleID:`, counts, first and last Azimuth and Polar, the angle of incidence,
              then a row of values by Azimuth for each Polar
    Reflet    `Name / Comment :`, `Theta measure beginning :` and others, `Theta Lighting`, then rows of Polar and
              values
    Speos     `OPTIS - Anisotropic BSDF surface file v1.0`, `SampleID: Sample 60` (the only source of the angle of
              incidence), a header, then a row of Azimuth and rows of Polar and values; a second table is derived from
              it

For the angles and the quantity see `rt300s`. From a file with several measurements the last is read, or the one asked
for. Checked against four exports of one measurement, which give the same table; they hold test data only, whose values
mean nothing. Even spacing of Raywiz' Polar, and the meaning of its first line, are guesses.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np

from ..declared.arguments import Declared
from ..errors import FormatError
from ..tables.gridded import Gridded
from ._optical import rt300s
from ._optical.rt300s import Scan
from ._reading import plain_text

NAME = "RT-300S"
SUFFIXES = (".jdv", ".rtd", ".txt")
SHARED_SUFFIX = True
DESCRIPTION = "exports of the RT-300S goniophotometer: .jdv, Raywiz, Reflet (LightTools), Speos"
ORACLE = "real files (University of Arizona), the same measurement in four dialects"

RAW, RAYWIZ = "datatype: brdf(rt-300s)", "datatype: brdf(raywiz)"
REFLET, SPEOS = "name / comment :", "optis - anisotropic"


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is one of these."""
    text = b" ".join(head.replace(b"\0", b"").lower().split())
    start = text[:256]
    if start.startswith(SPEOS.encode()):
        return b"v1.0 sampleid:" in start
    if RAW.encode() in start or RAYWIZ.encode() in start:
        return True
    return start.startswith(REFLET.encode()) and b"theta measure beginning" in text


def read(
    path: str | os.PathLike,
    measurement: Annotated[
        int, Declared("which measurement is read, where angles of incidence are repeated: from 0, or -1, the last")
    ] = -1,
) -> Gridded:
    """The reflectance of a file: `angles` axes theta_i, theta_o, phi; quantity "brdf * cos(theta_o)".

    Raises FormatError where the file is damaged, or holds no such measurement.
    """
    lines = plain_text.read(path)
    first = " ".join((lines.peek() or "").lower().split())
    dialects = {RAW: _raw, RAYWIZ: _raywiz, REFLET: _reflet, SPEOS: _speos}
    for start, dialect in dialects.items():
        if first.startswith(start):
            return rt300s.of_scans(Path(path), list(dialect(lines)), measurement)
    raise FormatError(f"{path}: begins with {first[:40]!r}, expected one of {', '.join(map(repr, dialects))}")


def _raw(lines: plain_text.Lines) -> Iterator[Scan]:
    while (words := _words(lines, "raw data")) is not None:
        receive = lines.floats(lines.take("a row of Polar angles"))
        rows = _rows(lines, len(receive) + 1)
        azimuth = [row[0] for row in rows]
        for name, angles in (("polar", receive), ("azimuth", azimuth)):
            _expect(lines, name, words.get(name, ""), angles)
        incidence = lines.float(words.get("incidence", ""), "Incidence: and an angle")
        yield Scan(words.get("sampleid", ""), incidence, azimuth, receive, np.array(rows)[:, 1:])


def _raywiz(lines: plain_text.Lines) -> Iterator[Scan]:
    while (words := _words(lines, "date")) is not None:
        lines.floats(lines.take("counts"))
        ends = lines.floats(lines.take("first and last Azimuth and Polar"))
        incidence = lines.floats(lines.take("the angle of incidence"))
        columns = len(plain_text.split(lines.peek() or ""))
        if len(ends) != 4 or len(incidence) != 1 or not columns:
            raise lines.fault(f"{len(ends)} and {len(incidence)} numbers", "4 angles, then the angle of incidence")
        rows = _rows(lines, columns)
        azimuth, receive = np.linspace(ends[0], ends[1], columns), np.linspace(ends[2], ends[3], len(rows))
        yield Scan(words.get("sampleid", ""), incidence[0], azimuth.tolist(), receive.tolist(), np.array(rows).T)


def _reflet(lines: plain_text.Lines) -> Iterator[Scan]:
    while (words := _words(lines, "theta lighting")) is not None:
        ends = ("beginning", "end", "step")
        phi = [lines.float(words.get(f"phi measure {end}", ""), f"Phi measure {end}") for end in ends]
        azimuth = _range(lines, phi)
        rows = _rows(lines, len(azimuth) + 1)
        receive = [row[0] for row in rows]
        _expect(lines, "theta measure", ",".join(words.get(f"theta measure {end}", "") for end in ends), receive)
        incidence = lines.float(words["theta lighting"], "Theta Lighting and an angle")
        yield Scan(words.get("name / comment", ""), incidence, azimuth, receive, np.array(rows)[:, 1:].T)


def _speos(lines: plain_text.Lines) -> Iterator[Scan]:
    while (line := lines.next()) is not None:
        if not line.lower().startswith(SPEOS):
            continue  # the derived table
        name = lines.take("SampleID:").partition("\t")[2].strip()
        incidence = re.search(r"(?:[-+]|(?<![0-9]))[0-9]+(\.[0-9]+)?$", name)
        if incidence is None:
            raise lines.fault(name, "a name that ends with the angle of incidence")
        for _ in range(7):
            lines.take("a header of 7 lines")
        lines.take("the name of the spectrum")
        for _ in range(lines.count(lines.take("the number of wavelengths"))):
            lines.take("a wavelength and a share")
        azimuth = lines.floats(lines.take("a row of Azimuth angles"))
        rows: list[list[float]] = []
        while (line := lines.peek()) is not None and not line.lower().startswith(SPEOS):
            row = lines.floats(line)
            if rows and row == rows[-1]:
                raise lines.fault(line, "each Polar angle once; remove the repeated row")
            if rows and row and row[0] <= rows[-1][0]:
                break
            lines.next()
            rows.append(lines.row(line, len(azimuth) + 1))
        if not rows:
            raise lines.cut_short("rows of Polar angles and values")
        yield Scan(name, float(incidence[0]), azimuth, [row[0] for row in rows], np.array(rows)[:, 1:].T)


def _words(lines: plain_text.Lines, last: str) -> dict[str, str] | None:
    """Entries by keys in lower case, up to and with the key `last`; None at the end of the file."""
    words: dict[str, str] = {}
    for line in lines:
        key, _, value = line.partition("\t") if "\t" in line else line.partition(":")
        key = key.strip().rstrip(":").strip().lower()
        words[key] = value.strip()
        if key == last:
            return words
    if words:
        raise lines.cut_short(repr(last))
    return None


def _rows(lines: plain_text.Lines, columns: int) -> list[list[float]]:
    """The following lines that begin with a number."""
    rows = []
    while (line := lines.peek()) is not None and re.match(r"[-+.0-9]", line):
        lines.next()
        rows.append(lines.row(line, columns))
    if not rows:
        raise lines.cut_short(f"rows of {columns} numbers")
    return rows


def _range(lines: plain_text.Lines, ends: list[float]) -> list[float]:
    """The angles first, first + step, ... last."""
    first, last, step = ends
    count = 1.0 + (np.round((last - first) / step) if step else 0.0)
    if not 1.0 <= count <= 100_000.0:
        raise lines.fault(repr(ends), "first and last angle, and the step between")
    return (first + step * np.arange(int(count))).tolist()


def _expect(lines: plain_text.Lines, name: str, entry: str, angles: list[float]) -> None:
    """Raises FormatError unless the angles are those of the header's entry: the file was cut, or changed."""
    ends = lines.floats(entry)
    if len(ends) != 3:
        raise lines.fault(entry, f"{name}: first and last angle, and the step between")
    expected = _range(lines, ends)
    if len(angles) != len(expected) or not np.allclose(angles, expected, atol=1e-6):
        raise lines.fault(f"{len(angles)} angles of {name}", f"{len(expected)}: {entry}")
