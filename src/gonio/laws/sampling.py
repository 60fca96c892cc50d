"""Sampling: `sample` draws directions as `pdf` says, with weight = f cos(theta_i)/pdf; at the ends of u too.

Measured   total variation between samples and density; error of weight = f cos(theta_i)/pdf; the ends of u
Holds if   <= 0.02
Tolerance  65536 points leave 2e-3
"""

from __future__ import annotations

import numpy as np

from ..arrays.kinds import with_channels
from ..base.reflectance import Reflectance
from ..base.results import Sample
from ._probes import SAMPLES, degrees, samples, some, values
from ._rings import places
from ._verdict import Findings, Law, at_most

ORDER = 32
TOLERANCE = 2e-2  # of 200 bins, 65536 evenly spread points fill most to a few in a thousand; an error of 2 % shows

ENDS = np.array([[u, v] for u in (0.0, 0.5, 1.0) for v in (0.0, 0.5, 1.0)])
"""Corners, sides and middle of the unit square: uniform numbers that are rounded to float32 may be 1."""


def _off(m: Reflectance, view: np.ndarray, s: Sample, used: np.ndarray) -> float:
    """The largest relative error of a weight, of the samples that are used."""
    f, weight = values(m, s.wi, np.broadcast_to(view, s.wi.shape)), with_channels(s.weight, 1)
    with np.errstate(all="ignore"):
        ideal = f * np.abs(s.wi[:, 2:]) / s.pdf[:, None]
        off = np.abs(weight - ideal) / (np.abs(ideal) + 1e-6)
    return float(np.nanmax(np.where(used[:, None], off, 0.0), initial=0.0))


def law(m: Reflectance) -> Findings:
    """Total variation between histogram and density, or the largest error of a weight, at the worst of VIEWS."""
    every_view = [*places(m)]
    for view, _, _ in every_view:
        s = m.sample(view, ENDS)
        lost = ~np.isfinite(np.column_stack([s.wi, s.pdf])).all(axis=-1)
        if lost.any():
            why = f"wi or pdf is no finite number for u = {ENDS[lost][0].tolist()}"
            yield Law("sampling", False, float("inf"), TOLERANCE, "distance = {value}", degrees(wo=view), why)
            return
    distances, every = [], SAMPLES // some(m, SAMPLES)
    for view, grid, bins_of in every_view:
        expected = np.bincount(grid.bins, m.pdf(grid.w, view) * grid.solid)
        observed, off = np.zeros(len(expected)), 0.0
        for k, s in enumerate(samples(m, view)):
            used = (s.pdf > 0.0) & ~s.delta
            observed += np.bincount(bins_of(s.wi[used]), minlength=len(expected)) / SAMPLES
            if k % every == 0:
                off = max(off, _off(m, view, s, used))
        distance = 0.5 * float(np.abs(observed - expected).sum())
        why = f"the distributions of `sample` and `pdf` differ by {distance:.3g} in total variation"
        if off > max(distance, 1e-3):
            distance, why = off, f"weight differs from f cos(theta_i)/pdf by {off:.3g}, relative"
        distances.append((float(np.nan_to_num(distance, nan=np.inf)), degrees(wo=view), why))
    worst, place, why = max(distances, key=lambda distance: distance[0])
    yield at_most("sampling", worst, TOLERANCE, "distance = {value} <= {tolerance}", place, why)
