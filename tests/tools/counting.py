"""What calls cost, counted and not timed: calls of gonio's functions, traces, kernels, operations of their graphs.

    python3 tests/tools/counting.py       counts, writes tests/house/counts.txt, and prints what has changed in it

Each task runs in a process of its own, forked from one that has done nothing but import gonio: no count depends on
another task, nor on what a caller did before. It is called three times; the first and the third call are counted.
There is one thread, nothing is kept on disk, and code is compiled at the least cost.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

TABLE = Path(__file__).resolve().parents[1] / "house" / "counts.txt"
SETTINGS = {
    "GONIO_CACHE": "off",
    "GONIO_OPTIMIZE": "off",
    "GONIO_THREADS": "1",
    "GONIO_KEEP": "1024",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
}
UNSET = ("GONIO_ENGINE", "GONIO_LANES", "GONIO_PASSES", "GONIO_CACHE_DIR")

SLACK = 1.05
"""What is no short way of a call may take so many times the calls that were seen."""

HEAD = """\
What calls cost, counted: the first call in a process, and one that is warm. `python3 dev.py counts` writes this file.

calls       of functions in gonio's own files, without comprehensions and lambdas, without those that write machine
            code, as the processor wants it, and without what these call; after "<" what was seen, of which 5 % more
            are allowed
traces      formulas run on symbols
kernels     compiled
operations  of the graphs that were made shorter, to be compiled or written as source

"""


class Counts(NamedTuple):
    """What one call takes."""

    calls: int
    traces: int
    kernels: int
    operations: int


WHICH = ("first", "warm")


# The tasks: each prepares what a call needs, and returns the call.

Call = Callable[[], Any]
TASKS: dict[str, tuple[Callable[[], Call], bool]] = {}


def task(name: str, exact: bool = False) -> Callable[[Callable[[], Call]], Callable[[], Call]]:
    def kept(prepare: Callable[[], Call]) -> Callable[[], Call]:
        TASKS[name] = prepare, exact
        return prepare

    return kept


def metal() -> Any:
    import gonio as gn

    return gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.9))


def directions(count: int, seed: int = 1) -> Any:
    """Directions (count, 3) above the horizon."""
    import numpy as np

    import gonio as gn

    u = np.random.default_rng(seed).random((count, 2))
    return gn.direction(np.arccos(np.sqrt(u[:, 0])), 2.0 * np.pi * u[:, 1])


@task("f of one direction", exact=True)
def _f_of_one() -> Call:
    m, w = metal(), directions(1)[0]
    return lambda: m.f(w, w)


@task("f of 1000 directions", exact=True)
def _f_of_many() -> Call:
    m, w = metal(), directions(1000)
    return lambda: m.f(w, w)


@task("pdf", exact=True)
def _pdf() -> Call:
    m, w = metal(), directions(1)[0]
    return lambda: m.pdf(w, w)


@task("sample", exact=True)
def _sample() -> Call:
    import numpy as np

    m, w, u = metal(), directions(1)[0], np.array([0.3, 0.6])
    return lambda: m.sample(w, u)


@task("mueller", exact=True)
def _mueller() -> Call:
    m, w = metal(), directions(1)[0]
    return lambda: m.mueller(w, w)


@task("replace and f", exact=True)
def _replace() -> Call:
    m, w, alphas = metal(), directions(1)[0], iter([0.3, 0.4, 0.5])
    return lambda: m.replace({"distribution.alpha_x": next(alphas)}).f(w, w)


@task("jacobian", exact=True)
def _jacobian() -> Call:
    m, w = metal(), directions(1)[0]
    return lambda: m.jacobian(w, w)


@task("albedo of one direction")
def _albedo_of_one() -> Call:
    import gonio as gn

    m, w = metal(), directions(1)[0]
    return lambda: gn.albedo(m, w)


@task("albedo of 100 directions")
def _albedo_of_many() -> Call:
    import gonio as gn

    m, w = metal(), directions(100)
    return lambda: gn.albedo(m, w)


@task("reflected_radiance, two lights")
def _reflected_radiance() -> Call:
    import gonio as gn

    m, w = metal(), directions(1)[0]
    lights = [gn.DistantLight([0.0, 0.6, 0.8]), gn.ConstantLight(1.0)]
    return lambda: gn.reflected_radiance(m, lights, w)


@task("render, 16 x 16")
def _render() -> Call:
    import gonio as gn

    m, lights = metal(), [gn.DistantLight([0.0, 0.6, 0.8]), gn.ConstantLight(1.0)]
    return lambda: gn.render(m, lights, size=16, samples=4)


@task("fit of 1000 values")
def _fit() -> Call:
    import gonio as gn

    wi, wo = directions(1000, 1), directions(1000, 2)
    data, model = (wi, wo, gn.Lambertian(0.3).f(wi, wo)), gn.Lambertian(0.5)
    return lambda: gn.fit(data, model)


@task("load of a CSV file")
def _load_csv() -> Call:
    from text_files import CSV

    return _load(".csv", CSV.encode())


@task("load of an RGL file")
def _load_rgl() -> Call:
    from rgl_files import synthetic

    from gonio.formats._reading import tensor_file

    path = Path(tempfile.mkdtemp()) / "file.bsdf"
    tensor_file.write(path, synthetic())
    return _load(".bsdf", path.read_bytes())


def _load(suffix: str, content: bytes) -> Call:
    import gonio as gn

    path = Path(tempfile.mkdtemp()) / f"file{suffix}"
    path.write_bytes(content)
    return lambda: gn.load(path)


@task("source")
def _source() -> Call:
    from gonio.bridges.source import shader_source

    m = metal()
    return lambda: shader_source(m, "glsl")


@task("report of a formula, as numbers")
def _report() -> Call:
    import gonio as gn

    path, m = Path(tempfile.mkdtemp()) / "report.json", gn.Lambertian(0.5)
    return lambda: gn.write_report(m, path, fits=False)


# Counting.


def counted(call: Call) -> Counts:
    """What a call takes."""
    import gonio as gn
    from gonio.compile import elf
    from gonio.compile.llvm import machine
    from gonio.evaluate import tracing
    from gonio.trace import passes

    folder, writers = (
        str(Path(gn.__file__).parent) + os.sep,
        (str(Path(machine.__file__).parent) + os.sep, elf.__file__),
    )
    own: dict[Any, bool] = {}
    trace, compiled, shorter = tracing._trace.__code__, machine.to_object.__code__, passes.rewritten.__code__
    calls = traces = kernels = operations = 0

    def seen(frame: Any, event: str, value: Any) -> None:
        nonlocal calls, traces, kernels, operations
        code = frame.f_code
        if event == "call":
            is_own = own.get(code)
            if is_own is None:
                file, name = code.co_filename, code.co_name
                is_own = own[code] = file.startswith(folder) and not file.startswith(writers) and name[0] != "<"
            calls += is_own and not frame.f_back.f_code.co_filename.startswith(writers)
            traces += code is trace
            kernels += code is compiled
        elif event == "return" and code is shorter and value is not None:
            graph, ends = value
            operations += len(graph.reachable(ends))

    gc.collect()
    gc.disable()
    sys.setprofile(seen)
    try:
        call()
    finally:
        sys.setprofile(None)
        gc.enable()
    return Counts(calls, traces, kernels, operations)


def apart(work: Callable[[], Any]) -> Any:
    """What `work` returns in a fork of this process."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.write(write, json.dumps(work()).encode())
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        answer = pipe.read()
    _, status = os.waitpid(child, 0)
    if status:
        raise RuntimeError("a task failed: see above")
    return json.loads(answer)


def counted_task(prepare: Callable[[], Call]) -> list[Counts]:
    """What the first call takes, and the third."""
    call = prepare()
    first = counted(call)
    call()
    return [first, counted(call)]


def serve() -> None:
    """For each name of a task on standard input print its counts as JSON; first how many modules gonio has loaded."""
    import gonio as gn

    print(sum(name.partition(".")[0] == "gonio" for name in sys.modules), flush=True)
    gn.engine.threads(1)
    for line in sys.stdin:
        prepare, _ = TASKS[line.strip()]
        print(json.dumps(apart(lambda prepare=prepare: counted_task(prepare))), flush=True)


class Counter:
    """A process that counts, and what it has counted by line of the table; `modules`: that `import gonio` loads."""

    def __init__(self) -> None:
        environment = {k: v for k, v in os.environ.items() if k not in UNSET} | SETTINGS
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._child = subprocess.Popen([sys.executable, __file__, "serve"], env=environment, **pipes)
        self._lines: dict[str, Counts] = {}
        self.modules = int(self._answer())

    def __getitem__(self, line: str) -> Counts:
        if line not in self._lines:
            name, _, _ = line.rpartition(", ")
            print(name, file=self._child.stdin, flush=True)
            for which, numbers in zip(WHICH, json.loads(self._answer()), strict=True):
                self._lines[f"{name}, {which}"] = Counts(*numbers)
        return self._lines[line]

    def __enter__(self) -> Counter:
        return self

    def __exit__(self, *_: object) -> None:
        self._child.communicate()

    def _answer(self) -> str:
        answer = self._child.stdout.readline()
        if not answer:
            raise RuntimeError("counting failed, for the reason above")
        return answer


# The table.


def lines() -> list[str]:
    """The names of the table's lines."""
    return [f"{name}, {which}" for name in TASKS for which in WHICH]


def is_exact(line: str) -> bool:
    """Whether a line says how many calls there are, or else how many about."""
    return TASKS[line.rpartition(", ")[0]][1]


def written(counter: Counter) -> str:
    """The table, counted now."""
    rows = [f"{'':<42}{'calls':>9}{'traces':>9}{'kernels':>9}{'operations':>12}"]
    for line in lines():
        calls, *others = counter[line]
        numbers = "".join(f"{x:>{n}}" for x, n in zip(others, (9, 9, 12), strict=True))
        shown = str(calls) if is_exact(line) else f"<{calls}"
        rows.append(f"{line:<42}{shown:>9}{numbers}")
    return HEAD + "\n".join(rows) + f"\n\nimport gonio, its modules{'<' + str(counter.modules):>27}\n"


def table() -> tuple[dict[str, Counts], int]:
    """The lines of the table as it was written, and the modules."""
    found, modules = {}, 0
    for row in TABLE.read_text(encoding="utf-8").removeprefix(HEAD).splitlines()[1:]:
        if row.startswith("import gonio"):
            modules = int(row.rpartition("<")[2])
        elif row:
            *words, calls, traces, kernels, operations = row.split()
            found[" ".join(words)] = Counts(int(calls.lstrip("<")), int(traces), int(kernels), int(operations))
    return found, modules


def main() -> None:
    if sys.argv[1:] == ["serve"]:
        serve()
        return
    before = TABLE.read_text(encoding="utf-8").splitlines() if TABLE.exists() else []
    with Counter() as counter:
        text = written(counter)
    TABLE.write_text(text, encoding="utf-8")
    after = text.splitlines()
    changed = [*(f"- {x}" for x in before if x not in after), *(f"+ {x}" for x in after if x not in before)]
    print("\n".join(changed) or "nothing has changed")


if __name__ == "__main__":
    main()
