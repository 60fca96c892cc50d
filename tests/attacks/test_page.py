"""docs/security.md answers every attack, and every answer is a test."""

from __future__ import annotations

import re
from pathlib import Path

from places import ROOT

HERE = Path(__file__).resolve().parent
NUMBERS = {f"D{k}" for k in range(1, 29)}


def test_every_attack_is_answered_on_the_page_and_in_a_test():
    """The numbers of the page are those that docstrings of tests end with."""
    page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    tests = "".join(path.read_text(encoding="utf-8") for path in HERE.glob("test_*.py"))
    ends = " ".join(re.findall(r"\((D[0-9, D]+)\)\"\"\"", tests))
    assert set(re.findall(r"\bD\d+\b", page)) == NUMBERS
    missing = NUMBERS - set(re.findall(r"\bD\d+\b", ends))
    assert not missing
