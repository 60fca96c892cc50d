"""Text without ends: lines, comments, tags, columns."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from clock import seconds
from libraries import thinned
from seeds import SEEDS

import gonio as gn
from gonio import errors
from gonio.formats._laboratory import sheets
from gonio.formats._reading import plain_text
from gonio.formats.window_xml import xml_document

MB = 1_000_000

LOAD = """
import resource, sys
import gonio as gn
from gonio.formats import formats

def size():
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith("VmSize:"))

formats()  # what modules import does not count
resource.setrlimit(resource.RLIMIT_AS, (size() + int(sys.argv[2]),) * 2)
try:
    print(gn.load(sys.argv[1]))
except gn.Error as error:
    print(type(error).__name__, error)
"""

needs_proc = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the size of a process in /proc")


def loaded(path: Path, room: int) -> str:
    """What a fresh process says that loads the file in so many bytes of address space more than it starts with."""
    search = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", LOAD, str(path), str(room)]
    done = subprocess.run(command, env=search, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-500:]
    return done.stdout.strip()


def table(columns: int, rows: int = 2) -> str:
    """A CSV table of so many channels."""
    names = ["theta_i", "theta_o", "phi", *(f"f_{k}nm" for k in range(400, 397 + columns))]
    numbers = "\n".join(",".join([*angles, *["0.25"] * (columns - 3)]) for angles in ROWS[:rows])
    return ",".join(names) + "\n" + numbers + "\n"


ROWS = [("0", "0", "0"), ("30", "0", "0"), ("0", "30", "0"), ("30", "30", "0")]


@needs_proc
@pytest.mark.parametrize("what", thinned([b"1.5 ", b"x", b",", b"0.1,0.2,"], [b"1.5 "]))
def test_a_csv_of_one_line_without_end_is_refused_in_little_memory(tmp_path, what):
    """... in three times its own size. (D14)"""
    path = tmp_path / "a.csv"
    path.write_bytes(b"theta_i,theta_o,phi,f\n0,0,0,0.5\n" + what * (40 * MB // len(what)) + b"\n0,30,0,0.5\n")
    assert f"line 3: more than {plain_text.LONGEST} characters, expected shorter lines" in loaded(path, 150 * MB)


@pytest.mark.parametrize("count", [500, pytest.param(10_000, marks=pytest.mark.full)])
def test_columns_are_counted(count, tmp_path):
    """A table of a hundred thousand columns is refused, one of thousands is read. (D14)"""
    path = tmp_path / "a.csv"
    path.write_text(table(count, 4))
    assert len(gn.load(path).channel_names) == count - 3
    path.write_text(table(sheets.COLUMNS + 1))
    with pytest.raises(errors.FormatError, match=f"{sheets.COLUMNS + 1} columns, expected at most {sheets.COLUMNS}"):
        gn.load(path)


@needs_proc
def test_a_million_columns_are_refused_in_little_memory(tmp_path):
    """... by their line, before it is split into words. (D14)"""
    path = tmp_path / "a.csv"
    path.write_text("theta_i,theta_o,phi" + ",f_0.123" * 1_000_000 + "\n" + "0.5," * 1_000_000 + "\n")
    assert "line 1: more than" in loaded(path, 100 * MB)


def text_seeds() -> list[str]:
    found = []
    for name, seed in SEEDS.items():
        data = seed()
        lines = isinstance(data, bytes) and b"\0" not in data and not data.lstrip().startswith((b"{", b"<", b"PK"))
        if lines and data.isascii():
            found.append(name)
    return sorted(found)


@pytest.mark.parametrize("name", text_seeds())
def test_no_text_format_makes_words_of_a_line_without_end(tmp_path, monkeypatch, name):
    """Every reader of lines refuses one that is too long, wherever it stands, or never looks at it. (D14)"""
    data = SEEDS[name]()
    at = data.rfind(b"\n", 0, len(data) * 2 // 3) + 1
    path = tmp_path / "a"
    path.write_bytes(data[:at] + b"1.5 " * (2 * MB) + b"\n" + data[at:])
    kept = plain_text.split
    longest = [0]

    def split(line: str) -> list[str]:
        longest[0] = max(longest[0], len(line))
        return kept(line)

    monkeypatch.setattr(plain_text, "split", split)
    with pytest.raises(errors.FormatError) as caught:
        gn.load(path)
    assert "more than" in str(caught.value) or "not a known format" in str(caught.value)
    assert longest[0] <= plain_text.LONGEST


def test_the_longest_line_is_read():
    """The bound is that of a line, not of a text, and binary parts have no lines. (D14)"""
    lines = plain_text.Lines("a", ("1 " * (plain_text.LONGEST // 2) + "\n") * 3)
    assert lines.rows(plain_text.LONGEST // 2).shape == (3, plain_text.LONGEST // 2)
    with pytest.raises(errors.FormatError, match="a, line 3: more than"):
        plain_text.Lines("a", "1\n2\n" + "3" * (plain_text.LONGEST + 1) + "\n4\n")
    assert plain_text.Lines("a", "1\n" + "3" * (plain_text.LONGEST + 1), mixed=True).next() == "1"


# XML.

CASES = {
    "comment": (b"<!--", b"-->"),
    "instruction": (b"<?a ", b"?>"),
    "attribute": (b"<a b='", b"'/>"),
    "name": (b"<a", b"/>"),
}


def document(before: bytes, content: bytes, after: bytes) -> bytes:
    whole = SEEDS["WINDOW XML"]()
    at = whole.index(b">", whole.index(b"<WindowElement")) + 1
    return whole[:at] + before + content + after + whole[at:]


@pytest.mark.parametrize("case", CASES)
def test_xml_that_is_looked_at_again_and_again_is_refused(tmp_path, monkeypatch, case):
    """Expat scans an open comment or tag from its start with every chunk: no more of it is fed than 1 MB. (D14)"""
    path = tmp_path / "a.xml"
    before, after = CASES[case]
    path.write_bytes(document(before, b"x" * (25 * MB), after))
    chunks = [0]
    real = xml_document._chunks

    def counted(path):
        for chunk in real(path):
            chunks[0] += 1
            yield chunk

    monkeypatch.setattr(xml_document, "_chunks", counted)
    with pytest.raises(errors.FormatError, match=r"line \d+: a comment, a tag or the like of more than 1048576 bytes"):
        gn.load(path)
    assert chunks[0] <= 20


@pytest.mark.parametrize("count", [1, 8, pytest.param(20, marks=pytest.mark.full)])
def test_xml_with_much_in_it_is_read_in_linear_time(tmp_path, count):
    """Text, CDATA and any number of comments below the bound are read. (D14)"""
    path = tmp_path / "a.xml"
    piece = b"<!--" + b"x" * 900_000 + b"-->"
    path.write_bytes(document(piece * count, b"<a>" + b"x " * (count * MB // 4) + b"</a>", b"<a><![CDATA[x]]></a>"))
    assert seconds(lambda: gn.load(path)) < 0.5 * count + 2.0


def test_tags_are_counted(tmp_path, monkeypatch):
    """A file does not become an object per four bytes without end. (D14)"""
    path = tmp_path / "a.xml"
    monkeypatch.setattr(xml_document, "MANY", 10_000)
    path.write_bytes(document(b"<a/>" * 9_000, b"", b""))
    gn.load(path)
    path.write_bytes(document(b"<a/>" * 10_000, b"", b""))
    with pytest.raises(errors.FormatError, match="more than 10000 tags"):
        gn.load(path)


# All formats.

EVERY = """
import resource, sys, warnings
import gonio as gn
warnings.simplefilter("ignore")  # memory is looked at

def size():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * resource.getpagesize()

def load(path):
    try:
        gn.load(path)
    except gn.Error:
        pass

most = resource.getrlimit(resource.RLIMIT_AS)[1]
resource.setrlimit(resource.RLIMIT_AS, (size() + 2_000_000_000, most))
for path in sys.argv[1:]:
    load(path)
print("done")
"""


@needs_proc
def test_no_example_of_a_format_needs_much_memory(tmp_path):
    """All are loaded within 2 GB of address space, libraries included, without a MemoryError. (D14)"""
    for name, seed in SEEDS.items():
        data = seed()
        if isinstance(data, bytes):
            (tmp_path / name.replace(" ", "-").replace("/", "-")).write_bytes(data)
    search = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", EVERY, *map(str, sorted(tmp_path.iterdir()))]
    done = subprocess.run(command, env=search, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.strip() == "done", done.stderr[-600:]


def test_running_out_of_memory_while_a_file_is_read_is_an_error_of_ours(tmp_path, monkeypatch):
    """... that says of which file, and one of ours stays what it is. (D14)"""
    path = tmp_path / "a.csv"
    path.write_text(table(5, 4))

    def full(*args, **more):
        raise MemoryError

    monkeypatch.setattr(sheets.TextSheet, "lines", full)
    with pytest.raises(gn.errors.TooLargeError, match=r"a\.csv: a CSV file that takes more memory than there is"):
        gn.load(path)
