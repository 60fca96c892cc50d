"""Furnace: in a uniform surround of radiance 1 nothing is brighter than 1, rendered through `sample`.

In a medium of index n the surround has radiance n^2, and L/n_o^2 is at most 1.

Measured   radiance in a surround of radiance 1, 65536 samples at 11 views
Holds if   <= 1.005
Tolerance  the means are good to 3e-3
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..base.reflectance import Reflectance
from ._probes import SAMPLES, degrees, in_channel, incidence, index, largest, samples, weights
from ._verdict import Findings, at_most

ORDER = 22
FOLLOWS = ("energy", "reciprocity")
TOLERANCE = 1.0 + 5e-3  # means of 65536 weights, which lie within 3e-3 of the integral


def radiance(m: Reflectance) -> tuple[np.ndarray, np.ndarray]:
    """Views (K, 3) and the radiance seen there (K, C)."""
    views, n = incidence(m), index(m)
    return views, np.stack([_seen(m, view, n) for view in views])


def _seen(m: Reflectance, view: np.ndarray, n: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The radiance (C,) in one view, over the square of its index n."""
    total = 0.0
    for s in samples(m, view):
        weight = weights(s) * (n(s.wi) / n(view)) ** 2
        total = total + weight.sum(axis=0)
    return np.asarray(total / SAMPLES)


def law(m: Reflectance) -> Findings:
    """The largest radiance."""
    views, L = radiance(m)
    value, (at, c) = largest(L)
    place, channel = degrees(wo=views[at]), in_channel(m, c, L.shape[-1])
    why = f"a body of this material would outshine a surround of radiance 1: L = {value:.4g}{channel}"
    yield at_most("furnace", value, TOLERANCE, "max L = {value} <= {tolerance}", place, why, placed=True)
