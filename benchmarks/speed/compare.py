"""Compare this commit with another in time, by asv: `python3 dev.py speed BASE` (what is not committed is not timed).

asv builds both commits, installs them in turn in one environment in build/asv, runs the benchmarks of tasks.py in
three rounds, A B A B A B, and calls a change what a test of ranks and a tenth of difference both say. The first time
it takes a minute or two to make the environment (0.7 GB). The whole table goes to benchmarks/speed.txt, to be
committed at the end of a piece of work; further arguments go to asv: `--bench Evaluation`, `--factor 1.05`.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from timing import machine  # noqa: E402  (beside this folder)

TABLE = HERE.parent / "speed.txt"


def asv(*arguments: str, keep: bool = False) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "asv", arguments[0], "--config", str(HERE / "asv.conf.json"), *arguments[1:]]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "GONIO_THREADS": "1"}
    return subprocess.run(command, env=environment, text=True, stdout=subprocess.PIPE if keep else None)


def main() -> int:
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        print(__doc__)
        return 2
    base, *further = sys.argv[1:]
    git = ["git", "-C", str(HERE), "rev-parse", base, "HEAD"]
    old, new = (name[:9] for name in subprocess.run(git, stdout=subprocess.PIPE, text=True, check=True).stdout.split())
    asv("machine", "--yes")
    code = asv("continuous", "--interleave-rounds", *further, old, new).returncode
    found = asv("compare", old, new, keep=True)
    if found.returncode:
        return found.returncode
    lines = [f"{old} beside {new}, one thread; processor time", *machine(5)]
    TABLE.write_text("\n".join([*lines, "", found.stdout.strip(), ""]), encoding="utf-8")
    return code if code not in (0, 1) else 0  # 1: something has become slower, which is said


if __name__ == "__main__":
    sys.exit(main())
