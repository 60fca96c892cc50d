"""A campaign of damaged files: `python benchmarks/fuzz.py [COUNT [FORMAT...]]`, results in benchmarks/fuzz.txt.

Every format's minimal valid file, what it holds where that is a dataset, and meshes are mutated COUNT times (1e5 by
default; FIRST:END for the mutations with these numbers, where a campaign goes on) and read, with at most 5 seconds and
a bounded amount of memory for each. Only `gonio.Error` may be raised. Numbers of mutations with outcomes not seen
before are kept in tests/formats/corpus, which the tests read again.
"""

from __future__ import annotations

import os
import sys
import time
import traceback
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["GONIO_ENGINE"] = "numpy"  # a kernel for every damaged table would take the time
HERE = Path(__file__).resolve().parent
TESTS = HERE.parent / "tests"
sys.path.insert(0, str(TESTS / "tools"))

import numpy as np  # noqa: E402  (after the path is set)
from fuzz_trials import TRIALS  # noqa: E402  (after the path is set)
from fuzzing import Hang  # noqa: E402  (after the path is set)

from gonio.base import provenance  # noqa: E402  (after the path is set)

provenance.HASHED = 1 << 16  # checksums of larger files take half of the time

KEEP = 48
"""How many mutations per format are kept at most."""


def campaign(name: str, numbers: range, seconds: float) -> tuple[int, int, list[int], dict[str, int]]:
    """How many mutations of a format's seed were tried and read, numbers worth keeping, and findings with a number."""
    seen: dict[str, int] = {}
    findings: dict[str, int] = {}
    tried, read, start = 0, 0, time.perf_counter()
    with TemporaryDirectory(dir="/dev/shm") as folder:
        trial = TRIALS[name](Path(folder) / "damaged")
        for number in numbers:
            if time.perf_counter() - start > seconds:
                break
            tried += 1
            try:
                found = trial(number)
            except (Exception, Hang) as error:
                frames = traceback.extract_tb(error.__traceback__)
                where = next(
                    (f"{Path(f.filename).name}:{f.lineno}" for f in reversed(frames) if "gonio" in f.filename), ""
                )
                findings.setdefault(f"{type(error).__name__}: {str(error)[:100]!r} at {where}", number)
                continue
            read += found == "read"
            seen.setdefault(found if found != "read" else f"read {number % 8}", number)
    return tried, read, sorted([*list(findings.values()), *seen.values()][:KEEP]), findings


def main(arguments: list[str]) -> None:
    """Run the campaign and write what it found."""
    first, _, last = arguments[0].rpartition(":") if arguments else ("", "", "1e5")
    numbers = range(int(float(first or 0)), int(float(last)))
    names = arguments[1:] or sorted(TRIALS)
    seconds = float(os.environ.get("GONIO_FUZZ_SECONDS", "1e9"))
    corpus = TESTS / "formats" / "corpus"
    corpus.mkdir(exist_ok=True)
    for name in names:
        start = time.perf_counter()
        tried, read, kept, findings = campaign(name, numbers, seconds)
        took = time.perf_counter() - start
        said = [f"{name:24} {tried:8} tried {read / max(tried, 1):7.1%} read {len(findings):4} findings {took:7.0f} s"]
        said += [f"    {number}: {words}" for words, number in findings.items()]
        print(*said, sep="\n", flush=True)
        record(name, said)
        file = corpus / f"{name.replace(' ', '_').replace('/', '_')}.txt"
        old = np.loadtxt(file, dtype=int, ndmin=1).tolist() if file.exists() else []
        file.write_text("\n".join(map(str, sorted({*kept, *old})[: 2 * KEEP])) + "\n", encoding="ascii")


def record(name: str, said: list[str]) -> None:
    """Put what a format's campaign came to in place of what the last one did, in benchmarks/fuzz.txt."""
    file = HERE / "fuzz.txt"
    results: dict[str, list[str]] = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        if not line.startswith(" "):
            results[line[:24].strip()] = []
        results[next(reversed(results))].append(line)
    results[name] = said
    lines = [line for key in sorted(results) for line in results[key]]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
