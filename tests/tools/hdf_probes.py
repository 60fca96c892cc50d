"""Run as a program: `hdf_probe` for each line of standard input, in a copy of this process, which is small.

Each line is a list in JSON: the bytes of memory that the copy may take more than this process, and the probe's words.
What the probe says is printed, and a zero byte after it.
"""

from __future__ import annotations

import importlib.util
import json
import os
import resource
import sys
from pathlib import Path

import h5py  # noqa: F401  (loaded before memory is limited)

if importlib.util.find_spec("pyhdf"):
    import pyhdf.SD  # noqa: F401  (loaded before memory is limited)


def main(program: str) -> None:
    spec = importlib.util.spec_from_file_location("probe", program)
    probe = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(probe)
    taken = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    for line in iter(sys.stdin.readline, ""):
        more, *words = json.loads(line)
        child = os.fork()
        if not child:
            try:
                resource.setrlimit(resource.RLIMIT_AS, (taken + more,) * 2)
                os.write(1, json.dumps(probe.main(*words)).encode())
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        os.write(1, b"\0")


if __name__ == "__main__":
    main(sys.argv[1])
