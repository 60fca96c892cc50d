"""Excel workbooks as zip files of XML: what their cells are, and that no more is unpacked than a file accounts for."""

import datetime
import re
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from clock import seconds
from xlsx_files import MAIN, packed, parts_of, with_part, workbook

import gonio as gn
from gonio.errors import Error, FormatError
from gonio.formats._laboratory.workbook import Workbook

NAMES = ["theta_i", "theta_o", "phi", "f"]
PARTS = parts_of({"Data": [NAMES, [0.0, 30.0, 180.0, 0.3]]})


def sheet(rows: str) -> dict[str, str]:
    """A workbook whose sheet has these rows, in XML."""
    return {**PARTS, "xl/s1.xml": f'<worksheet xmlns="{MAIN}"><sheetData>{rows}</sheetData></worksheet>'}


def cells(path):
    with Workbook(path) as book:
        return {name: [list(row) for row in book.rows(name)] for name in book.sheets}


def test_cells_are_those_that_openpyxl_reads(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["a", 1, 2.5, True, None, "same", "same", " ü "])
    book.active.append([])
    book.active["AB4"] = -1e-300
    book.active["A5"] = datetime.datetime(2024, 5, 17, 13, 45)
    book.active["B5"] = 0.25
    book.active["B5"].number_format = "0.00%"
    book.active["C5"] = "#DIV/0!"
    book.active["D5"] = "=1+1"
    book.create_sheet("other")["B2"] = 7
    book.save(tmp_path / "a.xlsx")
    theirs = openpyxl.load_workbook(tmp_path / "a.xlsx", data_only=True)

    def text(cell):
        is_number = isinstance(cell, (int, float)) and not isinstance(cell, bool)
        return "" if cell is None else repr(float(cell)) if is_number else str(cell).strip()

    expected = {each.title: [[text(cell) for cell in row] for row in each.values] for each in theirs}
    found = cells(tmp_path / "a.xlsx")
    for name, rows in expected.items():
        width = len(rows[0])
        assert [row + [""] * (width - len(row)) for row in found[name]] == rows


def test_texts_in_pieces_shared_and_inline(tmp_path):
    strings = (
        '<sst><si><r><t>BR</t></r><r><t>DF</t></r><rPh sb="0" eb="1"><t>ビ</t></rPh></si><si/><si><t>é</t></si></sst>'
    )
    rows = '<row r="2"><c t="s"><v>0</v></c><c t="s"><v>1</v></c><c r="E2" t="s"><v>2</v></c></row>'
    rows += '<row><c t="inlineStr"><is><r><t>a</t></r><r><t>b</t></r></is></c><c t="str"><f>A1</f><v>c</v></c></row>'
    (tmp_path / "a.xlsx").write_bytes(packed(with_part(sheet(rows), "sharedStrings", strings)))
    assert cells(tmp_path / "a.xlsx") == {"Data": [[], ["BRDF", "", "", "", "é"], ["ab", "c"]]}


def test_prefixes_and_links_elsewhere(tmp_path):
    """A part that is said to be elsewhere is none; names of tags have a prefix or none."""
    relations = "xl/_rels/workbook.xml.rels"
    parts = {**PARTS, "xl/s1.xml": re.sub(r"<(/?)(?=\w)", r"<\1x:", PARTS["xl/s1.xml"]).replace("xmlns=", "xmlns:x=")}
    (tmp_path / "a.xlsx").write_bytes(packed(parts))
    assert cells(tmp_path / "a.xlsx") == {"Data": [NAMES, ["0.0", "30.0", "180.0", "0.3"]]}
    parts = {**PARTS, relations: PARTS[relations].replace('Target="s1.xml"', 'Target="s1.xml" TargetMode="External"')}
    (tmp_path / "b.xlsx").write_bytes(packed(parts))
    with pytest.raises(FormatError, match="every sheet is empty"):
        gn.load(tmp_path / "b.xlsx")


LAUGHS = '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'
LONG = "x" * 40_000
HOSTILE = {
    "a cell of megabytes": (sheet(f'<row><c t="inlineStr"><is><t>{"x" * 25_000_000}</t></is></c></row>'), "unpacked"),
    "a long cell": (sheet(f'<row><c t="inlineStr"><is><t>{LONG}</t></is></c></row>'), "more than 32767 characters"),
    "a long number": (sheet(f"<row><c><v>{LONG}</v></c></row>"), "more than 32767 characters"),
    "a long text": (with_part(PARTS, "sharedStrings", f"<sst><si><t>{LONG}</t></si></sst>"), "more than 32767"),
    "a long tag": (sheet(f'<row a="{"x" * 2_000_000}"></row>'), "a tag or a comment"),
    "many texts": (with_part(PARTS, "sharedStrings", f"<sst>{'<si/>' * 5_000_000}</sst>"), "unpacked"),
    "wide rows": (
        sheet("".join(f'<row r="{k}"><c r="XFD{k}"><v>1</v></c></row>' for k in range(1, 5000))),
        "20 times its size and 40 MB",
    ),
    "a wide row": (sheet("<row>" + "<c><v>1</v></c>" * 17_000 + "</row>"), "a cell in column 16385"),
    "a column of no name": (sheet('<row><c r="ABCD1"><v>1</v></c></row>'), "a cell in column 'ABCD'"),
    "a row of no number": (sheet('<row r="99999999"><c><v>1</v></c></row>'), "row 99999999 after 0"),
    "rows backwards": (sheet('<row r="2"/><row r="1"/>'), "row 1 after 2"),
    "no such text": (sheet('<row><c t="s"><v>5</v></c></row>'), "text 5 of 0"),
    "no number": (sheet("<row><c><v>x</v></c></row>"), "could not convert"),
    "entities": ({**PARTS, "xl/workbook.xml": LAUGHS + PARTS["xl/workbook.xml"]}, "document type declaration"),
    "no end": ({**PARTS, "xl/s1.xml": PARTS["xl/s1.xml"][:-20]}, "no element found|not a workbook"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_no_workbook_holds_is_refused_soon(name, tmp_path):
    parts, says = HOSTILE[name]
    (tmp_path / "a.xlsx").write_bytes(packed(parts))

    def refused():
        with pytest.raises(FormatError, match=says):
            gn.load(tmp_path / "a.xlsx")

    assert seconds(refused) < 2.0


@pytest.mark.parametrize("how", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_parts_are_packed_as_excel_packs_them(how, tmp_path):
    (tmp_path / "a.xlsx").write_bytes(packed(PARTS, how))
    with pytest.raises(FormatError, match="is packed as workbooks are not"):
        gn.load(tmp_path / "a.xlsx")


def test_sizes_that_are_not_true(tmp_path):
    """The directory says that the sheet has so many bytes, or more than 4 GiB as zip64 has them."""
    honest = packed(sheet("<row>" + "<c><v>1</v></c>" * 10_000 + "</row>"))
    at = honest.index(b"PK\x01\x02", honest.rindex(b"PK\x01\x02"))
    size = struct.unpack_from("<I", honest, at + 24)[0]
    for lie in (100, size - 1, 2**31, 2**32 - 1):
        (tmp_path / "a.xlsx").write_bytes(honest[: at + 24] + struct.pack("<I", lie) + honest[at + 28 :])
        with pytest.raises(FormatError):
            gn.load(tmp_path / "a.xlsx")


def test_the_first_rows_decide_before_all_are_read(tmp_path):
    """Of 2000 rows of 100 numbers without a name."""
    rows = "".join(f"<row>{''.join(f'<c><v>{k}.{j}</v></c>' for j in range(100))}</row>" for k in range(2000))
    (tmp_path / "a.xlsx").write_bytes(packed(sheet(rows)))
    read = []
    rows_of = Workbook.rows

    def counted(book, name):
        for row in rows_of(book, name):
            read.append(len(row))
            yield row

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Workbook, "rows", counted)
        with pytest.raises(Error):
            gn.load(tmp_path / "a.xlsx")
    assert len(read) < 1000


def test_large_tables_take_less_than_thirty_times_their_file(tmp_path):
    values = np.random.default_rng(0).random(6_000)
    rows = [[10.0 * (k // 2000), 0.5 * (k // 20 % 100), 9.0 * (k % 20), float(v)] for k, v in enumerate(values)]
    (tmp_path / "a.xlsx").write_bytes(workbook({"Data": [NAMES, *rows]}))
    code = """
import re, sys
import gonio as gn
from gonio.formats import formats

def most():
    return int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1])

formats()
before = most()
gn.load(sys.argv[1])
print(1024 * (most() - before))
"""
    words = [sys.executable, "-W", "ignore", "-c", code, tmp_path / "a.xlsx"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60)
    assert int(done.stdout) <= 30 * (tmp_path / "a.xlsx").stat().st_size + (64 << 20)
