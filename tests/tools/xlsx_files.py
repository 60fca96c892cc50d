"""Excel workbooks (`.xlsx`), written from the layout of ECMA-376: what gonio does not write itself."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import escape
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
RELATIONS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
PACKAGE = "http://schemas.openxmlformats.org/package/2006"
TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml"


def workbook(sheets: Mapping[str, Sequence[Sequence[str | float | None]]]) -> bytes:
    """A workbook of these sheets; None is an empty cell."""
    return packed(parts_of(sheets))


def parts_of(sheets: Mapping[str, Sequence[Sequence[str | float | None]]]) -> dict[str, str]:
    """The parts of a workbook by name."""
    numbered = [*enumerate(sheets.items(), 1)]
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{PACKAGE}/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{TYPE}.sheet.main+xml"/>'
        + "".join(f'<Override PartName="/xl/s{k}.xml" ContentType="{TYPE}.worksheet+xml"/>' for k, _ in numbered)
        + "</Types>",
        "_rels/.rels": f'<Relationships xmlns="{PACKAGE}/relationships">'
        f'<Relationship Id="r" Type="{RELATIONS}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{MAIN}" xmlns:r="{RELATIONS}"><sheets>'
        + "".join(f'<sheet name="{escape(name)}" sheetId="{k}" r:id="s{k}"/>' for k, (name, _) in numbered)
        + "</sheets></workbook>",
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{PACKAGE}/relationships">'
        + "".join(f'<Relationship Id="s{k}" Type="{RELATIONS}/worksheet" Target="s{k}.xml"/>' for k, _ in numbered)
        + "</Relationships>",
    }
    for k, (_, rows) in numbered:
        lines = "".join(f'<row r="{r}">{_cells(r, row)}</row>' for r, row in enumerate(rows, 1))
        parts[f"xl/s{k}.xml"] = f'<worksheet xmlns="{MAIN}"><sheetData>{lines}</sheetData></worksheet>'
    return parts


def with_part(parts: Mapping[str, str], kind: str, text: str) -> dict[str, str]:
    """The parts with another one, "sharedStrings" or "styles"."""
    named = f'<Relationship Id="{kind}" Type="{RELATIONS}/{kind}" Target="{kind}.xml"/></Relationships>'
    relations = "xl/_rels/workbook.xml.rels"
    return {**parts, relations: parts[relations].replace("</Relationships>", named), f"xl/{kind}.xml": text}


def packed(parts: Mapping[str, str], how: int = ZIP_DEFLATED) -> bytes:
    """A workbook of these parts."""
    found = io.BytesIO()
    with ZipFile(found, "w") as file:
        for name, text in parts.items():
            file.writestr(ZipInfo(name), f'<?xml version="1.0" encoding="UTF-8"?>{text}', how)
    return found.getvalue()


def _cells(number: int, row: Sequence[str | float | None]) -> str:
    written = []
    for k, cell in enumerate(row):
        place = f"{chr(65 + k)}{number}"
        if isinstance(cell, str):
            written.append(f'<c r="{place}" t="inlineStr"><is><t>{escape(cell)}</t></is></c>')
        elif cell is not None:
            written.append(f'<c r="{place}"><v>{cell!r}</v></c>')
    return "".join(written)
