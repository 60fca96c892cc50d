"""The computation of a material's formula: its graph as text, and the code compiled from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.kinds import VECTOR
from ..base import kernels
from ..base.reflectance import Reflectance
from ..compile import store
from ..compile.llvm.program import EACH, PACKED, SAME, Array, Output, Program
from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from ..errors import NotFoundError
from ..evaluate import tracing
from ..formula import tree
from ..trace import passes
from ..trace.show import show

_KERNELS: dict[str, tuple[tracing.Task, tuple[str, ...], tuple[str, ...]]] = {
    "f": (kernels.F, ("f",), ("wi", "wo")),
    "pdf": (kernels.PDF, ("pdf",), ("wi", "wo")),
    "sample": (kernels.SAMPLE[2], ("wi", "weight", "pdf", "delta"), ("wo", "u")),
}
"""Method -> its task, and the names of its results and inputs."""

_COMPONENTS = {"wi": "xyz", "wo": "xyz", "u": "01"}


@dataclass(frozen=True)
class Kernel:
    """The computation of a material's formula; prints as `source`.

    source    assignments in the order of computation; a value used twice has a name
    inputs    components of directions, and parameters, that the formula reads
    rewritten the same with fewer operations, as it is compiled; GONIO_PASSES=off compiles `source`
    program   input of the compiler, for float32 batches (N, 3)

    Example
    >>> kernel = gn.engine.kernel(gn.Lambertian(0.5))
    >>> print(kernel.inputs)
    ('wi.x', 'wi.y', 'wi.z', 'wo.x', 'wo.y', 'wo.z', 'rho')
    """

    _repr_html_ = repr_html

    source: str
    inputs: tuple[str, ...]
    rewritten: str
    program: Program

    @property
    def llvm(self) -> str:
        """The kernel in LLVM's intermediate representation, for this processor.

        Example
        >>> print("define" in gn.engine.kernel(gn.Lambertian(0.5)).llvm)
        True
        """
        return store.source(self.program)

    @property
    def assembly(self) -> str:
        """The kernel in this processor's assembly language.

        Example
        >>> print("ret" in gn.engine.kernel(gn.Lambertian(0.5)).assembly)
        True
        """
        return store.assembly(self.program)

    def __str__(self) -> str:
        return self.source


@checked
def kernel(m: Reflectance, method: str = "f") -> Kernel:
    """The kernel that `m.f`, `m.pdf` or `m.sample` runs on NumPy arrays.

    Raises TraceError, with the reason, if the formula cannot be compiled and runs on arrays instead.

    Example
    >>> kernel = gn.engine.kernel(gn.Lambertian(0.5))
    >>> print(str(kernel))
    t1 = wi.x + wo.x
    t2 = wi.y + wo.y
    t3 = wi.z + wo.z
    t4 = t1 * t1 + t2 * t2 + t3 * t3
    f = where((wi.z <= 1e-06) | (wo.z <= 1e-06), 0.0, rho * 0.3183098861837907) + (t4 - t4)
    """
    if method not in _KERNELS:
        raise NotFoundError(f"kernel(method={method!r}): expected one of {', '.join(map(repr, _KERNELS))}")
    task, returned, names = _KERNELS[method]
    paths, shapes = [path or "channel" for path in tree.leaf_paths(m)], [np.shape(v)[-1:] for v in tree.leaves(m)]
    channels = m.channels
    trace = tracing.traced(task, m, channels)
    loads = _names(names, paths, shapes)
    outputs = {}
    for kind, name, nodes in zip(task.kinds, returned, trace.results, strict=True):
        ends = [f".{c}" for c in "xyz"] if kind == VECTOR else _entries(len(nodes) if channels else None)
        outputs.update({name + end: node for end, node in zip(ends, nodes, strict=True)})
    order = trace.graph.reachable(outputs.values())
    read = tuple(loads[trace.graph.arguments[n]] for n in order if trace.graph.operations[n] == "load")
    arrays = [Array(w, PACKED) for w in task.widths]
    arrays += [Array(shape[0] if shape else 1, SAME) for shape in shapes]
    arrays += [Array(1, SAME)] * (len(shapes) if channels else 0)
    tables = 1 + max((trace.graph.arguments[n][0] for n in order if trace.graph.operations[n] == "take"), default=-1)
    graph, numbers = passes.rewritten(
        trace.graph, list(outputs.values()), "float32", range(len(task.widths), len(arrays))
    )
    named = dict(zip(outputs, numbers, strict=True))
    table_names = [f"table{i}" for i in range(tables)]
    texts = [show(g, of, loads, table_names) for g, of in ((trace.graph, outputs), (graph, named))]
    results = tuple(Output(nodes, EACH) for nodes in trace.results)
    return Kernel(texts[0], read, texts[1], Program(trace.graph, results, tuple(arrays), tables, "float32"))


def _names(inputs: tuple[str, ...], paths: list[str], shapes: list[tuple[int, ...]]) -> dict[tuple[int, int], str]:
    """(number of an array, number of an entry) -> the name of what is loaded from there."""
    names = {(k, c): f"{name}.{x}" for k, name in enumerate(inputs) for c, x in enumerate(_COMPONENTS[name])}
    for k, (path, shape) in enumerate(zip(paths, shapes, strict=True), len(inputs)):
        for c, end in enumerate(_entries(shape[0] if shape else None)):
            names[k, c] = path + end
        names[k + len(paths), 0] = f"merged({path})"
    return names


def _entries(count: int | None) -> list[str]:
    return [""] if count is None else [f"[{c}]" for c in range(count)]
