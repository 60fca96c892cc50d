"""Starting a Python of its own: which program that is, and what it imports from."""

from __future__ import annotations

import os
import sys
from multiprocessing import spawn
from pathlib import Path

from ..errors import DependencyError


def interpreters() -> list[str]:
    """Possible paths of this Python's program. Other names are left out: such a program may have gonio built in."""
    name = f"python{sys.version_info.major}.{sys.version_info.minor}"
    homes = (sys.exec_prefix, sys.base_exec_prefix)
    programs = [spawn.get_executable(), sys.executable, getattr(sys, "_base_executable", None)]
    programs += [str(Path(home, *place)) for home in homes for place in (("bin", name), ("python.exe",))]
    paths = dict.fromkeys(os.fsdecode(x) for x in programs if x)
    return [x for x in paths if Path(x).name.lower().startswith(("python", "pypy"))]


def no_interpreter(what: str, failures: list[str]) -> DependencyError:
    """The error where none of them runs; `what`: what needs one."""
    told = "; ".join(failures) or "none"
    return DependencyError(
        f"{what} in a process of its own, for which no Python was found ({told}); say where it is: "
        f"multiprocessing.set_executable('/path/to/python')"
    )
