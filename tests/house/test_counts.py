"""What calls cost, counted: gonio is as fast as counts.txt says, on any machine and at any load."""

from __future__ import annotations

import os
from collections.abc import Iterator

import counting
import pytest
from counting import Counter
from libraries import thinned

from gonio.evaluate import planning

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="tasks are counted in forks, which this system has not"),
    pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here"),
]
TABLE, MODULES = counting.table()
REMEDY = (
    "tests/house/counts.txt says {expected}. Is a call slower, or a kernel made twice, for no reason? If the change is"
    " meant, `python3 dev.py counts` writes the table anew; say in the commit what it costs"
)


@pytest.fixture(scope="module")
def counter() -> Iterator[Counter]:
    with Counter() as counter:
        yield counter


def test_the_table_has_all_tasks():
    assert [*TABLE] == counting.lines(), "python3 dev.py counts writes the table anew"


LONG = "report of a formula, as numbers"
"""A third of the time of all tasks; the kernels of a report are counted in tests/report, too."""


@pytest.mark.parametrize("line", thinned(counting.lines(), [x for x in counting.lines() if not x.startswith(LONG)]))
def test_a_call_takes_what_the_table_says(counter, line):
    found, expected = counter[line], TABLE[line]
    differing = [
        f"{found_of} {name} instead of {expected_of}"
        for name, found_of, expected_of in zip(found._fields, found, expected, strict=True)
        if found_of != expected_of and (name != "calls" or counting.is_exact(line))
    ]
    if not counting.is_exact(line) and found.calls > counting.SLACK * expected.calls:
        differing.append(f"{found.calls} calls instead of {expected.calls}, of which 5 % more are allowed")
    assert not differing, f"{line}: {'; '.join(differing)}. " + REMEDY.format(expected=expected)


def test_import_loads_as_many_modules_as_the_table_says(counter):
    most = counting.SLACK * MODULES
    assert counter.modules <= most, f"import gonio: {counter.modules} modules. " + REMEDY.format(expected=MODULES)


def test_thousand_directions_are_no_more_calls_than_one():
    one, many = (TABLE[f"f of {what}, warm"].calls for what in ("one direction", "1000 directions"))
    assert many == one <= 15
