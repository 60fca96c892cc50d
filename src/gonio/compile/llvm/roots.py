"""Which square roots of a kernel are estimated and improved by Newton steps, and which the processor takes itself.

A processor has one unit for roots and divisions, which works beside those that multiply. Where that unit would be the
slower, roots are estimated until both take as long: those first that spare it the most time for a product more.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...trace.costs import COSTS
from ...trace.graph import Graph


class Times(NamedTuple):
    """Cycles that a vector of float32 takes: a root, a division, and a product with what is done beside it."""

    root: float
    division: float
    product: float


ROOT, RECIPROCAL, BOTH = 6, 6, 9
"""Products, and what takes as long, of an estimated root, reciprocal root, or both of one number."""


def estimated(graph: Graph, order: Sequence[int], level: Mapping[int, int], times: Times) -> set[int]:
    """The roots to be estimated of those nodes of a kernel that vary along the inner axis (level 2)."""
    inner = [node for node in order if level[node] == 2]
    divisors = Counter(graph.arguments[n][1] for n in inner if graph.operations[n] == "div")
    uses = Counter(source for node in inner for source in graph.inputs(node))
    spared, added, unit, products = dict[int, float](), dict[int, int](), 0.0, 0.0
    for node in inner:
        operation = graph.operations[node]
        if operation == "sqrt":
            under, plain = divisors[node] > 0, uses[node] > divisors[node]
            spared[node] = times.root + times.division * under
            added[node] = BOTH if under and plain else RECIPROCAL if under else ROOT
            unit += spared[node]
        elif operation == "div":
            bottom = graph.arguments[node][1]
            unit += times.division * (level[bottom] == 2 and graph.operations[bottom] != "sqrt")
        elif operation not in ("add", "sub"):  # most sums are fused with a product, or have units of their own
            products += COSTS.get(operation, 0.0)
    chosen: set[int] = set()
    for node in sorted(spared, key=lambda n: added[n] / spared[n]):
        fewer, more = unit - spared[node], products + added[node]
        if max(fewer, more * times.product) >= max(unit, products * times.product):
            break
        chosen.add(node)
        unit, products = fewer, more
    return chosen
