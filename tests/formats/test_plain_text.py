"""Lines and rows of text files: what is read, where faults are, what is written."""

import itertools

import numpy as np
import pytest

from gonio.errors import FormatError
from gonio.formats._reading import plain_text


def lines(tmp_path, content, comment=()):
    file = tmp_path / "a.txt"
    file.write_bytes(content)
    return plain_text.read(file, comment)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    ("mark", "encoding"), [(b"", "utf-8"), (b"\xef\xbb\xbf", "utf-8"), (b"", "latin-1"), (b"\xff\xfe", "utf-16-le")]
)
def test_any_encoding_and_line_end(tmp_path, end, mark, encoding):
    text = end.join(["größe 1", "  ", "# no", " 2 "])
    read = lines(tmp_path, mark + text.encode(encoding), "#")
    assert list(read) == ["größe 1", "2"]
    assert read.number == 4


def test_files_that_are_no_text_are_refused(tmp_path):
    for content in (b"ab\0c", b"\xff\xfea"):
        with pytest.raises(FormatError, match=r"a\.txt"):
            lines(tmp_path, content)


@pytest.mark.parametrize("chunk", [1, 7, 2**20])
def test_rows_are_read_and_counted(tmp_path, monkeypatch, chunk):
    monkeypatch.setattr(plain_text, "CHUNK", chunk)
    head, rest = "head\n\n", "1, 2\n\t3;4 \n# x\n\n5 nan\n-inf 1e-3\nend\n"
    read = lines(tmp_path, (head + rest).encode(), "#")
    assert read.next() == "head"
    expected = [[1, 2], [3, 4], [5, np.nan], [-np.inf, 1e-3]]
    np.testing.assert_array_equal(read.rows(2, 4), expected)
    assert read.number == 8
    assert read.peek() == read.next() == "end"
    assert read.next() is read.peek() is None
    read = lines(tmp_path, b"1 2\n3 4\n")
    np.testing.assert_array_equal(read.rows(2), [[1, 2], [3, 4]])
    with pytest.raises(FormatError, match=r"cut short: ends after line \d, expected rows of numbers"):
        read.rows(2)


@pytest.mark.parametrize("chunk", [1, 2**20])
@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ("1 x", "line 4: got 'x', expected numbers"),
        ("1", "line 4: got '1', expected 2 numbers, not 1"),
        ("1 2 3", "line 4"),
        ("1_0 2", "line 4: got '1_0'"),
        ("0x10 2", "line 4"),
        ("٣ 2", "line 4: got '٣'"),
        ("² 2", "line 4: got '²'"),
    ],
)
def test_faults_name_their_line(tmp_path, monkeypatch, chunk, bad, says):
    monkeypatch.setattr(plain_text, "CHUNK", chunk)
    with pytest.raises(FormatError, match=says):
        lines(tmp_path, f"1 2\n\n3 4\n{bad}\n5 6".encode()).rows(2)


def test_promises_of_a_header_are_not_believed(tmp_path):
    with pytest.raises(FormatError, match=r"cut short: ends after line 2, expected 10+ rows"):
        lines(tmp_path, b"1 2\n3 4").rows(2, 10**30)
    with pytest.raises(FormatError, match="cut short: ends after line 2"):
        lines(tmp_path, b"1 2\n3 4").numbers(10**30)
    with pytest.raises(FormatError, match="line 2: got '4 numbers', expected 3"):
        lines(tmp_path, b"1 2\n3 4").numbers(3)
    assert lines(tmp_path, b"1 2\n3").numbers(3).tolist() == [1, 2, 3]


def test_single_numbers(tmp_path):
    read = lines(tmp_path, b"x")
    assert [read.float(t) for t in ("1", "-.5", "2.", "1E3", "+inf")] == [1, -0.5, 2, 1e3, np.inf]
    assert [read.count(t) for t in ("0", "3.0", "1e3")] == [0, 3, 1000]
    for token in ("", "1.5", "-1", "nan", "inf", "1_0", "x"):
        with pytest.raises(FormatError):
            read.count(token)


def test_written_numbers_read_back_exactly(tmp_path):
    rng = np.random.default_rng(90)
    rows = np.concatenate([rng.normal(size=(99, 3)) * 10.0 ** rng.integers(-300, 300, (99, 3)), [[0.0, -0.0, 45.0]]])
    text = "".join(plain_text.join(rows, ", "))
    assert text.endswith("0, -0, 45\n")
    back = lines(tmp_path, text.encode()).rows(3)
    assert back.tobytes() == rows.tobytes()


def test_degrees_are_short_and_exact():
    written = np.array([*np.arange(0, 361, 2.5), *(np.arange(900) / 10.0), *(np.arange(9999) / 1e6)])
    assert plain_text.degrees(np.radians(written)).tolist() == written.tolist()
    any_angle = np.linspace(0.0, np.pi / 2, 998)
    np.testing.assert_allclose(np.radians(plain_text.degrees(any_angle)), any_angle, rtol=3e-16)
    assert np.isnan(plain_text.degrees([np.nan, 0.0])).tolist() == [True, False]


def test_rows_of_words_and_numbers():
    rows = [[1.5, "a"], [2, "b"]]
    assert list(itertools.islice(plain_text.join(rows, ","), 2)) == ["1.5,a\n", "2,b\n"]
