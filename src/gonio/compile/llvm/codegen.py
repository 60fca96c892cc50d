"""A graph as LLVM IR: a function that runs over two axes of a batch, the inner one several lanes at a time.

The function is `kernel(args, outer, inner, grain)`, with the lengths of the axes. Threads that call it with the same
block of arguments share the work: each takes `grain` elements of the inner axis at a time, or -`grain` of the outer.
`args` is a block of 64-bit words: for every array its address and three strides in bytes (outer axis, inner axis,
component), for every table its address and the number of its last entry, for every output its address and its outer
stride in bytes; whether results go past the caches to memory, if they begin with a line of the cache (on x86); at last
the beginning of the next part. Nodes that depend on no axis are computed before the loops, nodes that depend on the
outer axis alone outside the inner loop.
"""

from __future__ import annotations

from ...arrays.ops import OPERATIONS
from ...trace.graph import COMPARISONS, INDEX, LOGIC, REAL
from ...trace.passes import rewritten
from . import elementary, machine, rays
from .access import Access
from .lanes import IRValue, Lanes
from .program import ONCE, ROW, SAME, SUMS, Program
from .roots import Times, estimated
from .stores import Stores

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
"""The function that callers call: it takes parts of the batch until no thread has left any."""


INLINE = 40
"""Elementary functions that a kernel contains inline at most; with more, each becomes a function that is called, since
compilers take long over long blocks."""


HELD = 24
"""Entries of tables at constant places that are read before the loops at most; more than a processor has registers for
are read where they are used, which takes no longer to run and is compiled in a tenth of the time."""


def generate(program: Program, width: int, register: int, times: Times | None) -> str:
    """The IR of a kernel for vectors of `width` lanes; `register`: see `Lanes`; `times`: of a
    processor that estimates roots."""
    nodes = [node for output in program.outputs for node in output.nodes]
    fixed = [k for k, array in enumerate(program.arrays) if array.layout in (SAME, ROW)]
    graph, renamed = rewritten(program.graph, nodes, program.dtype, fixed)
    new = iter(renamed)
    outputs = tuple(output._replace(nodes=tuple(next(new) for _ in output.nodes)) for output in program.outputs)
    return _Writer(program._replace(graph=graph, outputs=outputs), width, register, times).text()


class _Writer:
    def __init__(self, program: Program, width: int, register: int, times: Times | None):
        self.program, self.width = program, width
        self.v = Lanes(program.dtype, width, times is not None, register)
        self.values: dict[int, IRValue] = {}
        self.reciprocals: dict[int, IRValue] = {}
        self.blocks: dict[str, list[str]] = {}
        self.block = ""
        graph = program.graph
        self.order = graph.reachable([node for output in program.outputs for node in output.nodes])
        self.within = graph.steps(self.order)
        self.ended: dict[int, list[IRValue]] = {}  # the states of loops in the end, and what rays met
        self.going = self.v.mask(True)  # the lanes that take the step of a loop
        self.access = Access(program, self.v, self.order, self.values)
        self.stores = Stores(program, self.v, self.values)
        self.level = self._levels()
        self.estimated = set[int]() if times is None else estimated(graph, self.order, self.level, times)
        self.loads = [node for node in self.order if graph.operations[node] == "load"]
        many = sum(graph.operations[node] in elementary.FUNCTIONS for node in self.order) > INLINE
        self.functions: dict[str, str] | None = {} if many else None

    def _levels(self) -> dict[int, int]:
        """0, 1 or 2 for every node: changes with nothing, with the outer axis, with the inner axis."""
        graph, level = self.program.graph, {}
        weights = [
            n for n in self.order if graph.operations[n] == "take" and graph.value(graph.arguments[n][1]) is not None
        ]
        again = set(weights if len(weights) > HELD else ())
        for node in self.order:
            if graph.operations[node] == "load":
                layout = self.program.arrays[graph.arguments[node][0]].layout
                level[node] = {SAME: 0, ROW: 1}.get(layout, 2)
            elif node in again or graph.operations[node] in ("state", "loop"):
                level[node] = 2
            else:
                level[node] = max((level[source] for source in graph.inputs(node)), default=0)
        return level

    def text(self) -> str:
        v, access, stores, outputs = self.v, self.access, self.stores, self.program.outputs
        summed = list(dict.fromkeys(node for output in outputs if output.use in SUMS for node in output.nodes))
        varying = [node for node in self.loads if self.level[node] == 2]
        wide, real = f"<{self.width} x double>", v.types["real"]
        self.into("entry")
        if any(self.program.graph.operations[node] == "rays" for node in self.order):
            v.write(*rays.MEMORY)
        access.arguments()
        self.compute(0)
        v.write("br label %outer")

        self.into("outer", "%i = phi i64 [ %start0, %entry ], [ %i.next, %outer.end ]")
        v.write("%i.more = icmp ult i64 %i, %stop0", "br i1 %i.more, label %row, label %exit")
        self.into("row")
        access.rows(sorted({self.program.graph.arguments[node][0] for node in self.loads}))
        stores.rows()
        self.compute(1)
        v.write("br label %inner")

        self.into("inner", "%j = phi i64 [ %start1, %row ], [ %j.next, %inner.end ]")
        for node in summed:
            v.write(f"%total{node} = phi {wide} [ zeroinitializer, %row ], [ %total{node}.next, %inner.end ]")
        v.write("%j.more = icmp ult i64 %j, %stop1", "br i1 %j.more, label %load, label %outer.end")
        self.into("load", "%left = sub i64 %stop1, %j", f"%full = icmp uge i64 %left, {self.width}")
        v.write("br i1 %full, label %load.full, label %load.part")
        self.into("load.full", "br i1 %past.caches, label %load.ahead, label %load.near")
        self.into("load.ahead")
        access.look_ahead(varying)
        v.write("br label %load.near")
        self.into("load.near")
        full = access.full_loads(varying)
        v.write("br label %body")
        self.into("load.part")
        access.remaining()
        part = access.part_loads(varying)
        v.write("br label %body")

        self.into("body")
        for node, a, b in zip(varying, full, part, strict=True):
            self.values[node] = v.emit("real", f"phi {real} [ {a.name}, %load.near ], [ {b.name}, %load.part ]")
        v.write(f"%valid = phi <{self.width} x i1> [ splat (i1 true), %load.near ], [ %inside, %load.part ]")
        self.compute(2)
        for node in summed:
            stores.accumulate(node)
        v.write("br i1 %full, label %store.full, label %store.part")
        self.into("store.full")
        left = stores.store_full()
        if machine.is_x86():
            v.write("br i1 %streamed, label %store.past, label %store.near")
            streamed = (f"{store}, align {v.register * v.size}, !nontemporal !0" for store in left)
            self.into("store.past", *streamed, "br label %inner.end")
            self.into("store.near")
        v.write(*(f"{store}, align 1" for store in left), "br label %inner.end")
        self.into("store.part")
        stores.store_part()
        v.write("br label %inner.end")
        self.into("inner.end", f"%j.next = add i64 %j, {self.width}", "br label %inner")

        self.into("outer.end")
        totals = {node: stores.total(node) for node in summed}
        for k, output in enumerate(outputs):
            if output.use in SUMS:
                stores.store_sums(k, totals)
            if output.use == ONCE:
                stores.store_once(k)
        v.write("%i.next = add i64 %i, 1", "br label %outer")
        self.into("exit")
        if machine.is_x86():
            v.write("br i1 %past.caches, label %finish, label %end")
            self.into("finish", v.intrinsic("x86.sse.sfence", "void"), "br label %end")  # before others read
            self.into("end")
        v.write("ret void")

        body = "\n".join(f"{name}:\n  " + "\n  ".join(lines) for name, lines in self.blocks.items())
        bits = min(self.width * v.size * 8, 512)
        attributes = f'nounwind "prefer-vector-width"="{bits}" "min-legal-vector-width"="{bits}"'
        declared = "\n".join(sorted(v.declared))
        signature = "ptr noalias readonly %args, i64 %start0, i64 %stop0, i64 %start1, i64 %stop1"
        return (
            f"{declared}\n"
            f"{''.join((self.functions or {}).values())}"
            f"define internal void @part({signature}) noinline #0 {{\n{body}\n}}\n"
            f"{_SHARED.replace('WORDS', str(self.program.words()))}"
            f"attributes #0 = {{ alignstack=64 {attributes} }}\nattributes #1 = {{ {attributes} }}\n!0 = !{{i32 1}}\n"
        )

    def into(self, block: str, *lines: str) -> None:
        """Begin a block: these lines and all further ones belong to it."""
        self.v.lines = self.blocks[block] = list(lines)
        self.block = block

    # Operations.

    def compute(self, level: int) -> None:
        """The nodes of a level; loads along the inner axis are done already."""
        for node in self.loads:
            if self.level[node] == level < 2:
                self.values[node] = self.access.splat(node, "pr"[level])
        for node in self.order:
            if self.level[node] == level and node not in self.values and not self.within[node]:
                self.values[node] = self.operation(node)

    def loop(self, node: int, open_loops: int = 0) -> IRValue:
        """A loop, within the steps of others, whose depths are bits; its states in the end are in `ended`.

        The code goes on in a new block, whence it can use all that was computed before.
        """
        v, graph, prefix = self.v, self.program.graph, self.v.name()[1:]
        first, go_on, after = graph.parts(node)
        depth = graph.arguments[node][0]
        step, end, left = f"{prefix}.step", f"{prefix}.end", f"{prefix}.left"
        mask, before = v.types["mask"], self.block
        v.write(f"br label %{step}")
        self.into(step)
        states = [IRValue(graph.kinds[n], f"%{prefix}.state{i}") for i, n in enumerate(first)]
        for state, n in zip(states, first, strict=True):
            start = self.values[n].name
            v.write(f"{state.name} = phi {v.types[state.kind]} [ {start}, %{before} ], [ {state.name}.next, %{end} ]")
        going = IRValue("mask", f"%{prefix}.going")
        v.write(f"{going.name} = phi {mask} [ splat (i1 true), %{before} ], [ {going.name}.next, %{end} ]")

        outside, caches, others = dict(self.values), self.access.lookups.begin_step(), self.going
        self.going = going
        here = open_loops | 1 << depth
        for n in graph.reachable((go_on, *after)):
            if n in self.values or self.within[n] & ~here:
                continue
            operation, arguments = graph.operations[n], graph.arguments[n]
            if operation == "state":
                self.values[n] = states[arguments[1]]
            elif operation == "loop":
                self.values[n] = self.loop(n, here)
            else:
                self.values[n] = self.operation(n)
        v.write(f"br label %{end}")
        self.into(end)
        for state, n in zip(states, after, strict=True):
            vector, new = v.types[state.kind], self.values[n].name
            v.write(f"{state.name}.next = select {mask} {going.name}, {vector} {new}, {vector} {state.name}")
        v.write(f"{going.name}.next = and {mask} {going.name}, {self.values[go_on].name}")
        some = v.intrinsic(f"vector.reduce.or.v{self.width}i1", "i1", (mask, f"{going.name}.next"))
        v.write(f"%{prefix}.some = {some}", f"br i1 %{prefix}.some, label %{step}, label %{left}")
        self.into(left)
        self.values.clear()
        self.values.update(outside)
        self.access.lookups.end_step(caches)
        self.going = others
        self.ended[node] = [IRValue(state.kind, f"{state.name}.next") for state in states]
        return going

    def operation(self, node: int) -> IRValue:
        v, graph = self.v, self.program.graph
        operation, arguments = graph.operations[node], graph.arguments[node]
        kind = graph.kinds[node]
        if operation == "constant":
            value = arguments[0]
            return v.real(value) if kind == REAL else v.index(value) if kind == INDEX else v.mask(bool(value))
        if operation == "take":
            return self.access.lookup(node)
        if operation == "loop":
            return self.loop(node)
        if operation == "rays":
            table, way, *sources = arguments
            self.ended[node] = rays.shot(v, table, way, [self.values[n] for n in sources], self.going)
            return self.going
        if operation == "result":
            return self.ended[arguments[1]][arguments[0]]
        a = [self.values[x] for x in arguments]
        if operation in COMPARISONS:
            return v.compare(operation, *a)
        if operation in ("minimum", "maximum"):
            return self.extremum(operation, node, *a)
        if operation == "div":
            return self.quotient(*arguments)
        if operation == "stop":
            return a[0]
        if operation == "to_index":
            near = v.compare("lt", v.absolute(a[0]), v.real(2147483520.0))
            return v.truncated(v.select(near, a[0], v.real(0.0)), "index")
        if operation == "to_real":
            return v.as_real(a[0])
        if operation == "neg" and kind == INDEX:
            return v.integer("sub", v.index(0), a[0])
        if operation in LOGIC or (kind == INDEX and operation != "select"):
            return v.integer(operation, *a)
        if operation == "sqrt":
            return v.sqrt(a[0], node in self.estimated)
        if operation in elementary.FUNCTIONS:
            return self.elementary(operation, a)
        if intrinsic := OPERATIONS[operation].llvm:
            return v.call(intrinsic, *a)
        return getattr(v, operation)(*a)

    def elementary(self, name: str, a: list[IRValue]) -> IRValue:
        """An elementary function: inline, or as a call where a kernel has many of them."""
        v, function = self.v, elementary.FUNCTIONS[name]
        if self.functions is None:
            return function(v, *a)
        vector = v.types["real"]
        if name not in self.functions:
            outside, v.lines = v.lines, []
            inner = [IRValue("real", f"%x{i}") for i in range(len(a))]
            result = function(v, *inner)
            signature = ", ".join(f"{vector} {x.name}" for x in inner)
            body = "\n  ".join([*v.lines, f"ret {vector} {result.name}"])
            self.functions[name] = f"define internal {vector} @{name}({signature}) noinline #1 {{\n  {body}\n}}\n"
            v.lines = outside
        return v.emit("real", f"call {vector} @{name}({', '.join(f'{vector} {x.name}' for x in a)})")

    def quotient(self, top: int, bottom: int) -> IRValue:
        """top / bottom: by the reciprocal where several elements share it, or where it is that of a root."""
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
            r = v.rsqrt(self.values[graph.arguments[bottom][0]], bottom in self.estimated)
            return r if graph.value(top) == 1.0 else v.mul(a, r)
        return v.div(a, self.values[bottom])

    def extremum(self, operation: str, node: int, a: IRValue, b: IRValue) -> IRValue:
        """The smaller or larger of two, NaN if one is NaN."""
        v, graph = self.v, self.program.graph
        how = "lt" if operation == "minimum" else "gt"
        first, second = graph.arguments[node]
        if graph.value(first) is not None or graph.kinds[node] == INDEX:
            return v.select(v.compare(how, a, b), a, b)
        if graph.value(second) is not None:
            return v.select(v.compare(how, b, a), b, a)
        return v.select(v.is_nan(a), a, v.select(v.compare(how, a, b), a, b))
