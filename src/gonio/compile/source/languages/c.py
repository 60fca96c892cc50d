"""C99: directions are arrays of three; large tables are pointers that the program sets."""

from __future__ import annotations

from collections.abc import Mapping

from ....trace.graph import INDEX, MASK, REAL
from ..language import Language, NamedVector, calls


class C(Language):
    name, title, suffix = "c", "C99", ".c"
    preamble: tuple[str, ...] = ("#include <math.h>",)
    before, before_constant, dereference = "static inline ", "static const", "*"
    words: Mapping[str, str] = {REAL: "float", INDEX: "int", MASK: "int"}
    truth = ("1", "0")
    number_end, infinity, missing = "f", "INFINITY", "NAN"
    calls: Mapping[str, str] = calls("c")
    imprecise = frozenset()

    def argument(self, v: NamedVector) -> str:
        return super().argument(v) if self.type(v.width) else f"const float {v.name}[{v.width}]"

    def result(self, v: NamedVector) -> str:
        return f"{self.type(v.width, v.kind)} *{v.name}" if self.type(v.width) else f"float {v.name}[{v.width}]"

    def to_index(self, x: str) -> str:
        return f"(int)({x})"

    def to_real(self, x: str) -> str:
        return f"(float)({x})"

    def shifted(self, operation: str, a: str, b: str) -> str:
        return f"(int)((unsigned)({a}) {'<<' if operation == 'shl' else '>>'} ({b}))"

    def unread(self, name: str) -> str:
        return f"(void){name};"

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        return [f"const float *{name}; // of {count} numbers: set it first", *self.reader(name, count)]

    def clamped(self, count: int) -> str:
        return f"i < 0 ? 0 : i > {count - 1} ? {count - 1} : i"


LANGUAGE = C()
