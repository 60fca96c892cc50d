"""A campaign of interrupts: `python benchmarks/interrupts.py [COUNT [PROCESSES]]`, results in interrupts.txt.

COUNT signals (1e5 by default), SIGALRM and SIGINT in turn, at random moments of f, sample, jacobian, albedo, render,
compiling and saving, on two threads; each raises an exception wherever the program is. See tests/tools/interrupting.py.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
AT_ONCE = 2
THREADS = 2


def main(arguments: list[str]) -> None:
    """Run the campaign in fresh processes, a few at once, and write what it saw."""
    count = int(float(arguments[0] if arguments else 1e5))
    processes = int(arguments[1]) if len(arguments) > 1 else 20
    start, total, hit, broken = time.perf_counter(), Counter(), Counter(), []
    waiting, running = list(range(processes)), {}
    while waiting or running:
        while waiting and len(running) < AT_ONCE:
            seed = waiting.pop()
            command = [sys.executable, HERE.parent / "tests" / "tools" / "interrupting.py"]
            command += map(str, (-(-count // processes), seed, THREADS))
            running[seed] = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for seed, process in list(running.items()):
            try:
                said, error = process.communicate(timeout=0.5)
            except subprocess.TimeoutExpired:
                continue
            del running[seed]
            if process.returncode:
                broken.append(f"seed {seed}: exit code {process.returncode}: {error.strip().splitlines()[-1:]}")
                continue
            seen = json.loads(said)
            hit.update(seen.pop("hit"))
            if seen["where"] or seen["ignored"] or seen["left over"]:
                broken.append(f"seed {seed}: {seen['where']} {seen['ignored']} {seen['left over']}")
            total.update({name: n for name, n in seen.items() if isinstance(n, int)})
    facts = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    model = next((line for line in facts if line.startswith("model name")), "model name: unknown")
    lines = [
        f"{time.strftime('%Y-%m-%d')}; {model.partition(':')[2].strip()}; {THREADS} threads; {processes} processes",
        f"interrupts               {total['interrupts']:8}   in {time.perf_counter() - start:.0f} s",
        f"processes that failed    {len([b for b in broken if 'exit code' in b]):8}   crashed, hung or stopped",
        f"wrong results            {total['wrong']:8}",
        f"interrupts lost          {total['lost interrupts']:8}   raised, and never arrived",
        f"helpers lost             {total['helpers lost']:8}",
        "where they came: " + ", ".join(f"{name} {n}" for name, n in hit.most_common()),
        *broken,
    ]
    print(*lines, sep="\n")
    (HERE / "interrupts.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
