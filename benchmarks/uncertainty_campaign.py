"""Whether uncertainties hold: python benchmarks/uncertainty_campaign.py [--out FILE] [--measurements N] [--first K]

Known surfaces are measured as laboratories do, on grids of 2.5 to 30 degrees, in 2 to 36 half-planes, in rows in no
grid, with noise of 0 to 5 %, and results of the measurements (`gn.with_uncertainty`) are compared with those of the
surfaces. Measurements are numbered and made from their numbers alone (tests/tools/synthetic.py).
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from timing import machine

from gonio.errors import MissingDataWarning, ToleranceWarning

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.tools.synthetic import results, synthetic

FIRST = 10_000
"""The first number; those with which the method was made are below."""

QUADRATURE = 1e-5
"""Absolute error that quadrature may add to the difference of two albedos."""

ROUNDING = 1e-12
"""Relative error of f at nodes."""


class Case(NamedTuple):
    """A result: what it is of, its error, and its uncertainties."""

    name: str
    kind: str
    step: float
    planes: int
    noise: float
    error: float
    u: float
    u_noise: float
    u_interpolation: float
    size: float

    @property
    def off(self) -> float:
        """|error|, less what quadrature or rounding may have added."""
        return max(abs(self.error) - (ROUNDING * self.size if self.name == "f" else QUADRATURE), 0.0)

    def within(self, k: float, u: float) -> bool:
        return self.off <= k * u


def cases(number: int) -> list[Case]:
    """All results of a measurement; the white-sky albedo of every third one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)  # holes are part of the campaign
        warnings.simplefilter("ignore", ToleranceWarning)  # the error is what is judged
        made = synthetic(number)
        return [
            Case(result.name, made.kind, made.step, made.planes, made.noise, *map(float, numbers))
            for result in results(number, made, sky=number % 3 == 0)
            for numbers in zip(*result[1:], strict=True)
        ]


def line(name: str, some: list[Case]) -> str:
    """A row of the table."""
    within = [np.mean([case.within(k, case.u) for case in some]) for k in (3.0, 2.0)]
    before = np.mean([case.within(3.0, case.u_noise) for case in some])
    z = np.median([case.off / case.u for case in some if case.u > 0.0])
    resolved = [c.u_interpolation / abs(c.error) for c in some if abs(c.error) > max(1e-3 * c.size, 3.0 * c.u_noise)]
    wide = f"{np.median(resolved):8.1f}" if resolved else f"{'-':>8}"
    return f"{name:<28}{len(some):>7}{within[0]:>9.1%}{within[1]:>9.1%}{before:>10.1%}{z:>10.2f}{wide}"


def lines(found: list[Case]) -> Iterator[str]:
    """The table."""
    yield f"{'':<28}{'':>7}{'within':>9}{'within':>9}{'3 u of':>10}{'median':>10}{'u over':>8}"
    yield f"{'':<28}{'results':>7}{'3 u':>9}{'2 u':>9}{'noise':>10}{'|err|/u':>10}{'|err|':>8}"
    yield line("all", found)
    for by in ("name", "kind", "step", "planes", "noise"):
        yield ""
        for value in sorted({getattr(case, by) for case in found}):
            words = {"step": f"every {value} degrees", "planes": f"{value} half-planes"}.get(by, str(value))
            words = f"noise {value:.1%}" if by == "noise" else words
            yield line(words, [case for case in found if getattr(case, by) == value])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--measurements", type=int, default=1000)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--processes", type=int, default=2)
    chosen = parser.parse_args()
    numbers = range(chosen.first, chosen.first + chosen.measurements)
    with ProcessPoolExecutor(chosen.processes) as pool:
        found = [case for part in pool.map(cases, numbers, chunksize=5) for case in part]
    text = "\n".join(
        [
            f"Results of {len(numbers)} synthetic measurements, number {numbers[0]} to {numbers[-1]}, beside the truth",
            "3 u of noise: within three times the component by noise alone. u over |err|: the median of the component",
            "by interpolation over the error, where the error is above 3 u of noise and 0.1 %.",
            *machine(1)[:3],
            "",
            *lines(found),
            "",
        ]
    )
    print(text)
    if chosen.out:
        chosen.out.write_text(text)


if __name__ == "__main__":
    main()
