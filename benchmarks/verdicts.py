"""Whether verdicts of measurements hold: python benchmarks/verdicts.py [--out FILE] [--measurements N] [--power N]

Sound measurements of lawful surfaces are simulated in five shapes, with errors as large as they state, independent ones
and such of which half of the variance is common to all values (tests/tools/sound.py). None of them should fail a law.
Unsound ones should: not reciprocal by 5 u, root mean square, and of an albedo of 1 + 4 u.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from timing import machine

import gonio as gn

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "tools"))
from sound import LAWS, SHAPES, sound, too_white, unreciprocal

COMMON = (0.0, 0.5)
"""Shares of the variance that are common to all values."""

BREACHES = {"reciprocity": (unreciprocal, 5.0), "energy": (too_white, 4.0)}


def of_sound(number: int) -> tuple[str, float, list[str]]:
    """The shape, the common share, and the laws that a sound measurement fails."""
    common = COMMON[number // len(SHAPES) % len(COMMON)]
    shape, m = sound(number, common)
    report = gn.check(m, laws=LAWS)
    return shape, common, [law.name for law in report.laws if not law.passed]


def of_breach(job: tuple[str, int]) -> tuple[str, str, float, bool]:
    """The law, the shape, the common share, and whether the law says FAIL."""
    law, number = job
    common = COMMON[number // len(SHAPES) % len(COMMON)]
    made, size = BREACHES[law]
    shape, m = made(number, size, common)
    return law, shape, common, gn.check(m, laws=[law])[law].verdict == "FAIL"


def lines(found: list, caught: list) -> Iterator[str]:
    """The table."""
    caught_at = "FAIL at 5 u of reciprocity, at an albedo of 1 + 4 u"
    yield f"{'':<16}{'common share':>14}{'sound':>8}{'fail':>6}   {caught_at}"
    for shape in (*SHAPES, "all"):
        for common in (*COMMON, "any"):
            if (shape == "all") != (common == "any") and shape != "all":
                continue
            some = [x for x in found if shape in (x[0], "all") and common in (x[1], "any")]
            shares = []
            for law in BREACHES:
                of = [x[-1] for x in caught if x[0] == law and shape in (x[1], "all") and common in (x[2], "any")]
                shares.append(f"{sum(of)} of {len(of)}")
            failed = sum(bool(x[2]) for x in some)
            yield f"{shape:<16}{common:>14}{len(some):>8}{failed:>6}   {', '.join(shares)}"
    laws = {law: sum(law in x[2] for x in found) for law in LAWS}
    yield ""
    yield "failed by law: " + ", ".join(f"{law} {n}" for law, n in laws.items())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--measurements", type=int, default=1000)
    parser.add_argument("--power", type=int, default=200)
    parser.add_argument("--processes", type=int, default=2)
    chosen = parser.parse_args()
    jobs = [(law, number) for law in BREACHES for number in range(chosen.power)]
    with ProcessPoolExecutor(chosen.processes, mp_context=get_context("spawn")) as pool:
        caught = list(pool.map(of_breach, jobs, chunksize=10))
        print("\n".join(lines([], caught)), flush=True)
        found = list(pool.map(of_sound, range(chosen.measurements), chunksize=10))
    text = "\n".join(
        [
            f"Verdicts of {len(found)} sound measurements, simulated, and of {chosen.power} of each breach",
            *machine(1)[:3],
            "",
            *lines(found, caught),
            "",
        ]
    )
    print(text)
    if chosen.out:
        chosen.out.write_text(text)


if __name__ == "__main__":
    main()
