"""HDF files as a process of its own sees them (`hdf_probe`): their libraries may crash or hang on damaged ones."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from multiprocessing import spawn
from pathlib import Path
from typing import Any

from ...errors import DependencyError, FormatError
from . import hdf_probe


def inspected(kind: str, path: Path, *more: str) -> dict[str, Any]:
    """The findings of `hdf_probe` in an "hdf4" or "hdf5" file; FormatError for damage, and where it finds no end.

    Raises DependencyError where no process can be started.
    """
    try:
        found = json.loads(probed(kind, str(path), *more))
    except ValueError:
        raise FormatError(
            f"{path}: {kind.upper()} file that is damaged: its library does not come to an end with it; fetch it again"
        ) from None
    if "refused" in found:
        raise FormatError(f"{path}: {found['refused']}")
    return found


def probed(*words: str) -> bytes:
    """The output of the program, called with these words; cut short where a file stops it."""
    search = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    failed = []
    for program in _interpreters():
        command = [program, "-P", hdf_probe.__file__, *words]  # -P: modules beside it have names of Python's own
        try:
            done = subprocess.run(command, env=search, capture_output=True, timeout=600.0, check=False)
        except subprocess.TimeoutExpired:
            return b""
        except OSError as error:
            failed.append(f"{program}: {error.strerror}")
            continue
        start, said = hdf_probe.STARTED.encode(), done.stdout.replace(b"\r\n", b"\n")
        if said.startswith(start):
            return said.removeprefix(start)
        failed.append(f"{program}: {done.stderr.decode(errors='replace').strip()[-80:] or 'says nothing'}")
    raise DependencyError(
        f"{words[1]}: HDF files are read in a process of its own, for which no Python was found "
        f"({'; '.join(failed) or 'none'}); say where it is: multiprocessing.set_executable('/path/to/python')"
    )


def _interpreters() -> list[str]:
    """Where this Python's program may be. One of another name is never run: it could be what gonio is part of."""
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    homes = (sys.exec_prefix, sys.base_exec_prefix)
    found = [spawn.get_executable(), sys.executable, getattr(sys, "_base_executable", None)]
    found += [str(Path(home, *place)) for home in homes for place in (("bin", name), ("python.exe",))]
    named = dict.fromkeys(os.fsdecode(x) for x in found if x)
    return [x for x in named if Path(x).name.lower().startswith(("python", "pypy"))]
