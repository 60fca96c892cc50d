"""An expression graph: every operation of a formula once, in the order in which it can be computed."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Sequence
from typing import Any

from ..errors import TraceError

REAL, INDEX, MASK = "real", "index", "mask"

COMPARISONS = ("lt", "le", "gt", "ge", "eq", "ne")
LOGIC = ("and", "or", "xor")
SHIFTS = ("shl", "lshr")
SEVERAL = "several"
"""The kind of what is no number, but has results that are."""

LEAVES = ("constant", "load", "state")
OWN = {**dict.fromkeys(LEAVES, 2), "take": 1, "loop": 1, "result": 1, "rays": 2}
"""The number of arguments, the first ones, that are no nodes."""

TRACED = 200_000
"""Operations up to which a formula is traced: recorded to be differentiated, shown or compiled."""

NODE = 320
"""Bytes of memory that a node takes, about."""

_COMMUTE = {"add", "mul", "eq", "ne", "and", "or", "xor"}
_KINDS = {**dict.fromkeys(COMPARISONS, MASK), "to_index": INDEX, "to_real": REAL}
"""Kinds of operations that are not those of their last argument."""


MET = ((REAL, REAL, REAL, INDEX), (MASK,))
"""Kinds of what "rays" give: distance, place and number of the nearest triangle; or whether there is any."""


class Graph:
    """Nodes in order: node i has an operation, arguments and a kind ("real", "index" or "mask").

    Leaves are "constant" (value), "load" (array, component): a component of an input array. "take" (table, node) looks
    up a table. The arguments of every other operation are earlier nodes. Equal nodes are one node, and operations that
    change no value (x * 1, x / 1, - - x, a choice between equals) are left out. Raises TraceError for more than
    `TRACED` nodes.

    Indices are whole numbers of 32 bits, whose sums and products wrap around.

    "loop" (depth, states before it, whether it goes on, states after a step) holds no number; "result" (i, loop) is its
    state number i in the end. The leaf "state" (depth, i) is that state before a step: nodes that depend on it are
    those of a step. The depth of a loop is the number of loops whose steps it is in, so that equal loops are one node.
    "rays" (table, way, origin, direction, distances) has results likewise.
    """

    def __init__(self) -> None:
        self.operations: list[str] = []
        self.arguments: list[tuple] = []
        self.kinds: list[str] = []
        self._numbers: dict[tuple, int] = {}
        self._hashed: dict[tuple[int, ...], tuple[Any, list[int]]] = {}
        self.depth = 0  # of loops whose steps are being traced
        self.kept: dict[Any, dict[Any, Any]] = {}
        """What has been made of the graph, by who made it."""

    def __len__(self) -> int:
        return len(self.operations)

    def size(self) -> int:
        """Bytes of memory, about."""
        return NODE * len(self)

    def _node(self, operation: str, arguments: tuple, kind: str) -> int:
        swapped = operation in _COMMUTE and arguments[0] > arguments[1]
        key = (operation, kind, *(arguments[::-1] if swapped else arguments))
        node = self._numbers.get(key)
        if node is None:
            node = self._numbers[key] = len(self.operations)
            if node >= TRACED:
                raise TraceError(f"a formula of more than {TRACED} operations is not traced")
            self.operations.append(operation)
            self.arguments.append(arguments)
            self.kinds.append(kind)
        return node

    def constant(self, value: float, kind: str = REAL) -> int:
        if kind == REAL:
            value = float(value)
            # 0.0 and -0.0 are equal keys, but different numbers; NaN is no key at all.
            return self._node("constant", (value, math.copysign(1.0, value) if value == value else "nan"), kind)
        whole = int(value)
        if kind == INDEX:
            whole = (whole + (1 << 31)) % (1 << 32) - (1 << 31)
        return self._node("constant", (whole, 1), kind)

    def load(self, array: int, component: int) -> int:
        """Component of input array number `array`."""
        return self._node("load", (array, component), REAL)

    def take(self, table: int, index: int) -> int:
        """Entry of table number `table`."""
        return self._node("take", (table, index), REAL)

    def state(self, depth: int, number: int, kind: str) -> int:
        """A state of a loop before a step."""
        return self._node("state", (depth, number), kind)

    def loop(self, depth: int, first: Sequence[int], go_on: int, states: Sequence[int]) -> list[int]:
        """The states of a loop in the end; `first`: before it; `go_on` and `states`: of a step."""
        node = self._node("loop", (depth, *first, go_on, *states), SEVERAL)
        return [self._node("result", (i, node), self.kinds[x]) for i, x in enumerate(first)]

    def rays(self, table: int, way: int, nodes: Sequence[int]) -> list[int]:
        """What rays meet: the results of `arrays/packets.py` for origins, directions and distances."""
        node = self._node("rays", (table, way, *nodes), SEVERAL)
        return [self._node("result", (i, node), kind) for i, kind in enumerate(MET[way])]

    def parts(self, loop: int) -> tuple[Sequence[int], int, Sequence[int]]:
        """The states before a loop, whether it goes on after a step, and its states then."""
        _, *nodes = self.arguments[loop]
        count = len(nodes) // 2
        return nodes[:count], nodes[count], nodes[count + 1 :]

    def copied(self, node: int, into: Graph, inputs: Sequence[int]) -> int:
        """The node in another graph, with other inputs."""
        operation, arguments = self.operations[node], self.arguments[node]
        if operation == "constant":
            return into.constant(arguments[0], self.kinds[node])
        if operation in OWN:
            return into._node(operation, (*arguments[: OWN[operation]], *inputs), self.kinds[node])
        return into.apply(operation, *inputs)

    def steps(self, order: Iterable[int]) -> dict[int, int]:
        """For each of some nodes in order the loops whose steps it is computed in: their depths as bits."""
        within: dict[int, int] = {}
        for node in order:
            if self.operations[node] == "state":
                within[node] = 1 << self.arguments[node][0]
            elif self.operations[node] == "loop":
                first, go_on, states = self.parts(node)
                of_step = 0
                for n in (go_on, *states):
                    of_step |= within[n]
                within[node] = of_step & ~(1 << self.arguments[node][0])
                for n in first:
                    within[node] |= within[n]
            else:
                within[node] = 0
                for n in self.inputs(node):
                    within[node] |= within[n]
        return within

    def value(self, node: int) -> float | None:
        """The value of a constant node, else None."""
        return self.arguments[node][0] if self.operations[node] == "constant" else None

    def apply(self, operation: str, *nodes: int) -> int:
        """A node that applies `operation` to other nodes."""
        same = self._simplified(operation, nodes)
        if same is not None:
            return same
        return self._node(operation, nodes, _KINDS.get(operation) or self.kinds[nodes[-1]])

    def _simplified(self, operation: str, nodes: Sequence[int]) -> int | None:
        """A node with the same value, bit by bit, that needs no operation; None where there is none."""
        first = nodes[0]
        value = self.arguments[first][0] if self.operations[first] == "constant" else None
        if operation == "mul":
            if value == 1:
                return nodes[1]
            if self.value(nodes[1]) == 1:
                return first
            return self._product_of_index(nodes) if self.kinds[first] == INDEX else None
        if operation == "div":
            return first if self.value(nodes[1]) == 1 else None
        if operation == "neg":
            if self.operations[first] == "neg":
                return self.arguments[first][0]
            return None if value is None else self.constant(-value, self.kinds[first])
        if operation == "select":
            if nodes[1] == nodes[2]:
                return nodes[1]
            return self._simplified_choice(nodes) if value is None else nodes[1] if value else nodes[2]
        if operation in ("and", "or"):
            return first if first == nodes[1] else self._simplified_condition(operation, nodes)
        if operation == "to_real":
            return None if value is None else self.constant(value)
        if operation == "to_index":
            return None if value is None else self.constant(value if math.isfinite(value) else 0, INDEX)
        if operation in ("add", "sub") and self.kinds[first] == INDEX:
            return self._simplified_index(operation, nodes)
        return None

    def _simplified_choice(self, nodes: Sequence[int]) -> int | None:
        """A choice of what the same condition chooses already."""
        condition, *sides = nodes
        chosen = [
            self.arguments[n][i] if self.operations[n] == "select" and self.arguments[n][0] == condition else n
            for i, n in enumerate(sides, 1)
        ]
        return None if chosen == sides else self.apply("select", condition, *chosen)

    def _simplified_condition(self, operation: str, nodes: Sequence[int]) -> int | None:
        """A condition with True or False."""
        for certain, other in (nodes, nodes[::-1]):
            if self.kinds[certain] == MASK and (value := self.value(certain)) is not None:
                return other if value == (operation == "and") else certain
        return None

    def _product_of_index(self, nodes: Sequence[int]) -> int | None:
        """(x + c) d is x d + c d."""
        x, factor = nodes if self.value(nodes[1]) is not None else nodes[::-1]
        by = self.value(factor)
        if by is None:
            return None
        base, offset = self.split(x)
        if base is None:
            return self.constant(offset * by, INDEX)
        if offset == 0:
            return None
        return self.apply("add", self.apply("mul", base, factor), self.constant(offset * by, INDEX))

    def _simplified_index(self, operation: str, nodes: Sequence[int]) -> int | None:
        """Whole numbers have no rounding: sums are written with one constant, and that last."""
        sign = 1 if operation == "add" else -1
        if sign > 0 and self.value(nodes[0]) is not None:
            nodes = nodes[::-1]
        (x, c), (y, d) = (self.split(n) for n in nodes)
        offset = int(c + sign * d)
        if x is None and y is None:
            return self.constant(offset, INDEX)
        if offset == 0 and (c != 0 or self.value(nodes[1]) == 0):
            return x if y is None else self.apply(operation, x, y) if x is not None else None
        if y is None and x is not None and (c != 0 or sign < 0):
            return self._node("add", (x, self.constant(offset, INDEX)), INDEX)
        if x is not None and y is not None and (c != 0 or d != 0):
            return self._node("add", (self.apply(operation, x, y), self.constant(offset, INDEX)), INDEX)
        return None

    def split(self, node: int) -> tuple[int | None, float]:
        """An index as a node and a constant to be added; None and the value for a constant."""
        value = self.value(node)
        if value is not None:
            return None, value
        if self.operations[node] == "add":
            a, b = self.arguments[node]
            last = self.value(b)
            if last is not None:
                return a, last
        return node, 0

    def neighbours(self, order: Iterable[int]) -> dict[tuple[int, int], dict[int, int]]:
        """Lookups among some nodes whose places differ by constants: (table, index node) -> offset -> node."""
        lookups: dict[tuple[int, int], dict[int, int]] = {}
        for node in order:
            if self.operations[node] == "take":
                table, index = self.arguments[node]
                base, offset = self.split(index)
                if base is not None:
                    lookups.setdefault((table, base), {})[int(offset)] = node
        return lookups

    def inputs(self, node: int) -> Sequence[int]:
        """The nodes that a node is computed from."""
        operation, arguments = self.operations[node], self.arguments[node]
        return arguments[OWN[operation] :] if operation in OWN else arguments

    def reachable(self, outputs: Iterable[int]) -> list[int]:
        """The nodes that `outputs` depend on, in order."""
        ends = list(outputs)
        count = max(ends, default=-1) + 1
        needed, inputs = bytearray(count), self.inputs
        for node in ends:
            needed[node] = 1
        for node in range(count - 1, -1, -1):
            if needed[node]:
                for source in inputs(node):
                    needed[source] = 1
        return [node for node in range(count) if needed[node]]

    def digest(self, outputs: Sequence[int], *facts: Any) -> str:
        """A name for the computation of `outputs` (and `facts`): equal for equal graphs, in any process."""
        key = tuple(outputs)
        if key not in self._hashed:  # nodes are only ever added: a hash stays valid
            self._hashed[key] = self._hash(key)
        total, ends = self._hashed[key]
        total = total.copy()
        total.update(repr((ends, facts)).encode())
        return total.hexdigest()

    def _hash(self, outputs: Sequence[int]) -> tuple[Any, list[int]]:
        """The hash of all that `outputs` depend on, and their numbers among it."""
        numbers: dict[int, int] = {}
        text = []
        for node in self.reachable(outputs):
            numbers[node] = len(numbers)
            operation, arguments = self.operations[node], self.arguments[node]
            plain = OWN.get(operation, 0)
            arguments = (*arguments[:plain], *(numbers[a] for a in arguments[plain:]))
            text.append(f"{operation}{arguments}{self.kinds[node]}\n")
        return hashlib.sha256("".join(text).encode()), [numbers[node] for node in outputs]
