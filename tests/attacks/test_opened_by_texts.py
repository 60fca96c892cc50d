"""Files that texts open, and what `gn.load` opens: pipes are read to their end, and only where a caller says so."""

import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import gonio as gn
from gonio.cli.arguments import resolve
from gonio.errors import ExpressionError, FormatError, NotFoundError, ParameterError
from gonio.formats._reading import pipes
from gonio.formula.json_form import from_json

SECRET = "root:x:0:0:correct horse battery staple"
TABLE = "theta_i,phi_i,theta_o,phi_o,f\n" + "".join(
    f"{i},0,{o},0,{(1 + i + o) / 1000}\n" for i in (0, 30, 60) for o in (0, 40)
)

unless_fifos = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")


@pytest.fixture
def secret(tmp_path):
    path = tmp_path / "secret.txt"
    path.write_text(SECRET)
    return path


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(TABLE)
    return path


@pytest.fixture
def opened(monkeypatch):
    """The paths that are opened while the test runs."""
    paths = []
    active = [True]

    def hook(event, args):
        if active and event == "open":
            paths.append(str(args[0]))

    sys.addaudithook(hook)
    yield paths
    active.clear()


@pytest.mark.parametrize("text", ["load({!r})", "0.5 * load({!r}) + Lambertian()", "EnvironmentLight({!r})"])
def test_an_expression_opens_no_file(text, secret, opened):
    """Unless the caller says so; the file is not even looked at. (D15)"""
    with pytest.raises(ExpressionError, match="files=True"):
        gn.expression(text.format(str(secret)))
    assert str(secret) not in opened


def test_a_picture_named_by_keyword_is_a_file_too(secret):
    """`image=` as well as the first argument. (D15)"""
    with pytest.raises(ExpressionError, match="files=True"):
        gn.expression(f"EnvironmentLight(scale=2, image={str(secret)!r})")


@pytest.mark.parametrize("text", ["load({!r})", "EnvironmentLight({!r})", "Lambertian() + load({!r}, sample=3)"])
def test_nothing_of_a_files_content_is_told(text, secret):
    """Where a text may open files, its errors do not quote them. (D15)"""
    with pytest.raises(gn.Error) as caught:
        gn.expression(text.format(str(secret)), files=True)
    assert "secret.txt" in str(caught.value)
    assert "horse" not in str(caught.value)


def test_an_expression_loads_where_it_is_allowed(table):
    """`files=True`, and what is typed on the command line. (D15)"""
    m = gn.load(table)
    assert gn.expression(f"0.5 * load({str(table)!r})", files=True) == 0.5 * m
    assert resolve(f"0.5 * load({str(table)!r})") == 0.5 * m
    with pytest.raises(NotFoundError, match="no such file"):
        gn.expression("load('nothing.csv')", files=True)


@pytest.mark.parametrize("data", [{"type": "EnvironmentLight"}, {"type": "EnvironmentLight", "scale": 2.0}])
def test_a_material_file_opens_no_other_file(data, secret, tmp_path, opened):
    """{"image": "/dev/zero"} took all memory, a pipe never ended, other files were quoted. (D14, D15)"""
    import json

    path = tmp_path / "m.json"
    for image in (str(secret), "/dev/zero", "secret.txt", "../secret.txt"):
        path.write_text(json.dumps({"type": "Scaled", "of": {**data, "image": image}}))
        with pytest.raises(FormatError, match="opens no others") as caught:
            gn.load(path)
        assert "horse" not in str(caught.value)
        with pytest.raises(ParameterError, match="opens no others"):
            from_json({**data, "image": image})
    assert not {str(secret), "/dev/zero"} & set(opened)


@unless_fifos
@pytest.mark.parametrize("text", ["load({!r})", "EnvironmentLight({!r})"])
def test_a_text_opens_no_pipes_and_no_devices(text, tmp_path):
    """Only files and folders, also where it may open any. (D15, D24)"""
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/null")):
        with pytest.raises(ExpressionError, match="a pipe or a device"):
            gn.expression(text.format(str(path)), files=True)


@unless_fifos
def test_a_pipe_is_read_to_its_end(tmp_path, table):
    """`gn.load(fifo)`, written in pieces; what is known of it names the pipe. (D24)"""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    def write():
        with pipe.open("w") as file:
            for line in TABLE.splitlines(keepends=True):
                file.write(line)
                file.flush()

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    m = gn.load(pipe)
    writer.join(10.0)
    assert m == gn.load(table)
    assert m.path == str(pipe)
    assert m.provenance["file"] == "pipe"
    assert m.provenance["sha256"] == gn.load(table).provenance["sha256"]


@unless_fifos
def test_a_pipe_that_nobody_writes_to_is_refused(tmp_path, monkeypatch):
    """It waited forever. (D24)"""
    monkeypatch.setattr(pipes, "PATIENCE", 0.2)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(NotFoundError, match="nobody writes to"):
        gn.load(tmp_path / "pipe")


@unless_fifos
def test_a_pipe_without_end_is_refused(tmp_path, monkeypatch):
    """As much as is kept of a pipe has a bound, and its copy goes. (D24)"""
    monkeypatch.setattr(pipes, "LIMIT", 100_000)
    monkeypatch.setattr(pipes.tempfile, "tempdir", str(tmp_path))
    with subprocess.Popen(["cat", "/dev/zero"], stdout=subprocess.PIPE) as endless:
        with pytest.raises(FormatError, match="more than 100000 bytes"):
            gn.load(f"/dev/fd/{endless.stdout.fileno()}")
        endless.kill()
    assert list(tmp_path.iterdir()) == []


@unless_fifos
def test_messages_name_the_pipe_and_not_its_copy(tmp_path):
    """What a pipe holds is judged as a file is. (D24)"""
    with subprocess.Popen(["printf", "nonsense"], stdout=subprocess.PIPE) as short:
        path = f"/dev/fd/{short.stdout.fileno()}"
        with pytest.raises(FormatError) as caught:
            gn.load(path)
    assert str(caught.value).startswith(f"{path}: not a known format")
    assert "gonio-pipe" not in str(caught.value)


def test_standard_input_is_a_path(table):
    """/dev/stdin, of a pipe and of a file. (D24)"""
    if not os.path.exists("/dev/stdin"):
        pytest.skip("this system has no /dev/stdin")
    code = "import gonio as gn; print(gn.load('/dev/stdin').valid[0, 0, 0].shape)"
    of_pipe = subprocess.run([sys.executable, "-c", code], input=TABLE, capture_output=True, text=True, timeout=300)
    with table.open() as file:
        of_file = subprocess.run([sys.executable, "-c", code], stdin=file, capture_output=True, text=True, timeout=300)
    assert of_pipe.stdout == of_file.stdout == "()\n"


def test_devices_and_sockets_are_named_for_what_they_are(tmp_path, monkeypatch):
    """Not "no such file", and not read. (D24)"""
    for path in ("/dev/null", "/dev/zero"):
        with pytest.raises(NotFoundError, match="character device, expected a file, a folder or a pipe"):
            gn.load(path)
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("s")
        with pytest.raises(NotFoundError, match="a socket"):
            gn.load("s")


@pytest.mark.parametrize(
    "path",
    ["x" * 10_000, "a/" * 100_000, "a\nb", "a\ud800", b"\xff\xfe", "", "loop", "table.csv/inside"],
    ids=lambda x: repr(x[:12]),
)
def test_odd_paths_end_in_one_short_line(path, table, monkeypatch):
    """Raw OSError, ValueError and UnicodeEncodeError before. (D18)"""
    monkeypatch.chdir(table.parent)
    os.symlink("loop", "loop")
    with pytest.raises(gn.Error) as caught:
        gn.load(path)
    assert len(str(caught.value)) < 700
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("path", ["a\0b", b"a\0b", 3, None, 2.5, ["a"]])
def test_what_is_no_path_is_a_parameter_error(path):
    """NUL was a raw ValueError, other types a raw TypeError. (D18)"""
    with pytest.raises(ParameterError, match="path"):
        gn.load(path)


def test_a_folder_that_may_not_be_entered(tmp_path):
    """A raw PermissionError before. (D18)"""
    if not hasattr(os, "fork") or not hasattr(os, "seteuid"):
        pytest.skip("this system has no users to become")
    closed = tmp_path / "closed"
    closed.mkdir()
    (closed / "table.csv").write_text(TABLE)
    closed.chmod(0)
    own = os.geteuid()
    try:
        if own == 0:
            os.seteuid(65534)
        with pytest.raises(NotFoundError, match="cannot be read: Permission denied"):
            gn.load(closed / "table.csv")
    finally:
        os.seteuid(own)
        closed.chmod(0o700)


def test_bytes_are_a_path(table):
    """As for `open`. (D18)"""
    assert np.array_equal(gn.load(os.fsencode(table)).f(*np.eye(3)[[2, 2]]), gn.load(table).f(*np.eye(3)[[2, 2]]))
