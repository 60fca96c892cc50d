"""Misuse of the public API: `python benchmarks/public_fuzz.py [COUNT [SEED]]`, results in benchmarks/public_fuzz.txt.

COUNT calls (1e5 by default) of everything public with arguments of any kind (tests/tools/public_calls.py). Printed:
calls by target, what came out other than `gonio.Error`, and the longest call.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

os.environ["GONIO_ENGINE"] = "numpy"  # a kernel for every combination of dtypes would take the time
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "tools"))

from public_calls import call_of, outcome, targets  # noqa: E402


def main(arguments: list[str]) -> None:
    count, seed = (int(float(x)) for x in [*arguments, "1e5", "1"][: 2 if not arguments else 2]) if len(
        arguments
    ) != 1 else (int(float(arguments[0])), 1)
    random, calls, findings = Random(seed), Counter(), {}
    longest, start = (0.0, ""), time.perf_counter()
    only = os.environ.get("ONLY", "")
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        chosen = [t for t in targets() if only in t.name]
        for number in range(count):
            target = chosen[number % len(chosen)]
            call = call_of(target, random, Path(folder))
            begun = time.perf_counter()
            found = outcome(call)
            longest = max(longest, (time.perf_counter() - begun, call.text))
            calls[target.name] += 1
            if found:
                findings.setdefault(found, []).append(call.text)
    print(f"{count} calls of {len(calls)} targets in {time.perf_counter() - start:.0f} s; seed {seed}")
    print(f"longest: {longest[0]:.1f} s, {longest[1][:200]}")
    print(f"{len(findings)} findings")
    for found, texts in sorted(findings.items(), key=lambda item: -len(item[1])):
        print(f"{len(texts):5} {found}\n        {min(texts, key=len)[:300]}")


if __name__ == "__main__":
    main(sys.argv[1:])
