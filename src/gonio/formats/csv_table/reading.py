"""Reading a table: one of our own, by its words, or a laboratory's, as it was understood."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError, MeaningWarning, warn
from ...tables.angle_systems import ANGLES
from .._laboratory.layout import NOTE
from .._laboratory.meanings import stated_incidence
from .._laboratory.names import QUANTITIES
from .._laboratory.sheets import COLUMNS
from .._laboratory.suspicions import suspicions
from .._laboratory.understanding import Understood
from .._reading import plain_text
from .columns import of_columns
from .words import VALUE


def of_table(table: Understood, path: str, side: str | None) -> Any:
    """The measurement of a laboratory's table."""
    about: dict[str, Any] = {**table.layout.notes, **described(table)}
    about["angle_unit"] = "rad" if table.in_radians else "deg"
    m = of_columns(path, dict(table.angles), table.values, about, side, stated_incidence(table.layout.text))
    for text in suspicions(table):
        warn(f"{path}: {text}", MeaningWarning)
    return m


def described(table: Understood) -> dict[str, Any]:
    """What `about` says of a laboratory's table: its text, its columns if they have other names, what is missing."""
    names = {column.name for column in table.columns}
    about: dict[str, Any] = {}
    if table.layout.text or table.numbers.below:
        about["text"] = [*table.layout.text, *table.numbers.below]
    if not all(name.lower() in ANGLES or VALUE.fullmatch(name) for name in names):
        about["columns"] = {
            column.name or "(said)": f"{column.meaning} [{column.unit}]" if column.unit else column.meaning
            for column in table.columns
        }
    if table.remarks:
        about["understood"] = list(table.remarks)
    return about


def read_own(path: Path, side: str | None) -> Any:
    """The table in a file of `write`."""
    lines = plain_text.read(path)
    about: dict[str, Any] = {}
    while (line := lines.take("a line of column names")).startswith("#"):
        if match := NOTE.fullmatch(line):
            about[match[1].strip()] = match[2]
    separator = next((s for s in ";\t," if s in line), None)
    names = [name.strip().strip('"') for name in line.split(separator)]
    if len(names) > COLUMNS:
        raise FormatError(f"{path}: {len(names)} columns, expected at most {COLUMNS}; split the table by channels")
    lines.comment = "#"
    if separator is not None:
        lines.edit(lambda text: _filled(text, separator))
    table = lines.rows(len(names))
    key: Any
    columns: dict[Any, np.ndarray]
    angles: dict[str, np.ndarray] = {}
    values: dict[tuple[str, bool, str], np.ndarray] = {}
    for k, name in enumerate(names):
        if name.lower() in (*ANGLES, "wavelength"):
            key, columns = name.lower(), angles
        elif match := VALUE.fullmatch(name):
            key, columns = (QUANTITIES[match[2].lower()], bool(match[1]), match[3] or ""), values
        else:
            expected = f"{', '.join(ANGLES)}, wavelength, or {', '.join(QUANTITIES)}"
            raise FormatError(f"{path}: column {name!r}: expected {expected}")
        if key in columns:
            raise FormatError(f"{path}: column {name} twice, expected each once")
        columns[key] = table[:, k]
    return of_columns(str(path), angles, values, about, side)


def _filled(text: str, separator: str) -> str:
    """The text with nan in its empty cells."""
    if separator == ";":
        text = text.replace(",", ".")
    if f"{separator} " in text or " \n" in text:
        text = re.sub(rf"(?<! ) +(?=[{separator}\n])|(?<={separator}) +", "", text)
    for _ in range(2):
        text = text.replace(2 * separator, f"{separator}nan{separator}")
    text = text.replace(f"{separator}\n", f"{separator}nan\n").replace(f"\n{separator}", f"\nnan{separator}")
    return text + "nan" if text.endswith(separator) else text
