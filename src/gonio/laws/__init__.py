"""Whether a reflectance obeys the laws: a verdict per law, with its number, tolerance, place and reason.

A law is a file of its own, named after it. It has a function `law(m)` that yields verdicts and notes; ORDER, its place
in reports: tens for its subject (values of f, energy, sampling, limits), ones within; a docstring "Name: statement.",
with the labels Measured, Holds if, and Tolerance with its reason; and FOLLOWS, where another broken law explains it. It
is found by being here; files with an underscore serve the laws.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

import numpy as np

from ..base.calls import breaches
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..declared import discover
from ..declared.arguments import Declared, checked
from ..errors import MissingDataWarning, NotFoundError, shown, suggestion
from ..tables.gridded import Gridded
from . import _overview
from ._maps import MapReport as MapReport
from ._maps import check_map
from ._verdict import Findings
from ._verdict import Law as Law
from ._verdict import Report as Report

MODULES = dict(sorted(discover.by_name(__name__).items(), key=lambda named: named[1].ORDER))
"""Every law's module by the law's name, in the order of reports."""

LAWS: dict[str, Callable[[Reflectance], Findings]] = {name: m.law for name, m in MODULES.items()}
"""Every law by name, in the order of reports."""

FOLLOWS: dict[str, tuple[str, ...]] = {name: m.FOLLOWS for name, m in MODULES.items() if hasattr(m, "FOLLOWS")}
"""Laws that may break because another does: declared with it."""


def summaries() -> dict[str, str]:
    """The statement of each law in one sentence, by name."""
    heads = {name: discover.docstring(module).split("\n\n")[0] for name, module in MODULES.items()}
    return {name: " ".join(head.partition(": ")[2].split()).split(". ")[0].rstrip(".") for name, head in heads.items()}


@checked
def check(
    m: Reflectance,
    progress: Callable[[int, int], None] | None = None,
    laws: Annotated[Sequence[str], Declared("only these; all without it")] | None = None,
) -> Any:
    """Hold a reflectance to the laws.

    `LAWS` names them, `summaries()` states each in a sentence, docs/check.md gives measurements and tolerances.

    The same for models and measurements, on 131072 pairs of directions and 65536 samples, without random numbers: two
    runs give the same report. Of more than 64 channels f is taken at fewer pairs, in half a GB. A law that does not
    apply is left out; a note may say why. `progress(done, total)` is called after each law. A law
    that the model's class declares not to obey is marked with the class's reason. Of a measured table it is one of all
    its values together: a breach that their uncertainties, or interpolation, may explain is "not significant", and does
    not fail (docs/uncertainty.md).

    Of a material whose parameters are maps, positivity, reciprocity and energy are measured at each place, and the
    result is a `MapReport`; of arrays of Dask it is computed when it is asked for.

    Example
    >>> report = gn.check(gn.OriginalPhong(0.2), laws=["positivity", "reciprocity"])
    >>> print(report.verdicts)
    {'positivity': 'pass', 'reciprocity': 'breaks'}
    """
    names = list(LAWS) if laws is None else list(laws)
    for name in names:
        if name not in LAWS:
            close = suggestion(name, LAWS)
            asked = f"check(laws={shown(laws)}): expected some of {', '.join(LAWS)}"
            raise NotFoundError(f"{asked}: no law {name!r}{close}")
    if map_shape(m):
        return check_map(m, None if laws is None else names, progress)
    judge = _judge(m)
    verdicts, notes = [], []
    for done, name in enumerate(names, 1):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", MissingDataWarning)  # verdicts say themselves what had no data
            for outcome in LAWS[name](m):
                if isinstance(outcome, str):
                    notes.append(outcome)
                    continue
                reason = declared(m, name)
                if reason and outcome.passed and m.parameters and name not in FOLLOWS:
                    notes.append(f"{name} holds at these parameters, but not at all parameters: {reason}")
                outcome = outcome if outcome.passed else replace(outcome, declared=reason)
                verdicts.append(judge(outcome))
        if progress is not None:
            progress(done, len(names))
    return Report(repr(m), tuple(verdicts), tuple(notes))


def _judge(m: Reflectance) -> Callable[[Law], Law]:
    """The function that adds its uncertainty and significance to a verdict, for a measured table."""
    if isinstance(m, Gridded):
        from ._significance import judged

        return partial(judged, m)
    return lambda law: law


def check_all(progress: Callable[[int, int], None] | None = None) -> dict[str, Report]:
    """Name -> report of every model of gonio, with its default parameters; `table` makes rows of them."""
    kinds = _overview.models()
    reports = {}
    for name, kind in kinds.items():
        reports[name] = check(kind())
        if progress is not None:
            progress(len(reports), len(kinds))
    return reports


def table(reports: dict[str, Report]) -> list[tuple[str, ...]]:
    """Rows of words: a header, then per model its name and its verdicts; "–" where a law does not apply."""
    names = list(LAWS)
    rows = [tuple(report.verdicts.get(law, "–") for law in names) for report in reports.values()]
    return [("model", *names), *((model, *row) for model, row in zip(reports, rows, strict=True))]


def declared(m: Reflectance, name: str) -> str:
    """The reason that a material's classes give for not obeying a law, or one it follows from; "" if there is none."""
    reasons = breaches(m)
    return next((reasons[law] for law in (name, *FOLLOWS.get(name, ())) if law in reasons), "")
