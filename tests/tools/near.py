"""Two options of pytest's: the tests near to a change, and a slice of all tests.

    --near         the tests of the rooms that were changed since the branch left main (or the branch that it follows),
                   and of the rooms above these; what is not committed counts too. On main: what is not committed
    --near=COMMIT  the same, since COMMIT
    --slice=K/N    one in N of all tests, by their names: a test stays in its slice, whatever is added
    both           what is near, and the slice of the rest. What is marked `full` takes as long again: where more than
                   0.4 of the files of tests are near, it is run whole only of the changed rooms themselves, and where
                   these have more than 0.4, of none

Near to a room are the tests in its folder, those files of `tests/attacks` and `tests/sweeps` that name something of it
or of a room above, and `tests/house`. A module beside the rooms is near to whatever imports it; the doors that users
enter by (`gonio/__init__.py`, `testing.py`) only to `tests/house`. Changed tests are near, and so are those that name a
changed module of `tests/tools`, all of them if none does. `conftest.py` and `pyproject.toml` are near to all tests;
pages, examples and whatever else is not the package, to `tests/house` and the test of the page about security.
"""

from __future__ import annotations

import re
import subprocess
import zlib
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TO_ALL = {"pyproject.toml", "tests/conftest.py"}
ACROSS = ("tests/attacks", "tests/sweeps")
"""Folders of tests that go across the rooms."""
TO_TEXTS = ("tests/house/", "tests/attacks/test_page.py")
FEW = 0.4
"""The largest part of the files of tests of which `full` is run whole beside a slice."""


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def branched() -> str:
    """The commit at which HEAD left the branch that it follows, or main."""
    for branch in ("@{upstream}", "main", "origin/main"):
        try:
            return _git("merge-base", "HEAD", branch).strip()
        except subprocess.CalledProcessError:
            continue
    return "HEAD"


def changed(commit: str) -> list[str]:
    """Files in which the working tree differs from a commit; those that git does not know, too."""
    try:
        names = _git("diff", "--name-only", "--no-renames", "-z", commit, "--")
    except subprocess.CalledProcessError as error:
        raise pytest.UsageError(f"--near={commit}: expected a commit that is here; {error.stderr.strip()}") from None
    return [name for name in (names + _git("ls-files", "--others", "--exclude-standard", "-z")).split("\0") if name]


def using(tool: str) -> set[str]:
    """Files of tests that import or run a module of tests/tools, directly or by others of it."""
    files = {path: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")}
    found: set[Path] = set()
    names = {tool}
    while names:
        module = rf"(?:{'|'.join(names)})"
        line = re.compile(rf"^\s*(?:from|import) (?:tests\.tools\.)?{module}\b|[\"']{module}\.py[\"']", re.MULTILINE)
        new = {path for path, text in files.items() if path not in found and line.search(text)}
        found |= new
        names = {path.stem for path in new if not path.stem.startswith("test_")} - {"conftest"}
    return {path.relative_to(ROOT).as_posix() for path in found if path.stem.startswith("test_")}


def near(names: Iterable[str], up: bool = True) -> tuple[str, ...]:
    """Of files of the repository that were changed: beginnings of the paths of all tests that are near.

    `up`: with those of the rooms above.
    """
    from rooms import DOORS, above, used, users

    parts: set[str] = set()
    paths: set[str] = set()
    for name in names:
        place = Path(name)
        if name in TO_ALL:
            return ("tests/",)
        if name.startswith("src/gonio/") and len(place.parts) > 3:
            parts.add(place.parts[2])
        elif name.startswith("src/gonio/") and place.suffix == ".py" and place.name != "__init__.py":
            parts |= {place.stem} - DOORS
        elif name.startswith("explorer/"):
            parts.add("explorer")
        elif name.startswith("tests/tools/"):
            paths |= using(place.stem) or {"tests/"}
        elif name.startswith("tests/"):
            paths.add(name if place.stem.startswith("test_") else f"tests/{place.parts[1]}/")
        if up and not name.startswith("tests/"):
            paths.update(["tests/house/"] if name.startswith("src/") else TO_TEXTS)
    if up:
        parts = above(parts, users())
        files = (file for folder in ACROSS for file in (ROOT / folder).glob("test_*.py"))
        naming = [file for file in files if used(file.read_text(encoding="utf-8")) & parts]
        paths |= {file.relative_to(ROOT).as_posix() for file in naming}
    return tuple(sorted(paths | {f"tests/{part}/" for part in parts}))


def sliced(word: str) -> tuple[int, int]:
    """The two numbers of --slice."""
    found = re.fullmatch(r"(\d+)/(\d+)", word)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise pytest.UsageError(f"--slice={word}: expected K/N with K from 1 to N, as in --slice=3/8")
    return int(found[1]), int(found[2])


def listed(paths: Iterable[str]) -> str:
    """Paths, for the header."""
    return ", ".join(path.removeprefix("tests/") or "everything" for path in paths) or "nothing"


class Selection:
    """What the two options leave of the tests."""

    def __init__(self, commit: str | None, piece: str | None):
        """`commit`: of --near; "" for the one at which the branch began."""
        self.since = None if commit is None else commit or branched()
        self.number, self.count = sliced(piece) if piece else (0, 0)
        self.changed = [] if self.since is None else changed(self.since)
        self.near = near(self.changed)
        files = [path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py")]
        choices = (self.near, near(self.changed, up=False), ())
        self.whole = next(c for c in choices if sum(file.startswith(c) for file in files) <= FEW * len(files))
        """Where `full` is whole beside a slice."""

    def has(self, item: pytest.Item) -> bool:
        """Whether a test is selected."""
        if self.count and zlib.crc32(item.nodeid.encode()) % self.count == self.number - 1:
            return True
        return item.nodeid.startswith(self.whole if self.count and item.get_closest_marker("full") else self.near)

    def pytest_report_header(self) -> list[str]:
        lines = []
        if self.since is not None:
            lines.append(f"near, {len(self.changed)} files changed since {self.since:.12}: {listed(self.near)}")
        if self.count:
            lines.append(f"slice {self.number} of {self.count}; what is marked `full` whole: {listed(self.whole)}")
        return lines

    def pytest_ignore_collect(self, collection_path: Path) -> bool | None:
        """Files without a selected test are not even read."""
        is_test = collection_path.name.startswith("test_") and collection_path.suffix == ".py"
        if self.count or not is_test or not collection_path.is_relative_to(ROOT):
            return None
        return None if collection_path.relative_to(ROOT).as_posix().startswith(self.near) else True

    @pytest.hookimpl(trylast=True)  # after conftest.py has marked what is `full`
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        left = [item for item in items if not self.has(item)]
        items[:] = [item for item in items if self.has(item)]
        config.hook.pytest_deselected(items=left)


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("selection by what was changed")
    group.addoption(
        "--near", nargs="?", const="", metavar="COMMIT", help="the tests near to what was changed since COMMIT"
    )
    group.addoption("--slice", metavar="K/N", help="one part of N of all tests, by their names")


def pytest_configure(config: pytest.Config) -> None:
    commit, piece = config.getoption("--near"), config.getoption("--slice")
    if commit is not None or piece:
        config.pluginmanager.register(Selection(commit, piece), "selection")
