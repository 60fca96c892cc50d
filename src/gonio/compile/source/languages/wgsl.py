"""WGSL: results of several values are a structure; large tables are storage buffers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ....trace.graph import INDEX, MASK, REAL
from ..language import Language, NamedVector, Signature, bare


class Wgsl(Language):
    name, title, suffix = "wgsl", "WGSL", ".wgsl"
    words: Mapping[str, str] = {REAL: "f32", INDEX: "i32", MASK: "bool"}
    vectors: Mapping[int, str] = {2: "vec2f", 3: "vec3f", 4: "vec4f"}
    returns_arrays = True

    def type(self, width: int, kind: str = REAL) -> str:
        return super().type(width, kind) or f"array<f32, {width}>"

    def argument(self, v: NamedVector) -> str:
        return f"{v.name}: {self.type(v.width, v.kind)}"

    def array(self, numbers: Sequence[str]) -> str:
        return f"array<f32, {len(numbers)}>({', '.join(numbers)})"

    def global_constant(self, v: NamedVector, values: Sequence[float]) -> str:
        # not const: what is made of constants alone must be finite there, in branches that are not taken, too
        return f"var<private> {v.name}: {self.type(v.width)} = {self.built(v, list(map(self.number, values)))};"

    def declare(self, name: str, kind: str, value: str) -> str:
        return f"let {name}: {self.words[kind]} = {value};"

    def variable(self, name: str, kind: str, value: str) -> str:
        return f"var {name}: {self.words[kind]} = {value};"

    def loop(self, body: Sequence[str], go_on: str) -> list[str]:
        return ["loop {", *(f"    {line}" for line in body), f"    if !({go_on}) {{ break; }}", "}"]

    def select(self, condition: str, a: str, b: str) -> str:
        return f"select({b}, {a}, {bare(condition)})"

    def shifted(self, operation: str, a: str, b: str) -> str:
        return f"i32(u32({a}) {'<<' if operation == 'shl' else '>>'} u32({b}))"

    def structure(self, signature: Signature) -> str:
        """The name of the structure of several results."""
        return "".join(part.capitalize() for part in signature.name.split("_")) + "Result"

    def function(self, signature: Signature, body: Sequence[str]) -> list[str]:
        lines = []
        result_type = self.structure(signature)
        if len(signature.results) > 1:
            lines = [f"struct {result_type} {{", *(f"    {self.argument(v)}," for v in signature.results), "}", ""]
        else:
            (single,) = signature.results
            result_type = self.type(single.width, single.kind)
        arguments = ", ".join(self.argument(v) for v in signature.arguments)
        return [*lines, f"fn {signature.name}({arguments}) -> {result_type} {{", *(f"    {line}" for line in body), "}"]

    def outputs(self, signature: Signature, values: Mapping[str, Sequence[str]]) -> list[str]:
        built = [self.built(v, values[v.name]) for v in signature.results]
        return [
            f"return {built[0]};" if len(built) == 1 else f"return {self.structure(signature)}({', '.join(built)});"
        ]

    def small_table(self, name: str, values: np.ndarray) -> list[str]:
        numbers = self.array([self.number(x) for x in values])
        return [f"const {name} = {numbers};", *self.reader(name, len(values))]

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        declared = f"@group(0) @binding({number}) var<storage, read> {name}: array<f32>; // {count} numbers"
        return [declared, *self.reader(name, count)]

    def reader(self, name: str, count: int) -> list[str]:
        return [f"fn {name}_at(i: i32) -> f32 {{ return {name}[{self.clamped(count)}]; }}"]


LANGUAGE = Wgsl()
