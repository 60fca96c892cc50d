"""Names in a source text: of parameters, and of what nodes of a graph are, such as components of the half vector."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from ...trace.graph import Graph
from .elementary import FUNCTIONS
from .lines import ascii_of
from .reserved import WORDS

_HALF = {("wi", "wo"), ("wo", "wi")}


def suggested(
    graph: Graph, order: Iterable[int], leaves: Mapping[int, str], known: Mapping[int, str]
) -> dict[int, str]:
    """Names for some nodes. `leaves`: loads by their words, wi_x for a component; `known`: names of results.

    A name says that a node has that value wherever it counts: a direction below the horizon is replaced by the normal.
    """
    names = dict(known)
    for node in order:
        if node not in names and (name := leaves.get(node) or _name(graph, node, names)):
            names[node] = name
    return names


def _name(g: Graph, node: int, names: Mapping[int, str]) -> str | None:
    operation = g.operations[node]
    inputs = g.inputs(node)
    a, b = (*(names.get(n, "") for n in inputs), "", "")[:2]
    if operation == "select":  # a value, or a constant that stands in for it
        _, first, second = inputs
        kept = second if g.value(first) is not None else first if g.value(second) is not None else None
        return None if kept is None else names.get(kept)
    if operation == "add":
        if a[:-1] and a[-2:] == b[-2:] and (a[:-2], b[:-2]) in _HALF and re.fullmatch(r"_[xyz]", a[-2:]):
            return f"h{a[-2:]}"  # wi + wo
        parts = {a, b}
        if parts == {"h_x2", "h_y2"}:
            return "h_xy2"
        if parts in ({"h_xy2", "h_z2"}, {"h_x2", "h_yz2"}):
            return "h2"
        return None
    if operation == "mul":
        if inputs[0] == inputs[1]:
            return f"{a}2" if a and not a[-1].isdigit() else None
        return "cos_d" if "length_h" in (a, b) and 0.5 in map(g.value, inputs) else None  # |wi + wo|/2
    if operation == "sqrt":
        return "length_h" if a == "h2" else None
    if operation in ("le", "lt"):
        return "below" if a in ("wi_z", "wo_z") and g.value(inputs[1]) is not None else None
    if operation == "or":
        return "below" if a == b == "below" else None
    return None


_OURS = re.compile(r"(t|s|go|table)\d+")
_FORBIDDEN = re.compile(r"(web)?gl(_.*)?|.*__.*|.*_")
"""Words that GLSL does not allow, or not with _ and more behind them."""


def is_prefix(name: str) -> bool:
    """Whether all languages take names that begin with this and _."""
    return bool(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)) and not _FORBIDDEN.fullmatch(name)


def identifier(text: str) -> str:
    """A text as a name that all languages take, but for their reserved words."""
    word = re.sub(r"[^A-Za-z0-9]+", "_", ascii_of(text)).strip("_")
    return f"p_{word}" if not word or word[0].isdigit() or _FORBIDDEN.fullmatch(word) else word


def short_names(paths: Sequence[str]) -> list[str]:
    """A name for each path: its last word, with those of its other words that tell it from others of the same end."""
    parts = [path.split(".") for path in paths]
    names: list[str] = []
    for *before, end in parts:
        alike = [other[:-1] for other in parts if other[-1] == end]
        own = [word for word in before if not all(word in other for other in alike)] if len(alike) > 1 else []
        places = [word for word in own if word.isdigit()]
        name = identifier("_".join([*(word for word in own if not word.isdigit()), end, *places]))
        if name in WORDS or name in FUNCTIONS or _OURS.fullmatch(name):
            name += "_of_it"
        number = 2
        free = name
        while free in names:
            free, number = f"{name}_{number}", number + 1
        names.append(free)
    return names
