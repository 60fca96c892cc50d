"""A graph as LLVM IR: a function that runs over two axes of a batch, the inner one several lanes at a time.

The function is `kernel(args, outer, inner, grain)`, with the lengths of the axes. Threads that call it with the same
block of arguments share the work: each takes `grain` elements of the inner axis at a time, or -`grain` of the outer one.
`args` is a block of 64-bit words: for every array its address and three strides in bytes (outer axis, inner axis,
component), for every table its address and the number of its last entry, for every output its address and its outer
stride in bytes; and at last where the next part begins. What depends on no axis is computed before the loops, what
depends on the outer axis alone outside the inner loop.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..trace.graph import INDEX, MASK, REAL
from . import elementary
from .divisions import fewer_divisions
from .lanes import FLOAT32, Lanes, Value
from .program import EACH, ONCE, PACKED, PLANES, ROW, SAME, TOTAL, Program

INLINE = 4  # components of a vector that are taken apart by shuffles; of longer ones by gathers


_SHARED = """
define void @kernel(ptr %args, i64 %outer, i64 %inner, i64 %grain) nounwind {
entry:
  %next = getelementptr i64, ptr %args, i64 WORDS
  %rows = icmp slt i64 %grain, 0
  br i1 %rows, label %down, label %along
along:
  %a = atomicrmw add ptr %next, i64 %grain monotonic
  %a.more = icmp ult i64 %a, %inner
  br i1 %a.more, label %along.part, label %exit
along.part:
  %a.end = add i64 %a, %grain
  %a.less = icmp ult i64 %a.end, %inner
  %a.stop = select i1 %a.less, i64 %a.end, i64 %inner
  call void @part(ptr %args, i64 0, i64 %outer, i64 %a, i64 %a.stop)
  br label %along
down:
  %step = sub i64 0, %grain
  %d = atomicrmw add ptr %next, i64 %step monotonic
  %d.more = icmp ult i64 %d, %outer
  br i1 %d.more, label %down.part, label %exit
down.part:
  %d.end = add i64 %d, %step
  %d.less = icmp ult i64 %d.end, %outer
  %d.stop = select i1 %d.less, i64 %d.end, i64 %outer
  call void @part(ptr %args, i64 %d, i64 %d.stop, i64 0, i64 %inner)
  br label %down
exit:
  ret void
}
"""
"""What is called: takes parts of the batch, as long as there are any that no other thread has taken."""


def generate(program: Program, width: int, estimates: bool) -> str:
    """The IR of a kernel for vectors of `width` lanes; `estimates`: see `Lanes`."""
    nodes = [node for output in program.outputs for node in output.nodes]
    graph, renamed = fewer_divisions(program.graph, nodes, program.dtype)
    new = iter(renamed)
    outputs = tuple(output._replace(nodes=tuple(next(new) for _ in output.nodes)) for output in program.outputs)
    return _Writer(program._replace(graph=graph, outputs=outputs), width, estimates).text()


class _Writer:
    def __init__(self, program: Program, width: int, estimates: bool):
        self.program, self.width = program, width
        self.v = Lanes(program.dtype, width, estimates)
        self.size = 4 if program.dtype == FLOAT32 else 8
        self.real = self.v.scalar["real"]
        self.values: dict[int, Value] = {}
        self.reciprocals: dict[int, Value] = {}
        self.blocks: dict[str, list[str]] = {}
        graph = program.graph
        self.order = graph.reachable([node for output in program.outputs for node in output.nodes])
        self.decided = self._decided()
        self.paired = self.pairs() if program.dtype == FLOAT32 else {}
        self.read: dict[int, tuple[Value, Value]] = {}
        self.level = self._levels()
        self.loads = [node for node in self.order if graph.operations[node] == "load"]

    def _decided(self) -> dict[int, int]:
        """Choices whose result matters only where another choice by the same condition takes its second side: node ->
        that side. So a formula that is given replaced directions and masked afterwards is computed without them."""
        graph = self.program.graph
        under: dict[int, list[int]] = {}
        for node in self.order:
            if graph.operations[node] == "select":
                under.setdefault(graph.arguments[node][0], []).append(node)
        found: dict[int, int] = {}
        kept = {node for output in self.program.outputs for node in output.nodes}
        for condition, choices in under.items():
            if len(choices) < 2:
                continue
            free = kept.copy()  # nodes whose value matters where the condition holds
            for node in reversed(self.order):
                if node not in free:
                    continue
                sources = graph.inputs(node)
                if graph.operations[node] == "select" and sources[0] == condition:
                    sources = sources[:2]
                free.update(sources)
            found.update((node, graph.arguments[node][2]) for node in choices if node not in free)
        return found

    def _levels(self) -> dict[int, int]:
        """0, 1 or 2 for every node: changes with nothing, with the outer axis, with the inner axis."""
        graph, level = self.program.graph, {}
        for node in self.order:
            if graph.operations[node] == "load":
                layout = self.program.arrays[graph.arguments[node][0]].layout
                level[node] = {SAME: 0, ROW: 1}.get(layout, 2)
            else:
                level[node] = max((level[source] for source in graph.inputs(node)), default=0)
        return level

    def text(self) -> str:
        v, totals = self.v, [i for i, o in enumerate(self.program.outputs) if o.use == TOTAL]
        self.into("entry")
        self.arguments()
        lane = ", ".join(f"i64 {i}" for i in range(self.width))
        self.index_type = f"<{self.width} x i64>"
        for node in self.loads:
            if self.level[node] == 0:
                self.values[node] = self.splat(node, "p")
        self.compute(0)
        v.lines.append("br label %outer")

        self.into("outer")
        v.lines.append("%i = phi i64 [ %start0, %entry ], [ %i.next, %outer.end ]")
        v.lines.append("%i.more = icmp ult i64 %i, %stop0")
        v.lines.append("br i1 %i.more, label %row, label %exit")

        self.into("row")
        for k in sorted({self.program.graph.arguments[node][0] for node in self.loads}):
            v.lines.append(f"%r{k}.step = mul i64 %i, %p{k}.s0")
            v.lines.append(f"%r{k} = getelementptr i8, ptr %p{k}, i64 %r{k}.step")
        for k in range(len(self.program.outputs)):
            v.lines.append(f"%q{k}.step = mul i64 %i, %o{k}.s0")
            v.lines.append(f"%q{k} = getelementptr i8, ptr %o{k}, i64 %q{k}.step")
        for node in self.loads:
            if self.level[node] == 1:
                self.values[node] = self.splat(node, "r")
        self.compute(1)
        v.lines.append("br label %inner")

        sums = [f"%total{k}.{c}" for k in totals for c in range(len(self.program.outputs[k].nodes))]
        wide = f"<{self.width} x double>"
        self.into("inner")
        v.lines.append("%j = phi i64 [ %start1, %row ], [ %j.next, %inner.end ]")
        for name in sums:
            v.lines.append(f"{name} = phi {wide} [ zeroinitializer, %row ], [ {name}.next, %inner.end ]")
        v.lines.append("%j.more = icmp ult i64 %j, %stop1")
        v.lines.append("br i1 %j.more, label %load, label %outer.end")
        self.into("load")
        v.lines.append("%left = sub i64 %stop1, %j")
        v.lines.append(f"%full = icmp uge i64 %left, {self.width}")
        v.lines.append("br i1 %full, label %load.full, label %load.part")
        varying = [node for node in self.loads if self.level[node] == 2]
        self.into("load.full")
        full = self.full_loads(varying)
        v.lines.append("br label %body")
        self.into("load.part")
        v.lines.append("%last = sub i64 %left, 1")
        v.lines.append(f"%last.some = insertelement {self.index_type} poison, i64 %last, i64 0")
        zeros = f"<{self.width} x i32> zeroinitializer"
        v.lines.append(f"%last.all = shufflevector {self.index_type} %last.some, {self.index_type} poison, {zeros}")
        v.lines.append(f"%inside = icmp ule {self.index_type} <{lane}>, %last.all")
        v.lines.append(
            f"%lanes = select <{self.width} x i1> %inside, {self.index_type} <{lane}>, {self.index_type} %last.all"
        )
        part = [self.gathered(node, "%lanes") for node in varying]
        v.lines.append("br label %body")

        self.into("body")
        kind = v.types["real"]
        for node, a, b in zip(varying, full, part, strict=True):
            self.values[node] = v.emit("real", f"phi {kind} [ {a.name}, %load.full ], [ {b.name}, %load.part ]")
        true = "splat (i1 true)"
        v.lines.append(f"%valid = phi <{self.width} x i1> [ {true}, %load.full ], [ %inside, %load.part ]")
        self.compute(2)
        for k in totals:
            self.accumulate(k)
        v.lines.append("br i1 %full, label %store.full, label %store.part")
        self.into("store.full")
        self.store_full()
        v.lines.append("br label %inner.end")
        self.into("store.part")
        self.store_part(lane)
        v.lines.append("br label %inner.end")
        self.into("inner.end")
        v.lines.append(f"%j.next = add i64 %j, {self.width}")
        v.lines.append("br label %inner")

        self.into("outer.end")
        for k in totals:
            self.store_total(k)
        for k, output in enumerate(self.program.outputs):
            if output.use == ONCE:
                self.store_once(k)
        v.lines.append("%i.next = add i64 %i, 1")
        v.lines.append("br label %outer")
        self.into("exit")
        v.lines.append("ret void")

        body = "\n".join(f"{name}:\n  " + "\n  ".join(lines) for name, lines in self.blocks.items())
        bits = min(self.width * self.size * 8, 512)
        attributes = f'nounwind alignstack=64 "prefer-vector-width"="{bits}" "min-legal-vector-width"="{bits}"'
        declared = "\n".join(sorted(v.declared))
        signature = "ptr noalias readonly %args, i64 %start0, i64 %stop0, i64 %start1, i64 %stop1"
        return (
            f"{declared}\n"
            f"define internal void @part({signature}) noinline #0 {{\n{body}\n}}\n"
            f"{_SHARED.replace('WORDS', str(self.program.words()))}"
            f"attributes #0 = {{ {attributes} }}\n"
        )

    def into(self, block: str) -> None:
        """What is written from here on belongs to this block."""
        self.v.lines = self.blocks[block] = []

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
                lanes = ", ".join(f"i64 {i}" for i in range(self.width))
                read = [self.gathered(node, f"<{lanes}>") for node in members]
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

    # Operations.

    def compute(self, level: int) -> None:
        for node in self.order:
            if self.level[node] == level and node not in self.values:
                self.values[node] = self.operation(node)

    def operation(self, node: int) -> Value:
        v, graph = self.v, self.program.graph
        operation, arguments = graph.operations[node], graph.arguments[node]
        if node in self.decided:
            return self.values[self.decided[node]]
        if operation == "constant":
            value = arguments[0]
            kind = graph.kinds[node]
            return v.real(value) if kind == REAL else v.index(value) if kind == INDEX else v.mask(bool(value))
        if operation == "take":
            if node in self.paired:
                return self.partner(node)
            return self.lookup(arguments[0], self.values[arguments[1]])
        a = [self.values[x] for x in arguments]
        if operation in ("lt", "le", "gt", "ge", "eq", "ne"):
            return v.compare(operation, *a)
        if operation in ("minimum", "maximum"):
            return self.extremum(operation, node, *a)
        if operation == "select":
            return v.select(*a)
        if operation == "div":
            return self.quotient(*arguments)
        if operation in ("and", "or", "xor"):
            return v.integer(operation, *a)
        if operation == "stop":
            return a[0]
        if operation == "to_index":
            near = v.compare("lt", v.absolute(a[0]), v.real(2147483520.0))
            return v.truncated(v.select(near, a[0], v.real(0.0)), "index")
        if operation == "to_real":
            return v.as_real(a[0])
        if graph.kinds[node] == INDEX:
            if operation == "neg":
                return v.integer("sub", v.index(0), a[0])
            return v.integer(operation, *a)
        if operation in elementary.FUNCTIONS:
            return elementary.FUNCTIONS[operation](v, *a)
        return getattr(v, operation)(*a)

    def quotient(self, top: int, bottom: int) -> Value:
        """top / bottom: by the reciprocal where that is the same for more elements, or the reciprocal of a root."""
        v, graph = self.v, self.program.graph
        a = self.values[top]
        if self.level[bottom] < self.level[top]:
            if bottom not in self.reciprocals:
                lines, block = v.lines, ("entry", "row")[self.level[bottom]]
                v.lines = self.blocks[block]
                end = v.lines.pop()
                self.reciprocals[bottom] = v.div(v.real(1.0), self.values[bottom])
                v.lines.append(end)
                v.lines = lines
            return v.mul(a, self.reciprocals[bottom])
        if graph.operations[bottom] == "sqrt":
            r = v.rsqrt(self.values[graph.arguments[bottom][0]])
            return r if graph.value(top) == 1.0 else v.mul(a, r)
        return v.div(a, self.values[bottom])

    def extremum(self, operation: str, node: int, a: Value, b: Value) -> Value:
        """The smaller or larger of two, NaN if one is NaN."""
        v, graph = self.v, self.program.graph
        how = "lt" if operation == "minimum" else "gt"
        first, second = graph.arguments[node]
        if graph.value(first) is not None or graph.kinds[node] == INDEX:
            return v.select(v.compare(how, a, b), a, b)
        if graph.value(second) is not None:
            return v.select(v.compare(how, b, a), b, a)
        return v.select(v.is_nan(a), a, v.select(v.compare(how, a, b), a, b))

    def pairs(self) -> dict[int, tuple[int, int]]:
        """Lookups of entries side by side, which are read together: node -> (the first of the two, 0 or 1)."""
        graph = self.program.graph
        places: dict[tuple, dict[int, int]] = {}
        for node in self.order:
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
            self.read[first] = self.pair(first)
        return self.read[first][which]

    def pair(self, node: int) -> tuple[Value, Value]:
        """Two neighbouring entries of a table, for which the processor loads one number of twice the length."""
        table, index = self.program.graph.arguments[node]
        w, real = self.width, f"<{2 * self.width} x {self.real}>"
        full, name = f"@llvm.masked.gather.v{w}f64.v{w}p0", self.v.name()
        self.v.declare(f"<{w} x double> {full}(<{w} x ptr>, i32, <{w} x i1>, <{w} x double>)")
        pointers = self.pointers(table, self.values[index])
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

    def lookup(self, table: int, index: Value) -> Value:
        """Entries of a table; an index beyond it reads its last entry."""
        return self.gather(self.pointers(table, index), self.size)

    def pointers(self, table: int, index: Value) -> str:
        """Where entries of a table are."""
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

    def store_part(self, lane: str) -> None:
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
