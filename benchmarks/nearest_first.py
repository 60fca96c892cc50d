"""Pytest, tests that name a word first: `python benchmarks/nearest_first.py FILE WORDS [ARGUMENTS OF PYTEST]`.

WORDS are separated by commas. A test's later cases come after the first of others, those that must import a large
library last. FILE gets the first test that failed, or the file that could not be collected.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections import Counter
from pathlib import Path

import pytest

LARGE = re.compile("torch|jax|drjit|mitsuba|browser", re.IGNORECASE)


class NearestFirst:
    """The order, and who failed first."""

    def __init__(self, said: Path, words: list[str]) -> None:
        self.said = said
        self.named = re.compile("|".join(rf"\b{re.escape(word)}\b" for word in words))

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        cases, ranks, texts = Counter[str](), {}, dict[object, bool]()
        for item in items:
            test = item.nodeid.partition("[")[0]
            function = getattr(item, "function", None)
            if function not in texts:
                texts[function] = inspect.isfunction(function) and bool(self.named.search(inspect.getsource(function)))
            cases[test] += 1
            rank = 0 if self.named.search(item.nodeid.partition("::")[2]) else 1 if texts[function] else 2
            late = 4 if LARGE.search(item.nodeid) else min(3, cases[test] - 1)
            ranks[item] = rank + late, rank, cases[test]
        items.sort(key=lambda item: ranks[item])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.said.exists():
            self.said.write_text(report.nodeid, encoding="utf-8")

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed and not self.said.exists():
            self.said.write_text(report.nodeid, encoding="utf-8")


if __name__ == "__main__":
    sys.path.pop(0)  # this folder's modules are not the tests'
    sys.exit(pytest.main(sys.argv[3:], [NearestFirst(Path(sys.argv[1]), sys.argv[2].split(","))]))
