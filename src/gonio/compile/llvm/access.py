"""Access of a kernel to its arrays and tables: addresses and loads, as LLVM IR; stores are in `stores.py`.

Names in the IR: %p0 is the address of array 0, %r0 that of its part for row i, %t0 a table, %o0 an output and %q0 its
part for row i; %i and %j are the steps along the outer and the inner axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd

from . import machine
from .lanes import IRValue, Lanes
from .lookups import Lookups
from .program import PACKED, PLANES, Program

LINE = 64  # bytes of a line of the cache
STRUCTURED = 16  # bytes of ARM's vectors: instructions of its own take structures of two to four apart
AHEAD = 2048
"""How far ahead inputs beyond the caches are asked for [bytes]; without that, processors wait at every page."""
INLINE = 4  # components of a vector that are taken apart by shuffles; of longer ones by gathers


class Access:
    """Writes loads of a program to `v`; `values`: of its nodes, as far as computed."""

    def __init__(self, program: Program, v: Lanes, order: Sequence[int], values: dict[int, IRValue]):
        self.program, self.v, self.values = program, v, values
        self.width, self.real, self.size = v.width, v.scalar["real"], v.size
        self.index_type = f"<{self.width} x i64>"
        self.lanes = f"<{', '.join(f'i64 {i}' for i in range(self.width))}>"
        self.masks: dict[tuple[int, int, int], str] = {}  # of places that are left
        self.lookups = Lookups(program, v, order, min(machine.lanes(program.dtype), v.width))

    # Arguments and inputs.

    def arguments(self) -> None:
        at = 0

        def word(name: str, kind: str = "i64") -> None:
            nonlocal at
            self.v.write(f"{name}.at = getelementptr i64, ptr %args, i64 {at}")
            self.v.write(f"{name} = load {kind}, ptr {name}.at, align 8")
            at += 1

        for k in range(len(self.program.arrays)):
            word(f"%p{k}", "ptr")
            for part in ("s0", "s1", "sc"):
                word(f"%p{k}.{part}")
        for k in range(self.program.tables):
            word(f"%t{k}", "ptr")
            word(f"%t{k}.last64")
            self.v.write(f"%t{k}.last = trunc i64 %t{k}.last64 to i32")
            self.v.spread(f"%t{k}.end", "i32", f"%t{k}.last")
        for k in range(len(self.program.outputs)):
            word(f"%o{k}", "ptr")
            word(f"%o{k}.s0")
        word("%past")
        self.v.write("%past.caches = icmp ne i64 %past, 0")

    def rows(self, arrays: Sequence[int]) -> None:
        """The addresses at which row i of arrays begins."""
        for k in arrays:
            self.v.moved(f"%r{k}", f"%p{k}", "%i", f"%p{k}.s0")

    def component(self, base: str, k: int, c: int) -> str:
        """The address of component c at an address of array k."""
        if self.program.arrays[k].layout == PACKED:
            return self.v.beyond(base, c * self.size)
        return self.v.moved(self.v.name(), base, f"%p{k}.sc", str(c))

    def splat(self, node: int, base: str) -> IRValue:
        """One number in all lanes."""
        k, c = self.program.graph.arguments[node]
        address, name = self.component(f"%{base}{k}", k, c), self.v.name()
        self.v.write(f"{name}.s = load {self.real}, ptr {address}, align 1")
        return IRValue("real", self.v.spread(name, self.real, f"{name}.s"))

    def look_ahead(self, nodes: Sequence[int]) -> None:
        """Ask for the lines of the cache that loads need some turns later: no error where they are beyond an array."""
        for k in {self.program.graph.arguments[node][0]: 0 for node in nodes}:
            array = self.program.arrays[k]
            if array.layout == PACKED and array.width <= INLINE:
                places, count = [self.offset(k)], array.width
            elif array.layout == PLANES:
                places, count = [self.component(self.offset(k), k, c) for c in range(array.width)], 1
            else:
                continue
            for place in places:
                for line in range(0, count * self.width * self.size, LINE):
                    how = (("i32", n) for n in ("0", "3", "1"))  # to be read, soon, data
                    call = self.v.intrinsic("prefetch.p0", "void", ("ptr", self.v.beyond(place, AHEAD + line)), *how)
                    self.v.write(call)

    def full_loads(self, nodes: Sequence[int]) -> list[IRValue]:
        loads: dict[int, IRValue] = {}
        for k, members in self.by_array(nodes).items():
            array = self.program.arrays[k]
            components = [self.program.graph.arguments[node][1] for node in members]
            if array.layout == PACKED and array.width <= INLINE:
                values = self.packed_loads(k, components)
            elif array.layout == PLANES:
                values = [self.vector_load(self.component(self.offset(k), k, c)) for c in components]
            else:
                values = [self.gathered(node, self.lanes) for node in members]
            loads.update(zip(members, values, strict=True))
        return [loads[node] for node in nodes]

    def by_array(self, nodes: Sequence[int]) -> dict[int, list[int]]:
        """The loads of each array."""
        arrays: dict[int, list[int]] = {}
        for node in nodes:
            arrays.setdefault(self.program.graph.arguments[node][0], []).append(node)
        return arrays

    def offset(self, k: int) -> str:
        """The address of element j of array k."""
        return self.v.moved(self.v.name(), f"%r{k}", "%j", f"%p{k}.s1")

    def vector_load(self, address: str) -> IRValue:
        return self.v.emit("real", f"load {self.v.types['real']}, ptr {address}, align 1")

    def packed_loads(self, k: int, components: Sequence[int], left: bool = False) -> list[IRValue]:
        """Components of vectors side by side; `left`: those within the row alone, and 0."""
        base, n, w = self.offset(k), self.program.arrays[k].width, self.width
        if self.v.register * self.size == STRUCTURED:
            return self.structured_loads(base, n, components)
        if gcd(n, self.v.register) == 1 < n:
            return self.blended_loads(base, n, components, left)
        parts = [self.side_by_side(base, i * w, w, n * left) for i in range(n)]
        return [self.v.merged(parts, [divmod(p, w) for p in range(c, n * w, n)]) for c in components]

    def side_by_side(self, base: str, start: int, count: int, left: int) -> IRValue:
        """So many numbers from the start-th after an address on; `left`: how many each element has of which only those
        within the row are read."""
        vector, address = f"<{count} x {self.real}>", self.v.beyond(base, start * self.size)
        if not left:
            return self.v.emit("real", f"load {vector}, ptr {address}, align 1")
        if (left, start, count) not in self.masks:
            self.masks[left, start, count] = self.places_left(left, start, count)
        mask, suffix = self.masks[left, start, count], f"v{count}{'f32' if self.real == 'float' else 'f64'}"
        arguments = ("ptr", address), ("i32", "1"), (f"<{count} x i1>", mask), (vector, "zeroinitializer")
        return self.v.emit("real", self.v.intrinsic(f"masked.load.{suffix}.p0", vector, *arguments))

    def places_left(self, width: int, start: int, count: int) -> str:
        """A mask of places that are within the row: so many, from a start on, of vectors of this width."""
        name, vector = self.v.name(), f"<{count} x i32>"
        self.v.write(f"{name}.end = mul i32 %left.short, {width}")
        self.v.write(f"{name}.some = insertelement {vector} poison, i32 {name}.end, i64 0")
        self.v.write(f"{name}.all = shufflevector {vector} {name}.some, {vector} poison, {vector} zeroinitializer")
        places = ", ".join(f"i32 {start + i}" for i in range(count))
        self.v.write(f"{name} = icmp ult {vector} <{places}>, {name}.all")
        return name

    def blended_loads(self, base: str, n: int, components: Sequence[int], left: bool) -> list[IRValue]:
        """`packed_loads` where each lane of n registers side by side holds every component once: they are blended into
        a register for each component, which one permutation orders. (LLVM makes a blend and a permutation of two
        registers of it for AVX-512, where that takes no longer.)"""
        w = self.v.register
        pieces: dict[int, list[IRValue]] = {c: [] for c in components}
        for start in range(0, n * self.width, n * w):
            parts = [self.side_by_side(base, start + i * w, w, n * left) for i in range(n)]
            for c in components:
                which = [next(i for i in range(n) if (i * w + lane) % n == c) for lane in range(w)]
                gathered = self.v.blended(parts, which)
                pieces[c].append(self.v.shuffle(gathered, gathered, w, [(e * n + c) % w for e in range(w)]))
        return [self.v.joined(pieces[c], w) for c in components]

    def structured_loads(self, base: str, n: int, components: Sequence[int]) -> list[IRValue]:
        """`packed_loads` in the form that LLVM knows as ARM's loads of structures."""
        w, vector = self.v.register, f"<{n * self.v.register} x {self.real}>"
        pieces: dict[int, list[IRValue]] = {c: [] for c in components}
        for start in range(0, n * self.width, n * w):
            whole = self.v.emit("real", f"load {vector}, ptr {self.v.beyond(base, start * self.size)}, align 1")
            for c in components:
                pieces[c].append(self.v.shuffle(whole, IRValue("real", "poison"), n * w, range(c, n * w, n)))
        return [self.v.joined(pieces[c], w) for c in components]

    def part_loads(self, nodes: Sequence[int]) -> list[IRValue]:
        """The loads of the elements that are left of a row."""
        loads: dict[int, IRValue] = {}
        for k, members in self.by_array(nodes).items():
            array = self.program.arrays[k]
            packed = array.layout == PACKED and 1 < array.width <= INLINE
            if packed and self.v.register * self.size != STRUCTURED:
                loads.update(zip(members, self.packed_rest(k, members), strict=True))
            else:
                loads.update((node, self.part_load(node)) for node in members)
        return [loads[node] for node in nodes]

    def packed_rest(self, k: int, members: Sequence[int]) -> list[IRValue]:
        """`packed_loads` of the elements that are left, and the row's last in all further lanes.

        Gathers would do both at once, but compilers take them apart, number by number.
        """
        components = [self.program.graph.arguments[node][1] for node in members]
        end, inside, loads = (
            self.v.moved(self.v.name(), f"%r{k}", "%final", f"%p{k}.s1"),
            IRValue("mask", "%inside"),
            [],
        )
        for value, c in zip(self.packed_loads(k, components, left=True), components, strict=True):
            address, name = self.component(end, k, c), self.v.name()
            self.v.write(f"{name}.s = load {self.real}, ptr {address}, align 1")
            last = IRValue("real", self.v.spread(name, self.real, f"{name}.s"))
            loads.append(self.v.select(inside, value, last))
        return loads

    def part_load(self, node: int) -> IRValue:
        """A component of the elements that are left of a row; where they lie side by side, by one masked load."""
        k, c = self.program.graph.arguments[node]
        array = self.program.arrays[k]
        if array.layout != PLANES and not (array.layout == PACKED and array.width == 1):
            return self.gathered(node, "%lanes")
        vector, address = self.v.types["real"], self.component(self.offset(k), k, c)
        arguments = ("ptr", address), ("i32", "1"), (f"<{self.width} x i1>", "%inside"), (vector, "zeroinitializer")
        return self.v.emit("real", self.v.intrinsic(f"masked.load.{self.v.suffix}.p0", vector, *arguments))

    def gathered(self, node: int, lanes: str) -> IRValue:
        """A component of elements j + lanes, one by one."""
        k, c = self.program.graph.arguments[node]
        base, name = self.component(self.offset(k), k, c), self.v.name()
        self.v.spread(f"{name}.s1", "i64", f"%p{k}.s1")
        self.v.write(f"{name}.steps = mul {self.index_type} {lanes}, {name}.s1")
        self.v.write(f"{name}.at = getelementptr i8, ptr {base}, {self.index_type} {name}.steps")
        return self.gather(f"{name}.at", 1, self.real)

    def gather(self, pointers: str, align: int, real: str) -> IRValue:
        """The numbers of a scalar type at these addresses."""
        w, vector = self.width, f"<{self.width} x {real}>"
        name = f"masked.gather.v{w}{'f32' if real == 'float' else 'f64'}.v{w}p0"
        mask = (f"<{w} x i1>", "splat (i1 true)")
        arguments = (f"<{w} x ptr>", pointers), ("i32", str(align)), mask, (vector, "poison")
        return self.v.emit("real", self.v.intrinsic(name, vector, *arguments))

    def remaining(self) -> None:
        """A mask of the lanes within the row, and an element for each lane: its own, or the row's last."""
        self.v.write("%last = sub i64 %left, 1", "%final = add i64 %j, %last", "%left.short = trunc i64 %left to i32")
        last = self.v.spread("%last.all", "i64", "%last")
        self.v.write(f"%inside = icmp ule {self.index_type} {self.lanes}, {last}")
        choice = f"select <{self.width} x i1> %inside, {self.index_type} {self.lanes}, {self.index_type} {last}"
        self.v.write(f"%lanes = {choice}")

    # Tables.

    def lookup(self, node: int) -> IRValue:
        """Entries of a table; a constant place is within it, which callers see to."""
        table, index_node = self.program.graph.arguments[node]
        place = self.program.graph.value(index_node)
        if place is not None:
            address, name = self.v.beyond(f"%t{table}", int(place) * self.size), self.v.name()
            self.v.write(f"{name}.s = load {self.real}, ptr {address}, align {self.size}")
            return IRValue("real", self.v.spread(name, self.real, f"{name}.s"))
        return self.lookups.entry(node, self.values[index_node])
