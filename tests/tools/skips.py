"""Why tests were skipped: a plugin that prints a line for each library that is missing, and for each other reason."""

from __future__ import annotations

import re
from collections import Counter

import pytest

MISSING = re.compile(r"could not import '(\w+)")


def reason(said: str) -> str:
    """A reason without what differs from test to test."""
    missing = MISSING.search(said)
    return f"{missing[1]} is not installed" if missing else said.removeprefix("Skipped: ")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    tests: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for report in terminalreporter.stats.get("skipped", []):
        why = reason(report.longrepr[-1] if isinstance(report.longrepr, (tuple, list)) else str(report.longrepr))
        (files if isinstance(report, pytest.CollectReport) else tests)[why] += 1
    if not tests and not files:
        return
    terminalreporter.section("skipped")
    for why in sorted(tests.keys() | files.keys(), key=lambda why: (-tests[why], why)):
        counts = [f"{n:,} {what}{'s' * (n > 1)}" for n, what in ((tests[why], "test"), (files[why], "file")) if n]
        terminalreporter.line(f"{why}: {' and '.join(counts)}")
