"""Text files in every encoding and with every end of line, pasted twice, and with a row that is there twice."""

from __future__ import annotations

import codecs
import re
import subprocess
import sys
import warnings
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from seeds import SEEDS, ZERNIKE
from text_files import ALTA, CSV, SSDD

import gonio as gn
from gonio.errors import FormatError
from gonio.formats._rows import direction_pairs

pytestmark = pytest.mark.usefixtures("uncompiled")  # kernels take longer than all else, and are not what is asked

BINARY = {
    *(
        "netCDF",
        "netCDF rows",
        "Zarr",
        "Zarr 3",
        "MCD43A1",
        "MCD43A1 tile",
        "MERL",
        "RGL",
        "KAIST",
        "UTIA",
        "UTIA picture",
        "bispectral EXR",
        "CSAIL",
    ),
    *("SCATFUN", "SCATFUN gzip", "Neural-BRDF", "RT-300S workbook", "ALTA binary", "SSDD binary", "Excel"),
}
TEXT = [name for name in SEEDS if name not in BINARY]
MARKS = {
    "utf-8": codecs.BOM_UTF8,
    "utf-16-le": codecs.BOM_UTF16_LE,
    "utf-16-be": codecs.BOM_UTF16_BE,
    "utf-32-le": codecs.BOM_UTF32_LE,
    "utf-32-be": codecs.BOM_UTF32_BE,
}
ENDS = {"lf": "\n", "crlf": "\r\n", "cr": "\r"}


def pairs(n: int = 200) -> np.ndarray:
    w = np.random.default_rng(27).normal(size=(2, n, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.02
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def read(folder: Path, content: bytes) -> tuple[str, np.ndarray]:
    """The kind of a file, and its f; of scattered rows, whose f takes long to make, these and their means."""
    file = folder / "file"
    file.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the values, which are random
        m = gn.load(file)
        if isinstance(m, gn.Scattered):
            _, first, which = np.unique(m.rows, axis=0, return_index=True, return_inverse=True)
            total = np.zeros((len(first), *m.stored.shape[1:]))
            np.add.at(total, which.reshape(-1), m.stored)
            counts = np.bincount(which.reshape(-1)).reshape(-1, *(1,) * (m.stored.ndim - 1))
            return type(m).__name__, np.column_stack([m.rows[first], total / counts])
        return type(m).__name__, m.f(*pairs())


@pytest.mark.parametrize("step", [4, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.parametrize("name", TEXT)
def test_every_encoding_and_end_of_line_reads_the_same(name, step, tmp_path):
    """A mark (BOM), UTF-16, UTF-32, CRLF and CR change no value of any text format. (D27)"""
    text = SEEDS[name]().decode()
    kind, f = read(tmp_path, text.encode())
    assert not text.startswith("\ufeff") and np.isfinite(f).any()
    every = [*product(MARKS.items(), ENDS.values())]
    for (encoding, mark), end in every[len(name) % step :: step]:
        found, g = read(tmp_path, mark + text.replace("\n", end).encode(encoding))
        assert found == kind
        np.testing.assert_array_equal(g, f, f"{encoding}, {end!r}")


def test_a_mark_before_latin_1_and_before_binary_numbers(tmp_path):
    """A mark that the rest of the file does not keep to takes no line away. (D27)"""
    kind, f = read(tmp_path, CSV.encode())
    latin = codecs.BOM_UTF8 + CSV.replace("grey", "größe").encode("latin-1")
    assert read(tmp_path, latin)[0] == kind
    np.testing.assert_array_equal(read(tmp_path, latin)[1], f)
    for name in ("ALTA binary", "SSDD binary"):
        content = SEEDS[name]()
        np.testing.assert_array_equal(read(tmp_path, codecs.BOM_UTF8 + content)[1], read(tmp_path, content)[1])


@pytest.mark.parametrize("name", ["CSV", "Zemax", "Speos", "gonio JSON", "Integra", "WINDOW XML"])
def test_half_characters_are_one_error(name, tmp_path):
    """UTF-16 and UTF-32 that end within a character, or hold none, are a FormatError. (D27)"""
    text = SEEDS[name]().decode()
    for encoding in ("utf-16-le", "utf-32-be"):
        content = MARKS[encoding] + text.encode(encoding)
        for damaged in (
            content[:-1],
            content + b"\xff",
            MARKS[encoding],
            content[:40] + b"\0\xd8\0\xd8" + content[40:],
        ):
            with pytest.raises(FormatError):
                read(tmp_path, damaged)


@pytest.mark.parametrize("name", TEXT)
def test_a_file_pasted_twice_is_refused_or_read_as_one(name, tmp_path):
    """Content twice, one after the other, never gives other values. (D27)"""
    content = SEEDS[name]()
    kind, f = read(tmp_path, content)
    for doubled in (content + content, content + b"\n" + content):
        try:
            found, g = read(tmp_path, doubled)
        except FormatError:
            continue
        assert found == kind
        np.testing.assert_allclose(g, f, rtol=1e-12)


SILENT = {
    "RT-300S Raywiz",  # says neither how many rows there are nor what angles they are at, but the first and the last
    "gonio JSON",  # a number more in a list of channels is another material
}


@pytest.mark.parametrize("step", [8, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.parametrize("name", sorted({*TEXT} - SILENT))
def test_a_line_that_is_there_twice_is_refused_or_changes_nothing(name, step, tmp_path):
    """Lines, repeated in their place or at the end: no other values, no grid that becomes scattered. (D27)"""
    lines = SEEDS[name]().decode().split("\n")
    kind, f = read(tmp_path, "\n".join(lines).encode())
    for k, line in [*enumerate(lines[:60])][::step]:
        for changed in ([*lines[: k + 1], line, *lines[k + 1 :]], [*lines[:-1], line, ""]):
            try:
                found, g = read(tmp_path, "\n".join(changed).encode())
            except FormatError:
                continue
            assert found == kind, line
            np.testing.assert_allclose(g, f, rtol=1e-12, err_msg=line)


@pytest.mark.parametrize(
    ("text", "again", "says"),
    [
        (ZERNIKE.decode(), 1, r"rows 2 and 6 are of one mode, \[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0\]"),
        (ALTA, 5, "row 5 repeats row 1, and the others are the nodes of a grid"),
        (CSV, 2, "row 4 repeats row 1, and the others are the nodes of a grid"),
        (CSV.replace("theta_i,phi_i,theta_o,phi_o", "theta_h,theta_d,phi_d,phi_h"), 3, "row 4 repeats row 2, and"),
    ],
)
def test_the_error_names_both_rows(text, again, says, tmp_path):
    """What is there twice is said by its rows. (D27)"""
    lines = text.split("\n")
    with pytest.raises(FormatError, match=says):
        read(tmp_path, "\n".join([*lines[:-1], lines[again], ""]).encode())


def test_scattered_rows_pasted_twice_are_refused(tmp_path):
    """All rows twice would halve the variance of their means; single rows that agree count as measured. (D27)"""
    head = "theta_i,phi_i,theta_o,phi_o,f,u_f\n"
    rows = ["0,0,10,0,0.31,0.01\n", "30,0,40,170,0.32,0.01\n", "45,0,5,90,0.3,0.01\n"]
    assert read(tmp_path, (head + "".join(rows)).encode())[0] == "Scattered"
    assert read(tmp_path, (head + "".join([*rows, rows[0]])).encode())[0] == "Scattered"
    with pytest.raises(FormatError, match="every row is there several times: row 4 repeats row 1"):
        read(tmp_path, (head + "".join([*rows, *rows])).encode())


def test_copies_of_all_rows_are_refused_before_they_are_a_table(tmp_path, monkeypatch):
    """A table of three million rows that repeat a thousand took most of a minute until it was refused."""
    for makes_a_table in ("_as_grid", "gridded_or_scattered"):
        monkeypatch.setattr(direction_pairs, makes_a_table, None)
    rows = "0,0,10,0,0.31,0.01\n30,0,40,170,0.32,0.01\n45,0,5,90,0.3,0.01\n"
    (tmp_path / "rows.csv").write_text("theta_i,phi_i,theta_o,phi_o,f,u_f\n" + 2 * rows)
    with pytest.raises(FormatError, match="every row is there several times: row 4 repeats row 1"):
        gn.load(tmp_path / "rows.csv")


def test_rows_beyond_those_that_a_header_promises(tmp_path):
    """SSDD's lists say how many rows there are: one more is no entry of the next block. (D27)"""
    with pytest.raises(FormatError, match="the table before has more rows than its lists say"):
        read(tmp_path, SSDD.replace("# PARAM3: 90\n", "99 98 97\n").encode())


STARTS = (
    "#DIM 3 1\n",
    "theta_i,theta_o,phi,f\n",
    '{"type": "Lambertian", "rho": 1}\n',
    "Source Measured\nAngleOfIncidence 1\nScatterType BRDF\n",
)


def test_a_text_beyond_the_limit_takes_no_memory(tmp_path):
    """Sparse files of 4 GB in UTF-16 are refused by their size, within 1 GB of memory. (D27)"""
    for k, start in enumerate(STARTS):
        with (tmp_path / str(k)).open("wb") as file:
            file.write(codecs.BOM_UTF16_LE + start.encode("utf-16-le") * 2000)
            file.truncate(1 << 32)
    code = (
        "import resource, sys; import gonio as gn, gonio.formats as d; d.formats()\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30),) * 2)\n"
        "for path in sys.argv[1:]:\n"
        "    try: gn.load(path)\n"
        "    except gn.errors.FormatError as error: print(error)\n"
    )
    files = [tmp_path / str(k) for k in range(len(STARTS))]
    done = subprocess.run([sys.executable, "-c", code, *files], capture_output=True, text=True, timeout=300)
    assert len(re.findall(r"4294967296 bytes, expected (?:text|JSON) of at most", done.stdout)) == len(files), (
        done.stderr
    )
