"""The kernel cache: what is run from it, what is removed from it, what its names stand for; and doing without."""

from __future__ import annotations

import ast
import hashlib
import json
import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from types import SimpleNamespace

import pytest
from libraries import thinned

import gonio
from gonio.compile import cache_folder, store
from gonio.compile.llvm import machine
from gonio.evaluate import planning

pytestmark = [
    pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here"),
    pytest.mark.skipif(os.name != "posix", reason="owners and modes are POSIX's"),
]
as_root = pytest.mark.skipif(os.name == "posix" and os.geteuid() != 0, reason="two users: only root can be both")

SOURCES = str(Path(gonio.__file__).resolve().parents[1])
NAME = "0123456789abcdef" * 2 + "01234567"
DAY = 86400.0

BEGIN = """
import ctypes, os, re, resource, sys, traceback
from pathlib import Path
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
import numpy as np
import gonio as gn
from gonio.compile import store
from gonio.compile.llvm import codegen, machine
from gonio.evaluate import planning

compiled, to_object = [], machine.to_object
machine.to_object = lambda text: compiled.append(text) or to_object(text)
w = np.array([[0.0, 0.0, 1.0]])

def f(m=None):
    "f of a material as in a new process: its value, and how many kernels were compiled."
    store._KNOWN.clear()
    planning._PATTERNS.clear()
    compiled.clear()
    return float((m or gn.Lambertian(0.5)).f(w, w)[0]), len(compiled)

def forked(work=f, **environment):
    "What work returns in a process of its own, or the signal that ended it."
    reader, writer = os.pipe()
    pid = os.fork()
    if not pid:
        os.environ.update(environment)
        try:
            os.write(writer, repr(work()).encode())
        except BaseException:
            traceback.print_exc()
        os._exit(0)
    os.close(writer)
    said = os.read(reader, 4096).decode()
    os.close(reader)
    status = os.waitpid(pid, 0)[1]
    return said or f"ended by signal {status}"
"""
RHO_PI = 0.5 / 3.141592653589793

FORKS = """
import json
for line in sys.stdin:
    code, arguments, environment, *files = json.loads(line)
    pid = os.fork()
    if not pid:
        for number, file in enumerate((os.devnull, *files)):
            os.dup2(os.open(file, os.O_RDWR), number)
        os.environ.clear()
        os.environ.update(environment)
        sys.argv[1:], status = arguments, 1
        try:
            exec(code, globals())
            status = 0
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(status)
    print(os.waitpid(pid, 0)[1], flush=True)
"""


@pytest.fixture(scope="module", autouse=True)
def forks(tmp_path_factory) -> Iterator[None]:
    """A process that has imported gonio and done nothing else, and a fork of it for each text that is run."""
    folder = tmp_path_factory.mktemp("forks")
    files = [folder / "stdout", folder / "stderr"]
    with ongoing(FORKS, timeout=600.0, PYTHONPATH=SOURCES) as ask:

        def answered(code: str, arguments: list[str], environment: dict[str, str]) -> tuple[int, str, str]:
            for file in files:
                file.write_text("")
            status = ask(json.dumps([code, arguments, environment, *map(str, files)]))
            return int(status), *(file.read_text() for file in files)

        _FORKS[:] = [answered]
        yield
        _FORKS.clear()


_FORKS: list[Callable[..., tuple[int, str, str]]] = []


def run(code: str, *arguments: object, timeout: float = 300.0, **environment: str | None) -> SimpleNamespace:
    """What a process prints that has done nothing before, line by line, and its warnings; None removes a variable. It
    is a new one where gonio is another, and else a fork."""
    both = {**os.environ, "PYTHONPATH": SOURCES, **environment}
    env = {name: str(value) for name, value in both.items() if value is not None}
    if env["PYTHONPATH"] == SOURCES:
        status, out, err = _FORKS[0](code, [*map(str, arguments)], env)
    else:
        command = [sys.executable, "-c", BEGIN + code, *map(str, arguments)]
        done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=timeout)
        status, out, err = done.returncode, done.stdout, done.stderr
    assert status == 0, err
    return SimpleNamespace(lines=out.splitlines(), stderr=err, warned=err.count("Warning:"))


@contextmanager
def ongoing(code: str, timeout: float = 300.0, **environment: object) -> Iterator[Callable[..., str]]:
    """A process that answers each line with a line; it is killed after a time."""
    env = {**os.environ, "PYTHONPATH": SOURCES, **{name: str(value) for name, value in environment.items()}}
    how = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "start_new_session": True}
    with subprocess.Popen([sys.executable, "-c", BEGIN + code], env=env, **how) as process:
        watch = Timer(timeout, os.killpg, (process.pid, signal.SIGKILL))  # with the children that it forked
        watch.start()

        def ask(line: str = "") -> str:
            print(line, file=process.stdin, flush=True)
            return process.stdout.readline().rstrip()

        try:
            yield ask
            process.stdin.close()
            process.wait()
        finally:
            watch.cancel()
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def kept(folder: Path) -> list[Path]:
    """The files of kernels in a folder, however deep: code, and records of programs that name it."""
    return sorted(p for p in folder.rglob("*") if re.fullmatch("[0-9a-f]{40}", p.name))


def kinds(folder: Path) -> tuple[list[Path], list[Path]]:
    """The files of code in a folder, and the records."""
    start = len(cache_folder.MAGIC) + 32
    records = {path for path in kept(folder) if path.read_bytes()[start:][:1] == b"r"}
    return [path for path in kept(folder) if path not in records], sorted(records)


def forged(path: Path, body: bytes, name: str = "") -> bytes:
    """A file as gonio writes it, with a right checksum for its name or this one, and this content."""
    data = path.read_bytes()
    start = data.index(b"\n") + 1
    salt = (
        b"" if hashlib.sha256(data[start + 32 :]).digest() == data[start : start + 32] else (name or path.name).encode()
    )
    return data[:start] + hashlib.sha256(salt + body).digest() + body


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """The folder of kernels, in this process."""
    monkeypatch.setenv("GONIO_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(cache_folder, "_WRITTEN", [0])
    monkeypatch.setattr(cache_folder, "_WARNED", [])
    return tmp_path / cache_folder.FOLDER


@pytest.fixture(scope="module")
def filled(tmp_path_factory) -> Path:
    """A folder in which a process has kept the kernel of f."""
    made = tmp_path_factory.mktemp("filled")
    run("print(f())", GONIO_CACHE_DIR=made)
    return made


def names(count: int) -> list[str]:
    return [hashlib.sha256(str(i).encode()).hexdigest()[:40] for i in range(count)]


# What is removed.


def test_files_of_the_user_stay(tmp_path):
    """However many files lie beside the kernels, whatever their names, none is removed. (D4)"""
    mine = [tmp_path / f"photo_{i}.raw" for i in range(2100)] + [tmp_path / name for name in names(50)]
    for path in mine:
        path.touch()
    run("print(f())", GONIO_CACHE_DIR=tmp_path)
    assert all(path.exists() for path in mine)


def test_only_kernels_are_counted_and_removed(folder, monkeypatch):
    """In the folder of kernels itself, too: other names, folders and links stay. (D4)"""
    monkeypatch.setattr(cache_folder, "BYTES_KEPT", 8 * cache_folder.BLOCK)
    monkeypatch.setattr(cache_folder, "LOOK", 1)
    cache_folder.write(NAME, b"kernel")
    foreign = [folder / name for name in ("notes.txt", ".hidden", NAME[:-1], NAME + "0", NAME.upper(), "x" * 40)]
    foreign += [folder / f"more_{i}" for i in range(20)]
    for path in foreign:
        path.write_text("mine")
    (folder / ("d" * 40)).mkdir()
    (folder / ("e" * 40)).symlink_to(folder / "notes.txt")
    os.mkfifo(folder / ("f" * 40))
    foreign += [folder / (c * 40) for c in "def"]
    for path in foreign:
        os.utime(path, (1, 1), follow_symlinks=False)
    for name in names(30):
        cache_folder.write(name, b"kernel")
    assert all(os.path.lexists(path) for path in foreign)
    assert sum(cache_folder.read(name) is not None for name in [NAME, *names(30)]) <= 8


def test_what_is_used_is_kept_longest(folder, monkeypatch):
    """A kernel that is used stays, written however long ago; of those that are not, the oldest go first. (D4)"""
    monkeypatch.setattr(cache_folder, "BYTES_KEPT", 100 * cache_folder.BLOCK)
    monkeypatch.setattr(cache_folder, "LOOK", 1)
    for name in names(60):
        cache_folder.write(name, b"kernel")
    for age, name in enumerate(names(60)):
        os.utime(folder / name, (1, time.time() - (age + 2) * DAY))
    assert cache_folder.read(names(60)[-1]) == b"kernel"
    monkeypatch.setattr(cache_folder, "BYTES_KEPT", 40 * cache_folder.BLOCK)
    cache_folder.write(NAME, b"kernel")
    assert {path.name for path in kept(folder)} == {NAME, names(60)[-1], *names(28)}


def test_a_clock_that_was_wrong_keeps_nothing_for_ever(folder, monkeypatch):
    """Times in the future count as old until the file is used. (D4)"""
    monkeypatch.setattr(cache_folder, "BYTES_KEPT", 4 * cache_folder.BLOCK)
    for name in names(4):
        cache_folder.write(name, b"kernel")
        os.utime(folder / name, (1, time.time() + 1000 * DAY))
    assert cache_folder.read(names(4)[3]) == b"kernel"
    monkeypatch.setattr(cache_folder, "LOOK", 1)
    cache_folder.write(NAME, b"kernel")
    assert {path.name for path in kept(folder)} > {NAME, names(4)[3]}
    assert len(kept(folder)) == 3


def test_kernels_are_bounded_by_bytes(folder, monkeypatch):
    """Large files count for more; one that is larger than any kernel is not written. (D4)"""
    monkeypatch.setattr(cache_folder, "BYTES_KEPT", 100_000)
    monkeypatch.setattr(cache_folder, "LARGEST", 30_000)
    monkeypatch.setattr(cache_folder, "LOOK", 1)
    for i, name in enumerate(names(20)):
        cache_folder.write(name, bytes(20_000))
        os.utime(folder / name, (1, time.time() - (100 - i) * 60))
    assert {path.name for path in kept(folder)} <= set(names(20)[-5:])
    assert sum(path.stat().st_size for path in kept(folder)) <= 100_000
    cache_folder.write(NAME, bytes(40_000))
    assert not (folder / NAME).exists()


def test_a_hit_is_noted_once_a_day(folder):
    """A kernel in daily use is not written to at each use. (D4)"""
    cache_folder.write(NAME, b"kernel")
    for age, fresh in ((0.5 * DAY, False), (2 * DAY, True)):
        before = time.time() - age
        os.utime(folder / NAME, (before, before))
        assert cache_folder.read(NAME) == b"kernel"
        assert ((folder / NAME).stat().st_mtime > before + 1) is fresh


def test_what_killed_processes_leave_is_swept(folder, monkeypatch):
    """A process killed before its file has its name leaves a temporary, which another removes an hour later. (D4)"""
    killed = "os.replace = lambda *a, **k: os.kill(os.getpid(), 9)\nprint(forked())\nprint(forked())"
    assert run(killed, GONIO_CACHE_DIR=folder.parent).lines == ["ended by signal 9"] * 2
    left = list(folder.iterdir())
    assert len(left) == 2
    assert not kept(folder)
    old = time.time() - 2 * 3600
    os.utime(left[0], (old, old))
    monkeypatch.setattr(cache_folder, "LOOK", 1)
    cache_folder.write(NAME, b"kernel")
    assert set(folder.iterdir()) == {folder / NAME, left[1]}


def test_processes_fill_and_empty_a_folder_at_once(folder):
    """Writers that all remove and readers that all find: nobody fails, and what is read is right. (D4)"""
    code = """
from gonio.compile import cache_folder
import hashlib
others = []
while len(others) < 3 and 0 not in others:
    others.append(os.fork())
cache_folder.BYTES_KEPT, cache_folder.LOOK, right = 20 * cache_folder.BLOCK, 2 * cache_folder.BLOCK, 0
for i in range(300):
    name = hashlib.sha256(str(i % 60).encode()).hexdigest()[:40]
    found = cache_folder.read(name)
    if found is None:
        cache_folder.write(name, name.encode())
    else:
        assert found == name.encode()
        right += 1
if 0 not in others:
    assert not any(os.waitpid(pid, 0)[1] for pid in others)
"""
    assert not run(code, GONIO_CACHE_DIR=folder.parent).stderr
    assert len(kept(folder)) == len(list(folder.iterdir())) <= 20 + 4 * 2


def test_a_folder_made_while_it_is_looked_for(folder, monkeypatch, recwarn):
    """Another process makes the folder after this one failed to open it: that is no reason to warn. (D4)"""

    def another(path, *arguments, dir_fd=None, to_open=os.open, **options):
        try:
            return to_open(path, *arguments, dir_fd=dir_fd, **options)
        finally:
            folder.mkdir(parents=True, exist_ok=True)

    monkeypatch.setattr(os, "open", another)
    assert cache_folder.read(NAME) is None
    assert folder.is_dir()
    assert not recwarn.list


# What is run.


def test_a_folder_that_others_may_write_to_is_not_used(filled, tmp_path):
    """Its kernels are not run; one warning names the folder and the remedy. (D6)"""
    shutil.copytree(filled, tmp_path, dirs_exist_ok=True)
    kernel, _ = kept(tmp_path)
    modes = (0o777, 0o1777, 0o775, 0o707, 0o755)
    code = f"for mode in {modes}: os.chmod(sys.argv[1], mode); print(forked(lambda: (f(), f())))"
    done = run(code, kernel.parent, GONIO_CACHE_DIR=tmp_path)
    assert done.lines == [str(((RHO_PI, 1), (RHO_PI, 1)))] * 4 + [str(((RHO_PI, 0), (RHO_PI, 0)))]
    assert done.warned == 4
    for word in (str(kernel.parent), "chmod 700 it, or set GONIO_CACHE_DIR", "GONIO_CACHE=off"):
        assert done.stderr.count(word) == 4
    assert re.findall(r"mode (\d+)", done.stderr) == ["0777", "1777", "0775", "0707"]


def test_a_folder_that_is_a_link_is_not_used(folder, tmp_path):
    """The folder itself must be one; links above it may be. (D6)"""
    cache_folder.write(NAME, b"kernel")
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    with pytest.warns(gonio.errors.EngineWarning, match="is a symbolic link"):
        assert cache_folder.read(NAME) is None
    (tmp_path / "link").symlink_to(tmp_path)
    (tmp_path / cache_folder.FOLDER).unlink()
    (tmp_path / "elsewhere").rename(folder)
    os.environ["GONIO_CACHE_DIR"] = str(tmp_path / "link")
    assert cache_folder.read(NAME) == b"kernel"


def test_files_are_their_owners_alone_whatever_the_umask(tmp_path):
    """Nobody else may read or write a kernel, or write to its folder. (D6)"""
    for i, umask in enumerate(("0", "0o777" if os.geteuid() == 0 else "0o77")):
        code = f"os.makedirs(os.environ['GONIO_CACHE_DIR']); os.umask({umask}); print(f())"
        run(code, GONIO_CACHE_DIR=tmp_path / str(i))
        for file in kept(tmp_path / str(i)):
            assert stat.S_IMODE(file.stat().st_mode) == 0o600
            assert not file.parent.stat().st_mode & 0o022


PLANTED: dict[str, Callable[[Path, Path], object]] = {
    "FIFO": lambda file, whole: os.mkfifo(file),
    "link to a kernel": lambda file, whole: file.symlink_to(whole),
    "link to a device": lambda file, whole: file.symlink_to("/dev/zero"),
    "link to itself": lambda file, whole: file.symlink_to(file),
    "hard link": lambda file, whole: os.link(whole, file),
    "open to a group": lambda file, whole: (shutil.copy(whole, file), file.chmod(0o660)),
    "open to all": lambda file, whole: (shutil.copy(whole, file), file.chmod(0o606)),
    "endless": lambda file, whole: (shutil.copy(whole, file), os.truncate(file, 1 << 40)),
    "folder": lambda file, whole: file.mkdir(),
}


def test_only_regular_files_of_ours_are_read(filled, tmp_path):
    """A FIFO, a device, a link, a folder, a hard link, what others may write to and what has no end, in the place of
    code or of a record: made anew, in bounded time and memory, and replaced where a file can be. (D6)"""
    shutil.copytree(filled, tmp_path, dirs_exist_ok=True)
    (code,), (record,) = kinds(tmp_path)
    begin = """
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
for line in sys.stdin:
    print(forked(), flush=True)
"""
    with ongoing(begin, GONIO_CACHE_DIR=tmp_path) as ask:
        for file, compiled in ((code, 1), (record, 0)):  # without a record the code is found by the formula's text
            whole = file.rename(tmp_path / "whole")
            for name, plant in PLANTED.items():
                plant(file, whole)
                assert ask() == str((RHO_PI, compiled)), name
                if name == "folder":
                    file.rmdir()
                    whole.rename(file)
                    continue
                assert file.read_bytes() == whole.read_bytes(), name
                assert not file.is_symlink(), name
                file.unlink()
    assert sorted(code.parent.iterdir()) == sorted((code, record))


def test_what_a_file_says_is_checked_before_it_is_run(filled, tmp_path):
    """With a right checksum: an unknown kind, no code, a start outside of it, an object that is none. (D6)"""
    shutil.copytree(filled, tmp_path / "cache")
    (kernel,), _ = kinds(tmp_path)
    (tmp_path / "bodies").mkdir()
    entry, code = bytes(8), kernel.read_bytes()[-200:]
    elf = b"\x7fELF\x02\x01\x01" + bytes(57)
    bodies = [
        b"z" + entry + code,
        b"i" + len(code).to_bytes(8, "little") + code,
        b"i" + b"\xff" * 8 + code,
        b"i" + entry,
        b"i",
        b"r" + kernel.name.encode(),
        b"",
        b"o" + entry,
        b"o" + entry + code,
        b"o" + b"\1" + bytes(7) + elf,
        b"o" + entry + elf,
        b"o" + entry + elf[:40] + (64).to_bytes(8, "little") + bytes(10) + b"\x40\0\x09\0" + bytes(66),
    ]
    for i, body in enumerate(bodies):
        (tmp_path / "bodies" / str(i)).write_bytes(forged(kernel, body))
    code = """
kernel, bodies = Path(sys.argv[1]), Path(sys.argv[2])
for i in range(len(list(bodies.iterdir()))):
    kernel.write_bytes((bodies / str(i)).read_bytes())
    print(forked())
"""
    done = run(code, kernel, tmp_path / "bodies", GONIO_CACHE_DIR=tmp_path / "cache")
    assert done.lines == [str((RHO_PI, 1))] * len(bodies)


def test_what_a_record_says_is_checked_before_it_is_followed(filled, tmp_path):
    """With a right checksum: a name that leads out of the folder, no name, itself, what is not there. (D6)"""
    run("print(f(gn.Lambertian(0.5) + gn.Lambertian(0.25)))", GONIO_CACHE_DIR=tmp_path / "other")
    (other,), _ = kinds(tmp_path / "other")
    shutil.copytree(filled, tmp_path / "cache")
    (code,), (record,) = kinds(tmp_path / "cache")
    body = other.read_bytes()[len(cache_folder.MAGIC) + 32 :]
    outside = [f"../{'a' * 37}", str(record.parent.parent / ("a" * 40)), "A" * 40, "a" * 39, f"{'a' * 40}.{'0' * 16}"]
    for name in outside:
        Path(record.parent, name).write_bytes(forged(code, body, name))
    texts = [*outside, "", record.name, "0" * 40, f"{code.name}\n", f"{code.name}\0", f" {code.name}", code.name[:-1]]
    bodies = [b"r" + text.encode() for text in texts] + [code.name.encode(), b"s" + code.name.encode(), b"r\xff" * 20]
    (tmp_path / "bodies").mkdir()
    for i, body in enumerate(bodies):
        (tmp_path / "bodies" / str(i)).write_bytes(forged(record, body))
    begin = """
record, bodies = Path(sys.argv[1]), Path(sys.argv[2])
for i in range(len(list(bodies.iterdir()))):
    record.write_bytes((bodies / str(i)).read_bytes())
    print(forked())
"""
    whole = record.read_bytes()
    done = run(begin, record, tmp_path / "bodies", GONIO_CACHE_DIR=tmp_path / "cache")
    assert done.lines == [str((RHO_PI, 0))] * len(bodies)
    assert record.read_bytes() == whole


def test_an_object_without_a_kernel_is_not_called(monkeypatch):
    """LLVM's loader gives address 0 for what it does not find. (D6)"""
    text = "define i64 @other(i64 %x) {\n ret i64 %x\n}\n"
    assert machine.linked(machine.to_object(text)) is None


def test_a_kernel_under_anothers_name_is_not_run(tmp_path):
    """Files that were mixed up are compiled anew. (D6)"""
    code = "print(f())\nprint(f(gn.Lambertian(0.5) + gn.Lambertian(0.25)))"
    run(code, GONIO_CACHE_DIR=tmp_path)
    codes, records = kinds(tmp_path)
    for (a, b), compiled in ((codes, 1), (records, 0), (zip(codes, records, strict=True), 1)):
        files = [*a, *b] if isinstance(a, tuple) else [a, b]
        contents = [file.read_bytes() for file in files]
        for file, content in zip(files, reversed(contents), strict=True):
            file.write_bytes(content)
        assert run(code, GONIO_CACHE_DIR=tmp_path).lines == [str((RHO_PI, compiled)), str((1.5 * RHO_PI, compiled))]
        assert [file.read_bytes() for file in files] == contents


TWO_USERS = """
store._versions(), machine._llvm()  # their files may lie where others may not enter
own = Path(sys.argv[1])
files = [(path.relative_to(own), path.read_bytes()) for path in own.rglob("*") if path.is_file()]

def plant():
    os.setgid(65533), os.setuid(65533), os.umask(0)
    for path, data in files:
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_bytes(data)
    return len(files)

def use():
    os.setgid(victim), os.setuid(victim)
    return f()

for victim, owner, mode, tree in eval(sys.argv[2]):
    folder = own.parent / f"{victim}-{owner}-{mode:o}-{tree}"
    folder.mkdir()
    os.chown(folder, owner, owner)
    folder.chmod(mode)
    if tree == "made":  # by the victim, with a mode that lets everybody in
        for place in {folder / path.parent for path, _ in files} - {folder}:
            place.mkdir()
            os.chown(place, victim, victim)
            place.chmod(0o777)
    print(forked(plant), forked(use, GONIO_CACHE_DIR=str(folder)))
    print("next", file=sys.stderr, flush=True)
"""
CASES = [  # user, owner of the folder, its mode, whether the user had made the tree
    (65534, 65534, 0o777, ""),
    (65534, 65534, 0o1777, ""),
    (65534, 65534, 0o777, "made"),
    (65534, 0, 0o1777, "made"),
    (0, 0, 0o777, ""),
    (0, 0, 0o1777, ""),
    (0, 0, 0o755, "made"),
]


@pytest.fixture(scope="module")
def compiled() -> Iterator[Path]:
    """A filled cache of root's, in a folder that every user may enter."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        run("print(f())", GONIO_CACHE_DIR=f"{name}/own")
        yield Path(name)


@as_root
def test_what_another_user_planted_is_not_run(compiled):
    """Kernels that another user put where this user looks for them, before or after the folder was made. (D6)"""
    done = run(TWO_USERS, compiled / "own", CASES)
    warnings = done.stderr.split("next\n")
    for case, line, warning in zip(CASES, done.lines, warnings[:-1], strict=True):
        assert line == f"2 {(RHO_PI, 1)}", (case, warning)
        assert "65533" in warning or "mode 0777" in warning, case


@as_root
def test_a_users_folder_is_not_used_by_root(compiled):
    """Root with a user's HOME or GONIO_CACHE_DIR runs nothing from there. (D6)"""
    theirs = shutil.copytree(compiled / "own", compiled / "theirs")
    for path in [*theirs.rglob("*"), theirs]:
        os.chown(path, 65534, 65534)
    done = run("print(f())", GONIO_CACHE_DIR=theirs)
    assert done.lines == [str((RHO_PI, 1))]
    assert "belongs to user 65534, not to user 0" in done.stderr


REFUSED = """
def refused():
    "What each of two calls of f raises."
    said = []
    for _ in range(2):
        try:
            said.append(f())
        except gn.errors.ParameterError as error:
            said.append(str(error))
    return said
"""


def test_a_folder_that_depends_on_the_working_directory_is_refused(tmp_path):
    """An empty, a relative or an unexpanded GONIO_CACHE_DIR: one line, nothing written, at every f. (D6)"""
    values = ("", "kernels", "./kernels", "~/kernels")
    code = f"os.chdir(sys.argv[1])\nfor value in {values}: print(forked(refused, GONIO_CACHE_DIR=value))"
    for value, line in zip(values, run(REFUSED + code, tmp_path).lines, strict=True):
        first, second = ast.literal_eval(line)
        assert first == second
        assert first.startswith(f"GONIO_CACHE_DIR={value!r}: expected an absolute path")
    assert not list(tmp_path.iterdir())


def test_the_cache_can_be_switched_off(tmp_path):
    """GONIO_CACHE=off neither writes nor runs; other values of the switches are refused. (D6)"""
    code = """
folder = Path(os.environ["GONIO_CACHE_DIR"])
print(forked(GONIO_CACHE="off"), len(list(folder.rglob("*"))))
print(forked(), forked(), len(list(folder.rglob("*"))))
print(forked(GONIO_CACHE="off"))
print(forked(refused, GONIO_CACHE="of"))
print(forked(refused, GONIO_ENGINE="Numpy"))
"""
    lines = run(REFUSED + code, GONIO_CACHE_DIR=tmp_path).lines
    assert lines[:3] == [f"{(RHO_PI, 1)} 0", f"{(RHO_PI, 1)} {(RHO_PI, 0)} 3", str((RHO_PI, 1))]
    assert lines[3].count("GONIO_CACHE='of': expected off") == 2
    assert lines[4].count("GONIO_ENGINE='Numpy': expected numpy") == 2


def test_files_by_path(folder, monkeypatch):
    """As on Windows, where files cannot be opened in an open folder."""
    monkeypatch.setattr(cache_folder, "_AT", False)
    monkeypatch.setattr(cache_folder, "BYTES_KEPT", 8 * cache_folder.BLOCK)
    monkeypatch.setattr(cache_folder, "LOOK", 1)
    for name in names(20):
        cache_folder.write(name, name.encode())
        assert cache_folder.read(name) == name.encode()
    assert len(kept(folder)) == len(list(folder.iterdir())) <= 8
    folder.chmod(0o777)
    with pytest.warns(gonio.errors.EngineWarning, match="mode 0777"):
        assert cache_folder.read(names(20)[-1]) is None


# No executable memory, no compiler.

REFUSE = """
def refuse():
    "From here on nothing may be made executable."
    assert ctypes.CDLL(None).prctl(65, 1, 0, 0, 0) == 0  # PR_SET_MDWE, PR_MDWE_REFUSE_EXEC_GAIN
"""
EVERYTHING = """
import warnings
m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
u = np.array([[0.3, 0.6]])
print(m.f(w, w)[0], m.pdf(w, w)[0], m.sample(w, u).weight[0], gn.albedo(m, w[0]), m.jacobian(w, w).f[0], len(compiled))
"""


@pytest.fixture(scope="module")
def refusing() -> str:
    done = subprocess.run(
        [sys.executable, "-c", "import ctypes; print(ctypes.CDLL(None).prctl(65, 1, 0, 0, 0))"],
        capture_output=True,
        text=True,
    )
    if done.stdout.strip() != "0":
        pytest.skip("this kernel has no PR_SET_MDWE (Linux 6.3 and later)")
    return REFUSE


@pytest.fixture(scope="module")
def by_numpy() -> list[str]:
    return run(EVERYTHING, GONIO_ENGINE="numpy").lines


@pytest.mark.parametrize("filled", [False, True])
def test_numpy_computes_where_memory_may_not_be_made_executable(refusing, by_numpy, tmp_path, filled):
    """With a cache that is filled or not: the same numbers, one warning that says how to silence it. (D9)"""
    if filled:
        run(EVERYTHING, GONIO_CACHE_DIR=tmp_path)
    done = run(refusing + "refuse()" + EVERYTHING, GONIO_CACHE_DIR=tmp_path)
    assert done.lines == by_numpy
    assert done.warned == 1
    for word in ("EngineWarning", "made executable", "GONIO_ENGINE=numpy"):
        assert word in done.stderr
    if filled:
        assert not run(refusing + "refuse()" + EVERYTHING, GONIO_ENGINE="numpy").stderr


def test_numpy_computes_when_memory_is_refused_later(refusing, tmp_path):
    """A service that closes itself off after its start: what is compiled runs on, what is new is NumPy's. (D9)"""
    code = """
m = gn.Lambertian(0.5)
print(f(m), m.f(w, w)[0])
refuse()
print(f(gn.Lambertian(0.25) + gn.Lambertian(0.25)), m.f(w, w)[0])
print((gn.Lambertian(0.5) + gn.Phong(0.0, 3.0)).jacobian(w, w).f[0])
"""
    done = run(refusing + code, GONIO_CACHE_DIR=tmp_path)
    assert done.lines == [f"{(RHO_PI, 1)} {RHO_PI}", f"{(RHO_PI, 1)} {RHO_PI}", str(RHO_PI)]
    assert done.warned == 1


def test_llvms_loader_is_not_asked_where_memory_is_refused(refusing):
    """It crashes there. (D9)"""
    code = """
code = to_object("define i64 @kernel(i64 %x) {\\n ret i64 %x\\n}\\n")
refuse()
try:
    machine.linked(code)
except gn.errors.EngineError as error:
    print(error)
"""
    (said,) = run(refusing + code).lines
    assert "made executable" in said


FAILURES = [
    ("import", "ImportError('no LLVM')"),
    ("import", "OSError('libstdc++.so.6: version not found')"),
    ("import", "AttributeError('undefined symbol: LLVMPY_X')"),
    ("start", "OSError('Could not find/load shared object file')"),
    ("start", "RuntimeError('no target')"),
    ("absent", ""),
]


@pytest.mark.parametrize(("when", "error"), thinned(FAILURES, [FAILURES[k] for k in (2, 3, 5)]))
def test_numpy_computes_where_llvmlite_does_not_load(by_numpy, tmp_path, when, error):
    """Whatever is wrong with it, or where it is not there: the same numbers and one warning. (D9)"""
    package = tmp_path / "llvmlite"
    package.mkdir()
    (package / "__init__.py").touch()
    raised = f"raise {error}" if when == "import" else f"def initialize_native_target():\n    raise {error}"
    (package / "binding.py").write_text("" if when == "absent" else raised)
    begin = "sys.modules['llvmlite'] = None\n" if when == "absent" else f"sys.path.insert(0, {str(tmp_path)!r})\n"
    done = run(begin + EVERYTHING, GONIO_CACHE_DIR=tmp_path)
    assert done.lines[0].rpartition(" ")[0] == by_numpy[0].rpartition(" ")[0]
    assert done.warned == 1
    for word in ("llvmlite", error.partition("(")[2].strip("')"), "GONIO_ENGINE=numpy"):
        assert word in done.stderr


# No home.


def test_a_user_without_a_home_computes(tmp_path):
    """No HOME and no entry of the user, a relative HOME, one that is not there: nothing is kept. (D10)"""
    code = """
import pwd
def getpwuid(uid):
    raise KeyError(f"getpwuid(): uid not found: {uid}")
pwd.getpwuid = getpwuid
os.chdir(sys.argv[1])
print(forked(), forked(HOME="relative"), forked(HOME=sys.argv[1] + "/none"), os.listdir("."))
"""
    done = run(code, tmp_path, HOME=None, XDG_CACHE_HOME=None, GONIO_CACHE_DIR=None)
    assert done.lines == [f"{(RHO_PI, 1)} {(RHO_PI, 1)} {(RHO_PI, 1)} []"]
    assert not done.stderr


@as_root
def test_an_unknown_user_computes(tmp_path):
    """As services and containers run: a number without an entry, no HOME. (D10)"""
    code = "store._versions(), machine._llvm(), os.setgid(54321), os.setuid(54321)\nprint(f())"
    done = run(code, HOME=None, XDG_CACHE_HOME=None, GONIO_CACHE_DIR=None)
    assert done.lines == [str((RHO_PI, 1))]
    assert not done.stderr


@pytest.mark.skipif(sys.platform == "darwin", reason="macOS has another folder, and no XDG_CACHE_HOME")
def test_the_users_folder_for_caches(tmp_path):
    """$XDG_CACHE_HOME, which counts only if it is absolute, or ~/.cache. (D10)"""
    (tmp_path / "home").mkdir()
    code = "for xdg in sys.argv[1:]: print(forked(XDG_CACHE_HOME=xdg))"
    values = (tmp_path / "a" / "b", "relative", "")
    done = run(code, *values, HOME=str(tmp_path / "home"), GONIO_CACHE_DIR=None)
    assert done.lines == [str((RHO_PI, 1)), str((RHO_PI, 1)), str((RHO_PI, 0))]
    assert not done.stderr
    folders = [path.parent.relative_to(tmp_path) for path in kinds(tmp_path)[0]]
    assert folders == [Path("a", "b", cache_folder.FOLDER), Path("home", ".cache", cache_folder.FOLDER)]


# What a name stands for.

CLASS = """
from gonio.arrays import ops
from gonio.formula.fields import param
class Sine(gn.Reflectance):
    rho = param(0.5, 0.0, 1.0, "a number")
    def formula(self, wi, wo):
        return ops.sin(self.rho + 0.0 * wi.x)
"""
SINE = CLASS + "print(*f(Sine(0.5)), gn.__file__)"


def copy_of_gonio(where: Path, seconds: float, own: tuple[str, ...] = ("compile",)) -> Path:
    """gonio with a compiler, or other rooms, of its own, whose files are of this time; what it has beside is linked."""
    package = Path(gonio.__file__).resolve().parent
    (where / "gonio").mkdir(parents=True)
    for path in package.iterdir():
        if path.name not in own:
            (where / "gonio" / path.name).symlink_to(path)
    for room in own:
        shutil.copytree(package / room, where / "gonio" / room, ignore=shutil.ignore_patterns("__pycache__"))
        for path in (where / "gonio" / room).rglob("*"):
            os.utime(path, (seconds, seconds))
    return where


def test_names_stand_for_what_the_compiler_says(tmp_path):
    """Two compilers that differ in one digit, all files of the same time: each gets its own kernels. (D11)"""
    a, b = (copy_of_gonio(tmp_path / name, 1.0) for name in "ab")
    source = b / "gonio" / "compile" / "llvm" / "elementary" / "angles.py"
    text = source.read_text(encoding="utf-8")
    first = re.search(r"^SIN = \{.*?(-0\.\d)(\d)", text, re.S | re.M)
    source.write_text(text[: first.start(2)] + str((int(first[2]) + 5) % 10) + text[first.end(2) :], encoding="utf-8")
    os.utime(source, (1.0, 1.0))
    got = {}
    for place in (a, b, a):
        value, compiled, path = run(SINE, PYTHONPATH=str(place), GONIO_CACHE_DIR=tmp_path / "cache").lines[0].split()
        assert Path(path).is_relative_to(place)
        assert compiled == ("0" if place in got else "1")
        assert got.setdefault(place, value) == value
    assert got[a] != got[b]
    assert float(got[a]) == pytest.approx(0.479425538604203, rel=1e-14)


def test_copies_share_their_kernels(tmp_path):
    """Times and paths are no part of a name: a second checkout finds what the first has compiled. (D11)"""
    for seconds, compiled in ((1.0, "1"), (2e9, "0")):
        place = copy_of_gonio(tmp_path / str(seconds), seconds)
        done = run(SINE, PYTHONPATH=str(place), GONIO_CACHE_DIR=tmp_path / "cache")
        assert done.lines[0].split()[1] == compiled


def test_a_compiler_edited_since_it_was_imported_keeps_nothing(tmp_path):
    """A name would stand for one text and what is kept under it be of another: of code what makes it of the formula's
    text, of a record all else. (D11)"""
    place = copy_of_gonio(tmp_path, 1.0)
    begin = """
for name in ("llvm/machine.py", "llvm/elementary/angles.py"):
    source = Path(gn.__file__).parent / "compile" / name
    text = source.read_bytes()
    source.write_bytes(text + b"# edited")
    print(f(), len(list(Path(sys.argv[1]).rglob("?" * 40))))
    source.write_bytes(text)
    print(f(), len(list(Path(sys.argv[1]).rglob("?" * 40))), f())
    for file in Path(sys.argv[1]).rglob("?" * 40):
        file.unlink()
"""
    cache = tmp_path / "cache"
    done = run(begin, cache, PYTHONPATH=str(place), GONIO_CACHE_DIR=cache)
    anew, found = (RHO_PI, 1), (RHO_PI, 0)
    assert done.lines == [f"{anew} 0", f"{anew} 2 {found}", f"{anew} 1", f"{found} 2 {found}"]


def test_an_edit_that_leaves_the_code_alone_compiles_nothing(tmp_path):
    """Of graphs, passes, the compiler: formulas are traced and written anew, and LLVM gets what changed. (D11)

    One digit of a sine changes the kernel that has one, and no other.
    """
    place = copy_of_gonio(tmp_path, 1.0, own=("compile", "trace"))
    begin = """
written, generate = [], codegen.generate
codegen.generate = lambda *a: written.append(1) or generate(*a)
print(f(), len(written), f(Sine(0.5))[1], len(written))
"""
    graph, sine = (
        place / "gonio" / "trace" / "graph.py",
        place / "gonio" / "compile" / "llvm" / "elementary" / "angles.py",
    )
    for edits, want in (
        ({}, f"{(RHO_PI, 1)} 1 1 2"),
        ({graph: (r"\A", "# A comment.\n"), sine: (r"\A", "# A comment.\n")}, f"{(RHO_PI, 0)} 1 0 2"),
        ({sine: (r"(?m)^(SIN = \{(?:.|\n)*?-0\.\d)\d", r"\g<1>0")}, f"{(RHO_PI, 0)} 1 1 2"),
    ):
        for path, (old, new) in edits.items():
            text = path.read_text(encoding="utf-8")
            path.write_text(re.sub(old, new, text, count=1), encoding="utf-8")
        own = {"PYTHONPATH": str(place), "PYTHONDONTWRITEBYTECODE": "1"}  # it hides quick edits
        done = run(CLASS + begin, **own, GONIO_CACHE_DIR=tmp_path / "cache")
        assert done.lines == [want], edits


@pytest.mark.parametrize("name", ["store", "elf", "llvm.machine"])
def test_code_is_named_by_what_makes_it_of_a_text(name, tmp_path, monkeypatch):
    """An edit of a module that machine code passes through names it anew. (D11)"""
    module = sys.modules[f"gonio.compile.{name}"]
    edited = tmp_path / "edited.py"
    edited.write_bytes(Path(module.__file__).read_bytes() + b"# edited")
    assert store._back_sources() == store._BACK
    monkeypatch.setattr(module, "__file__", str(edited))
    assert store._back_sources() not in (store._BACK, "")


def test_names_stand_for_the_library(tmp_path, monkeypatch):
    """LLVM's library of the same version, size and time, linked anew, is another. (D11)"""
    binding = tmp_path / "llvmlite" / "binding"
    binding.mkdir(parents=True)
    for name in ("__init__.py", "_version.py"):
        (binding.parent / name).write_text("version = '1.0'\n")
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda _: SimpleNamespace(origin=str(binding.parent / "__init__.py"))
    )
    seen = set()
    for build_id in (b"a" * 20, b"b" * 20):
        (binding / "libllvmlite.so").write_bytes(b"\x7fELF" + bytes(600) + build_id + bytes(1 << 20))
        for path in [*binding.parent.rglob("*"), binding.parent]:
            os.utime(path, (1.0, 1.0))
        seen.add(machine.compiler.__wrapped__())
    assert len(seen) == 2
