"""Speos' (OPTIS) text files: headers, lists of angles, tables, read and written. Their meaning: see `speos`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FormatError
from .._optical.angle_tables import increasing
from .._reading import plain_text

START = "optis - "
BRDF, ANISOTROPIC = "OPTIS - brdf surface file v8.0", "OPTIS - Anisotropic BSDF surface file v8.0"


class AngleTable(NamedTuple):
    """Values (theta, phi) as written, angles [degrees], and the share [%] where tables have one."""

    share: float
    theta: np.ndarray
    phi: np.ndarray
    values: np.ndarray


class ScatteredPart(NamedTuple):
    """Reflection or transmission: tables by sample and incidence, or by incidence and wavelength.

    turns      angles of the sample, (0,) in a `.brdf`
    incidence  a list for each of them
    lit        where the spectrum was measured (theta, phi)
    spectrum   wavelength and share [%], (n, 2); of a `.brdf` wavelengths only, (n, 1)
    """

    turns: list[float]
    incidence: list[list[float]]
    lit: list[float]
    word: str
    spectrum: np.ndarray
    tables: list[AngleTable]


class SpeosFile(NamedTuple):
    """A file."""

    start: str
    comment: str
    description: str
    vector: list[float]
    of_bsdf: bool
    parts: dict[str, ScatteredPart]

    @property
    def is_anisotropic(self) -> bool:
        return "anisotropic" in self.start.lower()


def read_sheet(path: Path) -> SpeosFile:
    """The content of a file. Raises FormatError where it is damaged, binary or of an unknown version."""
    text = plain_text.text(path)
    start, *head = text.split("\n", 3)
    if not start.lower().startswith(START) or len(head) < 3:
        raise FormatError(f"{path}: begins with {start[:60]!r}, expected {BRDF!r} or {ANISOTROPIC!r}, and more lines")
    if head[0].split() != ["0"]:
        raise FormatError(f"{path}, line 2: got {head[0][:20]!r}, expected 0: text; save binary files as text first")
    version = start.rpartition("v")[2].strip()
    if not plain_text.is_whole(version.replace(".", "", 1)) or float(version) < 7.0:
        raise FormatError(f"{path}: version {version[:10]!r}, expected 7 or above; save it anew with Ansys' viewer")
    described, rest, number = _described(path, head[2])
    lines = plain_text.Lines(path, rest)
    lines.number = number
    anisotropic = "anisotropic" in start.lower()
    vector = lines.floats(lines.take("a vector")) if anisotropic else []
    if anisotropic and len(vector) != 3:
        raise lines.fault(f"{len(vector)} numbers", "the 3 of a direction")
    flags = lines.floats(lines.take("two flags, of reflection and transmission"))
    of_bsdf = lines.floats(lines.take("1 for BSDF, 0 for intensity"))
    if len(flags) != 2 or not {*flags, *of_bsdf} <= {0.0, 1.0} or len(of_bsdf) != 1:
        raise lines.fault(f"{flags} and {of_bsdf}", "flags 0 or 1: reflection, transmission; and 1 for BSDF")
    names = [name for name, flag in zip(("reflection", "transmission"), flags, strict=True) if flag]
    parts = (_anisotropic_parts if anisotropic else _isotropic_parts)(lines, names)
    for line in lines:
        if line.lower().startswith(START):
            raise lines.fault("another header", "one table after the other of one file; keep several files apart")
    return SpeosFile(start.strip(), head[1].strip(), described, vector, bool(of_bsdf[0]), parts)


def _described(path: Path, text: str) -> tuple[str, str, int]:
    """The description, whose length the first line tells; the text after it; and the number of the line before that."""
    length, _, rest = text.partition("\n")
    if not plain_text.is_whole(length.strip()):
        raise FormatError(f"{path}, line 4: got {length[:20]!r}, expected how many characters the description has")
    wanted, described = int(length), list[str]()
    rows = rest.split("\n", 1000)
    # Ends of lines count as one or two characters, and that of the last line counts or not.
    while wanted and rows and sum(map(len, described)) + 2 * len(described) < wanted:
        described.append(rows.pop(0))
    return "\n".join(described), "\n".join(rows), 4 + len(described)


def _counts(lines: plain_text.Lines, expected: str) -> tuple[int, int]:
    counts = lines.floats(lines.take(expected))
    if len(counts) != 2 or not all(c >= 1.0 and c == int(min(c, 1e9)) for c in counts):
        raise lines.fault(f"{counts}", expected)
    return int(counts[0]), int(counts[1])


def _angles(lines: plain_text.Lines, name: str, low: float, high: float, count: int | None = None) -> list[float]:
    """Increasing angles [degrees]; their count comes first where it is not known."""
    count = lines.count(lines.take(f"how many {name}")) if count is None else count
    angles = lines.numbers(count, name).tolist()
    increasing(f"{lines.path}, line {lines.number}", name, angles, low, high)
    return angles


def _isotropic_parts(lines: plain_text.Lines, names: list[str]) -> dict[str, ScatteredPart]:
    incidences, wavelengths = _counts(lines, "counts of angles of incidence and wavelengths")
    incidence = _angles(lines, "angles of incidence", 0.0, 90.0, incidences)
    spectrum = lines.numbers(wavelengths, "wavelengths")[:, None]
    if not (np.diff(spectrum[:, 0]) > 0.0).all():
        raise lines.fault(f"{spectrum[:, 0].tolist()}", "increasing wavelengths")
    parts = {}
    for name in names:
        tables = [_table(lines, lines.numbers(1, "share [%]")[0]) for _ in range(len(incidence) * len(spectrum))]
        parts[name] = ScatteredPart([0.0], [incidence], [], "", spectrum, tables)
    return parts


def _anisotropic_parts(lines: plain_text.Lines, names: list[str]) -> dict[str, ScatteredPart]:
    angles = {}
    for name in names:
        turns = _angles(lines, "angles of the sample", -360.0, 360.0)
        angles[name] = turns, [_angles(lines, "angles of incidence", 0.0, 90.0) for _ in turns]
    spectra = {name: _spectrum(lines) for name in names}
    parts = {}
    for name in names:
        turns, incidence = angles[name]
        tables = [_table(lines, math.nan) for row in incidence for _ in row]
        parts[name] = ScatteredPart(turns, incidence, *spectra[name], tables)
    return parts


def _spectrum(lines: plain_text.Lines) -> tuple[list[float], str, np.ndarray]:
    """The direction of light, the word that follows, which may be missing, and wavelengths with their shares."""
    lit = lines.floats(lines.take("theta and phi of the light of the spectrum"))
    word = ""
    line = lines.take("a name for the spectrum, or how many wavelengths")
    if not plain_text.is_whole(line.replace(".", "", 1)):
        word, line = line, lines.take("how many wavelengths")
    spectrum = lines.rows(2, lines.count(line, "how many wavelengths"), "wavelength [nm] and share [%]")
    if not lit or not len(spectrum) or not (np.diff(spectrum[:, 0]) > 0.0).all():
        raise lines.fault(f"{len(spectrum)} wavelengths", "a direction, and increasing wavelengths")
    return lit, word, spectrum


def _table(lines: plain_text.Lines, share: float) -> AngleTable:
    thetas, phis = _counts(lines, "counts of theta and phi")
    phi = lines.numbers(phis, "azimuths phi")
    rows = lines.rows(phis + 1, thetas, "theta and values")
    theta = rows[:, 0].copy()
    where = f"{lines.path}, line {lines.number}"
    increasing(where, "phi", phi.tolist(), -360.0, 360.0)
    increasing(where, "theta", theta.tolist(), 0.0, 180.0)
    return AngleTable(float(share), theta, phi, rows[:, 1:].copy())


def written(sheet: SpeosFile) -> Iterator[str]:
    """The lines of a file."""
    number = plain_text.number
    yield f"{sheet.start}\n0\n{sheet.comment}\n{len(sheet.description)}\n{sheet.description}\n"
    if sheet.is_anisotropic:
        yield from plain_text.join([sheet.vector], "\t")
    yield "\t".join(str(int(name in sheet.parts)) for name in ("reflection", "transmission")) + "\n"
    yield f"{int(sheet.of_bsdf)}\n"
    if not sheet.is_anisotropic:
        part = next(iter(sheet.parts.values()))
        yield f"{len(part.incidence[0])}\t{len(part.spectrum)}\n"
        yield from plain_text.join([part.incidence[0], part.spectrum[:, 0].tolist()], "\t")
    else:
        for part in sheet.parts.values():
            for angles in (part.turns, *part.incidence):
                yield from plain_text.join([[len(angles)], angles], "\t")
        for part in sheet.parts.values():
            yield from plain_text.join([part.lit, [part.word], [len(part.spectrum)]], "\t")
            yield from plain_text.join(part.spectrum, "\t")
    for part in sheet.parts.values():
        for table in part.tables:
            yield f"{number(table.share)}\n" if not sheet.is_anisotropic else ""
            yield f"{len(table.theta)}\t{len(table.phi)}\n\t"
            yield from plain_text.join([table.phi.tolist()], "\t")
            yield from plain_text.join(np.column_stack([table.theta, table.values]), "\t")
    yield "End of file\n" if sheet.is_anisotropic else ""
