"""Writing files and folders whole or not at all: a failure, a full disk or a kill leaves the old ones untouched.

A new file or folder is made in a private folder beside its place, `.gonio-unfinished-` and 16 digits, which is locked
as long as its writer lives. It is synced with the disk, and then takes its place in one step. The next writer to the
same place removes what killed ones left (`_unfinished`).
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import re
import stat
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..errors import Error, NotFoundError, ParameterError, WriteError
from ._unfinished import beside

LONGER = 64
"""Characters by which a path in the private folder is longer than that of the place, and some to spare."""
KINDS = {stat.S_IFCHR: "a device", stat.S_IFBLK: "a disk", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
ACCESS = "system.posix_acl_access"
AT_FDCWD, RENAME_EXCHANGE = -100, 2


def target(path: str | os.PathLike) -> Path:
    """The place where a file of this name is written, links followed.

    Raises NotFoundError or ParameterError where there is none: long work checks this first. An existing file is
    replaced only if it may be written to and has no other name. Devices and pipes are neither replaced nor written to:
    nothing is whole or not at all there, nor can it be read again.
    """
    final, status = _place(path)
    if status is None:
        return final
    if stat.S_ISDIR(status.st_mode):
        raise ParameterError(f"{path or repr(path)}: is a directory, expected a file name; choose another")
    if status.st_nlink > 1:
        raise ParameterError(
            f"{path}: has {status.st_nlink} names (hard links), of which writing would change all or part one; remove "
            f"this one first, or choose another name"
        )
    _refuse_protected(path, final, status)
    return final


def target_folder(path: str | os.PathLike, foreign: Callable[[Path], str | None]) -> Path:
    """The same for a folder. An existing one is replaced only if all in it is ours.

    foreign   gives the reason, in words, why a folder is not ours, or None
    """
    final, status = _place(path)
    if status is None:
        return final
    if not stat.S_ISDIR(status.st_mode):
        raise ParameterError(f"{path}: is a file, expected a folder or nothing; choose another name, or remove it")
    with contextlib.suppress(FileNotFoundError):
        if Path.cwd().is_relative_to(final):
            raise ParameterError(
                f"{path}: is the working directory or above it, which is not replaced; name a new folder"
            )
    if os.path.ismount(final):
        raise ParameterError(f"{path}: is where a disk is mounted, which is not replaced; name a new folder")
    if reason := foreign(final):
        raise ParameterError(f"{path}: {reason}; nothing was changed; name a new folder, or remove this one yourself")
    _refuse_protected(path, final, status)
    return final


def _place(path: str | os.PathLike) -> tuple[Path, os.stat_result | None]:
    """The place that a name leads to, and the status of the file or folder there."""
    short = f"{path!s:.200}"
    try:
        final = Path(os.path.realpath(os.fsdecode(os.fsencode(path))))
    except ValueError as error:
        raise ParameterError(f"{short!r}: no name that a file can have: {error}; choose another") from None
    folder = final.parent
    if _is_open_file(path):
        raise ParameterError(
            f"{path}: is an open file of a process, expected a file's name; write to a file, and copy it"
        )
    if not os.path.isdir(folder):
        raise NotFoundError(f"{short}: the directory {folder!s:.200} does not exist; create it first")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise NotFoundError(f"{short}: the directory {folder} may not be written to; choose another")
    if hasattr(os, "pathconf"):
        lengths = {"name": len(os.fsencode(final.name)), "path": len(os.fsencode(final)) + LONGER}
        for part, length in lengths.items():
            if length > (most := os.pathconf(folder, f"PC_{part.upper()}_MAX")):
                raise ParameterError(
                    f"{short}...: its {part} needs {length} bytes, expected at most {most}; shorten it"
                )
    try:
        status = final.lstat()
    except FileNotFoundError:
        return final, None
    if stat.S_ISLNK(status.st_mode):
        raise ParameterError(f"{path}: is a link that leads back to itself, expected a file name; remove it")
    if kind := KINDS.get(stat.S_IFMT(status.st_mode)):
        raise ParameterError(f"{path}: is {kind}, expected a file or nothing; write to a file, and copy that")
    return final, status


def _is_open_file(path: str | os.PathLike) -> bool:
    """Whether a name stands for an open file, as /dev/stdout does: such links lead to no name."""
    link = os.fsdecode(path)
    for _ in range(40):
        folder = os.path.realpath(os.path.dirname(link))
        link = os.path.join(folder, os.path.basename(link))
        if re.fullmatch(r"/proc/.+/fd|/dev/fd", folder):
            return True
        if not os.path.islink(link):
            return False
        link = os.path.join(folder, os.readlink(link))
    return False


def _refuse_protected(path: str | os.PathLike, final: Path, status: os.stat_result) -> None:
    """ParameterError where a file or folder may not be written to, or not be replaced."""
    if not status.st_mode & 0o222 or not os.access(final, os.W_OK):
        raise ParameterError(f"{path}: is read-only; choose another name, or make it writable: chmod u+w")
    folder = final.parent.stat()
    if folder.st_mode & stat.S_ISVTX and os.geteuid() not in (0, status.st_uid, folder.st_uid):
        raise ParameterError(
            f"{path}: is another user's, in a folder where only they may replace it; choose another name"
        )


@contextlib.contextmanager
def replacing(path: str | os.PathLike) -> Iterator[Path]:
    """A temporary file to write to, which takes its place if the block ends well, and is removed if not.

    It is in a private folder, which is removed with all in it. A file that is replaced hands on its permissions, owner
    and attributes, the last two as far as they may be set.
    Raises the errors of `target`; WriteError where the system refuses, also within the block.
    """
    final = target(path)
    with beside(path, final.parent) as folder, _explained(path, folder):
        temporary = folder / "new"
        mode = 0o600 if final.exists() else 0o666
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
        yield temporary
        target(path)
        _settle(temporary, final if final.exists() else None)
        os.replace(temporary, final)
        _settle(final.parent)


@contextlib.contextmanager
def replacing_folder(path: str | os.PathLike, foreign: Callable[[Path], str | None]) -> Iterator[Path]:
    """As `replacing`, for a folder and all in it; `foreign`: see `target_folder`.

    Linux exchanges both in one step. Elsewhere there is no such folder for a moment; after a kill in that moment the
    next writer puts the old one back.
    """
    final = target_folder(path, foreign)
    with beside(path, final.parent) as folder, _explained(path, folder):
        new = folder / "new"
        new.mkdir()
        yield new
        for _ in range(100):
            with contextlib.suppress(FileNotFoundError, FileExistsError):  # of others who write here
                target_folder(path, foreign)
                _settle_all(new, final)
                _put(new, final)
                break
        else:
            raise WriteError(f"{path}: is replaced by others all the time; try again when they are done")
        _settle(final.parent)


@contextlib.contextmanager
def _explained(path: str | os.PathLike, folder: Path) -> Iterator[None]:
    """WriteError where the system refuses; libraries may raise errors of other kinds then."""
    try:
        yield
    except Error:
        raise
    except Exception as error:
        cause = _cause(error, folder)
        if cause is None:
            raise
        reason = cause.strerror or cause
        raise WriteError(f"{path}: cannot be written: {reason}; make room, or choose another place") from error


def _cause(error: Exception, folder: Path) -> OSError | None:
    """The system's error behind another one: in its chain, or raised when a little more is written."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno is not None:
            return cause
        cause = cause.__cause__ or cause.__context__
    try:
        with (folder / "new" if (folder / "new").is_file() else folder / "more").open("ab") as file:
            file.write(bytes(1 << 20))
            file.flush()
            os.fsync(file.fileno())
    except OSError as refusal:
        return refusal
    return error if isinstance(error, OSError) and not isinstance(error, TimeoutError) else None


def _put(new: Path, final: Path) -> None:
    """Put a folder into its place, and the old one, if any, into the private folder."""
    if not final.exists():
        try:
            os.rename(new, final)
        except OSError as error:
            if error.errno == errno.ENOTEMPTY:
                raise FileExistsError(error.errno, error.strerror) from None
            raise
        return
    if _exchanged(new, final):
        return
    old = new.parent / "old"
    old.mkdir()
    os.replace(final, old / final.name)
    try:
        os.replace(new, final)
    except OSError:
        os.replace(old / final.name, final)
        raise


def _exchanged(new: Path, final: Path) -> bool:
    """Exchange both in one step; False where the system or the file system cannot."""
    library: Any = ctypes.CDLL(None, use_errno=True) if sys.platform == "linux" else None
    if not hasattr(library, "renameat2"):  # as in old C libraries
        return False
    if library.renameat2(AT_FDCWD, os.fsencode(new), AT_FDCWD, os.fsencode(final), RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP):
        return False
    raise OSError(code, os.strerror(code), str(final))


def _like(new: Path, final: Path) -> None:
    """Give a file or folder the owner, permissions and attributes of the one that it replaces.

    Where it cannot get that group, its group gets only the permissions of others.
    """
    old, now = final.stat(), new.stat()
    mode = stat.S_IMODE(old.st_mode) & 0o777
    is_group_kept = (old.st_uid, old.st_gid) == (now.st_uid, now.st_gid) or _owned(new, old)
    if not is_group_kept:
        mode &= 0o707 | (mode & 0o007) << 3
    if hasattr(os, "listxattr"):
        ours, theirs = _attributes(new), _attributes(final)
        for name in theirs:
            if name.startswith("user.") or (name == ACCESS and is_group_kept):
                os.setxattr(new, name, os.getxattr(final, name))
        if ACCESS in ours and ACCESS not in theirs:
            os.removexattr(new, ACCESS)
    os.chmod(new, mode)


def _owned(new: Path, old: os.stat_result) -> bool:
    """Give a file the group of another, and its owner where that is allowed; whether it has the group now."""
    for user in (old.st_uid, -1):
        with contextlib.suppress(OSError):
            os.chown(new, user, old.st_gid)
            return True
    return False


def _attributes(path: Path) -> list[str]:
    try:
        return os.listxattr(path)
    except OSError:  # the file system has none
        return []


def _settle(new: Path, like: Path | None = None) -> None:
    """Make a file or folder like another, if there is one, and wait until it is on the disk."""
    try:
        handle = os.open(new, os.O_RDWR if new.is_file() else os.O_RDONLY)
    except PermissionError:
        if new.is_dir():  # nobody may list it
            return
        raise
    try:
        if like is not None:
            _like(new, like)
        os.fsync(handle)
    finally:
        os.close(handle)


def _settle_all(new: Path, final: Path) -> None:
    """The same for a folder and all in it: files become like the first one in the old folder."""
    like = final if final.exists() else None
    file = next((p for p in sorted(final.iterdir()) if p.is_file()), None) if like else None
    for folder, _, names in os.walk(new, topdown=False):
        for name in names:
            _settle(Path(folder) / name, file)
        _settle(Path(folder), like)
