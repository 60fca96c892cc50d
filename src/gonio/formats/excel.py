"""Excel workbooks (`.xlsx`) of measurements: a sheet with a line of column names above rows of numbers, as CSV tables.

Cells hold what was stored, not what is shown: a cell formatted as percent is a share. Cells that are formulas count
with the values that were stored with them. Dates are texts.

Checked against workbooks that gonio's tests write themselves, and against openpyxl.
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any
from xml.parsers.expat import ExpatError

from ..declared.arguments import Declared
from ..errors import Error, FormatError, ParameterError
from ..models.sheet import Sheet
from ..tables.gridded import Gridded
from . import csv_table
from ._laboratory.meanings import Said
from ._laboratory.sheets import CellSheet
from ._laboratory.understanding import Understood, understand
from ._laboratory.workbook import Workbook
from ._sides import Side

NAME = "Excel"
SUFFIXES = (".xlsx",)
DESCRIPTION = "workbooks with a table of angles and values, columns as in CSV"
ORACLE = "own generator, written from ECMA-376; openpyxl"

ENTRIES = (b"[Content_Types].xml", b"xl/", b"docProps/", b"_rels/")
"""How the name of the first entry of a workbook begins; stores in zip files begin with others."""

FAULTS = (zipfile.BadZipFile, zlib.error, struct.error, ExpatError)
"""What damaged zip files and XML raise, beside the errors of Python itself."""


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these."""
    return head.startswith(b"PK\x03\x04") and head[30:].startswith(ENTRIES)


def read(
    path: Path,
    side: Side = None,
    sheet: Annotated[
        int | str | None, Declared("name of the sheet, or its number from 1; needed where several")
    ] = None,
    columns: csv_table.Columns = None,
    skip: csv_table.Skip = None,
    angle_unit: csv_table.AngleUnit = None,
    wavelength_unit: csv_table.WavelengthUnit = None,
    quantity: csv_table.Quantity = None,
    value_unit: csv_table.ValueUnit = None,
    coverage: csv_table.Coverage = None,
    uncertainty: csv_table.Spread = None,
    missing: csv_table.Missing = None,
    forward: csv_table.Forward = None,
) -> Gridded | Sheet:
    """The table in a sheet.

    Raises ParameterError for a sheet that is not there, and the errors of `csv_table.read`.
    """
    said = Said(
        columns=columns, skip=skip, angle_unit=angle_unit, wavelength_unit=wavelength_unit, quantity=quantity,
        value_unit=value_unit, coverage=coverage, uncertainty=uncertainty, missing=missing, forward=forward,
    )  # fmt: skip
    return csv_table.of_table(understand(_sheet(path, sheet), said), str(path), side)


def understood(path: Path, side: str | None = None, sheet: int | str | None = None, **said: Any) -> Understood:
    """The table in a sheet, column by column, with the options of `read`."""
    return understand(_sheet(path, sheet), Said(**said))


def _sheet(path: Path, asked: int | str | None) -> CellSheet:
    return CellSheet(path, _rows(path, asked))


def _rows(path: Path, asked: int | str | None) -> Iterator[list[str]]:
    try:
        with Workbook(path) as book:
            yield from book.rows(_chosen(path, book, asked))
    except (LookupError, ValueError, OverflowError, EOFError, NotImplementedError, RuntimeError, *FAULTS) as error:
        if isinstance(error, Error):
            raise
        raise FormatError(f"{path}: not a workbook that can be read: {type(error).__name__}: {error!s:.200}") from None


def _chosen(path: Path, book: Workbook, asked: int | str | None) -> str:
    """The sheet of a name or a number; without, the only one with a cell."""
    listed = ", ".join(map(repr, book.sheets))
    if asked is None:
        filled = [name for name in book.sheets if any(map(any, book.rows(name)))]
        if len(filled) == 1:
            return filled[0]
        if not filled:
            raise FormatError(f"{path}: every sheet is empty; expected a table")
        raise ParameterError(f"{path}: {len(filled)} sheets, {listed}; say which: sheet={filled[0]!r}")
    if asked in book.sheets:
        return str(asked)
    if isinstance(asked, int) and 1 <= asked <= len(book.sheets):
        return [*book.sheets][asked - 1]
    raise ParameterError(f"sheet={asked!r}: expected one of {listed}, or a number from 1 to {len(book.sheets)}")
