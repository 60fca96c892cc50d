"""GLSL ES 3.00 (WebGL 2) and GLSL 3.30: large tables are textures of one float channel, 2048 texels wide."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..language import Shading

WIDTH = 2048
"""Texels in a row of a table's texture."""


class Glsl(Shading):
    name, title, suffix = "glsl", "GLSL (ES 3.00, 3.30 and later)", ".glsl"
    preamble = ("#ifdef GL_ES", "precision highp float;", "precision highp int;", "#endif")
    missing = "uintBitsToFloat(0x7fc00000u)"
    vectors: Mapping[int, str] = {2: "vec2", 3: "vec3", 4: "vec4"}
    returns_arrays = True

    def type(self, width: int, kind: str = "real") -> str:
        return super().type(width, kind) or f"float[{width}]"

    def declare(self, name: str, kind: str, value: str) -> str:
        return self.variable(name, kind, value)  # constants of ES 3.00 are known to the compiler

    def different(self, a: str, b: str) -> str:
        return f"({a} ^^ {b})"

    def to_index(self, x: str) -> str:
        return f"int({x})"

    def to_real(self, x: str) -> str:
        return f"float({x})"

    def shifted(self, operation: str, a: str, b: str) -> str:
        return f"int(uint({a}) {'<<' if operation == 'shl' else '>>'} {b})"

    def small_table(self, name: str, values: np.ndarray) -> list[str]:
        numbers = [self.number(x) for x in values]
        return [f"const float {name}[{len(values)}] = {self.array(numbers)};", *self.reader(name, len(values))]

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        rows = -(-count // WIDTH)
        inside = f"clamp(i, 0, {count - 1})"
        return [
            f"uniform highp sampler2D {name}; // R32F, nearest, {WIDTH} x {rows} texels, {count} numbers row by row",
            f"float {name}_at(int i)",
            "{",
            f"    i = {inside};",
            f"    return texelFetch({name}, ivec2(i % {WIDTH}, i / {WIDTH}), 0).r;",
            "}",
        ]

    def reader(self, name: str, count: int) -> list[str]:
        return [f"float {name}_at(int i) {{ return {name}[clamp(i, 0, {count - 1})]; }}"]


LANGUAGE = Glsl()
