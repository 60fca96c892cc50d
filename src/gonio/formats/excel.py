"""Excel workbooks (`.xlsx`) of measurements: a sheet with a line of column names above rows of numbers, as CSV tables.

Cells hold what was stored, not what is shown: a cell formatted as percent is a share. Cells that are formulas count
with the values that were stored with them. Dates are texts.

Needs openpyxl (`pip install 'gonio[io]'`). Checked against workbooks that gonio's tests write themselves.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Annotated, Any

from ..errors import DependencyError, FormatError, ParameterError
from ..models.sheet import Sheet
from ..tables.gridded import Gridded
from . import csv_table
from ._laboratory.meanings import Said
from ._laboratory.sheets import CellSheet
from ._laboratory.understanding import Understood, understand
from ._options import Declared
from ._reading import plain_text
from ._sides import Side

NAME = "Excel"
SUFFIXES = (".xlsx",)
DESCRIPTION = "workbooks with a table of angles and values, columns as in CSV (needs openpyxl)"
ORACLE = "own generator, written from ECMA-376"

ENTRIES = (b"[Content_Types].xml", b"xl/", b"docProps/", b"_rels/")
"""How the name of the first entry of a workbook begins; stores in zip files begin with others."""

CELLS = 2**25
"""Largest number of cells of a sheet."""


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

    Raises DependencyError without openpyxl, ParameterError for a sheet that is not there, and the errors of
    `csv_table.read`.
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
    try:
        import openpyxl
    except ImportError:
        raise DependencyError(
            f"{path}: workbooks are read with openpyxl; install it: pip install 'gonio[io]', or save the sheet as CSV"
        ) from None
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(entry.file_size for entry in packed.infolist())
        if size > plain_text.LIMIT:
            raise FormatError(
                f"{path}: {size} bytes unpacked, expected at most {plain_text.LIMIT}; save the sheet as CSV"
            )
        with path.open("rb") as file:
            book = openpyxl.load_workbook(file, read_only=True, data_only=True)
            return CellSheet(path, _content(path, _chosen(path, book, asked)))
    except (FormatError, ParameterError, MemoryError):
        raise
    except Exception as error:  # openpyxl raises any of damaged files
        raise FormatError(f"{path}: not a workbook that can be read: {type(error).__name__}: {error}") from None


def _chosen(path: Path, book: Any, asked: int | str | None) -> Any:
    """The sheet of a name or a number; without, the only one with a cell."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    listed = ", ".join(map(repr, sheets))
    if asked is None:
        filled = [sheet for sheet in sheets.values() if next(_rows(sheet), None) is not None]
        if len(filled) == 1:
            return filled[0]
        if not filled:
            raise FormatError(f"{path}: every sheet is empty; expected a table")
        raise ParameterError(f"{path}: {len(filled)} sheets, {listed}; say which: sheet={filled[0].title!r}")
    if asked in sheets:
        return sheets[asked]
    if isinstance(asked, int) and 1 <= asked <= len(sheets):
        return [*sheets.values()][asked - 1]
    raise ParameterError(f"sheet={asked!r}: expected one of {listed}, or a number from 1 to {len(sheets)}")


def _rows(sheet: Any) -> Any:
    sheet.reset_dimensions()  # the size that a file states may be wrong, and huge
    return (row for row in sheet.iter_rows(values_only=True) if any(cell is not None for cell in row))


def _content(path: Path, sheet: Any) -> list[list[str]]:
    """The cells of a sheet as texts, rows of the length of the longest."""
    sheet.reset_dimensions()
    content: list[list[str]] = []
    cells = 0
    for row in sheet.iter_rows(values_only=True):
        content.append([_text(cell) for cell in row])
        cells += len(row) + 1
        if cells > CELLS:
            raise FormatError(f"{path}: more than {CELLS} cells; save the sheet as CSV")
    return content


def _text(cell: Any) -> str:
    if cell is None:
        return ""
    return repr(float(cell)) if isinstance(cell, (int, float)) and not isinstance(cell, bool) else str(cell).strip()
