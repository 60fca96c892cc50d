"""Private folders in which files are made before they take their place, and the sweeping of those of killed writers;
files that one run holds at a time.

A folder is called `.gonio-unfinished-` and 16 digits, and holds a file that its writer keeps locked. The next writer to
the same place removes the user's own folders that nobody has locked. Where a file system has no locks, as some on
networks, none is removed: they may be removed by hand.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import shutil
import stat
import time
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import IO

from ..errors import NotFoundError, WaitingWarning, warn

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]  # Windows has none

UNFINISHED = re.compile(r"\.gonio-unfinished-[0-9a-f]{16}")
LOCK = "lock"
MANY, PAUSE = 10_000, 1e-4
"""Folders with more names are listed again only after a pause, in seconds for each name: listing takes 3e-7."""


@contextlib.contextmanager
def beside(path: str | os.PathLike, folder: Path) -> Iterator[Path]:
    """A private, locked folder in another one, which is swept first."""
    _sweep(folder)
    try:
        place, lock = _made(folder)
    except OSError as error:
        raise NotFoundError(f"{path}: no file can be made in {folder}: {error.strerror}") from None
    with lock:
        try:
            yield place
        finally:
            _remove(place)


_HELD: set[IO[bytes]] = set()
"""Files that are held. A fork does not hold them, so that they are free when the process that does is killed."""


def _let_go() -> None:
    for file in _HELD:
        os.close(file.fileno())


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)


@contextlib.contextmanager
def held(path: Path) -> Iterator[IO[bytes]]:
    """A file, made where there is none, that no other run holds meanwhile: whoever comes later waits, and the system
    frees those of killed ones. It goes if it is empty in the end. Without locks, as on Windows, nobody waits."""
    while True:
        with path.open("a+b") as file:
            if fcntl is not None:
                with contextlib.suppress(OSError):  # the file system has none
                    _lock(file, path)
            if not _is_at(file, path):  # its last holder removed it
                continue
            _HELD.add(file)
            try:
                yield file
            finally:
                if not os.fstat(file.fileno()).st_size and _is_at(file, path):
                    path.unlink()
                _HELD.discard(file)
            return


def _is_at(file: IO[bytes], path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _lock(file: IO[bytes], path: Path) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        warn(f"{path}: another run writes to its place; this one goes on when that has ended", WaitingWarning)
        fcntl.flock(file, fcntl.LOCK_EX)


def _made(folder: Path) -> tuple[Path, FileIO]:
    for _ in range(100):
        place = folder / f".gonio-unfinished-{secrets.token_hex(8)}"
        place.mkdir(0o700)
        try:
            lock = FileIO(place / LOCK, "x+")  # closes itself after an interrupt, as a file descriptor would not
        except FileNotFoundError:  # swept before it was locked
            continue
        if _locked(lock.fileno()):
            return place, lock
        lock.close()
    raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))


def _locked(lock: int) -> bool:
    """Whether a new lock is held and still there; or there are no locks here."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return os.fstat(lock).st_nlink > 0


_next_sweep: tuple[Path, float] = (Path(), 0.0)
"""The folder that was swept last, and the time of its next sweep."""


def _sweep(folder: Path) -> None:
    """Remove the private folders of killed writers."""
    global _next_sweep
    start = time.monotonic()
    if fcntl is None or (folder == _next_sweep[0] and start < _next_sweep[1]):
        return
    try:
        names = os.listdir(folder)
    except OSError:  # it may not be listed
        return
    _next_sweep = folder, start + (PAUSE * len(names) if len(names) > MANY else 0.0)
    for name in filter(UNFINISHED.fullmatch, names):
        with contextlib.suppress(OSError):
            _sweep_one(folder / name)


def _sweep_one(place: Path) -> None:
    status = place.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
        return
    try:
        lock = os.open(place / LOCK, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    except FileNotFoundError:  # not locked yet, and then its writer makes another one; or emptied already
        place.rmdir()
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for name in os.listdir(place / "old") if (place / "old").is_dir() else ():  # see `_put`
            if not os.path.lexists(place.parent / name):
                os.rename(place / "old" / name, place.parent / name)
        _remove(place)
    finally:
        os.close(lock)


def _remove(place: Path) -> None:
    """Remove a folder, its lock last: so the rest can be swept after a kill."""
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(place)):
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            elif entry.name != LOCK:
                os.unlink(entry.path)
        os.unlink(place / LOCK)
        place.rmdir()
