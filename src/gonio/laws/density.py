"""pdf: the density of `sample` integrates to 1, together with its delta lobes and with what falls below the horizon."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..interface import Reflectance, direction
from ..quadrature import lattice
from .probes import SAMPLES, VIEWS, degrees
from .rings import rings
from .verdict import Law

TOLERANCE = 5e-3  # grid and samples leave 3e-4 about the mirror direction; lobes elsewhere meet coarser rings


def law(m: Reflectance) -> Iterator[Law | str]:
    """The distance of the total from 1, at the worst of VIEWS."""
    worst, at, parts = -1.0, direction(0.0, 0.0), ""
    for view in direction(VIEWS, 0.3):
        grid = rings(view)
        inside = float((m.pdf(grid.w, view) * grid.solid).sum())
        s = m.sample(np.broadcast_to(view, (SAMPLES, 3)), lattice(SAMPLES))
        delta, lost = float(s.delta.mean()), float((s.pdf == 0.0).mean())
        error = abs(inside + delta + lost - 1.0)
        error = error if error == error else float("inf")
        if error > worst:
            worst, at = error, view
            parts = f"hemisphere {inside:.4f} + delta lobes {delta:.4f} + below the horizon {lost:.4f}, expected 1"
    passed = worst <= TOLERANCE
    rule = "|total - 1| = {value} <= {tolerance}"
    yield Law("pdf", passed, worst, TOLERANCE, rule, {} if passed else degrees(wo=at), "" if passed else parts)
