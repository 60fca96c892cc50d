"""What a language is to the writer: its words for types, numbers, operations, tables and functions.

Each file of `languages/` changes what differs from most of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays.ops import ELEMENTARY
from ...trace.graph import INDEX, MASK, REAL


def bare(text: str) -> str:
    """A text without brackets around the whole of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for i, c in enumerate(text):
        depth += {"(": 1, ")": -1}.get(c, 0)
        if depth == 0 and i < len(text) - 1:
            return text
    return text[1:-1]


def calls(*languages: str) -> dict[str, str]:
    """What languages of these sorts call elementary functions, those that have them."""
    return {
        name: row.languages[word] for word in languages for name, row in ELEMENTARY.items() if word in row.languages
    }


LARGEST = 3.4028235e38
"""The largest number of float32: languages that cannot write infinity have it in place of that."""


@dataclass(frozen=True)
class NamedVector:
    """Numbers under one name: an argument or a result. `kind`: of each, as graphs have it."""

    name: str
    width: int = 1
    kind: str = REAL
    is_direction: bool = False


@dataclass(frozen=True)
class Signature:
    """A function: its name, arguments and results."""

    name: str
    arguments: tuple[NamedVector, ...]
    results: tuple[NamedVector, ...]


class Language(ABC):
    """What most languages have in common, which is that of shaders."""

    name: str
    title: str
    suffix: str
    preamble: tuple[str, ...] = ()
    before = ""
    before_constant = "const"
    dereference = ""
    """What stands before a result to which a number is assigned."""
    comment = "//"
    words: Mapping[str, str] = {REAL: "float", INDEX: "int", MASK: "bool"}
    vectors: Mapping[int, str] = {}
    """Types of several numbers, by how many."""
    truth = ("true", "false")
    number_end = ""
    infinity = "3.4028234e38"  # as a decimal number not above the largest, which WGSL refuses
    missing = "0.0"
    """Where a measurement has no value; 0 where a language cannot write NaN."""
    calls: Mapping[str, str] = calls("shading")
    """Operations that the language has, by its names; the others are written as functions (`elementary`)."""
    imprecise = frozenset(name for name, row in ELEMENTARY.items() if "shading" in row.rough)
    """Those of `calls` that have too few digits to be called but by the helpers that replace them."""
    returns_arrays = False

    # Numbers.

    def number(self, value: float) -> str:
        """A real constant, with the fewest digits that give it back in float32."""
        if value != value:
            return self.missing
        if abs(value) > LARGEST:
            return ("-" if value < 0 else "") + self.infinity
        text = np.format_float_positional(np.float32(value), unique=True, trim="0")
        if not 1e-4 <= abs(value) < 1e7 and value != 0.0:
            text = np.format_float_scientific(np.float32(value), unique=True, trim="0", exp_digits=1)
        return text + self.number_end

    def constant(self, value: float, kind: str) -> str:
        """A constant of a kind of node."""
        if kind == REAL:
            return self.number(value)
        return str(int(value)) if kind == INDEX else self.truth[0 if value else 1]

    # Vectors.

    def type(self, width: int, kind: str = REAL) -> str:
        """The type of a vector; "" where it is an array, whose length stands behind its name."""
        return self.words[kind] if width == 1 else self.vectors.get(width, "")

    def component(self, v: NamedVector, i: int) -> str:
        """Component i of a vector."""
        if v.width == 1:
            return v.name
        return f"{v.name}.{'xyzw'[i]}" if v.width in self.vectors else f"{v.name}[{i}]"

    def constant_component(self, v: NamedVector, i: int) -> str:
        """Component i of a constant at the top of the text."""
        return self.component(v, i)

    def global_constant(self, v: NamedVector, values: Sequence[float]) -> str:
        """Numbers of a material, at the top of the text."""
        declared = f"{self.type(v.width)} {v.name}" if self.type(v.width) else f"float {v.name}[{v.width}]"
        return f"{self.before_constant} {declared} = {self.built(v, list(map(self.number, values)))};"

    def argument(self, v: NamedVector) -> str:
        """An argument in a signature."""
        return f"{self.type(v.width, v.kind)} {v.name}" if self.type(v.width) else f"float {v.name}[{v.width}]"

    def result(self, v: NamedVector) -> str:
        """A result in a signature, where it is not returned."""
        return f"out {self.argument(v)}"

    def array(self, numbers: Sequence[str]) -> str:
        """Numbers as an array."""
        return f"{{{', '.join(numbers)}}}"

    # Statements.

    def declare(self, name: str, kind: str, value: str) -> str:
        """A new name for a value that stays."""
        return f"const {self.words[kind]} {name} = {value};"

    def variable(self, name: str, kind: str, value: str) -> str:
        """A name for a value that changes."""
        return f"{self.words[kind]} {name} = {value};"

    def assign(self, name: str, value: str) -> str:
        return f"{name} = {value};"

    def loop(self, body: Sequence[str], go_on: str) -> list[str]:
        """Statements that are repeated while a condition, which they set, holds."""
        return ["do {", *(f"    {line}" for line in body), f"}} while ({go_on});"]

    def select(self, condition: str, a: str, b: str) -> str:
        """A choice between arguments that bind as those of a call do."""
        return f"({condition} ? {a} : {b})"

    def different(self, a: str, b: str) -> str:
        """Whether one of two conditions holds alone."""
        return f"({a} != {b})"

    def to_index(self, x: str) -> str:
        return f"{self.words[INDEX]}({x})"

    def to_real(self, x: str) -> str:
        return f"{self.words[REAL]}({x})"

    def shifted(self, operation: str, a: str, b: str) -> str:
        """A whole number shifted; to the right zeros follow."""
        return f"int(uint({a}) {'<<' if operation == 'shl' else '>>'} {b})"

    def unread(self, name: str) -> str:
        """A statement for an argument that a function does not read, where compilers complain without; else ""."""
        return ""

    # Functions.

    def outputs(self, signature: Signature, values: Mapping[str, Sequence[str]]) -> list[str]:
        """The last statements of a function."""
        if (single := self.returned(signature)) is not None:
            return [f"return {self.built(single, values[single.name])};"]
        lines = []
        for v in signature.results:
            if self.type(v.width):
                lines.append(f"{self.dereference}{v.name} = {self.built(v, values[v.name])};")
            else:
                lines += [f"{v.name}[{i}] = {x};" for i, x in enumerate(values[v.name])]
        return lines

    def returned(self, signature: Signature) -> NamedVector | None:
        """The one result that a function returns; None where results are arguments."""
        if len(signature.results) != 1:
            return None
        (single,) = signature.results
        return single if self.returns_arrays or self.type(single.width) else None

    def built(self, v: NamedVector, values: Sequence[str]) -> str:
        """A vector of values."""
        if v.width == 1:
            return values[0]
        return f"{self.type(v.width)}({', '.join(values)})" if self.type(v.width) else self.array(values)

    def header(self, signature: Signature) -> str:
        """The line that begins a function."""
        arguments = [self.argument(v) for v in signature.arguments]
        single = self.returned(signature)
        if single is None:
            arguments += [self.result(v) for v in signature.results]
        result_type = "void" if single is None else self.type(single.width, single.kind)
        return f"{self.before}{result_type} {signature.name}({', '.join(arguments)})"

    def function(self, signature: Signature, body: Sequence[str]) -> list[str]:
        """The lines of a function."""
        return [self.header(signature), "{", *(f"    {line}" for line in body), "}"]

    # Tables.

    def small_table(self, name: str, values: np.ndarray) -> list[str]:
        """A table in the text, and the function that reads it."""
        numbers = self.array([self.number(x) for x in values])
        return [f"{self.before_constant} float {name}[{len(values)}] = {numbers};", *self.reader(name, len(values))]

    @abstractmethod
    def large_table(self, name: str, count: int, number: int) -> list[str]:
        """The declaration of a table that the program brings, and the function that reads it."""

    def reader(self, name: str, count: int) -> list[str]:
        """The function that reads an entry of an array, the nearest one beyond its ends."""
        return [f"{self.before}float {name}_at(int i) {{ return {name}[{self.clamped(count)}]; }}"]

    def clamped(self, count: int) -> str:
        """The index i, or that of the nearest of so many entries."""
        return f"clamp(i, 0, {count - 1})"
