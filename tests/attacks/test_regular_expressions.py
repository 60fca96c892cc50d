"""Every regular expression of gonio, found in its source, takes time that grows with the text and no faster."""

from __future__ import annotations

import ast
import contextlib
import importlib
import re
from collections import defaultdict, deque
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest
from clock import seconds
from fuzzing import Hang, bounded_time

import gonio

ROOT = Path(gonio.__file__).parent
METHODS = ("match", "search", "fullmatch", "sub", "subn", "split", "findall", "finditer")
RUNS = (
    " ",
    "\n",
    "\t",
    "1",
    ",",
    "a",
    ".",
    "-",
    "#",
    "(",
    "[",
    "<",
    '"',
    "`",
    ":",
    "=",
    "_",
    "/",
    " \n",
    "1,",
    "a ",
    "# ",
    "A_",
    "1e1.",
)
SECONDS = 0.05
USED = re.compile(rf"\bre\.[a-z]+\(|[A-Z]\.(?:{'|'.join(METHODS)})\(|\.fullmatch\(")
"""What a module with an expression in it has in its text."""


class Expression(NamedTuple):
    """A pattern, the place it stands at, and the methods by which it sees text."""

    place: str
    pattern: re.Pattern
    methods: frozenset[str]


def value(node: ast.expr | None, names: dict) -> object:
    """A constant expression; "x" in the place of what is known only where it runs."""
    if node is None:
        return 0
    try:
        return eval(compile(ast.Expression(node), "", "eval"), dict(names))
    except Exception:
        if isinstance(node, ast.JoinedStr):
            return "".join(
                str(value(part.value if isinstance(part, ast.FormattedValue) else part, names)) for part in node.values
            )
        return "x"


def expressions() -> list[Expression]:
    """All that are compiled or used in the source."""
    calls, methods = [], defaultdict(set)
    for path in sorted(ROOT.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if not USED.search(source):
            continue
        tree = ast.parse(source)
        assigned = {
            id(n.value): n.targets[0].id
            for n in ast.walk(tree)
            if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name)
        }
        for node in ast.walk(tree):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            of, method = node.func.value, node.func.attr
            if isinstance(of, ast.Name) and of.id == "re" and method in ("compile", *METHODS):
                calls.append((path, node, method, assigned.get(id(node))))
            elif method in METHODS:
                methods[of.id if isinstance(of, ast.Name) else getattr(of, "attr", "")].add(method)
    return [expression(path, node, method, methods.get(name, {"search"})) for path, node, method, name in calls]


def expression(path: Path, node: ast.Call, method: str, used: set[str]) -> Expression:
    dotted = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")
    try:
        names = vars(importlib.import_module(dotted))
    except ImportError:  # of a library that is not installed
        names = {"re": re}
    last = {
        "compile": 1,
        "match": 2,
        "search": 2,
        "fullmatch": 2,
        "findall": 2,
        "finditer": 2,
        "split": 3,
        "sub": 4,
        "subn": 4,
    }[method]
    flags = next(
        (k.value for k in node.keywords if k.arg == "flags"), node.args[last] if len(node.args) > last else None
    )
    pattern = re.compile(value(node.args[0], names), value(flags, names))
    return Expression(
        f"{path.relative_to(ROOT)}:{node.lineno}", pattern, frozenset(used if method == "compile" else {method})
    )


def longest(e: Expression, text: str) -> float:
    """Time that the slowest of the methods takes."""
    given = text.encode() if isinstance(e.pattern.pattern, bytes) else text
    taken = []
    for method in e.methods:
        of = getattr(e.pattern, method)
        if method in ("sub", "subn"):
            of = partial(of, given[:0])
        elif method == "finditer":
            of = partial(lambda found, text: deque(found(text), 0), of)
        taken.append(seconds(partial(of, given)))
    return max(taken)


@pytest.mark.parametrize("length", [4_000, pytest.param(100_000, marks=pytest.mark.full)])
def test_every_expression_is_linear(length):
    """99 kB of line ends took an expression 107 s."""
    slow = {}
    found = expressions()
    assert len(found) > 100
    for e in found:
        source = e.pattern.pattern if isinstance(e.pattern.pattern, str) else e.pattern.pattern.decode("latin-1")
        word = next(iter(re.findall(r"[A-Za-z]{2,}", source)), "x")
        for run in RUNS:
            for text in (run * (length // len(run)) + "\0", word + run * (length // len(run))):
                taken = float("inf")
                with contextlib.suppress(Hang), bounded_time():
                    taken = longest(e, text)
                if taken > SECONDS:
                    slow[f"{e.place} {source!r}"] = f"{taken:.2f} s for {text[:9]!r}..."
                    break
    assert not slow, slow
