"""Which tests have passed: kept in pytest's cache, so that a run with more libraries may leave them out.

--not-passed=FILE   without the tests that passed in another run of the same commit, of which FILE is
                    .pytest_cache/v/gonio/passed. Those of arrays, attacks and the house are run all the same: they
                    take whatever library there is
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

AGAIN = ("tests/arrays/", "tests/attacks/", "tests/house/")


class Passed:
    """Notes what passes; of several processes, the one that hears of all."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call" and report.passed:
            self.names.append(report.nodeid)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        session.config.cache.set("gonio/passed", sorted(self.names))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.getgroup("selection by what was changed").addoption(
        "--not-passed", metavar="FILE", type=Path, help="without what passed in a run whose cache has this file"
    )


def pytest_configure(config: pytest.Config) -> None:
    file = config.getoption("--not-passed")
    if file and not file.is_file():
        raise pytest.UsageError(f"--not-passed={file}: no such file; expected .pytest_cache/v/gonio/passed of a run")
    if not hasattr(config, "workerinput") and hasattr(config, "cache"):
        config.pluginmanager.register(Passed(), "passed-tests")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    file = config.getoption("--not-passed")
    if file:
        known = {name for name in json.loads(file.read_text(encoding="utf-8")) if not name.startswith(AGAIN)}
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid in known])
        items[:] = [item for item in items if item.nodeid not in known]
