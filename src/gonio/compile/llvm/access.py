"""Access of a kernel to its arrays, tables and results: addresses, loads and stores, as LLVM IR.

Names in the IR: %p0 is the address of array 0, %r0 that of its part for row i, %t0 a table, %o0 an output and %q0 its
part for row i; %i and %j are the steps along the outer and the inner axis.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...trace.graph import MASK
from .lanes import FLOAT32, Lanes, Value
from .program import EACH, PACKED, PLANES, Program

INLINE = 4  # components of a vector that are taken apart by shuffles; of longer ones by gathers


class Access:
    """Writes loads and stores for a program to `v`; `values` holds what its nodes are, as far as computed."""

    def __init__(self, program: Program, v: Lanes, order: Sequence[int], values: dict[int, Value]):
        self.program, self.v, self.values = program, v, values
        self.width, self.real = v.width, v.scalar["real"]
        self.size = 4 if program.dtype == FLOAT32 else 8
        self.index_type = f"<{self.width} x i64>"
        self.lanes = f"<{', '.join(f'i64 {i}' for i in range(self.width))}>"
        self.paired = self.pairs(order) if program.dtype == FLOAT32 else {}
        self.read: dict[int, tuple[Value, Value]] = {}

    # Arguments and inputs.

    def arguments(self) -> None:
        at = 0

        def word(name: str, kind: str) -> None:
            nonlocal at
            self.v.lines.append(f"{name}.at = getelementptr i64, ptr %args, i64 {at}")
            self.v.lines.append(f"{name} = load {kind}, ptr {name}.at, align 8")
            at += 1

        for k in range(len(self.program.arrays)):
            word(f"%p{k}", "ptr")
            for part in ("s0", "s1", "sc"):
                word(f"%p{k}.{part}", "i64")
        for k in range(self.program.tables):
            word(f"%t{k}", "ptr")
            word(f"%t{k}.last64", "i64")
            self.v.lines.append(f"%t{k}.last = trunc i64 %t{k}.last64 to i32")
            self.v.lines.append(f"%t{k}.some = insertelement {self.v.types['index']} poison, i32 %t{k}.last, i64 0")
            self.v.lines.append(
                f"%t{k}.end = shufflevector {self.v.types['index']} %t{k}.some, {self.v.types['index']} poison, "
                f"<{self.width} x i32> zeroinitializer"
            )
        for k in range(len(self.program.outputs)):
            word(f"%o{k}", "ptr")
            word(f"%o{k}.s0", "i64")

    def component(self, base: str, k: int, c: int) -> str:
        """The address of component c at an address of array k."""
        name = self.v.name()
        if self.program.arrays[k].layout == PACKED:
            self.v.lines.append(f"{name} = getelementptr i8, ptr {base}, i64 {c * self.size}")
            return name
        self.v.lines.append(f"{name}.step = mul i64 %p{k}.sc, {c}")
        self.v.lines.append(f"{name} = getelementptr i8, ptr {base}, i64 {name}.step")
        return name

    def splat(self, node: int, base: str) -> Value:
        """One number in all lanes."""
        k, c = self.program.graph.arguments[node]
        address = self.component(f"%{base}{k}", k, c)
        name, kind = self.v.name(), self.v.types["real"]
        self.v.lines.append(f"{name}.s = load {self.real}, ptr {address}, align 1")
        self.v.lines.append(f"{name}.v = insertelement {kind} poison, {self.real} {name}.s, i64 0")
        return self.v.emit(
            "real", f"shufflevector {kind} {name}.v, {kind} poison, <{self.width} x i32> zeroinitializer"
        )

    def full_loads(self, nodes: Sequence[int]) -> list[Value]:
        found: dict[int, Value] = {}
        by_array: dict[int, list[int]] = {}
        for node in nodes:
            by_array.setdefault(self.program.graph.arguments[node][0], []).append(node)
        for k, members in by_array.items():
            array = self.program.arrays[k]
            components = [self.program.graph.arguments[node][1] for node in members]
            if array.layout == PACKED and array.width <= INLINE:
                read = self.packed_loads(k, components)
            elif array.layout == PLANES:
                read = [self.plane_load(k, c) for c in components]
            else:
                read = [self.gathered(node, self.lanes) for node in members]
            found.update(zip(members, read, strict=True))
        return [found[node] for node in nodes]

    def offset(self, k: int) -> str:
        """The address of element j of array k."""
        name = self.v.name()
        self.v.lines.append(f"{name}.step = mul i64 %j, %p{k}.s1")
        self.v.lines.append(f"{name} = getelementptr i8, ptr %r{k}, i64 {name}.step")
        return name

    def vector_load(self, address: str) -> Value:
        return self.v.emit("real", f"load {self.v.types['real']}, ptr {address}, align 1")

    def packed_loads(self, k: int, components: Sequence[int]) -> list[Value]:
        base, n, w = self.offset(k), self.program.arrays[k].width, self.width
        parts = []
        for i in range(n):
            address = self.v.name()
            self.v.lines.append(f"{address} = getelementptr i8, ptr {base}, i64 {i * w * self.size}")
            parts.append(self.vector_load(address))
        return [
            self.merged(parts, [p // w for p in range(c, n * w, n)], [p % w for p in range(c, n * w, n)])
            for c in components
        ]

    def merged(self, parts: Sequence[Value], which: Sequence[int], lane: Sequence[int]) -> Value:
        """The vector whose lane l is lane[l] of parts[which[l]], by one shuffle for every part but the first."""
        kind, current = self.v.types["real"], parts[0]
        if len(parts) == 1:
            return current
        placed = False
        for i in range(1, len(parts)):
            picks = []
            for to, (part, at) in enumerate(zip(which, lane, strict=True)):
                if part == i:
                    picks.append(f"i32 {self.width + at}")
                elif part < i:
                    picks.append(f"i32 {to if placed else at}")
                else:
                    picks.append("i32 poison")
            picked = ", ".join(picks)
            current = self.v.emit(
                "real",
                f"shufflevector {kind} {current.name}, {kind} {parts[i].name}, <{self.width} x i32> <{picked}>",
            )
            placed = True
        return current

    def plane_load(self, k: int, c: int) -> Value:
        return self.vector_load(self.component(self.offset(k), k, c))

    def gathered(self, node: int, lanes: str) -> Value:
        """A component of elements j + lanes, one by one."""
        k, c = self.program.graph.arguments[node]
        base = self.component(self.offset(k), k, c)
        name = self.v.name()
        self.spread(f"{name}.s1", f"%p{k}.s1")
        self.v.lines.append(f"{name}.steps = mul {self.index_type} {lanes}, {name}.s1")
        self.v.lines.append(f"{name}.at = getelementptr i8, ptr {base}, {self.index_type} {name}.steps")
        return self.gather(f"{name}.at", 1)

    def spread(self, name: str, word: str) -> None:
        """A 64-bit word in all lanes."""
        self.v.lines.append(f"{name}.some = insertelement {self.index_type} poison, i64 {word}, i64 0")
        self.v.lines.append(
            f"{name} = shufflevector {self.index_type} {name}.some, {self.index_type} poison, "
            f"<{self.width} x i32> zeroinitializer"
        )

    def suffix(self) -> str:
        return f"v{self.width}f{8 * self.size}"

    def gather(self, pointers: str, align: int) -> Value:
        w, kind = self.width, self.v.types["real"]
        full = f"@llvm.masked.gather.{self.suffix()}.v{w}p0"
        self.v.declare(f"{kind} {full}(<{w} x ptr>, i32, <{w} x i1>, {kind})")
        return self.v.emit(
            "real",
            f"call {kind} {full}(<{w} x ptr> {pointers}, i32 {align}, <{w} x i1> splat (i1 true), {kind} poison)",
        )

    def rows(self, arrays: Sequence[int]) -> None:
        """The addresses at which row i of arrays and outputs begins."""
        for k in arrays:
            self.v.lines.append(f"%r{k}.step = mul i64 %i, %p{k}.s0")
            self.v.lines.append(f"%r{k} = getelementptr i8, ptr %p{k}, i64 %r{k}.step")
        for k in range(len(self.program.outputs)):
            self.v.lines.append(f"%q{k}.step = mul i64 %i, %o{k}.s0")
            self.v.lines.append(f"%q{k} = getelementptr i8, ptr %o{k}, i64 %q{k}.step")

    def remaining(self) -> None:
        """A mask of the lanes within the row, and an element for each lane: its own, or the row's last."""
        self.v.lines.append("%last = sub i64 %left, 1")
        self.spread("%last.all", "%last")
        self.v.lines.append(f"%inside = icmp ule {self.index_type} {self.lanes}, %last.all")
        choice = f"select <{self.width} x i1> %inside, {self.index_type} {self.lanes}, {self.index_type} %last.all"
        self.v.lines.append(f"%lanes = {choice}")

    # Tables.

    def pairs(self, order: Sequence[int]) -> dict[int, tuple[int, int]]:
        """Pairs of lookups that read neighbouring entries, in one load: node -> (first node of its pair, 0 or 1)."""
        graph = self.program.graph
        places: dict[tuple, dict[int, int]] = {}
        for node in order:
            if graph.operations[node] == "take":
                table, index = graph.arguments[node]
                base, offset = graph.split(index)
                if base is not None:
                    places.setdefault((table, base), {})[int(offset)] = node
        found: dict[int, tuple[int, int]] = {}
        for members in places.values():
            for offset in sorted(members):
                if offset + 1 in members and members[offset] not in found:
                    found[members[offset]] = (members[offset], 0)
                    found[members[offset + 1]] = (members[offset], 1)
        return found

    def partner(self, node: int) -> Value:
        """An entry that is read together with a neighbour."""
        first, which = self.paired[node]
        if first not in self.read:
            table, index = self.program.graph.arguments[node]
            start = self.values[index]
            self.read[first] = self.pair(table, self.v.integer("sub", start, self.v.index(1)) if which else start)
        return self.read[first][which]

    def pair(self, table: int, index: Value) -> tuple[Value, Value]:
        """Two neighbouring entries of a table, loaded as one number of twice the length."""
        w, real = self.width, f"<{2 * self.width} x {self.real}>"
        full, name = f"@llvm.masked.gather.v{w}f64.v{w}p0", self.v.name()
        self.v.declare(f"<{w} x double> {full}(<{w} x ptr>, i32, <{w} x i1>, <{w} x double>)")
        pointers = self.pointers(table, index)
        self.v.lines.append(
            f"{name}.two = call <{w} x double> {full}(<{w} x ptr> {pointers}, i32 4, <{w} x i1> splat (i1 true), "
            f"<{w} x double> poison)"
        )
        self.v.lines.append(f"{name} = bitcast <{w} x double> {name}.two to {real}")
        both = []
        for start in (0, 1):
            picks = ", ".join(f"i32 {i}" for i in range(start, 2 * w, 2))
            both.append(self.v.emit("real", f"shufflevector {real} {name}, {real} poison, <{w} x i32> <{picks}>"))
        return both[0], both[1]

    def lookup(self, node: int) -> Value:
        """Entries of a table; an index beyond it reads its last entry."""
        if node in self.paired:
            return self.partner(node)
        table, index = self.program.graph.arguments[node]
        return self.gather(self.pointers(table, self.values[index]), self.size)

    def pointers(self, table: int, index: Value) -> str:
        """The addresses of entries of a table."""
        v, w = self.v, self.width
        kind = v.types["index"]
        v.declare(f"{kind} @llvm.umin.v{w}i32({kind}, {kind})")
        safe = v.emit("index", f"call {kind} @llvm.umin.v{w}i32({kind} {index.name}, {kind} %t{table}.end)")
        pointers = v.name()
        v.lines.append(f"{pointers} = getelementptr {self.real}, ptr %t{table}, {kind} {safe.name}")
        return pointers

    # Outputs.

    def stored(self, node: int) -> tuple[Value, str, int]:
        """A node's value as it is stored, its type, and the size of one element: masks become bytes."""
        value = self.values[node]
        if value.kind != MASK:
            return value, self.v.types["real"], self.size
        kind = f"<{self.width} x i8>"
        return self.v.emit("bytes", f"zext {self.v.types['mask']} {value.name} to {kind}"), kind, 1

    def output_address(self, k: int, step: int, offset: int = 0) -> str:
        """The address of element j of output k, whose elements are `step` bytes apart."""
        name = self.v.name()
        self.v.lines.append(f"{name}.j = mul i64 %j, {step}")
        self.v.lines.append(f"{name}.a = getelementptr i8, ptr %q{k}, i64 {name}.j")
        self.v.lines.append(f"{name} = getelementptr i8, ptr {name}.a, i64 {offset}")
        return name

    def store_full(self) -> None:
        for k, output in enumerate(self.program.outputs):
            if output.use != EACH:
                continue
            values = [self.stored(node) for node in output.nodes]
            n, w, (_, kind, size) = len(values), self.width, values[0]
            if n > INLINE:
                self.scatter(k, "splat (i1 true)", values)
                continue
            for i in range(n):
                places = range(i * w, (i + 1) * w)
                part = self.merged([x for x, _, _ in values], [p % n for p in places], [p // n for p in places])
                address = self.output_address(k, n * size, i * w * size)
                self.v.lines.append(f"store {kind} {part.name}, ptr {address}, align 1")

    def store_part(self) -> None:
        for k, output in enumerate(self.program.outputs):
            if output.use == EACH:
                self.scatter(k, "%valid", [self.stored(node) for node in output.nodes])

    def scatter(self, k: int, mask: str, values: Sequence[tuple[Value, str, int]]) -> None:
        n, w = len(values), self.width
        for c, (value, kind, size) in enumerate(values):
            address, name = self.output_address(k, n * size, c * size), self.v.name()
            steps = ", ".join(f"i64 {lane * n * size}" for lane in range(w))
            self.v.lines.append(f"{name} = getelementptr i8, ptr {address}, {self.index_type} <{steps}>")
            element = "i8" if size == 1 else f"f{8 * size}"
            full = f"@llvm.masked.scatter.v{w}{element}.v{w}p0"
            self.v.declare(f"void {full}({kind}, <{w} x ptr>, i32, <{w} x i1>)")
            self.v.lines.append(f"call void {full}({kind} {value.name}, <{w} x ptr> {name}, i32 1, <{w} x i1> {mask})")

    def accumulate(self, k: int) -> None:
        wide = f"<{self.width} x double>"
        for c, node in enumerate(self.program.outputs[k].nodes):
            term = self.v.select(Value("mask", "%valid"), self.values[node], self.v.real(0.0)).name
            if self.size == 4:
                name = self.v.name()
                self.v.lines.append(f"{name} = fpext {self.v.types['real']} {term} to {wide}")
                term = name
            self.v.lines.append(f"%total{k}.{c}.next = fadd {wide} %total{k}.{c}, {term}")

    def store_total(self, k: int) -> None:
        wide = f"<{self.width} x double>"
        full = f"@llvm.vector.reduce.fadd.v{self.width}f64"
        self.v.declare(f"double {full}(double, {wide})")
        for c in range(len(self.program.outputs[k].nodes)):
            name = self.v.name()
            self.v.lines.append(f"{name} = call reassoc double {full}(double 0.0, {wide} %total{k}.{c})")
            self.v.lines.append(f"{name}.at = getelementptr double, ptr %q{k}, i64 {c}")
            self.v.lines.append(f"store double {name}, ptr {name}.at, align 8")

    def store_once(self, k: int) -> None:
        for c, node in enumerate(self.program.outputs[k].nodes):
            value, kind, size = self.stored(node)
            element, name = "i8" if size == 1 else self.real, self.v.name()
            self.v.lines.append(f"{name} = extractelement {kind} {value.name}, i64 0")
            self.v.lines.append(f"{name}.at = getelementptr i8, ptr %q{k}, i64 {c * size}")
            self.v.lines.append(f"store {element} {name}, ptr {name}.at, align 1")
