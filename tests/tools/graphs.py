"""Random graphs of operations, and which of their numbers NumPy's rounding does not decide."""

from __future__ import annotations

import numpy as np
import pytest

from gonio.arrays import ops
from gonio.evaluate import interpret
from gonio.evaluate.interpret import evaluate
from gonio.trace.graph import INDEX, MASK, REAL, Graph

REALS = (
    "add",
    "sub",
    "mul",
    "div",
    "minimum",
    "maximum",
    "neg",
    "absolute",
    "sqrt",
    "floor",
    "exp",
    "log",
    "sin",
    "cos",
)
REALS += ("arctan2", "power", "erf", "arccos", "tan", "erfinv", "sin_turn", "cos_turn")
ROUNDED = set(REALS) - {"minimum", "maximum", "neg", "absolute", "floor"}


TURNING = ("sin", "cos", "tan", "sin_turn", "cos_turn")
"""Functions of angles: what they are of a huge one depends on its last digit."""


def random_graph(seed: int, loads: int, tables: int) -> tuple[Graph, list[int]]:
    """A graph of about 60 operations of all kinds, and four of its nodes."""
    rng = np.random.default_rng(seed)
    graph = Graph()
    found = {REAL: [graph.load(0, c) for c in range(loads)], INDEX: [graph.constant(3, INDEX)], MASK: []}
    found[REAL] += [graph.constant(x) for x in (0.5, -1.25, 0.0, 2.0, float(rng.normal()))]
    found[MASK].append(graph.apply("lt", found[REAL][0], found[REAL][1]))

    def pick(kind: str) -> int:
        choices = found[kind]
        return choices[int(rng.integers(max(0, len(choices) - 12), len(choices)))]

    for _ in range(60):
        what = rng.integers(12)
        if what < 6:
            name = REALS[int(rng.integers(len(REALS)))]
            count = len(ops.ELEMENTARY[name].arguments) if name in ops.ELEMENTARY else 1 if name == "neg" else 2
            found[REAL].append(graph.apply(name, *(pick(REAL) for _ in range(count))))
        elif what == 6:
            how = ("lt", "le", "gt", "ge", "eq", "ne")[int(rng.integers(6))]
            kind = REAL if rng.random() < 0.7 else INDEX
            found[MASK].append(graph.apply(how, pick(kind), pick(kind)))
        elif what == 7:
            found[MASK].append(graph.apply(("and", "or", "xor")[int(rng.integers(3))], pick(MASK), pick(MASK)))
        elif what == 8:
            kind = (REAL, INDEX, MASK)[int(rng.integers(3))]
            found[kind].append(graph.apply("select", pick(MASK), pick(kind), pick(kind)))
        elif what == 9:
            limited = graph.apply(
                "minimum", graph.apply("maximum", pick(REAL), graph.constant(-9.0)), graph.constant(9.0)
            )
            found[INDEX].append(graph.apply("to_index", limited))
        elif what == 10:
            entry = graph.apply(
                "minimum", graph.apply("maximum", pick(INDEX), graph.constant(0, INDEX)), graph.constant(6, INDEX)
            )
            found[REAL].append(graph.take(int(rng.integers(tables)), entry))
        else:
            found[INDEX].append(
                graph.apply(("add", "sub")[int(rng.integers(2))], pick(INDEX), graph.constant(1, INDEX))
            )
            found[REAL].append(graph.apply("to_real", pick(INDEX)))
    return graph, [found[REAL][-1], found[REAL][-2], found[REAL][-5], found[MASK][-1]]


def steady(graph: Graph, nodes: list[int], x: np.ndarray, tables: list[np.ndarray], want: list) -> list[np.ndarray]:
    """Where each result depends on no last digits: it stays as it is if every rounded operation errs a little."""
    ok = [np.ones(len(x), bool) for _ in nodes]
    for error in (1e-14, -1e-14, 3e-14):
        with pytest.MonkeyPatch.context() as patch:
            for name in TURNING:
                exact = getattr(ops, name)
                patch.setattr(ops, name, lambda v, exact=exact, e=error: exact(near(v, e)))
            for name in ROUNDED & set(dir(ops)):
                exact = getattr(ops, name)
                patch.setattr(ops, name, lambda *v, exact=exact, e=error: near(exact(*v), e))
            for name in ROUNDED & set(interpret._OPERATORS):
                exact = interpret._OPERATORS[name]
                patch.setitem(interpret._OPERATORS, name, lambda *v, exact=exact, e=error: near(exact(*v), e))
            moved = evaluate(graph, nodes, lambda a, c: x[..., c], tables, x.dtype)
        for i, (a, b) in enumerate(zip(want, moved, strict=True)):
            same = a == b
            if np.asarray(a).dtype != bool:
                same |= (np.abs(a - b) <= 1e-8 * np.abs(b)) | (np.isnan(a) & np.isnan(b))
            ok[i] &= same
    return ok


def near(value, error):
    return value * (1.0 + error) if np.asarray(value).dtype.kind == "f" else value
