"""GLSL ES 3.00 (WebGL 2) and GLSL 3.30: large tables are textures of one float channel, 2048 texels wide."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..language import Language

WIDTH = 2048
"""Texels in a row of a table's texture."""


class Glsl(Language):
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

    def array(self, numbers: Sequence[str]) -> str:
        return f"float[{len(numbers)}]({', '.join(numbers)})"

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        rows = -(-count // WIDTH)
        return [
            f"uniform highp sampler2D {name}; // R32F, nearest, {WIDTH} x {rows} texels, {count} numbers row by row",
            f"float {name}_at(int i)",
            "{",
            f"    i = {self.clamped(count)};",
            f"    return texelFetch({name}, ivec2(i % {WIDTH}, i / {WIDTH}), 0).r;",
            "}",
        ]


LANGUAGE = Glsl()
