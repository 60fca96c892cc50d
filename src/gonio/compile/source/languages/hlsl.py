"""HLSL, shader model 5: large tables are buffers."""

from __future__ import annotations

from collections.abc import Mapping

from ..language import Language


class Hlsl(Language):
    name, title, suffix = "hlsl", "HLSL (shader model 5)", ".hlsl"
    before_constant = "static const"
    missing = "asfloat(0x7fc00000u)"
    vectors: Mapping[int, str] = {2: "float2", 3: "float3", 4: "float4"}

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        declared = f"Buffer<float> {name} : register(t{number}); // {count} numbers"
        return [declared, *self.reader(name, count)]


LANGUAGE = Hlsl()
