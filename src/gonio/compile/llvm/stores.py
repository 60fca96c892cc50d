"""Results of a kernel: stores of elements, and sums, as LLVM IR. Names are those of `access.py`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import gcd

from ...trace.graph import MASK
from .access import INLINE, LINE, STRUCTURED
from .lanes import IRValue, Lanes
from .program import ADDED, EACH, SQUARED, Program

SQUARE = 16  # numbers of a matrix, which are stored together


class Stores:
    """Writes stores of a program to `v`; `values`: of its nodes, as far as computed."""

    def __init__(self, program: Program, v: Lanes, values: dict[int, IRValue]):
        self.program, self.v, self.values = program, v, values
        self.width, self.real, self.size = v.width, v.scalar["real"], v.size

    def rows(self) -> None:
        """The addresses at which row i of outputs begins, and whether it goes past the caches."""
        for k in range(len(self.program.outputs)):
            self.v.moved(f"%q{k}", f"%o{k}", "%i", f"%o{k}.s0")
        streamed = "%past.caches"
        for k in filter(self.streamable, range(len(self.program.outputs))):
            name = f"%q{k}.line"
            self.v.write(f"{name}.at = ptrtoint ptr %q{k} to i64", f"{name}.off = and i64 {name}.at, {LINE - 1}")
            self.v.write(f"{name}.whole = icmp eq i64 {name}.off, 0", f"{name} = and i1 {streamed}, {name}.whole")
            streamed = name
        self.v.write(f"%streamed = and i1 {streamed}, true")

    def stored(self, node: int) -> tuple[IRValue, str, int]:
        """A node's value as it is stored, its type, and the size of one element: masks become bytes."""
        value = self.values[node]
        if value.kind != MASK:
            return value, self.v.types["real"], self.size
        vector = f"<{self.width} x i8>"
        return self.v.emit("bytes", f"zext {self.v.types['mask']} {value.name} to {vector}"), vector, 1

    def output_address(self, k: int, step: int, offset: int = 0) -> str:
        """The address of element j of output k, whose elements are `step` bytes apart."""
        return self.v.beyond(self.v.moved(self.v.name(), f"%q{k}", "%j", str(step)), offset)

    def streamable(self, k: int) -> bool:
        """Whether stores of an output write whole lines of the cache, of results that begin with one."""
        output = self.program.outputs[k]
        together = len(output.nodes) <= INLINE or len(output.nodes) % SQUARE == 0
        return output.use == EACH and together and self.program.graph.kinds[output.nodes[0]] != MASK

    def store_full(self) -> list[str]:
        """Stores all lanes; of results that may go past the caches it gives the instructions that are left."""
        left = []
        for k, output in enumerate(self.program.outputs):
            if output.use == ADDED:
                self.add(k, "splat (i1 true)")
            if output.use != EACH:
                continue
            values = [self.stored(node) for node in output.nodes]
            parts, (_, vector, size) = [part for part, _, _ in values], values[0]
            n, w = len(parts), self.width
            if n == 1:
                store = f"store {vector} {parts[0].name}, ptr {self.output_address(k, size)}"
                left.append(store) if self.streamable(k) else self.v.write(f"{store}, align 1")
            elif n % SQUARE == 0 and self.streamable(k):
                left += self.square_stores(k, parts)
            elif not self.streamable(k):
                self.scatter(k, "splat (i1 true)", values)
            elif self.v.register * self.size == STRUCTURED:
                left += self.structured_stores(k, parts)
            elif gcd(n, self.v.register) == 1:
                left += self.blended_stores(k, parts)
            else:
                for i in range(n):
                    part = self.v.merged(parts, [(p % n, p // n) for p in range(i * w, (i + 1) * w)])
                    left.append(f"store {vector} {part.name}, ptr {self.output_address(k, n * size, i * w * size)}")
        return left

    def structured_stores(self, k: int, values: Sequence[IRValue]) -> list[str]:
        """What `structured_loads` does, the other way round; the stores are left."""
        n, w, vector, left = len(values), self.v.register, f"<{len(values) * self.v.register} x {self.real}>", []
        poison = IRValue("real", "poison")
        for start in range(0, self.width, w):
            parts = [self.v.shuffle(value, value, self.width, range(start, start + w)) for value in values]
            parts += [poison] * (-n % 2)
            pairs = [self.v.shuffle(a, b, w, range(2 * w)) for a, b in zip(parts[::2], parts[1::2], strict=True)]
            picks = [i % n * w + i // n for i in range(n * w)]
            whole = self.v.shuffle(pairs[0], pairs[-1] if len(pairs) > 1 else poison, 2 * w, picks)
            left.append(
                f"store {vector} {whole.name}, ptr {self.output_address(k, n * self.size, start * n * self.size)}"
            )
        return left

    def blended_stores(self, k: int, values: Sequence[IRValue]) -> list[str]:
        """What `blended_loads` does, the other way round; the stores are left."""
        left = []
        n, w, vector = len(values), self.v.register, f"<{self.v.register} x {self.real}>"
        for start in range(0, self.width, w):
            ordered = []
            for c, value in enumerate(values):
                lanes = {(e * n + c) % w: start + e for e in range(w)}
                ordered.append(self.v.shuffle(value, value, self.width, [lanes[lane] for lane in range(w)]))
            for i in range(n):
                part = self.v.blended(ordered, [(i * w + lane) % n for lane in range(w)])
                address = self.output_address(k, n * self.size, (start * n + i * w) * self.size)
                left.append(f"store {vector} {part.name}, ptr {address}")
        return left

    def square_stores(self, k: int, values: Sequence[IRValue]) -> list[str]:
        """Stores of matrices of `SQUARE` numbers, one behind the other: each is written as whole vectors, which
        lie across the lanes; the stores are left."""
        n, w, left = len(values), min(self.v.register, SQUARE), []
        vector = f"<{w} x {self.real}>"
        for first in range(0, n, SQUARE):
            for start in range(0, self.width, w):
                parts = values[first : first + SQUARE]
                if self.width > w:
                    parts = [self.v.shuffle(x, x, self.width, range(start, start + w)) for x in parts]
                # Vectors i and i + 8 are dealt into one another, lane by lane, until each number is behind its own.
                for _ in range(SQUARE.bit_length() - 1):
                    pairs = zip(parts[: SQUARE // 2], parts[SQUARE // 2 :], strict=True)
                    dealt = [[lane // 2 + w * (lane % 2) for lane in range(h, h + w)] for h in (0, w)]
                    parts = [self.v.shuffle(a, b, w, picks) for a, b in pairs for picks in dealt]
                for i, part in enumerate(parts):
                    at = ((start + i * w // SQUARE) * n + first + i * w % SQUARE) * self.size
                    left.append(f"store {vector} {part.name}, ptr {self.output_address(k, n * self.size, at)}")
        return left

    def store_part(self) -> None:
        for k, output in enumerate(self.program.outputs):
            if output.use == ADDED:
                self.add(k, "%valid")
            if output.use == EACH:
                self.scatter(k, "%valid", [self.stored(node) for node in output.nodes])

    def add(self, k: int, mask: str) -> None:
        """Adds the one number of an output to the double in memory of each element."""
        (node,), wide, lanes = self.program.outputs[k].nodes, f"<{self.width} x double>", f"<{self.width} x i1>"
        term, at, name = self.values[node], ("ptr", self.output_address(k, 8)), f"v{self.width}f64.p0"
        if self.size == 4:
            term = self.v.emit("real", f"fpext {self.v.types['real']} {term.name} to {wide}")
        where = ("i32", "8"), (lanes, mask)
        load = self.v.intrinsic(f"masked.load.{name}", wide, at, *where, (wide, "zeroinitializer"))
        total = self.v.emit("real", f"fadd {wide} {self.v.emit('real', load).name}, {term.name}")
        self.v.write(self.v.intrinsic(f"masked.store.{name}", "void", (wide, total.name), at, *where))

    def scatter(self, k: int, mask: str, values: Sequence[tuple[IRValue, str, int]]) -> None:
        n, w = len(values), self.width
        if n == 1 and mask == "%valid":
            ((value, vector, size),) = values
            full = f"masked.store.v{w}{'i8' if size == 1 else f'f{8 * size}'}.p0"
            where = ("ptr", self.output_address(k, size)), ("i32", "1"), (f"<{w} x i1>", mask)
            self.v.write(self.v.intrinsic(full, "void", (vector, value.name), *where))
            return
        for c, (value, vector, size) in enumerate(values):
            address, name = self.output_address(k, n * size, c * size), self.v.name()
            steps = ", ".join(f"i64 {lane * n * size}" for lane in range(w))
            self.v.write(f"{name} = getelementptr i8, ptr {address}, <{w} x i64> <{steps}>")
            full = f"masked.scatter.v{w}{'i8' if size == 1 else f'f{8 * size}'}.v{w}p0"
            arguments = (vector, value.name), (f"<{w} x ptr>", name), ("i32", "1"), (f"<{w} x i1>", mask)
            self.v.write(self.v.intrinsic(full, "void", *arguments))

    def accumulate(self, node: int) -> None:
        wide = f"<{self.width} x double>"
        term = self.v.select(IRValue("mask", "%valid"), self.values[node], self.v.real(0.0))
        if self.size == 4:
            term = self.v.emit("real", f"fpext {self.v.types['real']} {term.name} to {wide}")
        self.v.write(f"%total{node}.next = fadd {wide} %total{node}, {term.name}")

    def total(self, node: int) -> IRValue:
        """The sum of a node along the inner axis: one double."""
        arguments = ("double", "0.0"), (f"<{self.width} x double>", f"%total{node}")
        call = self.v.intrinsic(f"vector.reduce.fadd.v{self.width}f64", "double", *arguments)
        return self.v.emit("real", call.replace("call", "call reassoc"))

    def store_sums(self, k: int, totals: Mapping[int, IRValue]) -> None:
        """Totals or their squares, or what they make with those in memory."""
        output = self.program.outputs[k]
        for c, node in enumerate(output.nodes):
            total, name = totals[node], self.v.name()
            if output.use == SQUARED:
                total = self.v.emit("real", f"fmul double {total.name}, {total.name}")
            self.v.write(f"{name}.at = getelementptr double, ptr %q{k}, i64 {c}")
            if self.program.adds:
                self.v.write(f"{name}.old = load double, ptr {name}.at, align 8")
                total = self.v.emit("real", f"fadd double {name}.old, {total.name}")
            self.v.write(f"store double {total.name}, ptr {name}.at, align 8")

    def store_once(self, k: int) -> None:
        for c, node in enumerate(self.program.outputs[k].nodes):
            value, vector, size = self.stored(node)
            first = self.v.emit(value.kind, f"extractelement {vector} {value.name}, i64 0")
            address = self.v.beyond(f"%q{k}", c * size)
            self.v.write(f"store {'i8' if size == 1 else self.real} {first.name}, ptr {address}, align 1")
