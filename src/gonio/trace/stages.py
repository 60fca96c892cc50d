"""A graph in two stages: what does not depend on some arrays is computed first, once for all of their entries.

What depends on these arrays alone is computed once for all else. So that both are as much as can be, the factors of a
product are gathered before: of D F G / (4 cos cos) all but F is one number of the first stage. Results are the same but
for rounding.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, NamedTuple

from .costs import COSTS, OTHER
from .graph import INDEX, MASK, REAL, Graph
from .passes import wanted

AGAIN = 2
"""Simple operations that take no longer than the way of a number from the first stage to the second."""


class Stages(NamedTuple):
    """The first stage and what is alone are nodes of the graph, reals; the second is a graph of its own, which loads
    them.

    In the second the arrays that inputs bring keep their numbers, then come those of the first stage, one number for
    each element, then those that are alone, one number for each entry of the arrays within, then all others.
    """

    first: tuple[int, ...]
    alone: tuple[int, ...]
    saved: int  # operations of the first stage
    second: Graph
    outputs: tuple[int, ...]  # nodes of the second graph


def stages(
    graph: Graph,
    outputs: Sequence[int],
    inputs: int,
    within: Collection[int],
    around: Collection[int],
    noted: Callable[[int], Any] | None = None,
) -> Stages:
    """A computation for arrays `within`, which change fastest, and arrays `around`, among these the first `inputs`.

    What depends on arrays around and on none within is the first stage; what depends on arrays within and on none
    around is alone. Kept with the graph; `noted` is told how many bytes that takes.
    """
    kept = graph.kept.setdefault(stages, {})
    key = (tuple(outputs), inputs, tuple(within), tuple(around), wanted())
    found = kept.get(key)
    if found is None:
        found = kept[key] = _divided(graph, *key)
        if noted is not None:
            noted(found.second.size())
    return found


def _divided(
    graph: Graph,
    outputs: Sequence[int],
    inputs: int,
    within: Collection[int],
    around: Collection[int],
    gather: bool,
) -> Stages:
    ends = _gathered(graph, outputs, within, around) if gather else outputs
    order = graph.reachable(ends)
    on_within, on_around = (_dependent(graph, order, arrays) for arrays in (within, around))
    # Places in tables stay whole numbers, which float32 may not hold: the second stage computes them again.
    movable = {n for n in order if graph.operations[n] != "load" and graph.kinds[n] != INDEX}
    early, own = movable & (on_around - on_within), movable & (on_within - on_around) if gather else set[int]()
    late = _before(graph, ends, early | own)
    if gather:
        early -= _cheap(graph, [n for n in _sources(graph, ends, late) if n in early], on_around)
        late = _before(graph, ends, early | own)
    sources = _sources(graph, ends, late)[::-1]
    cut, alone = [n for n in sources if n in early], [n for n in sources if n in own]
    first, alone_nodes = (tuple(_as_real(graph, node) for node in nodes) for nodes in (cut, alone))
    second, new = Graph(), {}
    for i, node in enumerate([*cut, *alone]):
        number = second.load(inputs + i, 0)
        mask = graph.kinds[node] == MASK
        new[node] = second.apply("ne", number, second.constant(0.0)) if mask else number
    for node in late:
        operation, arguments = graph.operations[node], graph.arguments[node]
        if operation == "load":
            k, component = arguments
            new[node] = second.load(k if k < inputs else k + len(cut) + len(alone), component)
        else:
            new[node] = _again(graph, node, second, new)
    return Stages(first, alone_nodes, len(graph.reachable(cut)), second, tuple(new[node] for node in ends))


def _before(graph: Graph, ends: Sequence[int], stops: Collection[int]) -> list[int]:
    """The nodes in order that `ends` are computed from, without some and what these alone need."""
    needed, found = set(ends), []
    for node in reversed(graph.reachable(ends)):
        if node in needed and node not in stops:
            found.append(node)
            needed.update(graph.inputs(node))
    return found[::-1]


def _sources(graph: Graph, ends: Sequence[int], late: Sequence[int]) -> list[int]:
    """The nodes in order that late ones and ends are computed from, and that are not late."""
    return sorted({n for node in late for n in graph.inputs(node)}.union(ends).difference(late))


def _cheap(graph: Graph, cut: Sequence[int], on_around: Collection[int]) -> set[int]:
    """Nodes of the first stage that take fewer operations from others of its results than their way through memory."""
    found, ready = set[int](), set[int]()
    for node in cut:
        steps, left = set[int](), [node]
        while left and len(steps) <= AGAIN:
            one = left.pop()
            if one in ready or one not in on_around:
                continue
            left += graph.inputs(one)
            if graph.operations[one] == "load" or COSTS.get(graph.operations[one], OTHER) > 1.0:
                left.append(one)
                break
            steps.add(one)
        if left or len(steps) > AGAIN:
            ready.add(node)
        else:
            found |= steps
            ready |= steps
    return found


def _again(graph: Graph, node: int, other: Graph, new: dict[int, int]) -> int:
    """A node in another graph, where its inputs are `new`."""
    return graph.copied(node, other, [new[source] for source in graph.inputs(node)])


def _gathered(graph: Graph, outputs: Sequence[int], within: Collection[int], around: Collection[int]) -> list[int]:
    """The outputs as other nodes of the graph, where the factors of a number that depends on both are gathered: those
    of the arrays around and of no array, and those of the arrays within.

    A product of several numbers that depend on both stays as it is: to multiply first by what large or small factors
    are with it may take it out of the range of the dtype.
    """
    order = graph.reachable(outputs)
    on_within, on_around = (_dependent(graph, order, arrays) for arrays in (within, around))
    uses = Counter(source for node in order for source in graph.inputs(node)) + Counter(outputs)
    both = on_within & on_around
    products = {n for n in both if graph.kinds[n] == REAL and graph.operations[n] in ("mul", "div")}
    mixed = {n for n in products if not both.issuperset(graph.inputs(n))}
    inner = {n for node in mixed for n in graph.inputs(node) if n in mixed and uses[n] == 1}
    new: dict[int, int] = {}
    for node in order:
        if node not in both or graph.operations[node] == "load":
            new[node] = node
        elif node not in mixed:
            new[node] = _again(graph, node, graph, new)
        elif node not in inner:
            parts: tuple[list[tuple[int, int]], ...] = ([], [], [])
            for source, exponent in _factors(graph, node, inner):
                parts[(source in on_within) + (source in both)].append((new[source], exponent))
            *apart, rest = parts
            new[node] = _multiplied(graph, [*((_multiplied(graph, part), 1) for part in apart if part), *rest])
    return [new[node] for node in outputs]


def _factors(graph: Graph, product: int, inner: Collection[int]) -> Iterator[tuple[int, int]]:
    """The factors of a product and of the products in it, each with its exponent, 1 or -1."""
    left = [(product, 1)]
    while left:
        node, exponent = left.pop()
        if node != product and node not in inner:
            yield node, exponent
            continue
        a, b = graph.arguments[node]
        left += [(b, exponent if graph.operations[node] == "mul" else -exponent), (a, exponent)]


def _multiplied(graph: Graph, powers: Sequence[tuple[int, int]]) -> int:
    above, below = ([node for node, exponent in powers if exponent == sign] for sign in (1, -1))
    value = above[0] if above else graph.constant(1.0)
    for node in above[1:]:
        value = graph.apply("mul", value, node)
    for node in below:
        value = graph.apply("div", value, node)
    return value


def _as_real(graph: Graph, node: int) -> int:
    if graph.kinds[node] == MASK:
        return graph.apply("select", node, graph.constant(1.0), graph.constant(0.0))
    return node


def _dependent(graph: Graph, order: Sequence[int], arrays: Collection[int]) -> set[int]:
    """The nodes that depend on any of some arrays."""
    found: set[int] = set()
    for node in order:
        loaded = graph.operations[node] == "load" and graph.arguments[node][0] in arrays
        if loaded or any(source in found for source in graph.inputs(node)):
            found.add(node)
    return found
