"""Lookups of a kernel in tables, as LLVM IR: entries that lie side by side are read together.

Processors have an instruction that reads numbers from many places, but it takes about as long as a load for each of
them. So one or two neighbours are read by that instruction, two as one number of twice the length; more by loads of 16
bytes, lane by lane, which shuffles turn into a vector for each entry.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ...trace.graph import Graph
from .lanes import IRValue, Lanes
from .program import Program

BLOCK = 16
"""Bytes that a load of one lane brings."""

BLOCKS = 2
"""Loads of a lane that follow each other at most."""


class Run(NamedTuple):
    """Lookups of entries side by side: their table and the index node that they share, the offset from it of the first
    entry, the number of entries, and the least and the largest offset that is read of all lookups with that node."""

    table: int
    base: int
    start: int
    length: int
    least: int
    most: int


class Lookups:
    """Writes the lookups of a program to `v`.

    `order`: the nodes that are computed; `native`: how many lanes a vector of the processor has, of those of `v`.
    """

    def __init__(self, program: Program, v: Lanes, order: Sequence[int], native: int):
        self.v, self.native = v, native
        self.real, self.size = v.scalar["real"], v.size
        self.runs = _runs(program.graph, order, BLOCK // self.size)
        self.read: dict[Run, list[IRValue]] = {}
        self.indices: dict[tuple[int, int], IRValue] = {}
        self.addresses: dict[tuple[int, int], list[str]] = {}

    def entry(self, node: int, index: IRValue) -> IRValue:
        """The entry of a table that a node looks up.

        An index beyond the table reads some entry of it or the padding. Lookups that share a node are moved together,
        so all of them are in the table, or none is right but for two neighbours: callers see to that.
        """
        run, place = self.runs[node]
        if run not in self.read:
            first = self._first(run, index, run.start + place)
            if run.length * self.size <= 8:
                self.read[run] = self._gathered(run, first)
            else:
                self.read[run] = self._loaded(run, first)
        return self.read[run][place]

    def begin_step(self) -> tuple[dict[Any, Any], ...]:
        """The lookups before the steps of a loop, for `end_step`: those within are gone after them."""
        return dict(self.read), dict(self.indices), dict(self.addresses)

    def end_step(self, before: tuple[dict[Any, Any], ...]) -> None:
        self.read, self.indices, self.addresses = before

    def _first(self, run: Run, index: IRValue, offset: int) -> IRValue:
        """The index at the least offset of all lookups that share a node, moved so that all read within the table.

        That the table is as long as they are apart has been checked by `evaluate.planning`.
        """
        v, w, vector, name = self.v, self.v.width, self.v.types["index"], (run.table, run.base)
        if name not in self.indices:
            end = IRValue("index", f"%t{run.table}.end")
            if run.most > run.least + 1:  # tables are padded by one entry
                end = v.integer("sub", end, v.index(run.most - run.least - 1))
            if offset > run.least:
                index = v.integer("sub", index, v.index(offset - run.least))
            least = v.intrinsic(f"umin.v{w}i32", vector, (vector, index.name), (vector, end.name))
            self.indices[name] = v.emit("index", least)
        return self.indices[name]

    def _gathered(self, run: Run, first: IRValue) -> list[IRValue]:
        """One entry or two by the instruction for that."""
        v, w = self.v, self.v.width
        pointers, start = v.name(), self._beyond(f"%t{run.table}", run.start - run.least)
        v.write(f"{pointers} = getelementptr {self.real}, ptr {start}, {v.types['index']} {first.name}")
        entry = self.real if run.length == 1 else "double"
        name, vector = f"masked.gather.v{w}{'f32' if entry == 'float' else 'f64'}.v{w}p0", f"<{w} x {entry}>"
        mask = (f"<{w} x i1>", "splat (i1 true)")
        arguments = (f"<{w} x ptr>", pointers), ("i32", str(self.size)), mask, (vector, "poison")
        read = v.emit("real", v.intrinsic(name, vector, *arguments))
        if run.length == 1:
            return [read]
        halves = v.emit("real", f"bitcast {vector} {read.name} to <{2 * w} x {self.real}>")
        return [v.shuffle(halves, IRValue("real", "poison"), 2 * w, range(k, 2 * w, 2)) for k in (0, 1)]

    def _together(self, index: IRValue) -> IRValue:
        """The index, no vector of which is there before the others.

        Else compilers follow one vector through all steps of a search before the next one, and the processor, which
        waits for each step, has nothing else to do meanwhile. The highest bits that are added are 0.
        """
        v, w, vector = self.v, self.v.width, self.v.types["index"]
        if w == self.native:
            return index
        picks = ", ".join(f"i32 {(lane + self.native) % w}" for lane in range(w))
        other = v.emit("index", f"shufflevector {vector} {index.name}, {vector} poison, <{w} x i32> <{picks}>")
        return v.integer("or", index, v.integer("lshr", other, v.index(31)))

    def _loaded(self, run: Run, first: IRValue) -> list[IRValue]:
        """The entries of a run, lane by lane."""
        v, w, n, block, name = self.v, self.v.width, self.native, BLOCK // self.size, (run.table, run.base)
        if name not in self.addresses:
            self.addresses[name] = self._lane_by_lane(run.table, self._together(first))
        offset, skipped = run.start - run.least, max(run.length - block, 0)
        parts = []
        for lane in range(0, w, n):
            addresses = self.addresses[name][lane : lane + n]
            entries = self._transposed(addresses, offset)
            if skipped:  # the last block, without going beyond the run
                entries[skipped:] = self._transposed(addresses, offset + skipped)
            parts.append(entries)
        while len(parts) > 1:
            halves = zip(parts[::2], parts[1::2], strict=True)
            parts = [[v.shuffle(a, b, n, range(2 * n)) for a, b in zip(x, y, strict=True)] for x, y in halves]
            n *= 2
        return parts[0]

    def _lane_by_lane(self, table: int, index: IRValue) -> list[str]:
        """The address of an entry for each lane."""
        v, half = self.v, self.v.width // 2
        addresses = []
        # Two places at a time: taking a number out of a vector takes longer than taking it apart.
        pairs = v.emit("pairs", f"bitcast {v.types['index']} {index.name} to <{half} x i64>")
        for k in range(half):
            pair = v.emit("pair", f"extractelement <{half} x i64> {pairs.name}, i64 {k}")
            for place in (f"and i64 {pair.name}, 4294967295", f"lshr i64 {pair.name}, 32"):
                at = v.emit("place", place).name
                addresses.append(v.emit("address", f"getelementptr {self.real}, ptr %t{table}, i64 {at}").name)
        return addresses

    def _beyond(self, address: str, entries: int) -> str:
        """The address so many entries beyond another."""
        return self.v.emit("address", f"getelementptr {self.real}, ptr {address}, i64 {entries}").name

    def _transposed(self, addresses: Sequence[str], offset: int) -> list[IRValue]:
        """A block of entries that begins so many entries after an address, for each lane."""
        v, w, block = self.v, self.native, BLOCK // self.size
        read = []
        for address in addresses:
            at = self._beyond(address, offset)
            read.append(v.emit("real", f"load <{block} x {self.real}>, ptr {at}, align {self.size}"))
        rows = []
        for k in range(block):
            parts, n = read[k::block], block
            while len(parts) > 1:
                parts = [v.shuffle(a, b, n, range(2 * n)) for a, b in zip(parts[::2], parts[1::2], strict=True)]
                n *= 2
            rows.append(parts[0])

        def mixed(a: IRValue, b: IRValue, picks: Sequence[int]) -> IRValue:
            """These entries of every block of a and b together."""
            places = [p if p < block else w + p - block for p in picks]
            return v.shuffle(a, b, w, [start + p for start in range(0, w, block) for p in places])

        if block == 2:
            return [mixed(rows[0], rows[1], picks) for picks in ((0, 2), (1, 3))]
        entries = []
        for picks in ((0, 4, 1, 5), (2, 6, 3, 7)):
            low, high = mixed(rows[0], rows[1], picks), mixed(rows[2], rows[3], picks)
            entries += [mixed(low, high, (0, 1, 4, 5)), mixed(low, high, (2, 3, 6, 7))]
        return entries


def _runs(graph: Graph, order: Sequence[int], block: int) -> dict[int, tuple[Run, int]]:
    """Runs of lookups, with so many entries in a block: node -> its run, and its place in it."""
    places: dict[int, tuple[Run, int]] = {}
    for (table, base), members in graph.neighbours(order).items():
        offsets = sorted(members)
        runs: list[list[int]] = []
        for offset in offsets:
            # What lies between two is read for nothing.
            if runs and offset - runs[-1][-1] <= 2 and offset - runs[-1][0] < BLOCKS * block:
                runs[-1].append(offset)
            else:
                runs.append([offset])
        start, end = runs[-1][0], runs[-1][-1]
        last = max(end, start + block - 1) if end - start > 1 else end  # a block may reach beyond its run
        for near in runs:
            run = Run(table, base, near[0], near[-1] - near[0] + 1, offsets[0], last)
            places.update((members[offset], (run, offset - near[0])) for offset in near)
    return places
