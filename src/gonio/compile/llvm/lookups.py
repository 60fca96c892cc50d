"""Lookups of a kernel in tables, as LLVM IR: entries that lie side by side are read together.

Processors have an instruction that reads numbers from many places, but it takes about as long as a load for each of
them. So one or two neighbours are read by that instruction, two as one number of twice the length; more by loads of 16
bytes, lane by lane, which shuffles turn into a vector for each entry.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...trace.graph import Graph
from .lanes import FLOAT32, Lanes, Value
from .program import Program

BLOCK = 16
"""Bytes that a load of one lane brings."""

BLOCKS = 2
"""Loads that follow each other in a table at most."""


class Lookups:
    """Writes the lookups of a program to `v`; `order`: its nodes that are computed."""

    def __init__(self, program: Program, v: Lanes, order: Sequence[int], native: int):
        self.graph, self.v = program.graph, v
        self.real = v.scalar["real"]
        self.size = 4 if program.dtype == FLOAT32 else 8
        self.native = native
        self.runs = _runs(program.graph, order, BLOCKS * BLOCK // self.size)
        self.read: dict[int, list[Value]] = {}

    def entry(self, node: int, index: Value) -> Value:
        """The entry of a table that a node looks up; an index beyond it reads its last entry."""
        run, place = self.runs[node]
        if run[0] not in self.read:
            start = self.v.integer("sub", index, self.v.index(place)) if place else index
            self.read[run[0]] = self._entries(self.graph.arguments[node][0], start, run[1])
        return self.read[run[0]][place]

    def _entries(self, table: int, start: Value, length: int) -> list[Value]:
        """So many entries of a table from `start` on, or more."""
        v, w, kind = self.v, self.v.width, self.v.types["index"]
        least = v.intrinsic(f"umin.v{w}i32", kind, (kind, start.name), (kind, f"%t{table}.end"))
        safe = v.emit("index", least)
        if length == 1 or (length == 2 and self.size == 4):
            return self._gathered(table, safe, length)
        count = -(-length * self.size // BLOCK)
        block = BLOCK // self.size
        parts = []
        for first in range(0, w, self.native):
            addresses = list(self._addresses(table, safe, first))
            parts.append([x for k in range(count) for x in self._transposed(addresses, k * BLOCK, block)])
        n = self.native
        while len(parts) > 1:
            parts = [[v.shuffle(a, b, n, range(2 * n)) for a, b in zip(x, y, strict=True)] for x, y in zip(parts[::2], parts[1::2], strict=True)]
            n *= 2
        return parts[0]

    def _gathered(self, table: int, index: Value, length: int) -> list[Value]:
        v, w = self.v, self.v.width
        pointers = v.name()
        v.write(f"{pointers} = getelementptr {self.real}, ptr %t{table}, {v.types['index']} {index.name}")
        entry = self.real if length == 1 else "double"
        name, kind = f"masked.gather.v{w}{'f32' if entry == 'float' else 'f64'}.v{w}p0", f"<{w} x {entry}>"
        mask = (f"<{w} x i1>", "splat (i1 true)")
        arguments = (f"<{w} x ptr>", pointers), ("i32", str(self.size)), mask, (kind, "poison")
        read = v.emit("real", v.intrinsic(name, kind, *arguments))
        if length == 1:
            return [read]
        halves = v.emit("real", f"bitcast {kind} {read.name} to <{2 * w} x {self.real}>")
        return [v.shuffle(halves, Value("real", "poison"), 2 * w, range(k, 2 * w, 2)) for k in (0, 1)]

    def _addresses(self, table: int, index: Value, first: int) -> Iterator[str]:
        """The address of each lane's first entry, for a vector of lanes from `first` on."""
        v = self.v
        # Two places at a time: taking a number out of a vector takes longer than taking it apart.
        pairs = v.emit("pairs", f"bitcast {v.types['index']} {index.name} to <{v.width // 2} x i64>")
        for k in range(first // 2, (first + self.native) // 2):
            pair = v.emit("pair", f"extractelement <{v.width // 2} x i64> {pairs.name}, i64 {k}")
            for place in (f"and i64 {pair.name}, 4294967295", f"lshr i64 {pair.name}, 32"):
                at = v.emit("place", place)
                yield v.emit("address", f"getelementptr {self.real}, ptr %t{table}, i64 {at.name}").name

    def _transposed(self, addresses, offset, block):
        v, w = self.v, self.native
        read = []
        for address in addresses:
            if offset:
                address = v.emit("address", f"getelementptr i8, ptr {address}, i64 {offset}").name
            read.append(v.emit("real", f"load <{block} x {self.real}>, ptr {address}, align {self.size}"))
        rows = []
        for j in range(block):
            parts, size = read[j::block], block
            while len(parts) > 1:
                parts = [v.shuffle(a, b, size, range(2 * size)) for a, b in zip(parts[::2], parts[1::2], strict=True)]
                size *= 2
            rows.append(parts[0])

        def mixed(a: Value, b: Value, picks: Sequence[int]) -> Value:
            at = [g + p if p < block else w + g + p - block for g in range(0, w, block) for p in picks]
            return v.shuffle(a, b, w, at)

        if block == 2:
            return [mixed(*rows, (0, 2)), mixed(*rows, (1, 3))]
        out = []
        for picks in ((0, 4, 1, 5), (2, 6, 3, 7)):
            low, high = mixed(rows[0], rows[1], picks), mixed(rows[2], rows[3], picks)
            out += [mixed(low, high, (0, 1, 4, 5)), mixed(low, high, (2, 3, 6, 7))]
        return out


def _runs(graph: Graph, order: Sequence[int], most: int) -> dict[int, tuple[tuple[int, int], int]]:
    """Lookups of entries side by side, at most so many: node -> its run (name, length), and its place in it."""
    neighbours: dict[tuple[int, int], dict[int, int]] = {}
    for node in order:
        if graph.operations[node] == "take":
            table, index = graph.arguments[node]
            base, offset = graph.split(index)
            if base is not None:
                neighbours.setdefault((table, base), {})[int(offset)] = node
    runs: dict[int, tuple[tuple[int, int], int]] = {}
    for members in neighbours.values():
        offsets = sorted(members)
        while offsets:
            start = offsets[0]
            # Up to a gap: what lies between is not read for nothing.
            length = next((k for k, at in enumerate(offsets) if at != start + k or k == most), len(offsets))
            run = members[start], length
            runs.update((members[start + k], (run, k)) for k in range(length))
            offsets = offsets[length:]
    return runs
