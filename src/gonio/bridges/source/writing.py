"""Writing a source text: the traced formulas of a material, its numbers and tables, and the comments above them."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ...arrays import Fixed
from ...arrays.kinds import MATRIX, SCALAR, VALUE, VECTOR
from ...base.reflectance import Reflectance
from ...base.sums import Scaled, Sum
from ...compile.source.finite import HOLE, finite
from ...compile.source.language import Language, NamedVector, Signature
from ...compile.source.lines import ascii_of, with_comment, wrapped
from ...compile.source.names import short_names
from ...compile.source.writer import Load, Text
from ...declared import discover
from ...declared.version import __version__
from ...errors import ParameterError
from ...evaluate import tracing
from ...formula import tree
from ...formula.parametrised import Parametrised
from ...trace import passes
from ...trace.graph import MASK, REAL
from .functions import FUNCTIONS, Function
from .result import Argument, ShaderSource, SourceTable

SMALL = 256
"""Entries up to which a table stands in the text."""

OPERATIONS = 60_000
"""Operations up to which a formula is written."""

CHANNEL = "channel"
"""The name of the number that says which channel a formula is for."""


class SourceWriter:
    """The text of one material in one language, part by part."""

    def __init__(self, m: Reflectance, language: Language, name: str, as_arguments: bool):
        self.m, self.language, self.name = m, language, name
        self.content = tracing.content(m)
        self.channels = m.channels
        self.ways = [getattr(field, "sampled", "mean") for _, field, _, _ in tree.numbers(m)]
        values = [v.numbers if isinstance(v, Fixed) else v for v in self.content.leaves]
        self.values = [tuple(np.atleast_1d(np.asarray(v, float)).reshape(-1)[-_width(v) :].tolist()) for v in values]
        self.paths = [path or CHANNEL for path in tree.leaf_paths(m)]
        self.as_arguments = as_arguments
        self.short = short_names(self.paths)
        prefix = "" if as_arguments else f"{name}_"
        self.vectors = [NamedVector(prefix + s, len(v)) for s, v in zip(self.short, self.values, strict=True)]
        self.read: set[int] = set()
        self.tables: list[int] = []
        self.text = Text(language, name, self.table)

    def table(self, number: int) -> str:
        """The name of a table."""
        if number not in self.tables:
            self.tables.append(number)
        return f"{self.name}_table{self.tables.index(number)}"

    def written(self, functions: Sequence[str]) -> ShaderSource:
        traces = [(word, self.trace(FUNCTIONS[word], word)) for word in functions]
        for _, trace in traces:
            first = trace.inputs
            used = {self.number_of(k - first)[0] for k in trace.read if k >= first}
            self.read |= used
        for word, trace in traces:
            self.add(word, FUNCTIONS[word], trace)
        declared, large = self.declared_tables()
        lines = [*self.heading(functions), *self.language.preamble, ""]
        if not self.as_arguments and self.read:
            for k in sorted(self.read):
                *above, line = self.language.global_constant(self.vectors[k], self.values[k]).split("\n")
                lines += [*above, *with_comment(line, self.language.comment, self.meaning(k))]
            lines.append("")
        lines += declared
        for helper in self.text.helpers.values():
            lines += [*helper, ""]
        for word, function in zip(functions, self.text.functions, strict=True):
            lines += [f"{self.language.comment} {line}" for line in textwrap.wrap(FUNCTIONS[word].meaning, 116)]
            lines += [*function, ""]
        arguments = tuple(
            Argument(self.vectors[k].name, self.paths[k], len(self.values[k]), self.values[k])
            for k in sorted(self.read)
        )
        return ShaderSource(
            "\n".join(lines).rstrip() + "\n",
            self.language.name,
            self.name,
            self.channels,
            tuple(f"{self.name}_{word}" for word in functions),
            arguments if self.as_arguments else (),
            large,
        )

    def number_of(self, k: int) -> tuple[int, bool]:
        """The parameter that an array of a trace is, and whether its channels are merged."""
        count = len(self.values)
        return (k, False) if k < count else (k - count, True)

    def trace(self, function: Function, word: str) -> tracing.Trace:
        task = function.task
        if word == "jacobian":
            task = task.derivatives(tuple(range(len(self.values))), ())
        trace = tracing.traced(task, self.m, self.channels)
        if trace.operations > OPERATIONS:
            raise ParameterError(
                f"source: {word} takes {trace.operations} operations, expected at most {OPERATIONS}; "
                f"{self.advice(word, trace.operations)}"
            )
        return trace

    def advice(self, word: str, operations: int) -> str:
        """How to come to a formula that is short enough."""
        paths = [path for path, v in zip(self.paths, self.values, strict=True) if len(v) > 1]
        if self.channels is not None and self.channels > 3 and paths:
            count = max(OPERATIONS * self.channels // operations, 1)
            return f"take at most {count} channels: m.replace of {', '.join(map(repr, paths))} with fewer numbers each"
        return "take 'f' instead" if word == "jacobian" else "write the parts of the material as texts of their own"

    def add(self, word: str, function: Function, trace: tracing.Trace) -> None:
        count = self.channels or 1
        nodes = [n for result in trace.results for n in result]
        places = [k for k, v in enumerate(function.inputs) if not v.is_direction]
        shares = {(k, c) for k in places for c in range(function.inputs[k].width)}
        fixed = range(trace.inputs, trace.inputs + 2 * len(self.values))
        # By the nodes of results: what is written, and the nodes there.
        kept = trace.graph.kept.setdefault(SourceWriter, {})
        holed = tuple(k for k in sorted(trace.looked_up) if np.isnan(self.content.tables[k].numbers).any())
        if (key := (*nodes, -1, *holed)) not in kept:  # the longest part, the same for all languages and numbers
            kept[key] = passes.rewritten(*finite(trace.graph, nodes, shares, holed), "float32", fixed)
        graph, nodes = kept[key]
        rest = iter(nodes)
        ends = [[next(rest) for _ in result] for result in trace.results]
        widths = {VALUE: count, VECTOR: 3, SCALAR: 1, MASK: 1, MATRIX: 16 * count}
        results = [NamedVector(name, widths[kind], MASK if kind == MASK else REAL) for name, kind in function.results]
        named = dict(zip([v.name for v in results], ends, strict=False))
        if word == "jacobian":
            for k, slope in enumerate(ends[1:]):
                if k in self.read and self.paths[k] != CHANNEL:
                    v = NamedVector(f"d_{self.short[k]}", count)
                    results.append(v)
                    named[v.name] = slope
        loads = {(k, c): self.language.component(v, c) for k, v in enumerate(function.inputs) for c in range(v.width)}
        words = {(k, c): f"{v.name}_{'xyz'[c]}" for k, v in enumerate(function.inputs) for c in range(v.width)}
        words |= {(trace.inputs + k, 0): self.short[k] for k, v in enumerate(self.vectors) if v.width == 1}
        first: list[str] = []
        component = self.language.component if self.as_arguments else self.language.constant_component
        for k, v in enumerate(self.vectors):
            for c in range(v.width):
                loads[trace.inputs + k, c] = component(v, c)
        order = graph.reachable([n for of in named.values() for n in of])
        merged = {graph.arguments[n][0] for n in order if graph.operations[n] == "load"}
        for k in sorted(merged):
            if k < trace.inputs + len(self.values):
                continue
            j = k - trace.inputs - len(self.values)
            loads[k, 0] = self.merged(j, first, component)
        arguments = function.inputs
        if self.as_arguments:
            arguments += tuple(self.vectors[k] for k in sorted(self.read))
        signature = Signature(f"{self.name}_{word}", arguments, tuple(results))
        every = {place: Load(text, words.get(place, "")) for place, text in loads.items()}
        self.text.add(graph, signature, named, every, first)

    def merged(self, k: int, first: list[str], component: Callable[[NamedVector, int], str]) -> str:
        """The name of a parameter's merged channels, for sampling; `first` takes the statement that makes it."""
        v = self.vectors[k]
        parts = [component(v, c) for c in range(v.width)]
        if len(parts) == 1:
            return parts[0]
        if self.ways[k] == "mean":
            value = f"({' + '.join(parts)}) * {self.language.number(1.0 / len(parts))}"
        else:
            called = self.text.called("minimum" if self.ways[k] == "min" else "maximum")
            value = parts[0]
            for part in parts[1:]:
                value = f"{called}({value}, {part})"
        name = f"{self.short[k]}_{self.ways[k]}"
        while name in self.short:
            name += "_all"
        first.append(self.language.declare(name, REAL, value))
        return name

    def declared_tables(self) -> tuple[list[str], tuple[SourceTable, ...]]:
        """The declarations of all tables, and those that the program brings."""
        lines: list[str] = []
        large: list[SourceTable] = []
        for number in self.tables:
            values = np.asarray(self.content.tables[number].numbers, np.float32).reshape(-1)
            values = np.where(np.isnan(values), np.float32(HOLE), values)
            name = self.table(number)
            if len(values) <= SMALL:
                lines += [part for line in self.language.small_table(name, values) for part in wrapped(line)]
            else:
                lines += self.language.large_table(name, len(values), len(large))
                large.append(SourceTable(name, values))
            lines.append("")
        return lines, tuple(large)

    def meaning(self, k: int) -> str:
        """A parameter in words, with its unit."""
        p = self.m.parameters.get(self.paths[k])
        if p is None:
            return ""
        return " ".join(p.doc.split()) + (f" [{p.unit}]" if p.unit not in ("", "1") else "")

    def heading(self, functions: Sequence[str]) -> Iterator[str]:
        """Comments: what the text is, the formulas and their sources, what can be called."""
        words = [f"{', '.join(functions)} of a material, in {self.language.title}, by gonio {__version__}."]
        words += textwrap.wrap(repr(self.m), 116, max_lines=4, placeholder=" ...", break_long_words=True)
        for cls in _classes(self.m):
            parts = discover.labelled(
                discover.docstring(cls), ("Looks", "Shapes", "Units", "Error", "Source", "Example")
            )
            formula = parts[""].split("\n\n")[0].splitlines()
            cited = " ".join(parts.get("Source", "").split())
            words += ["", *(f"{cls.__name__}: {line}" if i == 0 else line for i, line in enumerate(formula))]
            words += textwrap.wrap(f"Source: {cited}", 116) if cited else []
        words += ["", "Directions are unit vectors that leave the surface, in its frame: z is the normal."]
        if self.as_arguments and self.read:
            words += ["", "Parameters:"]
            words += [
                f"    {self.vectors[k].name}: {meaning}" for k in sorted(self.read) if (meaning := self.meaning(k))
            ]
        short = (
            part for line in words for part in textwrap.wrap(ascii_of(line), 116, subsequent_indent="    ") or [""]
        )
        return (f"{self.language.comment} {line}".rstrip() for line in short)


def _classes(m: Parametrised) -> list[type]:
    """The classes of a material and of its parts, each once, without those that only add and weigh."""
    classes: dict[type, None] = {}
    for value in (m, *(owner for _, _, _, owner in tree.walk(m))):
        if not isinstance(value, (Sum, Scaled)):
            classes.setdefault(type(value))
    return list(classes)


def _width(value: Any) -> int:
    return np.shape(value)[-1] if np.ndim(value) else 1
