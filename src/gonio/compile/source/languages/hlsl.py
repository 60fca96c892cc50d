"""HLSL, shader model 5: large tables are buffers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..language import NamedVector, Shading


class Hlsl(Shading):
    name, title, suffix = "hlsl", "HLSL (shader model 5)", ".hlsl"
    missing = "asfloat(0x7fc00000u)"
    vectors: Mapping[int, str] = {2: "float2", 3: "float3", 4: "float4"}

    def array(self, numbers: Sequence[str]) -> str:
        return f"{{{', '.join(numbers)}}}"

    def global_constant(self, v: NamedVector, values: Sequence[float]) -> str:
        return f"static {super().global_constant(v, values)}"

    def to_index(self, x: str) -> str:
        return f"int({x})"

    def to_real(self, x: str) -> str:
        return f"float({x})"

    def shifted(self, operation: str, a: str, b: str) -> str:
        return f"int(uint({a}) {'<<' if operation == 'shl' else '>>'} {b})"

    def small_table(self, name: str, values: np.ndarray) -> list[str]:
        numbers = self.array([self.number(x) for x in values])
        return [f"static const float {name}[{len(values)}] = {numbers};", *self.reader(name, len(values))]

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        declared = f"Buffer<float> {name} : register(t{number}); // {count} numbers"
        return [declared, *self.reader(name, count)]

    def reader(self, name: str, count: int) -> list[str]:
        return [f"float {name}_at(int i) {{ return {name}[clamp(i, 0, {count - 1})]; }}"]


LANGUAGE = Hlsl()
