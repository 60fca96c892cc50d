"""Access of a kernel to its arrays, tables and results: addresses, loads and stores, as LLVM IR.

Names in the IR: %p0 is the address of array 0, %r0 that of its part for row i, %t0 a table, %o0 an output and %q0 its
part for row i; %i and %j are the steps along the outer and the inner axis.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...trace.graph import MASK
from . import machine
from .lanes import FLOAT32, Lanes, Value
from .lookups import Lookups
from .program import EACH, PACKED, PLANES, Program

INLINE = 4  # components of a vector that are taken apart by shuffles; of longer ones by gathers


class Access:
    """Writes loads and stores of a program to `v`; `values`: of its nodes, as far as computed."""

    def __init__(self, program: Program, v: Lanes, order: Sequence[int], values: dict[int, Value]):
        self.program, self.v, self.values = program, v, values
        self.width, self.real = v.width, v.scalar["real"]
        self.size = 4 if program.dtype == FLOAT32 else 8
        self.index_type = f"<{self.width} x i64>"
        self.lanes = f"<{', '.join(f'i64 {i}' for i in range(self.width))}>"
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

    def moved(self, name: str, base: str, steps: str, stride: str) -> str:
        """An address so many strides after another, under a name."""
        self.v.write(f"{name}.step = mul i64 {steps}, {stride}")
        self.v.write(f"{name} = getelementptr i8, ptr {base}, i64 {name}.step")
        return name

    def beyond(self, base: str, count: int) -> str:
        """The address so many bytes beyond another."""
        name = self.v.name()
        self.v.write(f"{name} = getelementptr i8, ptr {base}, i64 {count}")
        return name

    def component(self, base: str, k: int, c: int) -> str:
        """The address of component c at an address of array k."""
        if self.program.arrays[k].layout == PACKED:
            return self.beyond(base, c * self.size)
        return self.moved(self.v.name(), base, f"%p{k}.sc", str(c))

    def splat(self, node: int, base: str) -> Value:
        """One number in all lanes."""
        k, c = self.program.graph.arguments[node]
        address, name = self.component(f"%{base}{k}", k, c), self.v.name()
        self.v.write(f"{name}.s = load {self.real}, ptr {address}, align 1")
        return Value("real", self.v.spread(name, self.real, f"{name}.s"))

    def full_loads(self, nodes: Sequence[int]) -> list[Value]:
        loads: dict[int, Value] = {}
        by_array: dict[int, list[int]] = {}
        for node in nodes:
            by_array.setdefault(self.program.graph.arguments[node][0], []).append(node)
        for k, members in by_array.items():
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

    def offset(self, k: int) -> str:
        """The address of element j of array k."""
        return self.moved(self.v.name(), f"%r{k}", "%j", f"%p{k}.s1")

    def vector_load(self, address: str) -> Value:
        return self.v.emit("real", f"load {self.v.types['real']}, ptr {address}, align 1")

    def packed_loads(self, k: int, components: Sequence[int]) -> list[Value]:
        base, n, w = self.offset(k), self.program.arrays[k].width, self.width
        parts = [self.vector_load(self.beyond(base, i * w * self.size)) for i in range(n)]
        return [self.merged(parts, [divmod(p, w) for p in range(c, n * w, n)]) for c in components]

    def merged(self, parts: Sequence[Value], places: Sequence[tuple[int, int]]) -> Value:
        """The vector whose lanes are at these places (part, lane), by one shuffle for every part but the first."""
        merged = parts[0]
        for i in range(1, len(parts)):
            picks: list[int | str] = []
            for lane, (part, at) in enumerate(places):
                if part < i:  # in its place since the first shuffle
                    picks.append(at if i == 1 else lane)
                else:
                    picks.append(self.width + at if part == i else "poison")
            merged = self.v.shuffle(merged, parts[i], self.width, picks)
        return merged

    def gathered(self, node: int, lanes: str) -> Value:
        """A component of elements j + lanes, one by one."""
        k, c = self.program.graph.arguments[node]
        base, name = self.component(self.offset(k), k, c), self.v.name()
        self.v.spread(f"{name}.s1", "i64", f"%p{k}.s1")
        self.v.write(f"{name}.steps = mul {self.index_type} {lanes}, {name}.s1")
        self.v.write(f"{name}.at = getelementptr i8, ptr {base}, {self.index_type} {name}.steps")
        return self.gather(f"{name}.at", 1, self.real)

    def gather(self, pointers: str, align: int, real: str) -> Value:
        """The numbers of a scalar type at these addresses."""
        w, kind = self.width, f"<{self.width} x {real}>"
        name = f"masked.gather.v{w}{'f32' if real == 'float' else 'f64'}.v{w}p0"
        mask = (f"<{w} x i1>", "splat (i1 true)")
        arguments = (f"<{w} x ptr>", pointers), ("i32", str(align)), mask, (kind, "poison")
        return self.v.emit("real", self.v.intrinsic(name, kind, *arguments))

    def rows(self, arrays: Sequence[int]) -> None:
        """The addresses at which row i of arrays and outputs begins."""
        for k in arrays:
            self.moved(f"%r{k}", f"%p{k}", "%i", f"%p{k}.s0")
        for k in range(len(self.program.outputs)):
            self.moved(f"%q{k}", f"%o{k}", "%i", f"%o{k}.s0")

    def remaining(self) -> None:
        """A mask of the lanes within the row, and an element for each lane: its own, or the row's last."""
        self.v.write("%last = sub i64 %left, 1")
        last = self.v.spread("%last.all", "i64", "%last")
        self.v.write(f"%inside = icmp ule {self.index_type} {self.lanes}, {last}")
        choice = f"select <{self.width} x i1> %inside, {self.index_type} {self.lanes}, {self.index_type} {last}"
        self.v.write(f"%lanes = {choice}")

    # Tables.

    def lookup(self, node: int) -> Value:
        """Entries of a table; a constant place is within it, which callers see to."""
        table, index_node = self.program.graph.arguments[node]
        place = self.program.graph.value(index_node)
        if place is not None:
            address, name = self.beyond(f"%t{table}", int(place) * self.size), self.v.name()
            self.v.write(f"{name}.s = load {self.real}, ptr {address}, align {self.size}")
            return Value("real", self.v.spread(name, self.real, f"{name}.s"))
        return self.lookups.entry(node, self.values[index_node])

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
        return self.beyond(self.moved(self.v.name(), f"%q{k}", "%j", str(step)), offset)

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
                part = self.merged([x for x, _, _ in values], [(p % n, p // n) for p in range(i * w, (i + 1) * w)])
                address = self.output_address(k, n * size, i * w * size)
                self.v.write(f"store {kind} {part.name}, ptr {address}, align 1")

    def store_part(self) -> None:
        for k, output in enumerate(self.program.outputs):
            if output.use == EACH:
                self.scatter(k, "%valid", [self.stored(node) for node in output.nodes])

    def scatter(self, k: int, mask: str, values: Sequence[tuple[Value, str, int]]) -> None:
        n, w = len(values), self.width
        for c, (value, kind, size) in enumerate(values):
            address, name = self.output_address(k, n * size, c * size), self.v.name()
            steps = ", ".join(f"i64 {lane * n * size}" for lane in range(w))
            self.v.write(f"{name} = getelementptr i8, ptr {address}, {self.index_type} <{steps}>")
            full = f"masked.scatter.v{w}{'i8' if size == 1 else f'f{8 * size}'}.v{w}p0"
            arguments = (kind, value.name), (f"<{w} x ptr>", name), ("i32", "1"), (f"<{w} x i1>", mask)
            self.v.write(self.v.intrinsic(full, "void", *arguments))

    def accumulate(self, k: int) -> None:
        wide = f"<{self.width} x double>"
        for c, node in enumerate(self.program.outputs[k].nodes):
            term = self.v.select(Value("mask", "%valid"), self.values[node], self.v.real(0.0))
            if self.size == 4:
                term = self.v.emit("real", f"fpext {self.v.types['real']} {term.name} to {wide}")
            self.v.write(f"%total{k}.{c}.next = fadd {wide} %total{k}.{c}, {term.name}")

    def store_total(self, k: int) -> None:
        wide = f"<{self.width} x double>"
        for c in range(len(self.program.outputs[k].nodes)):
            arguments = ("double", "0.0"), (wide, f"%total{k}.{c}")
            call = self.v.intrinsic(f"vector.reduce.fadd.v{self.width}f64", "double", *arguments)
            total, name = self.v.emit("real", call.replace("call", "call reassoc")), self.v.name()
            self.v.write(f"{name}.at = getelementptr double, ptr %q{k}, i64 {c}")
            self.v.write(f"store double {total.name}, ptr {name}.at, align 8")

    def store_once(self, k: int) -> None:
        for c, node in enumerate(self.program.outputs[k].nodes):
            value, kind, size = self.stored(node)
            first = self.v.emit(value.kind, f"extractelement {kind} {value.name}, i64 0")
            address = self.beyond(f"%q{k}", c * size)
            self.v.write(f"store {'i8' if size == 1 else self.real} {first.name}, ptr {address}, align 1")
