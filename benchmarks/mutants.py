"""Faults that the tests must see: `python benchmarks/mutants.py COMMIT...`, results in benchmarks/mutants.txt.

The source of the first commit is broken in 60 places, one at a time; a seed chooses them, of all rooms and kinds
(benchmarks/faults.py); another --seed chooses others, whose results have a file of their own. Each commit has the same
line broken in a worktree of its own, made in the folder --trees (where this checkout is), and its tests run until one
fails: first the one that saw the fault in another commit, then the files that name most of what is broken, the other
tests of the room, those of the rooms above it, and with --whole all. A fault is open where --cpu seconds do not
suffice; more of them go on where the last run stopped.

Everything found is in the results at once, and is not asked for again. `--only 7 12` tries these, `--list` shows all,
`--check` runs the tests that saw a fault on what is whole, and forgets those that fail there, too.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from faults import SEED, Fault, chosen, room

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
MEMORY = 12 << 30
"""Bytes that a process of tests may take: a broken bound must not take the machine."""

EQUIVALENT = {
    31: {
        "src/gonio/catalogue/typed.py:99": "one format alone has a function for folders, and of one thing any is all",
        "src/gonio/compile/plans.py:284": "the address, which is what is looked at, is the same for another dtype",
        "src/gonio/conversion/comparison.py:227": "names of channels of a table that is integrated and thrown away",
        "src/gonio/laws/_probes.py:85": "the same directions, of which the maximum is taken, or one by its cosine",
    },
    2: {
        "src/gonio/base/kernels.py:113": "NaN where either direction has one, in any order",
        "src/gonio/distributions/student_t.py:61": "what keeps 0 from being divided by",
        "src/gonio/laws/_probes.py:85": "the same directions, of which the maximum is taken, or one by its cosine",
        "src/gonio/lights/_panorama.py:186": "means of a row to 1e-7, of pixels that have no more digits",
        "src/gonio/models/walthall.py:53": "an estimate by which a sum shares its samples",
        "src/gonio/radiometry/solid_angles.py:214": "where an edge is level, nothing is cut, and the share is not used",
        "src/gonio/rays/walk.py:63": "nothing times a number",
        "src/gonio/fitting/maps/lit_images.py:210": "what is near is so at 1 m, too; what is far is at infinity",
    },
}
"""By seed: faults of 5209b87 that no test can see, and why."""


class Verdict(NamedTuple):
    """What the tests of a commit said of a fault: `word` is killed, open, survived or gone."""

    word: str
    seconds: int
    test: str


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commits", nargs="+", metavar="COMMIT")
    parser.add_argument("--trees", type=Path, default=ROOT.parent, metavar="FOLDER")
    parser.add_argument("--cpu", type=int, default=180, metavar="SECONDS")
    parser.add_argument("--minutes", type=float, default=240.0)
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER")
    parser.add_argument("--seed", type=int, default=SEED)
    for option in ("--whole", "--list", "--check"):
        parser.add_argument(option, action="store_true")
    asked = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # what is broken is mended first
    trees = {tree.name.rpartition("-")[2]: tree for tree in (worktree(name, asked.trees) for name in asked.commits)}
    faults = dict(enumerate(chosen(next(iter(trees.values())), asked.seed), 1))
    same = EQUIVALENT.get(asked.seed, {})
    file = HERE / ("mutants.txt" if asked.seed == SEED else f"mutants_seed_{asked.seed}.txt")
    if asked.list:
        print(*(f"{number:2} {fault}" for number, fault in faults.items()), sep="\n")
        return
    end, known = time.monotonic() + 60.0 * asked.minutes, results(file, faults)
    if asked.check:
        for commit, tree in trees.items():
            check(commit, tree, known)
        write(file, faults, known, same)
        return
    for number in asked.only or faults:
        for commit, tree in trees.items():
            before = known.get((number, commit), Verdict("open", 0, "0"))
            done = (
                before.seconds >= asked.cpu if before.word == "open" else before.word != "survived" or not asked.whole
            )
            if done or faults[number].place in same or time.monotonic() > end:
                continue
            seen = [v.test for (n, _), v in known.items() if n == number and v.test.startswith("tests")]
            found = verdict(faults[number], tree, seen, before, asked.cpu, asked.whole)
            known |= results(file, faults) | {(number, commit): found}  # another process may have found others
            write(file, faults, known, same)
            print(f"{number:2} {commit} {found.word:8} {found.seconds:4} s  {found.test}  {faults[number]}", flush=True)


def worktree(commit: str, folder: Path) -> Path:
    """The text of a commit, in a folder of its own, whole."""
    name = _git(ROOT, "rev-parse", "--short=7", commit)
    tree = folder / f"{ROOT.name}-{name}"
    if not tree.exists():
        _git(ROOT, "worktree", "add", "--detach", str(tree), name)
    _git(tree, "checkout", "--quiet", "--", "src")
    return tree


def _git(tree: Path, *words: str) -> str:
    return subprocess.run(["git", "-C", str(tree), *words], check=True, capture_output=True, text=True).stdout.strip()


def verdict(fault: Fault, tree: Path, seen: list[str], before: Verdict, limit: int, whole: bool) -> Verdict:
    """Break a line, run tests in turn, mend it."""
    file = tree / fault.path
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    broken = put(fault, text)
    if not broken:
        return Verdict("gone", 0, "it is written in another way")
    spent, times = float(before.seconds if before.word == "open" else 0), file.stat()
    turns = enumerate(turns_of(fault, tree, seen, whole))
    first = int(before.test) if before.word == "open" else 5
    try:
        file.write_text(broken, encoding="utf-8")
        _forget(file)
        for turn, tests in turns:
            if tests and (turn >= first or not turn):
                code, test, took = run(tree, fault, tests, 7200.0 if turn == 5 else max(5.0, limit - spent))
                spent += took
                if code not in (0, 5) and (turn or code == 1):  # 5: no tests; 4 at first: that test is gone
                    stopped = code in (-signal.SIGXCPU, -signal.SIGKILL)
                    return Verdict("open" if stopped else "killed", round(spent), str(turn) if stopped else test)
    finally:
        file.write_text(text, encoding="utf-8")
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
        _forget(file)
    return Verdict("survived", round(spent), "whole" if whole else "rooms")


def _forget(file: Path) -> None:
    """Compiled files, which Python takes for new where time and size are the same."""
    for old in (file.parent / "__pycache__").glob(f"{file.stem}.*"):
        old.unlink()


def put(fault: Fault, text: str) -> str:
    """A file's text, broken where the same lines stand in a function of that name, nearest to the line; else ""."""
    lines, size = text.split("\n"), fault.old.count("\n") + 1
    name = fault.function.rpartition(".")[2]
    bodies = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef) and n.name == name]
    inside = {k for body in bodies for k in range(body.lineno - 1, body.end_lineno or 0)}
    same = [k for k in inside if "\n".join(lines[k : k + size]) == fault.old]
    if not same:
        return ""
    at = min(same, key=lambda k: abs(k + 1 - fault.line))
    return "\n".join([*lines[:at], fault.new, *lines[at + size :]])


def turns_of(fault: Fault, tree: Path, seen: list[str], whole: bool) -> Iterator[list[str]]:
    """Tests to run, the nearest first."""
    yield list(dict.fromkeys(test.partition("[")[0] for test in seen if _is_there(tree, test)))  # cases change
    home = room(fault.path)
    owned = {path: path.read_text(encoding="utf-8") for path in sorted((tree / "tests").glob("*/**/test_*.py"))}
    own, above = [home] if home else ["house", "attacks"], rooms_above(home, tree)
    named = {path: _mentions(fault, text) for path, text in owned.items()}
    folder = {path: path.relative_to(tree / "tests").parts[0] for path in owned}
    files = [path for path in owned if folder[path] in (*own, *above)]
    files.sort(key=lambda path: (bool(home) and folder[path] != home, -named[path]))
    nearest = [path for path in files if named[path] and (folder[path] == home or not home)][:3]
    near = [path for path in files if path not in nearest and folder[path] in own]
    others = [path for path in files if path not in (*nearest, *near)]
    examples = tree / "tests" / "house" / "test_examples.py"
    for paths in (nearest, near, [*(path for path in others if named[path]), examples], others, owned if whole else ()):
        yield [path.relative_to(tree).as_posix() for path in dict.fromkeys(paths)]


def _is_there(tree: Path, test: str) -> bool:
    path, _, name = test.partition("[")[0].partition("::")
    return (tree / path).exists() and (not name or f"def {name}(" in (tree / path).read_text(encoding="utf-8"))


def _mentions(fault: Fault, text: str) -> int:
    """How often a test's text names what is broken; its module, where it is imported, counts most."""
    *names, module = fault.words
    imports = len(re.findall(rf"\.{module}\b|import .*\b{module}\b", text))
    return 5 * imports + sum(min(3, len(re.findall(rf"\b{name}\b", text))) for name in names)


@cache
def _imports(tree: Path) -> dict[str, set[str]]:
    """Rooms -> the rooms that they import; "" is the ground, and no way up: its doors import from anywhere."""
    package = tree / "src" / "gonio"
    found: dict[str, set[str]] = {path.name: set() for path in package.iterdir() if path.is_dir()}
    for file in package.glob("*/**/*.py"):
        inside = file.parent.relative_to(package).parts
        for dots, module, names in re.findall(r"from (\.+)([\w.]*) import (.*)", file.read_text(encoding="utf-8")):
            base = [*inside[: len(inside) + 1 - len(dots)], *filter(None, module.split("."))]
            found[inside[0]].update(base[:1] or re.findall(r"\w+", names))
    return {name: {other if other in found else "" for other in others} for name, others in found.items()}


def rooms_above(home: str, tree: Path) -> list[str]:
    """Rooms that import a room, or import one that does."""
    above, uses = {home}, _imports(tree)
    while more := {name for name in uses if uses[name] & above} - above:
        above |= more
    return sorted(above, key=lambda name: len(uses.get(name, ())))


def run(tree: Path, fault: Fault, tests: list[str], limit: float) -> tuple[int, str, float]:
    """Code of pytest, the first test that failed, and seconds of processors."""
    environment = os.environ | {"PYTHONPATH": str(tree / "src"), "PYTHONDONTWRITEBYTECODE": ""}

    def limits() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))

    with TemporaryDirectory() as folder:
        if room(fault.path) in ("compile", "trace"):  # what a broken compiler made is no one else's
            environment["XDG_CACHE_HOME"] = folder
        said = Path(folder) / "failed"
        command = [sys.executable, str(HERE / "nearest_first.py"), str(said), ",".join(fault.words)]
        command += ["-n", "0", "-x", "-q", "-p", "no:cacheprovider", "--tb=line", *tests]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.Popen(
            command,
            cwd=tree,
            env=environment,
            preexec_fn=limits,
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            code = done.wait(10.0 * limit + 60.0)
        except subprocess.TimeoutExpired:
            code = -signal.SIGKILL
        finally:
            if done.poll() is None:
                os.killpg(done.pid, signal.SIGKILL)
                done.wait()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        test = said.read_text(encoding="utf-8") if said.exists() else f"pytest ended with {code}"
    return code, test, sum(b - a for a, b in zip(before[:2], after[:2], strict=True))


def check(commit: str, tree: Path, known: dict[tuple[int, str], Verdict]) -> None:
    """Forget verdicts by tests that fail on what is whole."""
    killed = {key: v.test for key, v in known.items() if key[1] == commit and v.word == "killed" and "::" in v.test}
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-p", "no:cacheprovider", "-rfE", *set(killed.values())]
    environment = os.environ | {"PYTHONPATH": str(tree / "src")}
    said = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True).stdout
    for key, test in killed.items():
        if re.search(rf"^(FAILED|ERROR) {re.escape(test)}( |$)", said, re.MULTILINE):
            print(f"{commit}: {test} fails on what is whole")
            del known[key]


def results(file: Path, faults: dict[int, Fault]) -> dict[tuple[int, str], Verdict]:
    """Number and commit -> verdict: those in the file that are of these faults."""
    found = {}
    for block in file.read_text(encoding="utf-8").split("\n\n")[1:] if file.exists() else ():
        title, *rows = block.splitlines()
        number = int(title[:2])
        if number in faults and title[3:] == str(faults[number]):
            for commit, word, s, test in re.findall(
                r"^ +([0-9a-f]{7}) (\w+) +(\d+) s  (.*)$", "\n".join(rows), re.MULTILINE
            ):
                found[number, commit] = Verdict(word, int(s), test)
    return found


def write(
    file: Path, faults: dict[int, Fault], known: dict[tuple[int, str], Verdict], equivalent: dict[str, str]
) -> None:
    head = [f"Python {sys.version.split()[0]}; seconds of processors"]
    same = [number for number, fault in faults.items() if fault.place in equivalent]
    for commit in dict.fromkeys(commit for _, commit in known):
        words = [v.word for (n, c), v in known.items() if c == commit and n not in same]
        counts = ", ".join(f"{words.count(word)} {word}" for word in ("killed", "survived", "open", "gone"))
        head.append(f"{commit}: of {len(faults) - len(same)}, {len(same)} equivalent ones aside: {counts}")
    rows = []
    for number, fault in faults.items():
        rows += ["", f"{number:2} {fault}"]
        rows += [f"   equivalent: {equivalent[fault.place]}"] if number in same else []
        rows += [f"   {c} {v.word:8} {v.seconds:4} s  {v.test}" for (n, c), v in known.items() if n == number]
    file.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
