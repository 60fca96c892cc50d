"""Saving: nothing is deleted or replaced that is not ours, and a failure or a kill leaves what was there."""

from __future__ import annotations

import errno
import os
import re
import resource
import signal
import socket
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from unittest import mock
from zlib import crc32

import numpy as np
import pytest
from killing import GROUPS, Outcome, campaign
from libraries import thinned

import gonio as gn
from gonio import files
from gonio.errors import NotFoundError, ParameterError, WriteError
from gonio.files import _unfinished
from gonio.pictures.image import Image, load_image

SOURCE = Path(gn.__file__).parents[1]
ROOT = hasattr(os, "geteuid") and os.geteuid() == 0
as_root = pytest.mark.skipif(not ROOT, reason="needs root")
PLAIN = gn.Lambertian(0.5)


def grid(value: float = 0.0) -> gn.Gridded:
    axes = {"theta_i": [0.1, 0.2], "theta_o": [0.0, 0.3], "phi": [0.0, 1.0, 2.0]}
    return gn.Gridded("angles", axes, np.full((2, 2, 3), value, "f4"))


def tree(folder: Path) -> dict[str, object]:
    """Everything below a folder: content, mode."""
    return {
        str(p.relative_to(folder)): (p.lstat().st_mode, p.read_bytes() if p.is_file() else None)
        for p in sorted(folder.rglob("*"))
    }


def child(code: str, **options) -> subprocess.CompletedProcess:
    """A Python of its own that runs this."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SOURCE), *filter(None, sys.path)]), "GONIO_ENGINE": "numpy"}
    return subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300, check=False, **options
    )


def zarr() -> None:
    pytest.importorskip("zarr")


def test_zarr_replaces_no_folder_that_is_no_store(tmp_path):
    """`gn.save(m, "results", format="zarr")` deleted the folder results. (D3)"""
    zarr()
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "thesis.tex").write_text("years of work")
    (tmp_path / "empty").mkdir()
    before = tree(tmp_path)
    for name in ("results", "empty"):
        with pytest.raises(ParameterError, match="is a folder, and no Zarr store"):
            gn.save(grid(), tmp_path / name, format="zarr")
    assert tree(tmp_path) == before


@pytest.mark.parametrize("name", [".", "..", "", "../..", "/", "../src"])
def test_the_working_directory_and_what_is_above_it_stay(name, tmp_path, monkeypatch):
    """A folder is not replaced while somebody works in it, be it a store. (D3)"""
    zarr()
    (tmp_path / "project").mkdir()
    gn.save(grid(), tmp_path / "project" / "src", format="zarr")
    monkeypatch.chdir(tmp_path / "project" / "src")
    before = tree(tmp_path)
    says = "is the working directory or above it|/ may not be written to"  # the latter of / to ordinary users
    with pytest.raises((ParameterError, NotFoundError), match=says):
        gn.save(grid(), name, format="zarr")
    assert tree(tmp_path) == before


@pytest.mark.parametrize(
    "place", ["notes.txt", "values/thesis.tex", "values/sub/0.0", "more/deep/1", "a link", "a pipe"]
)
def test_a_store_that_holds_something_else_stays(place, tmp_path):
    """Nothing foreign is deleted, wherever in a store it is, nor is what a link in it points to. (D3)"""
    zarr()
    path = tmp_path / "m.zarr"
    gn.save(grid(), path)
    if place == "a link":
        (path / "values" / "9.9.9").symlink_to(tmp_path)
    elif place == "a pipe":
        os.mkfifo(path / "values" / "9.9.9")
    else:
        (path / place).parent.mkdir(exist_ok=True, parents=True)
        (path / place).write_text("not ours")
    before = tree(tmp_path)
    with pytest.raises(ParameterError, match="which is no part of a Zarr store; nothing was changed"):
        gn.save(grid(1.0), path)
    assert tree(tmp_path) == before


def test_a_store_replaces_a_store(tmp_path):
    """Of both formats, and through a link, which stays; the permissions are kept, inside too. (D3, D19)"""
    zarr()
    path = tmp_path / "m.zarr"
    gn.tables.to_dataset(grid()).to_zarr(path, zarr_format=3, consolidated=False)
    path.chmod(0o750)
    (path / "zarr.json").chmod(0o640)
    (tmp_path / "link").symlink_to(path)
    gn.save(grid(1.0), tmp_path / "link", format="zarr")
    assert gn.load(path) == grid(1.0) and (tmp_path / "link").is_symlink() and not (path / "zarr.json").exists()
    modes = {stat.S_IMODE(p.stat().st_mode) for p in path.rglob("*") if p.is_file()}
    assert stat.S_IMODE(path.stat().st_mode) == 0o750 and modes == {0o640}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "m.zarr"]


@as_root
@pytest.mark.parametrize(("kind", "number"), [(stat.S_IFCHR, (1, 3)), (stat.S_IFCHR, (1, 7)), (stat.S_IFBLK, (7, 255))])
def test_a_device_is_never_replaced(kind, number, tmp_path):
    """Root, the usual user in a container, saved to its own null device: it became a regular file. (D5)"""
    node = tmp_path / "node.png"
    try:
        os.mknod(node, kind | 0o666, os.makedev(*number))
    except PermissionError:
        pytest.skip("no device may be made here")
    before = node.lstat()
    (tmp_path / "link.png").symlink_to(node)
    for path in (node, tmp_path / "link.png"):
        with pytest.raises(ParameterError, match=r"is a (device|disk), expected a file or nothing"):
            Image(np.zeros((2, 2, 3), "f4")).save(path)
        with pytest.raises(ParameterError, match=r"is a (device|disk)"):
            gn.save(PLAIN, path, format="gonio JSON")
    assert (node.lstat().st_mode, node.lstat().st_rdev) == (before.st_mode, before.st_rdev)


def test_a_pipe_and_a_socket_are_never_replaced(tmp_path):
    """Nor waited for. (D5)"""
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "socket"))
        for name in ("pipe", "socket"):
            for format in ("gonio JSON", "zarr"):
                with pytest.raises(ParameterError, match=f"is a {name}, expected a file or nothing"):
                    gn.save(PLAIN, tmp_path / name, format=format)
        assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode) and stat.S_ISSOCK((tmp_path / "socket").stat().st_mode)


@pytest.mark.parametrize("name", thinned(["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"], ["/dev/stdout"]))
def test_an_open_file_is_not_replaced(name, tmp_path):
    """`... /dev/stdout >> log` would have replaced the log; of a pipe it said that no file could be made. (D5)"""
    if not os.path.lexists(name):
        pytest.skip(f"there is no {name} here")
    log = tmp_path / "log"
    log.write_text("kept\n")
    code = f"import gonio as gn\ntry: gn.save(gn.Lambertian(0.5), {name!r}, format='gonio JSON')\n" + (
        "except gn.errors.ParameterError as error: print(error)"
    )
    with log.open("a") as file:
        env = {**os.environ, "PYTHONPATH": str(SOURCE)}
        subprocess.run([sys.executable, "-c", code], stdout=file, env=env, check=True, timeout=300)
    assert log.read_text() == (
        f"kept\n{name}: is an open file of a process, expected a file's name; write to a file, and copy it\n"
    )


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666, 0o755])
def test_a_file_keeps_its_permissions(mode, tmp_path):
    """0600 came back as 0644: what was private could be read by all. (D19)"""
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(mode)
    gn.save(PLAIN, path)
    assert stat.S_IMODE(path.stat().st_mode) == mode and gn.load(path) == PLAIN


def test_what_is_private_is_so_at_every_moment(tmp_path, monkeypatch):
    """What is written to can only be read by its owner, and has its permissions before its name. (D19)"""
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(0o600)
    with files.replacing(path) as temporary:
        assert stat.S_IMODE(temporary.stat().st_mode) == 0o600
        assert stat.S_IMODE(temporary.parent.stat().st_mode) == 0o700
    path.chmod(0o640)
    seen = []
    real = os.replace
    monkeypatch.setattr(os, "replace", lambda a, b: (seen.append(stat.S_IMODE(os.stat(a).st_mode)), real(a, b)))
    gn.save(PLAIN, path)
    assert seen == [0o640]


def test_a_new_file_has_the_usual_permissions(tmp_path):
    """Those that the umask leaves. (D19)"""
    old = os.umask(0o027)
    try:
        gn.save(PLAIN, tmp_path / "a.json")
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "a.json").stat().st_mode) == 0o640


def test_a_read_only_file_is_not_replaced(tmp_path):
    """0444 says so, to root as well; the same of a store. (D19)"""
    zarr()
    path = tmp_path / "a.json"
    path.write_text("old")
    path.chmod(0o444)
    gn.save(grid(), tmp_path / "a.zarr")
    (tmp_path / "a.zarr").chmod(0o555)
    for name in ("a.json", "a.zarr"):
        before = tree(tmp_path)
        with pytest.raises(ParameterError, match=f"{name}: is read-only"):
            gn.save(grid(1.0) if name == "a.zarr" else PLAIN, tmp_path / name)
        assert tree(tmp_path) == before
    (tmp_path / "a.zarr").chmod(0o755)


def test_a_name_may_be_a_text(tmp_path):
    path = str(tmp_path / "a.png")
    for value in (0.2, 0.8):
        Image(np.full((2, 2, 3), value, "f4")).save(path)
    assert load_image(path).pixels.min() > 0.7


def test_hard_links_are_not_parted(tmp_path):
    """Writing would part them, or change a file of another name: a backup, say. (D19)"""
    path, backup = tmp_path / "a.json", tmp_path / "backup"
    path.write_text("old")
    backup.hardlink_to(path)
    with pytest.raises(ParameterError, match=r"a.json: has 2 names \(hard links\).*remove this one first"):
        gn.save(PLAIN, path)
    assert backup.read_text() == "old" and path.samefile(backup)


@as_root
def test_owner_group_and_attributes_are_kept(tmp_path):
    """As far as the system lets us. (D19)"""
    path = tmp_path / "a.json"
    path.write_text("old")
    os.chown(path, 12345, 23456)
    path.chmod(0o640)
    try:
        os.setxattr(path, "user.note", b"mine")
    except OSError:
        pytest.skip("the file system has no attributes")
    gn.save(PLAIN, path)
    held = path.stat()
    assert (held.st_uid, held.st_gid, stat.S_IMODE(held.st_mode)) == (12345, 23456, 0o640)
    assert os.getxattr(path, "user.note") == b"mine"


@as_root
def test_a_group_that_cannot_be_kept_hands_nothing_to_another(tmp_path):
    """A user who may not give the file its group leaves that what everybody may. (D19)"""
    path = tmp_path / "a.json"
    path.write_text("old")
    os.chown(path, 12345, 23456)
    path.chmod(0o664)
    with mock.patch.object(os, "chown", side_effect=PermissionError(1, "Operation not permitted")):
        gn.save(PLAIN, path)
    held = path.stat()
    assert (held.st_uid, held.st_gid, stat.S_IMODE(held.st_mode)) == (0, 0, 0o644)


@pytest.mark.parametrize("length", [240, 241, 250, 255])
def test_long_names(length, tmp_path):
    """Names of 241 to 255 characters failed after the work was done: the temporary name was longer. (D26)"""
    path = tmp_path / ("x" * (length - 5) + ".json")
    gn.save(PLAIN, path)
    assert gn.load(path) == PLAIN


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("x" * 251 + ".json", "its name needs 256 bytes, expected at most 255"),
        ("ä" * 130 + ".json", "its name needs 265 bytes, expected at most 255"),
        ("a\0b.json", "no name that a file can have"),
        ("a\ud800.json", "no name that a file can have"),
        ("x/" * 5000 + "a.json", "does not exist"),
        ("no/a.json", "does not exist; create it first"),
    ],
)
def test_names_that_cannot_be_are_refused_before_any_work(name, says, tmp_path, monkeypatch):
    """By one line of a gonio error. (D26)"""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(gn.Lambertian, "to_json", lambda m: pytest.fail("the work was begun"))
    with pytest.raises((ParameterError, NotFoundError), match=says) as error:
        gn.save(PLAIN, name, format="gonio JSON")
    assert len(str(error.value)) < 1000


def test_a_link_to_itself(tmp_path):
    """It is not replaced. (D19)"""
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(ParameterError, match="is a link that leads back to itself"):
        gn.save(PLAIN, tmp_path / "loop", format="gonio JSON")
    assert (tmp_path / "loop").is_symlink()


def test_a_file_is_on_the_disk_before_it_has_its_name(tmp_path, monkeypatch):
    """And its folder after that; the same of every file of a store. (D26)"""
    zarr()
    done = []
    sync, replace, exchange = os.fsync, os.replace, files._put
    at = {}

    def noted(opened):
        done.append(("sync", at.get(os.fstat(opened).st_ino, os.fstat(opened).st_ino)))
        sync(opened)

    monkeypatch.setattr(os, "fsync", noted)
    monkeypatch.setattr(os, "replace", lambda a, b: (done.append(("named", os.stat(a).st_ino)), replace(a, b)))
    monkeypatch.setattr(files, "_put", lambda a, b: (done.append(("named", os.stat(a).st_ino)), exchange(a, b)))
    gn.save(PLAIN, tmp_path / "a.json")
    file, folder = (tmp_path / "a.json").stat().st_ino, tmp_path.stat().st_ino
    assert done == [("sync", file), ("named", file), ("sync", folder)]
    done.clear()
    gn.save(grid(), tmp_path / "a.zarr")
    numbers = {p.stat().st_ino for p in [tmp_path / "a.zarr", *(tmp_path / "a.zarr").rglob("*")]}
    assert {n for what, n in done[:-2] if what == "sync"} == numbers
    assert done[-2:] == [("named", (tmp_path / "a.zarr").stat().st_ino), ("sync", folder)]


HOLD = """
import os, sys
from gonio.files import replacing
with replacing(sys.argv[1]) as temporary:
    temporary.write_text("half")
    print("ready", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def writer(tmp_path):
    """A process that is writing tmp_path/a, until its standard input ends."""
    env = {**os.environ, "PYTHONPATH": str(SOURCE)}
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "a")], env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as running:
        assert running.stdout.readline() == b"ready\n"
        yield running
        running.kill()


def test_what_a_killed_writer_left_is_swept(writer, tmp_path):
    """By the next save to that folder. (D26)"""
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    left = [p.name for p in tmp_path.iterdir()]
    assert len(left) == 1 and re.fullmatch(r"\.gonio-unfinished-[0-9a-f]{16}", left[0])
    gn.save(PLAIN, tmp_path / "b.json")
    assert [p.name for p in tmp_path.iterdir()] == ["b.json"]


def test_a_folder_of_many_names_is_listed_again_after_a_pause(tmp_path, monkeypatch):
    """Listing it for each file would take longer than the file."""
    now, listed, names = [0.0], [], os.listdir
    monkeypatch.setattr(_unfinished, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(_unfinished, "_next_sweep", (Path(), 0.0))
    monkeypatch.setattr(_unfinished, "MANY", 1)
    monkeypatch.setattr(os, "listdir", lambda folder: (folder == tmp_path and listed.append(now[0])) or names(folder))
    for name in "abc":
        (tmp_path / name).write_text("")
    for now[0] in (1.0, 1.0 + 2.9 * _unfinished.PAUSE, 1.0 + 3.1 * _unfinished.PAUSE):
        gn.save(PLAIN, tmp_path / "a.json")
    assert listed == [1.0, 1.0 + 3.1 * _unfinished.PAUSE]


def test_what_a_living_writer_has_is_not_swept(writer, tmp_path):
    """It ends well. (D26)"""
    gn.save(PLAIN, tmp_path / "b.json")
    writer.stdin.close()
    assert writer.wait(60) == 0
    assert (tmp_path / "a").read_text() == "half"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b.json"]


def test_only_our_own_is_swept(tmp_path):
    """Other names, files, links, folders with something and no lock, and other users' folders stay. (D26)"""
    ours = ".gonio-unfinished-0123456789abcde"
    (tmp_path / f"{ours}0").write_text("a file")
    (tmp_path / f"{ours}1").mkdir()
    (tmp_path / f"{ours}1" / "new").write_text("no lock")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "lock").write_text("")
    (tmp_path / f"{ours}2").symlink_to("elsewhere")
    (tmp_path / f"{ours}3.bak").mkdir()
    (tmp_path / ".a-x7f3q2.json").write_text("of another program")
    if ROOT:
        (tmp_path / f"{ours}4").mkdir()
        (tmp_path / f"{ours}4" / "lock").write_text("")
        os.chown(tmp_path / f"{ours}4", 12345, 12345)
    before = tree(tmp_path)
    gn.save(PLAIN, tmp_path / "b.json")
    (tmp_path / "b.json").unlink()
    assert tree(tmp_path) == before
    (tmp_path / f"{ours}5").mkdir()  # of one that was killed before it had its lock
    gn.save(PLAIN, tmp_path / "b.json")
    (tmp_path / "b.json").unlink()
    assert tree(tmp_path) == before


def test_many_writers_sweep_and_save_at_once(tmp_path):
    """A folder that is swept before it is locked is made again: nobody's save fails. (D26)"""
    failed = []

    def save(k: int) -> None:
        try:
            for _ in range(20):
                with files.replacing(tmp_path / f"{k % 3}") as temporary:
                    temporary.write_text(str(k) * 100)
        except Exception as error:
            failed.append(error)

    threads = [threading.Thread(target=save, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed and sorted(p.name for p in tmp_path.iterdir()) == ["0", "1", "2"]


def test_without_an_exchange_in_one_step_a_kill_loses_no_store(tmp_path, monkeypatch):
    """Where the old folder is moved away first, the next writer puts it back. (D3, D26)"""
    zarr()
    monkeypatch.setattr(files, "_exchanged", lambda *_: False)
    path = tmp_path / "a.zarr"
    gn.save(grid(), path)
    gn.save(grid(1.0), path)
    assert gn.load(path) == grid(1.0)
    real, pid = os.replace, os.fork()
    if not pid:
        os.replace = lambda a, b: (real(a, b), Path(a) == path and os.kill(os.getpid(), signal.SIGKILL))
        gn.save(grid(), path)
        os._exit(1)
    assert os.WIFSIGNALED(os.waitpid(pid, 0)[1]) and not path.exists()
    gn.save(PLAIN, tmp_path / "b.json")
    assert gn.load(path) == grid(1.0) and sorted(p.name for p in tmp_path.iterdir()) == ["a.zarr", "b.json"]


@pytest.mark.parametrize("kills", [1, pytest.param(6, marks=pytest.mark.full)])
@pytest.mark.parametrize("group", list(GROUPS))
def test_a_kill_leaves_a_whole_file_and_nothing_after_the_next_save(group, kills, tmp_path):
    """kill -9 at random times left .x-random.suffix files that nobody swept; benchmarks/kills.py does more. (D26)"""
    if group in ("gzip and zip", "Zarr folder"):
        zarr()
    total = Outcome()
    for name, save in GROUPS[group].items():
        folder = tmp_path / f"of {name}"
        folder.mkdir()
        for outcome in campaign(save, folder / name, kills // len(GROUPS[group]) + 1, crc32(name.encode())):
            total += outcome
    assert (total.damaged, total.missing, total.unswept) == (0, 0, 0)


NAMES = [name for saves in GROUPS.values() for name in saves]


@pytest.mark.parametrize("name", NAMES)
def test_a_file_that_may_not_grow_leaves_the_old_one_and_one_error(name, tmp_path):
    """Under `ulimit -f`: EXR and PDF had errors of their libraries, netCDF a segmentation fault at the end. (D18)"""
    if name.endswith((".zip", ".zarr")):
        zarr()
    save = next(saves[name] for saves in GROUPS.values() if name in saves)
    save(tmp_path / name, 0)
    before = tree(tmp_path)
    largest = max(p.stat().st_size for p in [tmp_path / name, *(tmp_path / name).rglob("*")] if p.is_file())
    pid = os.fork()
    if not pid:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest // 4,) * 2)
            save(tmp_path / name, 1)
        except WriteError as error:
            right = str(error).startswith(f"{tmp_path / name}: cannot be written: File too large")
            code = 0 if right and "\n" not in str(error) else 2
        finally:
            os._exit(code)
    assert os.waitpid(pid, 0)[1] == 0
    assert tree(tmp_path) == before


def test_netcdf_under_ulimit_ends_well(tmp_path):
    """The process did not survive its end: the HDF5 library wrote again. (D18)"""
    code = f"""
import resource, numpy as np, gonio as gn
resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))
axes = dict(theta_i=[0.1, 0.2], theta_o=[0.0, 0.3], phi=np.linspace(0, 1, 9000))
m = gn.Gridded("angles", axes, np.random.default_rng(0).uniform(size=(2, 2, 9000)))
try: gn.save(m, {str(tmp_path / "a.nc")!r})
except gn.errors.WriteError as error: print(error)
"""
    done = child(code)
    assert (done.returncode, done.stderr) == (0, "") and "a.nc: cannot be written: File too large" in done.stdout
    assert not any(tmp_path.iterdir())


def open_files():
    """The files that this process holds open."""
    return [Path(os.readlink(entry)) for entry in Path("/proc/self/fd").iterdir() if entry.is_symlink()]


@as_root
def test_a_full_disk_leaves_the_old_file_and_one_error(tmp_path):
    """For every writer, with the path and the reason. (D18)"""
    zarr()
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", disk], capture_output=True).returncode:
        pytest.skip("nothing can be mounted here")
    try:
        for name in NAMES:
            save = next(saves[name] for saves in GROUPS.values() if name in saves)
            if name == "a.bin":  # larger than the disk
                (disk / name).write_bytes(b"old")
            else:
                save(disk / name, 0)
            room = os.statvfs(disk)
            with (disk / "filler").open("wb") as filler:
                filler.write(bytes(room.f_bfree * room.f_bsize))
            before = tree(disk)
            with pytest.raises(WriteError, match=f"{name}: cannot be written: No space left on device; make room"):
                save(disk / name, 1)
            assert tree(disk) == before
            assert [place for place in open_files() if place.is_relative_to(disk)] == [], name
            (disk / "filler").unlink()
            if (disk / name).is_file():
                (disk / name).unlink()
    finally:
        subprocess.run(["umount", disk], check=True)


def fitted_into(path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("dask")
    f = xarray.DataArray(np.full((4, 3), 0.1), dims=("texel", "observation"), coords={"texel": np.arange(4.0)})
    w = gn.direction([0.1, 0.5, 0.9], 0.0)
    gn.fitting.fit_map_chunks((w, w, f), PLAIN, output=path)


@pytest.mark.parametrize("name", ["a.zarr", "b.zarr.zip", "fits.zarr"])
def test_no_file_of_a_store_is_still_written_after_the_error(name, tmp_path, monkeypatch):
    """Zarr writes several at once: one went on after another had failed, in the folder that was being removed."""
    local = pytest.importorskip("zarr.storage._local")
    put, begun, ended = local._put, [], []

    def slow_or_full(path, *arguments, **options):
        begun.append(path)
        if len(begun) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        time.sleep(0.1)
        try:
            return put(path, *arguments, **options)
        finally:
            ended.append(path)

    monkeypatch.setattr(local, "_put", slow_or_full)
    with pytest.raises(WriteError, match="No space left on device"):
        fitted_into(tmp_path / name) if name.startswith("fits") else gn.save(grid(), tmp_path / name)
    assert len(ended) == len(begun) - 1 > 0 and tree(tmp_path) == {}


OTHER_WRITERS = (
    "compile/cache_folder.py",
    "formats/_reading/hdf_probe.py",
    "formats/_reading/pipes.py",
    "cli/group.py",
    "explorer/process.py",
    "explorer/uploads.py",
    "explorer/worker.py",
    "pictures/files/radiance.py",
    "report/page/browser.py",
)
"""Kernels, what a probe finds, private copies of pipes, closed streams, which lead to /dev/null, pipes of a process and
the number that tells Linux to end it first, files of private folders (dropped ones, the page that is printed), and the
bytes of a picture, which `Image.save` puts into place."""


def test_every_writer_goes_through_files():
    """Nobody else opens a file for writing. (D26)"""
    writes = re.compile(
        r"""write_text|write_bytes|\.open\(\s*["'](w|a|x)|open\([^)]*["'][wax]b?\+?["']|to_netcdf|to_zarr"""
    )
    package = Path(gn.__file__).parent
    for path in package.rglob("*.py"):
        name, lines = path.relative_to(package).as_posix(), path.read_text(encoding="utf-8").splitlines()
        text = "\n".join(line for line in lines if ">>> " not in line)  # examples write what they read
        if name not in (*OTHER_WRITERS, "files/__init__.py", "files/_unfinished.py") and writes.search(text):
            assert "import replacing" in text, f"{name} writes files by itself"
