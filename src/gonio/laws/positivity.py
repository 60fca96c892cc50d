"""Positivity: f is a number and not negative. No surface sends back a negative amount of light.

Measured   lowest f at 131072 pairs of directions (fewer beside more than 64 channels), and where formulas break:
           wi = wo, mirror pairs, along the normal, nearly opposite towards grazing; these in single precision too
Holds if   >= 0, finite
Tolerance  exact
"""

from __future__ import annotations

import numpy as np

from ..base.reflectance import Reflectance
from ._probes import (
    OPPOSITE,
    PAIRS,
    degrees,
    everywhere,
    exact_pairs,
    is_measured,
    opposite_pairs,
    pairs,
    precisions,
    some,
    values,
)
from ._verdict import Findings, Law

ORDER = 11


def law(m: Reflectance) -> Findings:
    """The lowest value at all pairs; not below 0, exactly. NaN is for missing data only."""
    usual = [np.concatenate(w) for w in zip(pairs(some(m, PAIRS)), exact_pairs(), strict=True)]
    hard = [np.concatenate(w) for w in zip(exact_pairs(), opposite_pairs(some(m, OPPOSITE, 4)), strict=True)]
    usual, hard = (list(everywhere(m, *of)) for of in (usual, hard))
    batches = [usual, *([w.astype(dtype) for w in hard] for dtype in precisions(m))]
    parts = [values(m, *w) for w in batches]
    missing = float(np.isnan(parts[0]).mean())
    (wi, wo), f = (np.concatenate(w) for w in zip(*batches, strict=True)), np.concatenate(parts)
    single = len(usual[0]) + len(hard[0])  # from here on
    bad = np.isinf(f) if is_measured(m) else ~np.isfinite(f)
    if bad.any():
        n, c = np.unravel_index(int(bad.argmax()), bad.shape)
        value, why = float(f[n, c]), f"{bad.mean():.2g} of the values are no finite numbers"
        why += ", here in single precision" if n >= single else ""
        yield Law("positivity", False, value, 0.0, "f = {value}", degrees(wi[n], wo[n]), why)
        return
    if missing > 0.0:
        yield f"{missing:.2%} of the pairs of directions hold no data; they are left out, and count as 0 in integrals"
    worst = np.where(np.isnan(f), np.inf, f).min(axis=-1)
    at = int(worst.argmin())
    value = float(worst[at])
    why = f"{(f < 0.0).mean():.2%} of the values are negative, the lowest is {value:.4g} sr-1" if value < 0.0 else ""
    why += ", in single precision" if why and at >= single else ""
    place = degrees(wi[at], wo[at]) if why else {}
    yield Law("positivity", value >= 0.0, value, 0.0, "min f = {value}", place, why)
