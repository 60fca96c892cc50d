"""CUDA C++: device functions; large tables are pointers in device memory that the program sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ....trace.graph import INDEX, MASK, REAL
from ..language import NamedVector, calls
from .c import C


class Cuda(C):
    name, title, suffix = "cuda", "CUDA C++", ".cu"
    preamble: tuple[str, ...] = ()
    before, before_constant, dereference = "static inline __device__ ", "static __device__ const", ""
    words: Mapping[str, str] = {REAL: "float", INDEX: "int", MASK: "bool"}
    vectors: Mapping[int, str] = {2: "float2", 3: "float3", 4: "float4"}
    truth = ("true", "false")
    infinity, missing = "__int_as_float(0x7f800000)", "__int_as_float(0x7fffffff)"
    calls: Mapping[str, str] = calls("c", "cuda")

    def result(self, v: NamedVector) -> str:
        return f"{self.type(v.width, v.kind)} &{v.name}" if self.type(v.width) else f"float {v.name}[{v.width}]"

    def built(self, v: NamedVector, values: Sequence[str]) -> str:
        return f"make_{super().built(v, values)}" if v.width in self.vectors else super().built(v, values)

    def global_constant(self, v: NamedVector, values: Sequence[float]) -> str:
        # vectors have no constructor that a constant in device memory could be made by
        if v.width not in self.vectors:
            return super().global_constant(v, values)
        return f"{self.before_constant} {self.type(v.width)} {v.name} = {self.array([self.number(x) for x in values])};"

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        declared = f"__device__ const float *{name}; // of {count} numbers: set it first, by cudaMemcpyToSymbol"
        return [declared, *self.reader(name, count)]


LANGUAGE = Cuda()
