"""Lookups of a kernel in tables, as LLVM IR: entries that lie side by side are read together.

Processors have an instruction that reads numbers from many places, but it takes about as long as a load for each of
them. So one or two neighbours are read by that instruction, two as one number of twice the length; more by loads of 16
bytes, lane by lane, which shuffles turn into a vector for each entry.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...trace.graph import Graph
from .lanes import FLOAT32, Lanes, Value
from .program import Program

BLOCK = 16
"""Bytes that a load of one lane brings."""

BLOCKS = 2
"""Loads of a lane that follow each other at most."""


class Run(NamedTuple):
    """Lookups of entries side by side: their table, the first node, their number, and the distances in the table [in
    entries] of other runs, which are read soon."""

    table: int
    first: int
    length: int
    others: tuple[int, ...]


class Lookups:
    """Writes the lookups of a program to `v`.

    `order`: the nodes that are computed; `native`: how many lanes a vector of the processor has, of those of `v`.
    """

    def __init__(self, program: Program, v: Lanes, order: Sequence[int], native: int):
        self.v, self.native = v, native
        self.real, self.size = v.scalar["real"], 4 if program.dtype == FLOAT32 else 8
        self.runs = _runs(program.graph, order, BLOCKS * BLOCK // self.size)
        self.read: dict[int, list[Value]] = {}

    def entry(self, node: int, index: Value) -> Value:
        """The entry of a table that a node looks up; an index beyond it reads its last entry."""
        run, place = self.runs[node]
        if run.first not in self.read:
            start = self.v.integer("sub", index, self.v.index(place)) if place else index
            self.read[run.first] = self._entries(run, start)
        return self.read[run.first][place]

    def _entries(self, run: Run, start: Value) -> list[Value]:
        v, w, kind = self.v, self.v.width, self.v.types["index"]
        least = v.intrinsic(f"umin.v{w}i32", kind, (kind, start.name), (kind, f"%t{run.table}.end"))
        index = v.emit("index", least)
        if run.length * self.size <= 8:
            return self._gathered(run, index)
        index = self._together(index)
        parts = [self._loaded(run, index, first) for first in range(0, w, self.native)]
        n = self.native
        while len(parts) > 1:
            pairs = zip(parts[::2], parts[1::2], strict=True)
            parts = [[v.shuffle(a, b, n, range(2 * n)) for a, b in zip(x, y, strict=True)] for x, y in pairs]
            n *= 2
        return parts[0]

    def _gathered(self, run: Run, index: Value) -> list[Value]:
        """One entry or two by the instruction for that."""
        v, w = self.v, self.v.width
        pointers = v.name()
        v.write(f"{pointers} = getelementptr {self.real}, ptr %t{run.table}, {v.types['index']} {index.name}")
        entry = self.real if run.length == 1 else "double"
        name, kind = f"masked.gather.v{w}{'f32' if entry == 'float' else 'f64'}.v{w}p0", f"<{w} x {entry}>"
        mask = (f"<{w} x i1>", "splat (i1 true)")
        arguments = (f"<{w} x ptr>", pointers), ("i32", str(self.size)), mask, (kind, "poison")
        read = v.emit("real", v.intrinsic(name, kind, *arguments))
        if run.length == 1:
            return [read]
        halves = v.emit("real", f"bitcast {kind} {read.name} to <{2 * w} x {self.real}>")
        return [v.shuffle(halves, Value("real", "poison"), 2 * w, range(k, 2 * w, 2)) for k in (0, 1)]

    def _together(self, index: Value) -> Value:
        """The index, no vector of which is there before the others.

        Else compilers follow one vector through all steps of a search before the next one, and the processor, which
        waits for each step, has nothing else to do meanwhile. The highest bits that are added are 0.
        """
        v, w, kind = self.v, self.v.width, self.v.types["index"]
        if w == self.native:
            return index
        picks = ", ".join(f"i32 {(lane + self.native) % w}" for lane in range(w))
        other = v.emit("index", f"shufflevector {kind} {index.name}, {kind} poison, <{w} x i32> <{picks}>")
        return v.integer("or", index, v.integer("lshr", other, v.index(31)))

    def _loaded(self, run: Run, index: Value, first: int) -> list[Value]:
        """The entries for a vector of lanes from `first` on."""
        v, block = self.v, BLOCK // self.size
        addresses: list[str] = []
        # Two places at a time: taking a number out of a vector takes longer than taking it apart.
        pairs = v.emit("pairs", f"bitcast {v.types['index']} {index.name} to <{v.width // 2} x i64>")
        for k in range(first // 2, (first + self.native) // 2):
            pair = v.emit("pair", f"extractelement <{v.width // 2} x i64> {pairs.name}, i64 {k}")
            for place in (f"and i64 {pair.name}, 4294967295", f"lshr i64 {pair.name}, 32"):
                at = v.emit("place", place).name
                addresses.append(v.emit("address", f"getelementptr {self.real}, ptr %t{run.table}, i64 {at}").name)
        import os
        if os.environ.get("PRE") == "1":
            v.declared.add("declare void @llvm.prefetch.p0(ptr, i32, i32, i32)")
            for d in run.others:
                for a in addresses:
                    far = v.emit("address", f"getelementptr i8, ptr {a}, i64 {d * self.size}").name
                    v.write(f"call void @llvm.prefetch.p0(ptr {far}, i32 0, i32 3, i32 1)")
        entries = self._transposed(addresses, 0)
        if run.length > block:  # the last block, without going beyond the run
            skipped = run.length - block
            entries[skipped:] = self._transposed(addresses, skipped)
        return entries

    def _transposed(self, addresses: Sequence[str], offset: int) -> list[Value]:
        """A block of entries that begins so many entries after an address, for each lane."""
        v, w, block = self.v, self.native, BLOCK // self.size
        read = []
        for address in addresses:
            at = v.emit("address", f"getelementptr {self.real}, ptr {address}, i64 {offset}").name
            read.append(v.emit("real", f"load <{block} x {self.real}>, ptr {at}, align {self.size}"))
        rows = []
        for k in range(block):
            parts, n = read[k::block], block
            while len(parts) > 1:
                parts = [v.shuffle(a, b, n, range(2 * n)) for a, b in zip(parts[::2], parts[1::2], strict=True)]
                n *= 2
            rows.append(parts[0])

        def mixed(a: Value, b: Value, picks: Sequence[int]) -> Value:
            """These entries of every block of a and b together."""
            places = [p if p < block else w + p - block for p in picks]
            return v.shuffle(a, b, w, [start + p for start in range(0, w, block) for p in places])

        if block == 2:
            return [mixed(*rows, (0, 2)), mixed(*rows, (1, 3))]
        entries = []
        for picks in ((0, 4, 1, 5), (2, 6, 3, 7)):
            low, high = mixed(rows[0], rows[1], picks), mixed(rows[2], rows[3], picks)
            entries += [mixed(low, high, (0, 1, 4, 5)), mixed(low, high, (2, 3, 6, 7))]
        return entries


def _runs(graph: Graph, order: Sequence[int], most: int) -> dict[int, tuple[Run, int]]:
    """Runs of at most so many lookups: node -> its run, and its place in it."""
    neighbours: dict[tuple[int, int], dict[int, int]] = {}
    for node in order:
        if graph.operations[node] == "take":
            table, index = graph.arguments[node]
            base, offset = graph.split(index)
            if base is not None:
                neighbours.setdefault((table, base), {})[int(offset)] = node
    places: dict[int, tuple[Run, int]] = {}
    for (table, _), members in neighbours.items():
        offsets, starts = sorted(members), []
        while offsets:
            start = offsets[0]
            length = next((k for k, at in enumerate(offsets) if at != start + k or k == most), len(offsets))
            starts.append((start, length))
            offsets = offsets[length:]
        for j, (start, length) in enumerate(starts):
            run = Run(table, members[start], length, () if j else tuple(s - start for s, _ in starts[1:]))
            places.update((members[start + k], (run, k)) for k in range(length))
    return places
