"""The cache folder of compiled kernels: files of machine code and of records, named by 40 hexadecimal digits, kept for
this user. What they say is `store.py`'s business.

The folder is `gonio-kernels-2` in GONIO_CACHE_DIR, or in the user's folder for caches; GONIO_CACHE=off keeps nothing.
A file here is code that runs as this user. So the folder and every file must belong to this user, and nobody else may
write to them. Both are checked on the open file, not on its name: the links above the folder may lead anywhere. The
checksum finds damage, not intent; neither would a key, which this user's programs could read. Windows has no such
modes: there an access list makes the user's folder private.

A file is written under another name and renamed, so that processes may share the folder. Nothing is synchronised to
the disk: the checksum finds half-written files. Other files in the folder are never counted, read or removed.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NamedTuple

from ..errors import EngineWarning, ParameterError, warn

FOLDER, MAGIC = "gonio-kernels-2", b"gonio kernel 2\n"  # with the format's number: files of older formats are ignored
LARGEST = 1 << 24  # bytes of a file
BYTES_KEPT = 1 << 29  # on the disk
BLOCK = 4096  # of the disk, which a file takes at least
LOOK = BYTES_KEPT >> 6  # bytes that a process writes between two looks at how much there is
HOUR = 3600.0
DAY = 24 * HOUR

_NAME = re.compile(r"[0-9a-f]{40}(\.[0-9a-f]{16})?")  # with an ending while it is written
_AT = os.open in os.supports_dir_fd  # files by name in an open folder; not on Windows
_SAFELY = sum(getattr(os, flag, 0) for flag in ("O_NOFOLLOW", "O_CLOEXEC", "O_NOINHERIT", "O_BINARY"))
_READ = os.O_RDONLY | _SAFELY | getattr(os, "O_NONBLOCK", 0)  # to open a FIFO waits for its other end
_WRITE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _SAFELY
_WARNED: list[str] = []
_WRITTEN = [int.from_bytes(os.urandom(4), "little") % LOOK]  # bytes since a look: of short processes some look


class _Folder(NamedTuple):
    path: str
    descriptor: int | None

    def at(self, name: str) -> str:
        """The name to open a file by, relative to the descriptor if there is one."""
        return os.path.join(self.path, name) if self.descriptor is None else name


def read(name: str) -> bytes | None:
    """The bytes written under a name; None where the file is missing, damaged, or not surely this user's."""
    with _opened() as folder, suppress(OSError):
        if folder is None:
            return None
        descriptor = os.open(folder.at(name), _READ, dir_fd=folder.descriptor)
        try:
            status = os.fstat(descriptor)
            alone = stat.S_ISREG(status.st_mode) and status.st_nlink == 1
            if not alone or status.st_size > LARGEST or not _ours(status) or _open_to_others(status):
                return None
            data = os.read(descriptor, status.st_size + 1)
            if abs(time.time() - status.st_mtime) > DAY:  # kernels in use are kept longest
                with suppress(OSError):
                    os.utime(descriptor if os.utime in os.supports_fd else folder.at(name))
        finally:
            os.close(descriptor)
        start = len(MAGIC) + 32
        return data[start:] if data[:start] == _head(name, data[start:]) else None
    return None


def write(name: str, body: bytes) -> None:
    """Write bytes under a name; where the folder cannot be used, nothing."""
    data = _head(name, body) + body
    if len(data) > LARGEST:
        return
    with _opened(make=True) as folder, suppress(OSError):
        if folder is None:
            return
        temporary = f"{name}.{os.urandom(8).hex()}"
        descriptor = os.open(folder.at(temporary), _WRITE, 0o600, dir_fd=folder.descriptor)
        try:
            with open(descriptor, "wb") as file:
                if _AT:
                    os.fchmod(descriptor, 0o600)  # whatever the umask
                file.write(data)
            os.replace(
                folder.at(temporary), folder.at(name), src_dir_fd=folder.descriptor, dst_dir_fd=folder.descriptor
            )
        except BaseException:  # also an interrupt
            _remove(folder, temporary)
            raise
        _WRITTEN[0] += _taken(len(data))
        if _WRITTEN[0] >= LOOK:
            _WRITTEN[0] = 0
            _prune(folder)


def _head(name: str, body: bytes) -> bytes:
    return MAGIC + hashlib.sha256(name.encode() + body).digest()


def _taken(length: int) -> int:
    """Bytes of the disk that a file takes."""
    return -(-length // BLOCK) * BLOCK


def _ours(status: os.stat_result) -> bool:
    return os.name != "posix" or status.st_uid == os.geteuid()


def _open_to_others(status: os.stat_result) -> bool:
    return os.name == "posix" and bool(status.st_mode & 0o022)


@contextmanager
def _opened(make: bool = False) -> Iterator[_Folder | None]:
    """The open folder; None where it may not be used, or is missing and not to be made."""
    path = _path()
    folder = None if path is None else _open(path, make)
    try:
        yield folder
    finally:
        if folder is not None and folder.descriptor is not None:
            os.close(folder.descriptor)


def _path() -> str | None:
    """The folder's path; None where GONIO_CACHE is off, or the user has no folder for caches."""
    switch = os.environ.get("GONIO_CACHE", "")
    if switch not in ("", "off"):
        raise ParameterError(f"GONIO_CACHE={switch!r}: expected off, which keeps no kernels on disk; or unset it")
    if switch:
        return None
    parent = os.environ.get("GONIO_CACHE_DIR")
    if parent is not None:
        if not os.path.isabs(parent):
            text = "expected an absolute path, as code is run from there; set one, or unset it"
            raise ParameterError(f"GONIO_CACHE_DIR={parent!r}: {text}")
    elif os.name == "nt":
        parent = os.environ.get("LOCALAPPDATA", "")
    else:
        parent = os.environ.get("XDG_CACHE_HOME", "") if sys.platform != "darwin" else ""
        if not os.path.isabs(parent):
            home = os.path.expanduser("~")  # stays "~" without a home; a missing home is not made
            caches = "Library/Caches" if sys.platform == "darwin" else ".cache"
            parent = os.path.join(home, caches) if os.path.isdir(home) else ""
    return os.path.join(parent, FOLDER) if os.path.isabs(parent) else None


def _open(path: str, make: bool) -> _Folder | None:
    """The folder, if it is this user's alone."""
    try:
        if make and not os.path.lexists(path):
            for folder_path in (os.path.dirname(path), path):
                with suppress(FileExistsError):  # also by another process just now
                    os.makedirs(folder_path, 0o700)
        folder = _Folder(path, os.open(path, os.O_RDONLY | os.O_DIRECTORY | _SAFELY) if _AT else None)
        status = os.stat(path if folder.descriptor is None else folder.descriptor)
    except OSError as error:  # no warning where another process has just made the folder
        if os.path.islink(path):
            _warn(path, "is a symbolic link", "put a folder there, or ")
        elif os.path.lexists(path) and not isinstance(error, FileNotFoundError):
            _warn(path, f"cannot be opened ({error.strerror})", "make it a folder of yours, or ")
        elif make and "GONIO_CACHE_DIR" in os.environ:
            _warn(path, f"cannot be made ({error.strerror})")
        return None
    if _ours(status) and not _open_to_others(status):
        return folder
    if folder.descriptor is not None:
        os.close(folder.descriptor)
    if _ours(status):
        mode = f"mode {stat.S_IMODE(status.st_mode):04o}"
        _warn(path, f"may be written to by other users ({mode}), and code is run from it", "chmod 700 it, or ")
    else:
        _warn(path, f"belongs to user {status.st_uid}, not to user {os.geteuid()}, and code is run from it")
    return None


def _warn(path: str, why: str, remedy: str = "") -> None:
    if path not in _WARNED:
        _WARNED.append(path)
        rest = f"{remedy}set GONIO_CACHE_DIR to a folder of yours, or GONIO_CACHE=off"
        warn(f"no kernels are kept on disk: {path!r} {why}; {rest}", EngineWarning)


def _prune(folder: _Folder) -> None:
    """Remove half-written files of killed processes and, where the folder is too large, those used least recently."""
    now, kept = time.time(), []
    with os.scandir(folder.path if folder.descriptor is None else folder.descriptor) as entries:
        for entry in entries:
            name = _NAME.fullmatch(entry.name)
            if name is None:
                continue
            try:
                status = entry.stat(follow_symlinks=False)
            except OSError:  # another process was quicker
                continue
            if not stat.S_ISREG(status.st_mode) or not _ours(status):
                continue
            if name[1] is None:
                used = status.st_mtime if status.st_mtime < now + DAY else 0.0  # a clock was wrong
                kept.append((used, _taken(status.st_size), entry.name))
            elif abs(now - status.st_mtime) > HOUR:
                _remove(folder, entry.name)
    size = sum(taken for _, taken, _ in kept)
    if size <= BYTES_KEPT:
        return
    for _, taken, oldest in sorted(kept):
        if size <= 0.75 * BYTES_KEPT:
            return
        _remove(folder, oldest)
        size -= taken


def _remove(folder: _Folder, name: str) -> None:
    with suppress(OSError):
        os.unlink(folder.at(name), dir_fd=folder.descriptor)
