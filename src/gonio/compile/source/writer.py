"""A graph as statements of a language: what is used twice or long has a name, the rest is written where it is used."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from ...trace.graph import COMPARISONS, INDEX, LEAVES, MASK, Graph
from . import elementary, reserved
from .language import Language, NamedVector, Signature, bare
from .lines import wrapped
from .names import suggested

_SIGNS = {"add": ("+", 4), "sub": ("-", 4), "mul": ("*", 5), "div": ("/", 5)}
_SIGNS |= dict(zip(COMPARISONS, (("<", 3), ("<=", 3), (">", 3), (">=", 3), ("==", 3), ("!=", 3)), strict=True))
_SIGNS |= {"and": ("&&", 1), "or": ("||", 1)}
_OF_BITS = {"and": "&", "or": "|", "xor": "^"}
_ATOM, _SIGNED = 9, 4
LENGTH = 100
"""Characters from which an expression gets a name."""


class Load(NamedTuple):
    """The text of a value that a graph loads, and the word for it in names of values made of it."""

    text: str
    word: str = ""


class Text:
    """Source text in a language: functions of graphs, with the helpers that they need before them.

    `prefix` begins all global names. `table(number)` gives the name of a table that is looked up.
    """

    def __init__(self, language: Language, prefix: str, table: Callable[[int], str]):
        self.language, self.prefix, self.table = language, prefix, table
        self.helpers: dict[str, list[str]] = {}
        self.functions: list[list[str]] = []

    def add(
        self,
        graph: Graph,
        signature: Signature,
        results: Mapping[str, Sequence[int]],
        loads: Mapping[tuple[int, int], Load],
        first: Sequence[str] = (),
    ) -> None:
        """A function: its results as nodes by name, and what the graph loads. `first`: statements before."""
        body = _Body(self, graph, {place: load.text for place, load in loads.items()})
        body.taken |= {v.name for v in (*signature.arguments, *signature.results)}
        components = {n: f"wi_{axis}" for n, axis in zip(results.get("wi", ()), "xyz", strict=False)}
        values = body.written(results, {place: load.word for place, load in loads.items() if load.word}, components)
        lines = [*first, *body.lines, *self.language.outputs(signature, values)]
        self.functions.append(self._function(signature, lines))

    def _function(self, signature: Signature, lines: Sequence[str]) -> list[str]:
        text = " ".join(lines)
        ignored = [v.name for v in signature.arguments if not re.search(rf"\b{v.name}\b", text)]
        unread = [statement for name in ignored if (statement := self.language.unread(name))]
        return [part for line in self.language.function(signature, [*unread, *lines]) for part in wrapped(line)]

    def called(self, operation: str) -> str:
        """The name of an elementary function, of the language or of a helper, which is written at the first call."""
        native = self.language.calls.get(operation)
        if native is not None and (operation not in elementary.FUNCTIONS or not self._improved(operation)):
            return native
        name = f"{self.prefix}_{operation}"
        if operation not in self.helpers:
            self.helpers[operation] = []  # a helper that calls itself is the language's own function
            graph, node, names = elementary.graph_of(operation)
            arguments = tuple(NamedVector(n) for n in names)
            signature = Signature(name, arguments, (NamedVector("y" if "y" not in names else "result"),))
            inner = _Body(self, graph, {(i, 0): n for i, n in enumerate(names)}, operation)
            values = inner.written({signature.results[0].name: [node]})
            lines = [*inner.lines, *self.language.outputs(signature, values)]
            written = self._function(signature, lines)
            del self.helpers[operation]  # after those that it calls
            self.helpers[operation] = written
        return name

    def _improved(self, operation: str) -> bool:
        """Whether the language's own function has too few digits."""
        return operation in self.language.imprecise


class _Body:
    def __init__(self, text: Text, graph: Graph, loads: Mapping[tuple[int, int], str], inside: str = ""):
        self.text, self.graph, self.loads, self.inside = text, graph, loads, inside
        self.language = text.language
        self.lines: list[str] = []
        self.names: dict[int, tuple[str, int]] = {}  # text and how tightly it binds
        self.ended: dict[int, list[str]] = {}
        self.taken = set(reserved.WORDS)
        self.words: dict[int, str] = {}
        self.count = 0

    def written(
        self,
        results: Mapping[str, Sequence[int]],
        words: Mapping[tuple[int, int], str] | None = None,
        known: Mapping[int, str] | None = None,
    ) -> dict[str, list[str]]:
        """The texts of the results, by name."""
        ends = [n for nodes in results.values() for n in nodes]
        self.ends = frozenset(ends)
        order = self.graph.reachable(ends)
        if words:
            leaves = {n: words.get(self.graph.arguments[n], "") for n in order if self.graph.operations[n] == "load"}
            self.words = suggested(self.graph, order, leaves, known or {})
        self.within = self.graph.steps(order)
        self.uses = Counter(source for node in order for source in self.graph.inputs(node))
        self.uses.update(ends)
        for node in order:
            if not self.within[node]:
                self.node(node, 0)
        return {name: [bare(self.names[n][0]) for n in nodes] for name, nodes in results.items()}

    def node(self, node: int, open_loops: int) -> None:
        operation = self.graph.operations[node]
        if operation == "loop":
            self.loop(node, open_loops)
            return
        text, binding = self.expression(node)
        leaf = operation in LEAVES or operation == "result"
        if not leaf and (self.uses[node] > 1 or (len(text) > LENGTH and node not in self.ends)):
            name = self.name(self.words.get(node, ""))
            self.lines.append(self.language.declare(name, self.graph.kinds[node], bare(text)))
            text, binding = name, _ATOM
        self.names[node] = (text, binding)

    def name(self, word: str = "") -> str:
        """A new name: the word, if it is free."""
        if word and word not in self.taken:
            self.taken.add(word)
            return word
        self.count += 1
        return f"t{self.count}"

    def loop(self, node: int, open_loops: int) -> None:
        """A loop: its states are variables, which a step sets at its end."""
        graph, language = self.graph, self.language
        first, go_on, after = graph.parts(node)
        depth = graph.arguments[node][0]
        states = [f"s{self.count + i + 1}" for i in range(len(first))]
        self.count += len(first)
        for state, n in zip(states, first, strict=True):
            self.lines.append(language.variable(state, graph.kinds[n], bare(self.names[n][0])))
        going = f"go{self.count}"
        self.lines.append(language.variable(going, MASK, language.truth[0]))
        outside, lines, here = dict(self.names), self.lines, open_loops | 1 << depth
        self.lines = []
        for n in graph.reachable((go_on, *after)):
            if n in self.names or self.within[n] & ~here:
                continue
            if graph.operations[n] == "state":
                self.names[n] = (states[graph.arguments[n][1]], _ATOM)
            else:
                self.node(n, here)
        new = []
        for state, n in zip(states, after, strict=True):
            if self.names[n][0] != state:
                name = self.name()
                self.lines.append(language.declare(name, graph.kinds[n], bare(self.names[n][0])))
                new.append((state, name))
        self.lines.append(language.assign(going, bare(self.names[go_on][0])))
        self.lines += [language.assign(state, name) for state, name in new]
        self.lines, body = lines, self.lines
        self.lines += language.loop(body, going)
        self.names = outside
        self.ended[node] = states

    def expression(self, node: int) -> tuple[str, int]:
        """The text of a node, and how tightly it binds."""
        graph, language = self.graph, self.language
        operation, arguments, kind = graph.operations[node], graph.arguments[node], graph.kinds[node]
        if operation == "constant":
            text = language.constant(arguments[0], kind)
            return text, _SIGNED if text.startswith("-") else _ATOM
        if operation == "load":
            return self.loads[arguments], _ATOM
        if operation == "take":
            return f"{self.text.table(arguments[0])}_at({bare(self.names[arguments[1]][0])})", _ATOM
        if operation == "result":
            return self.ended[arguments[1]][arguments[0]], _ATOM
        a = [self.names[x] for x in graph.inputs(node)]
        plain = [bare(text) for text, _ in a]
        if operation == "stop":
            return a[0]
        if operation == "neg":
            return f"-{self.bound(a[0], 5)}", _SIGNED
        if operation == "select":
            return language.select(self.bound(a[0], 3), self.bound(a[1], 4), self.bound(a[2], 4)), _ATOM
        if operation == "to_index":
            return language.to_index(plain[0]), _ATOM
        if operation == "to_real":
            return language.to_real(plain[0]), _ATOM
        if operation in ("shl", "lshr"):
            return language.shifted(operation, *plain), _ATOM
        if operation == "xor" and kind == MASK:
            return self.exclusive(node, a)
        if operation in _OF_BITS and kind == INDEX:
            return f"({self.bound(a[0], 6)} {_OF_BITS[operation]} {self.bound(a[1], 6)})", _ATOM
        if operation in _SIGNS:
            return self.binary(operation, a, self.graph.operations[arguments[1]] in ("neg", "constant"))
        if operation in ("minimum", "maximum") and kind == INDEX:
            sign = "<" if operation == "minimum" else ">"
            return language.select(f"{self.bound(a[0], 4)} {sign} {self.bound(a[1], 4)}", plain[0], plain[1]), _ATOM
        if operation == self.inside:
            return f"{language.calls[operation]}({', '.join(plain)})", _ATOM
        return f"{self.text.called(operation)}({', '.join(plain)})", _ATOM

    def binary(self, operation: str, a: Sequence[tuple[str, int]], simple: bool) -> tuple[str, int]:
        sign, binding = _SIGNS[operation]
        if operation in ("add", "sub") and simple and a[1][0].startswith("-"):  # a + -b is a - b
            sign, a = {"+": "-", "-": "+"}[sign], (a[0], (a[1][0][1:], 5))
        if operation in ("and", "or"):  # WGSL takes no mixture of them without brackets
            return f"{self.bound(a[0], 3)} {sign} {self.bound(a[1], 3)}", binding
        left = self.bound(a[0], binding) if binding > 3 else self.bound(a[0], 4)
        right = self.bound(a[1], binding + 1)
        return f"{left} {sign} {right}", binding

    def exclusive(self, node: int, a: Sequence[tuple[str, int]]) -> tuple[str, int]:
        first, second = self.graph.arguments[node]
        for leaf, other in ((first, 1), (second, 0)):
            value = self.graph.value(leaf)
            if value is not None:
                return (f"!{self.bound(a[other], 8)}", 8) if value else a[other]
        return self.language.different(self.bound(a[0], 6), self.bound(a[1], 6)), _ATOM

    def bound(self, term: tuple[str, int], binding: int) -> str:
        """A text, in brackets where it binds less tightly."""
        text, tightness = term
        return text if tightness >= binding else f"({text})"
