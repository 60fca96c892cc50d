"""A graph as text to read: one line per result that is used more than once, formulas in between written out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from ..arrays.ops import OPERATIONS
from .graph import COMPARISONS, LEAVES, MASK, Graph

_SIGNS: dict[str, tuple[str, float]] = {"add": ("+", 1), "sub": ("-", 1), "mul": ("*", 2), "div": ("/", 2)}
_SIGNS |= dict(zip(COMPARISONS, (("<", 0), ("<=", 0), (">", 0), (">=", 0), ("==", 0), ("!=", 0)), strict=True))
_SIGNS |= {"and": ("&", 0.5), "or": ("|", 0.5), "xor": ("^", 0.5)}
_ATOM, _MINUS = 9, 3
LENGTH = 90


def show(
    graph: Graph,
    outputs: Mapping[str, int],
    loads: Mapping[tuple[int, int], str],
    tables: Sequence[str],
) -> str:
    """Assignments that end with `outputs`; `loads` names components of inputs, `tables` the tables."""
    order = graph.reachable(outputs.values())
    uses = Counter(source for node in order for source in graph.inputs(node))
    names: dict[int, tuple[str, float]] = {}  # text and how tightly it binds
    lines: list[str] = []
    for node in order:
        text, binding = _text(graph, node, names, loads, tables)
        leaf = graph.operations[node] in LEAVES
        if not leaf and (uses[node] > 1 or len(text) > LENGTH):
            name = f"t{len(lines) + 1}"
            lines.append(f"{name} = {text}")
            text, binding = name, _ATOM
        names[node] = (text, binding)
    lines += [f"{name} = {names[node][0]}" for name, node in outputs.items()]
    return "\n".join(lines)


def _text(
    graph: Graph,
    node: int,
    names: Mapping[int, tuple[str, float]],
    loads: Mapping[tuple[int, int], str],
    tables: Sequence[str],
) -> tuple[str, float]:
    operation, arguments = graph.operations[node], graph.arguments[node]
    if operation == "constant":
        value = arguments[0]
        text = ("True" if value else "False") if graph.kinds[node] == MASK else repr(value)
        return text, _ATOM if arguments[1] == 1.0 else _MINUS
    if operation == "load":
        return loads[arguments], _ATOM
    if operation == "take":
        return f"{tables[arguments[0]]}[{names[arguments[1]][0]}]", _ATOM
    if operation == "state":
        return f"state{arguments[0]}_{arguments[1]}", _ATOM
    if operation == "result":
        return f"{names[arguments[1]][0]}[{arguments[0]}]", _ATOM
    if operation == "rays":
        listed = ", ".join(names[x][0] for x in graph.inputs(node))
        return f"{('nearest', 'blocked')[arguments[1]]}({tables[arguments[0]]}, {listed})", _ATOM
    if operation == "loop":
        first, go_on, states = graph.parts(node)
        before, after = (", ".join(names[x][0] for x in nodes) for nodes in (first, states))
        return f"loop(start=({before}), step=({after}), while={names[go_on][0]})", _ATOM
    if operation == "neg":
        text, binding = names[arguments[0]]
        return (f"-{text}" if binding > 1 else f"-({text})"), 1
    if operation in _SIGNS:
        sign, binding = _SIGNS[operation]
        (a, left), (b, right) = (names[x] for x in arguments)
        a = a if left >= binding else f"({a})"
        return f"{a} {sign} {b if right > binding else f'({b})'}", binding
    row = OPERATIONS[operation]
    return f"{row.shown or row.function or operation}({', '.join(names[x][0] for x in arguments)})", _ATOM
