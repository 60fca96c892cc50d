"""CUDA C++: device functions; large tables are pointers in device memory that the program sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ....trace.graph import INDEX, MASK, REAL
from ..language import Language, NamedVector, Shading, calls


class Cuda(Shading):
    name, title, suffix = "cuda", "CUDA C++", ".cu"
    before = "static inline __device__ "
    number_end, infinity = "f", "__int_as_float(0x7f800000)"
    words: Mapping[str, str] = {REAL: "float", INDEX: "int", MASK: "bool"}
    calls: Mapping[str, str] = calls("c", "cuda")
    imprecise = frozenset()
    missing = "__int_as_float(0x7fffffff)"
    vectors: Mapping[int, str] = {2: "float2", 3: "float3", 4: "float4"}

    def result(self, v: NamedVector) -> str:
        return f"{self.type(v.width, v.kind)} &{v.name}" if self.type(v.width) else f"float {v.name}[{v.width}]"

    def argument(self, v: NamedVector) -> str:
        return super().argument(v) if self.type(v.width) else f"const float {v.name}[{v.width}]"

    def built(self, v: NamedVector, values: Sequence[str]) -> str:
        return values[0] if v.width == 1 else f"make_{self.type(v.width)}({', '.join(values)})"

    def global_constant(self, v: NamedVector, values: Sequence[float]) -> str:
        # vectors have no constructor that a constant in device memory could be made by
        numbers = ", ".join(map(self.number, values))
        if v.width == 1:
            return f"static __device__ const float {v.name} = {numbers};"
        element_type, end = (self.type(v.width), "") if self.type(v.width) else ("float", f"[{v.width}]")
        return f"static __device__ const {element_type} {v.name}{end} = {{{numbers}}};"

    to_index, to_real, shifted, unread = Language.to_index, Language.to_real, Language.shifted, Language.unread

    def small_table(self, name: str, values: np.ndarray) -> list[str]:
        numbers = ", ".join(map(self.number, values))
        declared = f"static __device__ const float {name}[{len(values)}] = {{{numbers}}};"
        return [declared, *self.reader(name, len(values))]

    def large_table(self, name: str, count: int, number: int) -> list[str]:
        declared = f"__device__ const float *{name}; // of {count} numbers: set it first, by cudaMemcpyToSymbol"
        return [declared, *self.reader(name, count)]


LANGUAGE = Cuda()
