"""HDF files as a process of its own sees them (`_hdf_probe`): their libraries may crash or hang on damaged ones."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from ..errors import FormatError
from . import _hdf_probe


def inspected(kind: str, path: Path, *more: str) -> dict[str, Any]:
    """What `_hdf_probe` finds in an "hdf4" or "hdf5" file; FormatError where that is damage, or it finds no end."""
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
    """What the program says, called with these words; cut short where a file stops it."""
    search = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-P", _hdf_probe.__file__, *words]  # -P: modules beside it have names of Python's own
    return subprocess.run(command, env=search, capture_output=True, timeout=600.0, check=False).stdout
