"""The command line against the machine it runs on, and against what files and names say to a terminal."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import struct
import subprocess
import sys
import termios
import warnings
from pathlib import Path

import pytest
from click.testing import CliRunner
from libraries import thinned
from seeds import SEEDS
from text_files import CSV

import gonio as gn
from gonio.cli.arguments import resolve
from gonio.cli.commands import cli
from gonio.errors import Error, NotFoundError, visible
from gonio.formats import formats
from gonio.formats._options import options

SMALL = ["--size", "16", "--samples", "1"]
EVIL = "\x1b]0;evil\x07\x1b[2J\u202e\x9b31m"
"""Sets a terminal's title, wipes it, turns the direction of writing, colours by a C1 character."""
ACTS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
"""What acts on a terminal, but for the end of a line."""
LINE = re.compile(r"gonio: error: [^\n]+\n")


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs a command in an empty folder and returns its result."""
    monkeypatch.chdir(tmp_path)
    return lambda *args: CliRunner().invoke(cli, [str(a) for a in args])


def environment(**more: str) -> dict[str, str]:
    found = str(Path(gn.__file__).parents[1])
    users = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}  # hides late complaints
    return users | {"PYTHONPATH": os.pathsep.join([found, os.environ.get("PYTHONPATH", "")])} | more


def shell(line: str, folder: Path, **more: str) -> subprocess.CompletedProcess:
    """Runs a line of bash in which `gonio` is the command."""
    command = f"set -o pipefail; gonio() {{ '{sys.executable}' -m gonio \"$@\"; }}; {line}"
    return subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment(**more), capture_output=True, text=True, timeout=300
    )


# Standard streams and terminals.


STREAMS = [
    ("gonio info gold >&-", 2, "standard output is closed; lead it to /dev/null"),
    ("gonio info gold <&- >&- 2>&-", 2, None),
    ("gonio info golden 2>&-", 2, None),
    ("gonio info gold <&- 2>&- >/dev/null", 0, None),
    ("gonio info gold >/dev/full", 2, "standard output: No space left on device"),
    ("gonio --help >/dev/full", 2, "No space left on device"),
    ("gonio info golden 2>/dev/full", 2, None),
    ("gonio info - <&-", 2, "-: standard input is closed"),
    ("gonio materials | true", 141, None),
    ("gonio --help | true", 141, None),
]


@pytest.mark.parametrize(("line", "code", "says"), thinned(STREAMS, [STREAMS[k] for k in (0, 3, 5, 8)]))
def test_streams_that_are_closed_full_or_broken(line, code, says, tmp_path):
    """One line at most, exit code 2, or that of SIGPIPE; no traceback, no "Exception ignored". (D18)"""
    done = shell(line, tmp_path)
    assert done.returncode == code, done.stderr
    assert done.stderr == "" if says is None else LINE.fullmatch(done.stderr) and says in done.stderr


def test_no_file_gets_the_number_of_a_closed_stream(tmp_path):
    """With all streams closed a file that is written is not where messages go. (D18)"""
    code = (
        "import os; from gonio.cli.group import streams\n"
        "try: streams()\n"
        "except SystemExit: pass\n"
        "os._exit(os.open(os.devnull, os.O_RDONLY) < 3)"
    )
    assert shell(f'"{sys.executable}" -c "{code}" <&- >&- 2>&-', tmp_path).returncode == 0


@pytest.mark.parametrize(
    "more",
    [
        pytest.param({"COLUMNS": "1"}, marks=pytest.mark.full),
        pytest.param({"COLUMNS": "0", "TERM": "dumb"}, marks=pytest.mark.full),
        pytest.param({"COLUMNS": "9" * 20, "NO_COLOR": "1"}, marks=pytest.mark.full),
        {"COLUMNS": "x", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"COLUMNS": "1", "PYTHONIOENCODING": "ascii:strict", "TERM": ""},
        pytest.param({"PYTHONIOENCODING": "ascii:strict", "TERM": ""}, marks=pytest.mark.full),
    ],
)
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a terminal to draw on")
def test_odd_terminals(more, tmp_path):
    """Any width, encoding and kind of terminal prints, one column wide too. (D18)"""
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 1, 0, 0))
    command = [sys.executable, "-m", "gonio", "materials", "rubber"]
    done = subprocess.Popen(command, cwd=tmp_path, env=environment(**more), stdout=theirs, stderr=theirs)
    os.close(theirs)
    printed = b""
    while True:
        try:
            printed += os.read(ours, 1 << 16)
        except OSError:  # Linux says so that the other end is closed
            break
    os.close(ours)
    assert done.wait(60) == 0 and b"Traceback" not in printed and b"rubber" in printed


@pytest.mark.parametrize(("name", "backend"), thinned([("nonsense", None), ("svg", "svg")], [("nonsense", None)]))
def test_a_backend_of_matplotlib_that_is_not_there(name, backend, tmp_path):
    """Figures are drawn whatever MPLBACKEND says, and it still says it to others. (D18)"""
    code = (
        "import sys; from gonio.figures._drawing import new_figure\n"
        "with new_figure(sys.argv[1], (1.0, 1.0), 'a$b') as figure: pass\n"
        "import os, matplotlib; print(os.environ['MPLBACKEND'], matplotlib.rcParams['backend'])"
    )
    command = [sys.executable, "-c", code, tmp_path / "a.png"]
    done = subprocess.run(command, env=environment(MPLBACKEND=name), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and (tmp_path / "a.png").stat().st_size > 100, done.stderr
    assert done.stdout.split()[0] == name and backend in (None, done.stdout.split()[1])


# Failures of the machine, and faults.


@pytest.mark.parametrize(
    ("failure", "code", "says"),
    [
        (MemoryError(), 2, "not enough memory"),
        (MemoryError("Unable to allocate 9 GiB"), 2, "not enough memory: Unable to allocate 9 GiB; ask for less"),
        (RecursionError("maximum recursion depth exceeded"), 2, "nested too deeply"),
        (OSError(errno.ENOSPC, "No space left on device", "a\x1b.png"), 2, r"a\x1b.png: No space left on device"),
        (OSError(errno.EFBIG, "File too large", b"a.png"), 2, "a.png: File too large"),
        (OSError(errno.EDQUOT, "Disk quota exceeded"), 2, "error: Disk quota exceeded"),
        (PermissionError(errno.EACCES, "Permission denied", "a.png"), 2, "a.png: Permission denied"),
        (OSError("without a number"), 2, "error: without a number"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_failures_of_the_machine_are_one_line(run, monkeypatch, failure, code, says):
    """Whatever the machine refuses is said in one line, and where. (D18)"""

    def fails(*args, **kwargs):
        raise failure

    monkeypatch.setattr("gonio.pictures.image.Image.save", fails)
    result = run("render", "gold", "-o", "a.png", *SMALL)
    assert result.exit_code == code and isinstance(result.exception, SystemExit)
    assert LINE.fullmatch(result.stderr.lstrip("\n")) and says in result.stderr, result.stderr


@pytest.mark.parametrize("failure", [KeyError("x\x1b[2J"), EOFError("ended"), ZeroDivisionError()])
def test_a_fault_of_gonio_is_not_blamed_on_the_input(run, monkeypatch, failure):
    """A mistake in gonio shows where it is and how to go on, with an exit code of its own. (D18)"""

    def fails(*args, **kwargs):
        raise failure

    monkeypatch.setattr("gonio.pictures.image.Image.save", fails)
    result = run("render", "gold", "-o", "a.png", *SMALL)
    assert result.exit_code == 70 and "Traceback" in result.stderr
    assert "please report it" in result.stderr.splitlines()[-1] and not ACTS.search(result.stderr)


def test_a_file_larger_than_allowed(tmp_path):
    """`ulimit -f`: one line, and no file. (D18)"""
    done = shell("ulimit -f 8; gonio convert 'Lambertian(0.5)' m.binary", tmp_path)
    assert done.returncode == 2 and LINE.fullmatch(done.stderr), done.stderr
    assert list(tmp_path.iterdir()) == []


# Inputs.


@pytest.mark.slow_because("Zarr writes a store in many files, four times")
def test_a_zarr_folder_is_a_material(run, tmp_path):
    """What convert has written, all commands read. (D18)"""
    even = "theta_i,theta_o,phi,f\n" + "".join(f"30,{view},180,0.2\n" for view in (0, 45, 60))  # soon integrated
    (tmp_path / "m.csv").write_text(even)
    assert run("convert", "m.csv", "out.zarr").exit_code == 0
    size = sum(p.stat().st_size for p in (tmp_path / "out.zarr").rglob("*") if p.is_file())
    assert json.loads(run("info", "out.zarr", "--json").stdout)["bytes"] == size
    assert json.loads(run("convert", "m.csv", "other.zarr", "--json").stdout)["bytes"] == size
    for command in ("albedo out.zarr --theta-i 30", "convert out.zarr m.nc", "cite out.zarr"):
        result = run(*command.split())
        assert result.exit_code == 0 and result.stdout, (command, result.stderr)
    assert run("convert", "m.csv", "out.zarr").exit_code == 0  # a store is replaced, as gn.save does it
    (tmp_path / "out.zarr" / "notes.txt").write_text("not gonio's")
    assert run("convert", "m.csv", "out.zarr").exit_code == 2
    assert (tmp_path / "out.zarr" / "notes.txt").exists()


def test_a_folder_that_is_no_store_hides_no_built_in_material(run, tmp_path):
    """A folder named as a material is not read in its place. (D18)"""
    (tmp_path / "gold").mkdir()
    assert "metal: Au" in run("info", "gold").stdout
    (tmp_path / "folder").mkdir()
    assert "it is a directory, and no store" in run("info", "folder").stderr


def test_what_exists_is_not_said_to_be_missing(tmp_path, monkeypatch):
    """No "did you mean fifo.csv?" of fifo.csv itself: pipes and devices are read, or refused as such. (D24)"""
    asked = []
    for module in ("cli.arguments", "catalogue.typed"):
        monkeypatch.setattr(f"gonio.{module}.load_as_typed", lambda path, reading: asked.append(path))
    os.mkfifo(tmp_path / "fifo.csv")
    for text in (str(tmp_path / "fifo.csv"), "/dev/null"):
        resolve(text)
    resolve("-")
    assert asked == [str(tmp_path / "fifo.csv"), "/dev/null", "/dev/stdin"]


def test_what_is_missing_is_said_as_it_is(tmp_path):
    """Links to nowhere, folders that may not be read, and names that are too long, in gonio's words. (D24, D18)"""
    (tmp_path / "link.csv").symlink_to("nowhere")
    with pytest.raises(NotFoundError, match="it is a link to 'nowhere', which is not there"):
        resolve(str(tmp_path / "link.csv"))
    for text in ("a" * 100_000, "b/" * 50_000, str(tmp_path / ("c" * 300)), "a\0b", "\udcff.csv"):
        with pytest.raises(Error) as raised:
            resolve(text)
        assert len(str(raised.value)) < 1000
    if os.geteuid() == 0:
        pytest.skip("root may enter every folder")
    (tmp_path / "closed").mkdir(mode=0)
    with pytest.raises(NotFoundError, match="may not be read"):
        resolve(str(tmp_path / "closed" / "m.csv"))


def test_a_pipe_as_a_light_is_refused_at_once(run, tmp_path):
    """A picture is read more than once: a pipe is told from a file that is missing, and not waited for. (D24)"""
    os.mkfifo(tmp_path / "sky.exr")
    result = run("render", "gold", "-o", "a.png", "-l", "sky.exr", *SMALL)
    assert result.exit_code == 2 and "a pipe or a device, expected a file" in result.stderr


# What a terminal is not to obey.


@pytest.fixture
def nasty(tmp_path):
    """A file whose name and content act on a terminal."""
    name = f"m{EVIL.replace('/', '')}.csv"
    (tmp_path / name).write_text(CSV.replace("grey tile", f"grey {EVIL} tile\u2028\x00".replace("\x00", "")))
    return name


COMMANDS = ["info", "albedo", "check", "cite", "convert", "render", "show"]


@pytest.mark.parametrize("command", thinned(COMMANDS, COMMANDS[:-1]))
def test_nothing_from_files_and_names_acts_on_a_terminal(run, nasty, command):
    """Escapes, control characters and turned writing are printed as text, in what is said and in what fails. (D20)"""
    out = {
        "convert": [f"o{EVIL}.json"],
        "render": ["-o", f"o{EVIL}.png", *SMALL],
        "show": ["-o", f"o{EVIL}.png", *SMALL],
    }
    for source in (nasty, f'"{EVIL}"', f"Lambertian({EVIL})", f"nothing{EVIL}.csv"):
        result = run(command, source, *out.get(command, []), "-p", f"{EVIL}=1")
        assert result.exit_code == 2 and not ACTS.search(result.output), repr(result.output)
        result = run(command, source, *out.get(command, []))
        assert not ACTS.search(result.output), repr(result.output)
    if command == "info":
        printed = run("info", nasty).stdout
        assert r"\x1b]0;evil\x07\x1b[2J\u202e\x9b31m" in printed
        assert json.loads(run("info", nasty, "--json").stdout)["material"] == nasty


def test_a_name_forges_no_lines(run, tmp_path):
    """A line end in a name is not one in what is printed. (D20)"""
    name = "m\n  pass  everything.csv"
    (tmp_path / name).write_text(CSV)
    assert "\n  pass  everything" not in run("check", name).stdout
    assert run("info", "gone\ngonio: error: nothing.csv").stderr.count("\n") == 1


def test_styles_are_gonios_own_and_stay_off_where_asked(monkeypatch):
    """NO_COLOR takes styles away; only bold and the colours of verdicts ever reach a terminal. (D20)"""
    from gonio.cli.terminal import echo

    shown = []
    monkeypatch.setattr("click.echo", lambda text, err, color: shown.append((text, color)))
    monkeypatch.delenv("NO_COLOR", raising=False)
    echo("\x1b[1mname\x1b[0m \x1b[8m hidden \x1b[31mred\nend")
    monkeypatch.setenv("NO_COLOR", "1")
    echo("x")
    assert shown == [("\x1b[1mname\x1b[0m \\x1b[8m hidden \x1b[31mred\nend", None), ("x", False)]


@pytest.mark.parametrize("name", ["ALTA", "CSV", "pab-opto", "SSDD", "BiRD", "Zemax", "Integra", "WINDOW XML", "FRED"])
def test_messages_about_files_are_visible_and_bounded(name, tmp_path):
    """The Python API's errors quote files so that nothing acts, however long the word. (D20)"""
    text = SEEDS[name]().decode()
    file, count = tmp_path / "file", 0
    for k, word in enumerate(list(re.finditer(r'[^\s,;"<>:{}\[\]]+', text))[:60]):
        file.write_text(text[: word.start()] + EVIL * (300 if k % 2 else 1) + text[word.end() :])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # errors are looked at
                gn.load(file)
        except Error as error:
            count += 1
            assert not ACTS.search(str(error)) and len(str(error)) < 3000
    assert count > 3


def test_visible_text():
    """Only what cannot be seen is changed, and read back by Python it is the same. (D20)"""
    assert visible("größe 1 µm\u00a0θᵢ 漢字") == "größe 1 µm\u00a0θᵢ 漢字"
    odd = "".join(map(chr, [*range(32), *range(127, 160), 0x200B, 0x202E, 0x2028, 0xFEFF, 0xE000, 0xDC80, 0x1F600]))
    shown = visible(odd)
    assert shown.isprintable() and shown.endswith("\U0001f600")
    assert shown.encode("latin-1", "backslashreplace").decode("unicode_escape") == odd
    assert visible("a\nb\x1b", keep="\n") == "a\nb\\x1b"


# Without docstrings.


def test_help_and_sources_without_docstrings(tmp_path):
    """`python -OO` changes neither help nor citations, of any model. (D18)"""
    code = (
        "import gonio as gn, runpy, sys\n"
        "from gonio.declared.discover import modules\n"
        "[modules(f'gonio.{p}') for p in ('models', 'distributions', 'formats', 'lights')]\n"
        "from gonio.formula.fields import CLASSES\n"
        "for name in sorted(CLASSES): print(gn.cite(name))\n"
        "from gonio.cli.commands import cli\n"
        "for args in ['--help'], *([name, '--help'] for name in sorted(cli.commands)), ['info', 'gold']:\n"
        "    try: cli(args)\n"
        "    except SystemExit: pass\n"
    )
    said = [
        subprocess.run(
            [sys.executable, *flags, "-c", code], cwd=tmp_path, env=environment(), capture_output=True, text=True
        )
        for flags in ([], ["-OO"])
    ]
    assert said[0].returncode == said[1].returncode == 0, said[1].stderr
    assert said[0].stdout == said[1].stdout and len(said[0].stdout) > 50_000 and "@article" in said[0].stdout


# Options.

WRITERS = [w for w in formats() if hasattr(w, "write")]
WRONG = [
    *(0, -1, (0, 0, 0), (-1, 4, 4), (3,), (4, 4, 4, 4, 4, 4), (3000, 3000, 3000), (10**12,) * 3, (10**6,) * 4, 10**30),
    *("a", "64", "", (), [], {}, b"x", float("nan"), float("inf"), True, (True, True, True), (4.5, 4.0, 4.0)),
    *(1e-9, 1e-320),
]  # fmt: skip


@pytest.mark.parametrize("writer", WRITERS, ids=[w.NAME for w in WRITERS])
def test_no_resolution_is_ignored_or_a_raw_error(writer, tmp_path):
    """Of every format: the wrong kind, none, negative ones, too many nodes and too few are a gonio error. (D18)"""
    option = "step" if "step" in options(writer.write) else "resolution"
    more = {
        "pab-opto": {"incident": (0.5, 0.0)},
        "WINDOW XML": {"tree": 3},
        **{name: {"wavelengths": [550.0]} for name in ("BRF table", "OpenMATERIAL", "Speos")},
    }.get(writer.NAME, {})
    path = tmp_path / f"m{writer.SUFFIXES[0]}"
    for resolution in WRONG:
        with pytest.raises(Error, match=option):
            gn.save(gn.Lambertian(0.5), path, writer.NAME, **{option: resolution}, **more)
    assert not path.exists()
    if writer.NAME == "WINDOW XML":
        with pytest.raises(Error, match="are of trees"):
            gn.save(gn.Lambertian(0.5), path, writer.NAME, resolution=8)
    assert option in options(writer.write) or not more


@pytest.mark.parametrize(
    ("name", "first", "asked"),
    [
        ("CSAIL", (3, 3, 5, 2), (2, 2, 4, 1)),
        ("KAIST", (3, 3, 5), (3, 4, 6)),
        ("Integra", (3, 3, 5), (3, 4, 5)),
        *((name, 20, 30) for name in ("Zemax", "FRED", "Speos", "LightTools")),
    ],
)
def test_a_resolution_holds_for_what_was_read_from_such_a_file(name, first, asked, tmp_path):
    """A file of the format itself is resampled where a resolution is asked for, not copied. (D18)"""
    writer = next(w for w in WRITERS if name == w.NAME)
    suffix = writer.SUFFIXES[0]
    more = {"wavelengths": [550.0]} if name == "Speos" else {}
    option = "step" if "step" in options(writer.write) else "resolution"
    gn.save(gn.Lambertian(0.5), tmp_path / f"a{suffix}", name, **{option: first}, **more)
    m = gn.load(tmp_path / f"a{suffix}")
    gn.save(m, tmp_path / f"b{suffix}", name)
    gn.save(m, tmp_path / f"c{suffix}", name, **{option: asked})
    a, b, c = ((tmp_path / f"{x}{suffix}").read_bytes() for x in "abc")
    assert a == b and len(c) != len(a)


@pytest.mark.parametrize("resolution", [64, 0, "x", (3,), (3000, 3000, 3000)])
def test_tables_and_datasets_check_their_resolution_too(resolution):
    """`tabulate` and `to_dataset`: the same errors. (D18)"""
    for make in (gn.tables.tabulate, gn.tables.to_dataset):
        with pytest.raises(Error, match="resolution"):
            make(gn.Lambertian(0.5), resolution=resolution)


@pytest.mark.parametrize(
    "words",
    [
        "x.nc --resolution 64",
        "x.alta --format alta --resolution 64",
        "x.binary --format csail --resolution 64",
        "x.ddr --resolution 64",
        "x.nc --resolution 3000,3000,3000",
        "x.xml --resolution 8",
        "x.nc --resolution 0",
        "x.nc --resolution 8,,8",
        "x.json --resolution 8",
    ],
)
def test_resolution_on_the_command_line(run, tmp_path, words):
    """What cannot be done is one line and exit code 2. (D18)"""
    result = run("convert", "Lambertian(0.5)", *words.split())
    assert result.exit_code == 2 and LINE.fullmatch(result.stderr) and "resolution" in result.stderr, result.stderr
    assert list(tmp_path.iterdir()) == []
