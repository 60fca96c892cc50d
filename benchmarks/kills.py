"""A campaign of kills: `python benchmarks/kills.py [COUNT [GROUP...]]`, results in benchmarks/kills.txt.

COUNT processes (1000 by default) of each group of formats are killed (kill -9) at random times while they save one of
two contents under the same name. What is found there must be one of both, whole, and the next save must remove whatever
the killed one left. The law is a test, too, with fewer kills.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["GONIO_ENGINE"] = "numpy"  # what is killed is saving
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "tools"))

from killing import GROUPS, Outcome, campaign  # noqa: E402  (after the path is set)

COLUMNS = ("kills", "damaged", "missing", "left something", "unswept", "seconds")


def processor() -> str:
    """Its name, as Linux has it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def main(arguments: list[str]) -> None:
    """Run the campaign and write what it found."""
    count = int(float(arguments[0])) if arguments else 1000
    head = [f"{processor()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"]
    head += [f"{'':14}" + "".join(f"{name:>16}" for name in COLUMNS)]
    for group in arguments[1:] or GROUPS:
        total, start = Outcome(), time.perf_counter()
        for number, (name, save) in enumerate(GROUPS[group].items()):
            share = count // len(GROUPS[group]) + (number < count % len(GROUPS[group]))
            with TemporaryDirectory() as folder:
                for outcome in campaign(save, Path(folder) / name, share, number):
                    total += outcome
        took = time.perf_counter() - start
        row = (total.kills, total.damaged, total.missing, total.left, total.unswept, round(took))
        said = f"{group:14}" + "".join(f"{x:16}" for x in row)
        print(said, flush=True)
        file = HERE / "kills.txt"  # another process may have done other groups
        old = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        rows = {line[:14].strip(): line for line in [*old[2:], said]}
        file.write_text("\n".join([*head, *(rows[name] for name in GROUPS if name in rows)]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
