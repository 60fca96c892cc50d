"""Whether a reflectance obeys the laws: a verdict per law, with the number, the tolerance, the place and the reason.

One law is one file, with a function `law(m)` that yields verdicts and notes, and its tolerance with the reason for it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from ..base.reflectance import Reflectance
from ..errors import MissingDataWarning, NotFoundError, ShapeError
from ..evaluate import batch
from ..tables.gridded import Gridded
from . import (
    cavity,
    density,
    derivatives,
    energy,
    furnace,
    grazing,
    isotropy,
    limit,
    overview,
    positivity,
    reciprocity,
    sampling,
)
from .verdict import Law as Law
from .verdict import Report as Report

LAWS: dict[str, Callable[[Reflectance], Iterator[Law | str]]] = {
    "positivity": positivity.law,
    "reciprocity": reciprocity.law,
    "isotropy": isotropy.law,
    "energy": energy.law,
    "furnace": furnace.law,
    "cavity": cavity.law,
    "pdf": density.law,
    "sampling": sampling.law,
    "grazing": grazing.law,
    "derivatives": derivatives.law,
    "limit": limit.law,
}
"""Every law by name, in the order of reports."""

FOLLOWS = {"furnace": ("energy", "reciprocity"), "cavity": ("energy", "reciprocity"), "grazing": ("energy",)}
"""Laws that may break because another does: declared with it."""


def check(
    m: Reflectance, progress: Callable[[int, int], None] | None = None, laws: Iterable[str] | None = None
) -> Report:
    """Hold a reflectance to the laws.

    positivity   f >= 0, and finite
    reciprocity  f(wi, wo) = f(wo, wi)
    isotropy     turning both directions about the normal changes nothing, unless the class is `oriented`
    energy       albedo <= 1 at every incidence, by quadrature
    furnace      in a uniform surround of radiance 1 nothing is brighter than 1, rendered through `sample`
    cavity       between two plates of the material light bounces on and on, and never gets brighter than 1
    pdf          the density of `sample` integrates to 1 over the hemisphere, with what falls below the horizon
    sampling     samples are distributed as `pdf` says, and weight = f cos(theta_i)/pdf
    grazing      towards the horizon f is finite, has no jump, and f cos(theta) stops growing
    derivatives  `jacobian` is finite, and what differences say, by every parameter and by directions
    limit        with its widths at their narrow bounds the lobe is the mirror that the class says

    The same for models and measurements, on 131072 pairs of directions and 65536 samples, without random numbers:
    two runs give the same report. A law that does not apply is left out; a note may say why. `laws`: only these.
    `progress(done, total)` is called after each law. A law that the model's class declares not to obey is marked with
    the class's reason. Of a table that holds the uncertainty of its values, verdicts say whether a failure is more than
    that explains; they stay what the numbers say.
    """
    wanted = list(LAWS) if laws is None else list(laws)
    for name in wanted:
        if name not in LAWS:
            raise NotFoundError(f"check: no law {name!r}; expected some of {', '.join(LAWS)}")
    maps = batch.full_shape(m, ())
    if maps:
        raise ShapeError(f"check: parameters are maps of shape {maps}; expected one value, or one per channel")
    judge = _judge(m)
    verdicts, notes = [], []
    for i, name in enumerate(wanted):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", MissingDataWarning)
            for found in LAWS[name](m):
                if isinstance(found, str):
                    notes.append(found)
                    continue
                reason = declared(m, name)
                if reason and found.passed and m.parameters and name not in FOLLOWS:
                    notes.append(f"{name} holds at these parameters, but not at all parameters: {reason}")
                found = found if found.passed else replace(found, declared=reason)
                verdicts.append(judge(found))
        if progress is not None:
            progress(i + 1, len(wanted))
    return Report(repr(m), tuple(verdicts), tuple(notes))


def _judge(m: Reflectance) -> Callable[[Law], Law]:
    """What adds to a verdict how significant it is: of a measurement with uncertainties."""
    if not isinstance(m, Gridded):
        return lambda law: law
    from ..uncertainty.table import has_uncertainty
    from .significance import judged

    return (lambda law: judged(m, law)) if has_uncertainty(m) else (lambda law: law)


def check_all(progress: Callable[[int, int], None] | None = None) -> dict[str, Report]:
    """Name -> report of every model of gonio, with its default parameters; `table` makes rows of them."""
    kinds = overview.models()
    reports = {}
    for i, (name, kind) in enumerate(kinds.items()):
        reports[name] = check(kind())
        if progress is not None:
            progress(i + 1, len(kinds))
    return reports


def table(reports: dict[str, Report]) -> list[tuple[str, ...]]:
    """Rows of words: a header, then per model its name and its verdicts; "–" where a law does not apply."""
    names = list(LAWS)
    rows = [tuple(report.verdicts.get(law, "–") for law in names) for report in reports.values()]
    return [("model", *names), *((model, *row) for model, row in zip(reports, rows, strict=True))]


def declared(m: Reflectance, name: str) -> str:
    """The reason that a material's classes give for not obeying a law, or one it follows from; "" if there is none."""
    reasons = m.breaches()
    return next((reasons[law] for law in (name, *FOLLOWS.get(name, ())) if law in reasons), "")
