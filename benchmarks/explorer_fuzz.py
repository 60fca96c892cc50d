"""Messages of any kind to the explorer: `python benchmarks/explorer_fuzz.py [COUNT [SEED]]`; see explorer_fuzz.txt.

COUNT messages (1e5 by default, tests/tools/explorer_fuzz.py) go through one socket of a server that runs. Each must be
answered: with a result, or with an error that is no fault of gonio. Printed: how many of which, answers that must not
be, workers that ended, and the longest answers.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "tools"))

from explorer_fuzz import messages
from explorer_server import Explorer, unpacked


def main(count: str = "1e5", seed: str = "1") -> None:
    kinds: Counter[str] = Counter()
    wrong: list[str] = []
    slowest: list[tuple[float, str]] = []
    number = int(float(count))
    with Explorer("gold") as explorer:
        with explorer.socket() as connection:
            connection.send('{"id": 0, "call": "names"}')
            connection.recv(timeout=120)
            worker, start = explorer.children(), time.perf_counter()
            for message in messages(number, int(seed)):
                begun = time.perf_counter()
                connection.send(message)
                found = unpacked(connection.recv(timeout=120))
                slowest = sorted([*slowest, (time.perf_counter() - begun, repr(message)[:150])])[-5:]
                words = "" if found["ok"] else found["error"]
                kinds["results" if found["ok"] else "errors"] += 1
                if not found["ok"] and (not words or "fault of gonio" in words or "what computes" in words):
                    wrong.append(f"{words[:100]}\n        {message!r:.300}")
        seconds = time.perf_counter() - start
        same = explorer.children() == worker
        code, said = explorer.stop()
    print(f"{number} messages in {seconds:.0f} s, seed {seed}: {kinds['results']} results, {kinds['errors']} errors,")
    print(f"{len(wrong)} answers that must not be; the worker is {'still the first' if same else 'another one'};")
    print(f"after Ctrl-C exit code {code}, {len(said.splitlines())} lines on standard error")
    for text in wrong[:20]:
        print(text)
    print("\nlongest answers:")
    for taken, text in reversed(slowest):
        print(f"{taken:6.2f} s  {text}")


if __name__ == "__main__":
    main(*sys.argv[1:])
