"""Operations of the kernels of every model, as recorded and after the passes: python benchmarks/operations.py

A line for each kernel: its operations over all models of one side, and over those of both sides; then those of each
model. Kept in operations.txt, so that `git diff` shows what a change of kernels, passes or models costs.
"""

from __future__ import annotations

import gonio as gn
from gonio.base import kernels
from gonio.evaluate.tracing import Task, traced
from gonio.formula import tree
from gonio.formula.classes import takes_fields
from gonio.trace import passes

PLAIN, METAL = gn.Lambertian(0.3), gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
MIRROR, GLASS = gn.IdealSpecular(0.04), gn.RoughDielectric(gn.GGX(0.2), 1.5)
MADE = {
    "sum": PLAIN + METAL,
    "sum with a mirror": PLAIN + MIRROR,
    "sum of three channels": gn.Lambertian([0.1, 0.2, 0.3]) + METAL,
    "sum with glass": PLAIN + GLASS,
    "turned glass": gn.Rotated(GLASS, 0.3),
    "two sides, one with a mirror": gn.TwoSided(PLAIN + MIRROR, METAL),
    "sheet": gn.Sheet(PLAIN, METAL, PLAIN + MIRROR, PLAIN),
    "stack": gn.Stack([gn.RoughInterface(1.5, 0.2)], base=PLAIN),
    "open stack": gn.Stack([gn.Interface(1.5), gn.Medium(1.0)]),
}
TASKS = {
    "f": kernels.F,
    "pdf": kernels.PDF,
    "sample, 2 numbers": kernels.SAMPLE[2],
    "sample, 3 numbers": kernels.SAMPLE[3],
    "mueller": kernels.MUELLER,
    "delta_reflectance": kernels.DELTA_REFLECTANCE,
    "delta_reflectance, across": kernels.DELTA_TRANSMISSION,
    "delta_mueller": kernels.DELTA_MUELLER,
    "delta_mueller, across": kernels.DELTA_MUELLER_ACROSS,
}


def tasks(m: gn.Reflectance) -> dict[str, Task]:
    """The kernels of a material; the last one with all its derivatives."""
    return TASKS | {"jacobian": kernels.F.derivatives(tuple(range(len(list(tree.leaf_paths(m))))), (0, 1))}


def counted(task: Task, m: gn.Reflectance) -> tuple[int, int]:
    """Operations as recorded, and after the passes."""
    trace = traced(task, m, m.channels)
    graph, ends = passes.rewritten(trace.graph, [node for result in trace.results for node in result], "float64")
    return trace.operations, sum(graph.operations[n] not in ("constant", "load") for n in graph.reachable(ends))


def main() -> None:
    materials = {name: model() for name, model in gn.models().items() if takes_fields(model)} | MADE
    rows = {name: {task: counted(t, m) for task, t in tasks(m).items()} for name, m in materials.items()}
    one = {name for name, m in materials.items() if m.sides == "front"}
    print(
        f"Operations of kernels: recorded, after the passes; {len(one)} of one side, {len(rows) - len(one)} of both\n"
    )
    for task in rows["sum"]:
        sums = [[sum(rows[n][task][k] for n in some) for k in (0, 1)] for some in (one, rows.keys() - one)]
        print(f"{task:28}" + "".join(f"{recorded:9} {made:7}" for recorded, made in sums))
    for name, row in rows.items():
        print(f"\n{name}")
        print("".join(f"  {task:28}{recorded:7} {made:7}\n" for task, (recorded, made) in row.items()), end="")


if __name__ == "__main__":
    main()
