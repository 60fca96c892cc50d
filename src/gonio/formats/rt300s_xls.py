"""Excel workbooks (`.xls`, BIFF) of the RT-300S goniophotometer: one column for each measured point.

Rows are told by their first cell: `Azimuth`, `Incidence`, `Receive` [degrees], `RT`; `Method` and others are kept in
`about`. A measurement of more than 253 points goes on in further sheets. For the angles and the quantity see `rt300s`.

Checked against a real file and what its laboratory made of it (`fred`): pi f cos(theta_o) agrees within 0.0042, mean
-0.0005; the laboratory subtracts a measurement without light, which is of that size.

Needs xlrd (`pip install 'gonio[io]'`).
"""

from __future__ import annotations

import io
import os
import struct
from pathlib import Path
from typing import Any

from ..errors import FormatError, needed
from ..tables.gridded import Gridded
from ._optical import rt300s

NAME = "RT-300S workbook"
SUFFIXES = (".xls",)
DESCRIPTION = "Excel workbooks of the RT-300S goniophotometer (needs xlrd)"
ORACLE = "real file (University of Arizona) and the FRED file made of it"

MAGIC = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
NEEDED = ("azimuth", "incidence", "receive", "rt")


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so is a workbook of this kind of Excel: no other format here is one."""
    return head.startswith(MAGIC)


def read(path: str | os.PathLike) -> Gridded:
    """The reflectance of a workbook: `angles` axes theta_i, theta_o, phi; quantity "brdf * cos(theta_o)".

    Raises DependencyError without xlrd, FormatError where the workbook is damaged or not one of these.
    """
    columns: dict[str, list[float]] = {name: [] for name in NEEDED}
    about: dict[str, Any] = {}
    for sheet in _sheets(Path(path)):
        rows = {str(row[0]).strip().lower(): row for row in sheet if row and isinstance(row[0], str)}
        if not rows:
            continue
        missing = [name for name in NEEDED if name not in rows]
        if missing:
            raise FormatError(f"{path}: no row {missing[0]!r} in a sheet, expected {', '.join(NEEDED)}")
        for k in range(1, max(len(rows[name]) for name in NEEDED)):
            cells = [rows[name][k] if k < len(rows[name]) else "" for name in NEEDED]
            if all(cell == "" for cell in cells):
                continue
            if not all(isinstance(cell, float) for cell in cells):
                raise FormatError(f"{path}: column {k + 1} of a sheet has {cells}, expected numbers in {NEEDED}")
            for name, cell in zip(NEEDED, cells, strict=True):
                columns[name].append(float(cell))
        for name in ("method", "date", "illuminant.", "observer."):
            about.setdefault(name.rstrip("."), next((c for c in rows.get(name, ())[1:] if c != ""), ""))
    azimuth, incidence, receive, rt = columns.values()
    return rt300s.measured(Path(path), incidence, azimuth, receive, rt, about)


def _sheets(path: Path) -> list[list[list[Any]]]:
    """Cells of a workbook, by sheet, row and column."""
    with needed(f"{path}: workbooks are read with xlrd", "install it: pip install 'gonio[io]'"):
        import xlrd
        import xlrd.compdoc
    # xlrd checks little: damaged files raise any of these.
    faults = (xlrd.XLRDError, xlrd.compdoc.CompDocError, struct.error, LookupError, ValueError, TypeError)
    more = (ArithmeticError, AssertionError, AttributeError, NotImplementedError, RecursionError, MemoryError)
    try:
        book = xlrd.open_workbook(path, logfile=io.StringIO(), on_demand=False, ragged_rows=True)
        return [[sheet.row_values(k) for k in range(sheet.nrows)] for sheet in book.sheets()]
    except (*faults, *more) as error:
        raise FormatError(f"{path}: not a workbook that can be read: {type(error).__name__}: {error}") from None
