"""Misuse of the public API: `python benchmarks/public_fuzz.py [COUNT [SEED [NAME]]]`, results in public_fuzz.txt.

COUNT calls (1e5 by default) of everything public, or of what has NAME in its name, with arguments of any kind
(tests/tools/public_calls.py). Printed: calls by target, what came out other than `gonio.Error`, and the longest calls.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["GONIO_ENGINE"] = "numpy"  # a kernel for every combination of dtypes would take the time
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "tools"))

from public_calls import call_of, outcome, seeded, targets


def main(count: str = "1e5", seed: str = "1", name: str = "") -> None:
    calls, refused = Counter(), Counter()
    findings: dict[str, list[str]] = {}
    slowest: list[tuple[float, str]] = []
    chosen = [target for target in targets() if name in target.name]
    start = time.perf_counter()
    with TemporaryDirectory() as folder:
        os.chdir(folder)  # files with names of any kind
        for number in range(int(float(count))):
            target = chosen[number % len(chosen)]
            call = call_of(target, seeded(target.name, seed, number // len(chosen)), Path(folder))
            begun = time.perf_counter()
            came = outcome(call)
            slowest = sorted([*slowest, (time.perf_counter() - begun, call.text)])[-5:]
            calls[call.target.name] += 1
            refused[call.target.name] += came == "refused"
            if came not in ("", "refused"):
                findings.setdefault(came, []).append(call.text)
    seconds = time.perf_counter() - start
    print(
        f"{calls.total()} calls of {len(calls)} targets in {seconds:.0f} s, seed {seed}: {refused.total()} refused by"
    )
    print(f"a gonio.Error, {sum(map(len, findings.values()))} with something else in {len(findings)} kinds")
    for found, texts in sorted(findings.items(), key=lambda item: -len(item[1])):
        print(f"{len(texts):5} {found}\n        {min(texts, key=len)[:300]}")
    print("\nlongest calls:")
    for taken, text in reversed(slowest):
        print(f"{taken:5.1f} s  {text[:150]}")
    print("\ncalls, of which refused:")
    for target, number in sorted(calls.items()):
        print(f"{number:6} {refused[target]:6}  {target}")


if __name__ == "__main__":
    main(*sys.argv[1:])
