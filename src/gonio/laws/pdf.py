"""pdf: the density of `sample` integrates to 1, with delta lobes and samples below the horizon.

Measured   integral of the density + delta lobes + samples below the horizon
Holds if   1 ± 5e-3; >= 0, finite, in single precision too
Tolerance  the grid leaves 3e-4 about the mirror direction, and is coarser elsewhere
"""

from __future__ import annotations

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sides import hemispheres
from ._probes import SAMPLES, degrees, everywhere, opposite_pairs, precisions, samples
from ._rings import places
from ._verdict import Findings, Law, at_most

ORDER = 31
WHOLE = {1: "hemisphere", 2: "sphere"}
"""What so many hemispheres are together."""

TOLERANCE = 5e-3  # grid and samples leave 3e-4 about the mirror direction; lobes elsewhere meet coarser rings


def law(m: Reflectance) -> Findings:
    """The distance of the total from 1, at the worst of VIEWS; or the lowest density, if that is no density."""
    for dtype in precisions(m):
        wi, wo = everywhere(m, *(w.astype(dtype) for w in opposite_pairs()))
        pdf = m.pdf(wi, wo)
        bad = ~((pdf >= 0.0) & (pdf < np.inf))
        if bad.any():
            at = int(np.where(bad, pdf, np.inf).argmin())
            why = f"{bad.mean():.2g} of the densities near grazing are no finite numbers from 0 up, in {pdf.dtype}"
            yield Law("pdf", False, float(pdf[at]), 0.0, "min pdf = {value}", degrees(wi[at], wo[at]), why)
            return
    totals, where = [], WHOLE[len(hemispheres(m))]
    for view, grid, _ in places(m):
        inside = float((m.pdf(grid.w, view) * grid.solid).sum())
        counts = [(s.delta.sum(), (s.pdf == 0.0).sum()) for s in samples(m, view)]
        delta, lost = (float(sum(x)) / SAMPLES for x in zip(*counts, strict=True))
        error = np.nan_to_num(abs(inside + delta + lost - 1.0), nan=np.inf)
        parts = f"{where} {inside:.4f} + delta lobes {delta:.4f} + below the horizon {lost:.4f}, expected 1"
        totals.append((float(error), degrees(wo=view), parts))
    worst, place, why = max(totals, key=lambda total: total[0])
    yield at_most("pdf", worst, TOLERANCE, "|total - 1| = {value} <= {tolerance}", place, why)
