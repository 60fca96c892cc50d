"""HDF files, read in a process of its own (`hdf_probe`): their libraries may crash or hang on damaged ones."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from ...errors import FormatError
from ...machine.interpreters import interpreters, no_interpreter
from . import hdf_probe


def inspected(kind: str, path: Path, *more: str) -> dict[str, Any]:
    """The report of `hdf_probe` on an "hdf4" or "hdf5" file.

    Raises FormatError for damage and for reading without end, DependencyError where no process can be started.
    """
    try:
        report = json.loads(probed(kind, str(path), *more))
    except ValueError:
        raise FormatError(f"{path}: damaged {kind.upper()} file: its library hangs; fetch it again") from None
    if "refused" in report:
        raise FormatError(f"{path}: {report['refused']}")
    return report


def probed(*words: str) -> bytes:
    """The output of the program, called with these words; cut short by a file that stops it."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    failures = []
    for program in interpreters():
        command = [program, "-P", hdf_probe.__file__, *words]  # -P: modules beside it have names of Python's own
        try:
            process = subprocess.run(command, env=environment, capture_output=True, timeout=600.0, check=False)
        except subprocess.TimeoutExpired:
            return b""
        except OSError as error:
            failures.append(f"{program}: {error.strerror}")
            continue
        start, output = hdf_probe.STARTED.encode(), process.stdout.replace(b"\r\n", b"\n")
        if output.startswith(start):
            return output.removeprefix(start)
        failures.append(f"{program}: {process.stderr.decode(errors='replace').strip()[-80:] or 'says nothing'}")
    raise no_interpreter(f"{words[1]}: HDF files are read", failures)
