"""The functions that a source text may have, each the kernel that gonio itself computes by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...arrays import ops
from ...arrays.kinds import MATRIX, SCALAR, VALUE, VECTOR
from ...base import kernels
from ...base.reflectance import Reflectance
from ...compile.source.language import NamedVector
from ...evaluate.tracing import Task
from ...trace.graph import MASK


def _f_cos(m: Reflectance, mean: Reflectance, wi: Any, wo: Any) -> tuple[Any, ...]:
    return (kernels.value(m, mean, wi, wo)[0] * ops.absolute(wi[2]),)


@dataclass(frozen=True)
class Function:
    """A function for callers: its kernel, its arguments, kinds and names of its results, and what it gives in words."""

    kernel: Callable[..., tuple[Any, ...]]
    inputs: tuple[NamedVector, ...]
    results: tuple[tuple[str, str], ...]
    meaning: str

    @property
    def task(self) -> Task:
        kinds = tuple(SCALAR if kind == MASK else kind for _, kind in self.results)
        return Task(self.kernel, kinds, tuple(v.width for v in self.inputs))


_WI, _WO = (NamedVector(name, 3, is_direction=True) for name in ("wi", "wo"))
_SAMPLED = (("wi", VECTOR), ("weight", VALUE), ("pdf", SCALAR), ("delta", MASK))
FUNCTIONS = {
    "f": Function(kernels.value, (_WI, _WO), (("f", VALUE),), "BRDF [1/sr], without the cosine"),
    "f_cos": Function(_f_cos, (_WI, _WO), (("f_cos", VALUE),), "BRDF times |cos(theta_i)| [1/sr]"),
    "pdf": Function(kernels.pdf, (_WI, _WO), (("pdf", SCALAR),), "density [1/sr] at which `sample` draws wi for wo"),
    "sample": Function(
        kernels.sample,
        (_WO, NamedVector("u", 2)),
        _SAMPLED,
        "direction wi drawn by two numbers u in [0, 1); weight = f |cos|/pdf, its density, whether it is a delta lobe",
    ),
    "mueller": Function(
        kernels.mueller, (_WI, _WO), (("M", MATRIX),), "Mueller matrix [1/sr], 16 numbers row by row for each channel"
    ),
    "jacobian": Function(kernels.value, (_WI, _WO), (("f", VALUE),), "f, and its derivative by each parameter"),
}
"""By the word that asks for them."""
