"""OSL: functions of a shader; large tables are read from pictures of one channel, which `ShaderSource.save` writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ....trace.graph import INDEX, MASK, REAL
from ..language import Language, NamedVector

WIDTH = 2048
"""Texels in a row of a table's picture."""


class Osl(Language):
    name, title, suffix = "osl", "OSL", ".osl"
    words: Mapping[str, str] = {REAL: "float", INDEX: "int", MASK: "int"}
    truth = ("1", "0")

    def type(self, width: int, kind: str = REAL) -> str:
        return "vector" if width == 3 else super().type(width, kind)

    def result(self, v: NamedVector) -> str:
        return f"output {self.argument(v)}"

    def declare(self, name: str, kind: str, value: str) -> str:
        return self.variable(name, kind, value)

    def constant_component(self, v: NamedVector, i: int) -> str:
        return v.name if v.width == 1 else f"{v.name}_{i}"

    def global_constant(self, v: NamedVector, values: Sequence[float]) -> str:
        # outside functions a text has no constants but those of the preprocessor
        return "\n".join(f"#define {self.constant_component(v, i)} ({self.number(x)})" for i, x in enumerate(values))

    def shifted(self, operation: str, a: str, b: str) -> str:
        return f"(({a}) {'<<' if operation == 'shl' else '>>'} ({b}))"

    def small_table(self, name: str, values: np.ndarray) -> list[str]:
        numbers = ", ".join(self.number(x) for x in values)
        return [
            f"float {name}_at(int i)",
            "{",
            f"    float {name}[{len(values)}] = {{{numbers}}};",
            f"    return {name}[{self.clamped(len(values))}];",
            "}",
        ]

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        rows = -(-count // WIDTH)
        return [
            f"float {name}_at(int i) // a picture of {WIDTH} x {rows} texels, {count} numbers row by row",
            "{",
            f"    int k = {self.clamped(count)};",
            f'    return texture("{name}.exr", (k % {WIDTH} + 0.5) / {WIDTH}.0, (k / {WIDTH} + 0.5) / {rows}.0,',
            '        "interp", "closest", "width", 0.0);',
            "}",
        ]


LANGUAGE = Osl()
