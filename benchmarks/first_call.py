"""What a first call costs, beside another checkout: `python benchmarks/first_call.py OTHER [ROUNDS]`.

OTHER is a folder with another commit (`git worktree add ../before COMMIT`). Both run in turns, each time in a new
process, with no kernels kept. Times are processor time, the least of the rounds; only their ratio says anything.

    first f        the first f of 100 directions of a GGX metal, the import of llvmlite included
    operations     `fewer_operations` over the graphs of twelve materials; the digest of what it gives is that of all
    report         what compiling takes in `gonio report gold-metallic-paint`, by stage
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

from gonio.formula import tree

HERE = Path(__file__).resolve().parents[1]


def first_f() -> dict[str, Any]:
    """The first f of a process."""
    import numpy as np

    import gonio as gn

    m, wi = gn.Microfacet(gn.GGX(0.2), 0.9), gn.direction(np.linspace(0.0, 1.4, 100), 0.3)
    start = time.process_time()
    m.f(wi, wi[::-1])
    return {"first f": time.process_time() - start}


def operations() -> dict[str, Any]:
    """The rewriting of the graphs of f, pdf, samples and derivatives."""
    import gonio as gn
    from gonio.base import kernels
    from gonio.errors import TraceError
    from gonio.evaluate.tracing import Task, content, traced
    from gonio.trace.choices import fewer_choices
    from gonio.trace.fractions import fewer_operations

    diffuse, glossy = gn.Lambertian([0.3, 0.2, 0.1]), gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
    found = [
        *(gn.Microfacet(gn.GGX(0.2), 0.9), gn.material("gold"), diffuse + glossy, gn.OrenNayar([0.3, 0.2, 0.1], 0.3)),
        *(gn.Microfacet(gn.Beckmann(0.2), gn.Dielectric(1.5)), gn.DisneyPrincipled(), gn.HeTorrance(), gn.Hapke()),
        *(gn.RoughDielectric(gn.GGX(0.2), 1.5), gn.RoughCoated(diffuse), gn.OpenPBRGlossyDiffuse()),
        gn.material("gold-metallic-paint"),
    ]
    spent, digest = 0.0, hashlib.sha256()
    for m in found:
        leaves = tuple(range(len(content(m).leaves)))
        for task in (
            Task(kernels.value, ("value",), (3, 3)),
            Task(kernels.pdf, ("scalar",), (3, 3)),
            Task(kernels.sample, ("vector", "value", "scalar", "scalar"), (3, 2)),
            Task(kernels.value, ("value",), (3, 3), (leaves, ())),
        ):
            with contextlib.suppress(TraceError):
                trace = traced(task, m, 3 if any(getattr(v, "ndim", 0) for v in tree.leaves(m)) else None)
                graph, ends = fewer_choices(trace.graph, [n for nodes in trace.results for n in nodes])
                start = time.process_time()
                new, ends = fewer_operations(graph, ends, "float32", ())
                spent += time.process_time() - start
                digest.update(new.digest(ends).encode())
    return {"operations": spent, "digest": digest.hexdigest()[:16]}


def report() -> dict[str, Any]:
    """The stages of compiling in a report."""
    from gonio.cli.commands import cli
    from gonio.compile.llvm import codegen, machine
    from gonio.evaluate import tracing
    from gonio.trace import passes

    spent: dict[str, float] = defaultdict(float)
    under: list[str] = []

    def timed(module: Any, name: str, stage: str) -> None:
        inner = getattr(module, name)

        def outer(*args: Any, **named: Any) -> Any:
            start = time.thread_time()
            under.append(stage)
            try:
                return inner(*args, **named)
            finally:
                under.pop()
                seconds = time.thread_time() - start
                spent[stage] += seconds
                if under:  # a stage within another is counted once
                    spent[under[-1]] -= seconds

        setattr(module, name, outer)

    for name in ("_trace", "_jacobian", "_squares"):
        timed(tracing, name, "trace")
    timed(passes, "fewer_choices", "choices")
    timed(passes, "fewer_operations", "fractions")
    timed(codegen, "generate", "text")
    timed(machine, "to_object", "LLVM")
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        words = ["report", "gold-metallic-paint", "-o", os.path.join(folder, "a.html")]
        with contextlib.suppress(SystemExit):
            cli.main(words, standalone_mode=False)
    return {f"report: {stage}": seconds for stage, seconds in spent.items()} | {"report": sum(spent.values())}


PARTS = {part.__name__: part for part in (first_f, operations, report)}


def run(checkout: Path, part: str) -> dict[str, Any]:
    """What a part says in a new process, of the package in a checkout."""
    settings = {"PYTHONPATH": str(checkout / "src"), "GONIO_CACHE": "off", "GONIO_THREADS": "1"}
    command = [sys.executable, __file__, "--part", part]
    return json.loads(subprocess.run(command, env=os.environ | settings, check=True, capture_output=True).stdout)


def main() -> None:
    other, rounds = Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    least: dict[str, list[Any]] = {}
    for _ in range(rounds):
        for part in PARTS:
            both = [run(checkout, part) for checkout in (other, HERE)]
            for name in dict.fromkeys([*both[0], *both[1]]):
                new = [found.get(name, 0.0) for found in both]
                old = least.get(name, new)
                least[name] = new if isinstance(new[0], str) else [min(a, b) for a, b in zip(old, new, strict=True)]
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        lines = dict(line.split("\t: ", 1) for line in file.read().split("\n\n")[0].splitlines() if "\t: " in line)
    facts = {name.strip(): value for name, value in lines.items()}
    processor = f"{facts.get('model name', platform.processor())}, family {facts.get('cpu family')}"
    print(f"{processor}, model {facts.get('model')}; load {os.getloadavg()[0]:.1f}; least of {rounds}")
    for name, (a, b) in least.items():
        numbers = f"{a:>20} {b:>20}" if isinstance(a, str) else f"{1e3 * a:17.1f} ms {1e3 * b:17.1f} ms"
        print(f"{name:<20} {numbers}" + ("" if isinstance(a, str) or not a else f" {b / a:8.2f}"))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--part"]:
        print(json.dumps(PARTS[sys.argv[2]]()))
    else:
        main()
