"""Furnace: in a uniform surround of radiance 1 nothing is brighter than 1, rendered through `sample`.

Measured   radiance in a surround of radiance 1, 65536 samples at 11 views
Holds if   <= 1.005
Tolerance  the means are good to 3e-3
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..numerics.lattice import lattice
from ._probes import INCIDENCE, SAMPLES, azimuths, degrees, in_channel, with_channels
from ._verdict import Law

ORDER = 22
FOLLOWS = ("energy", "reciprocity")
TOLERANCE = 1.0 + 5e-3  # means of 65536 weights, which lie within 3e-3 of the integral


def radiance(m: Reflectance) -> tuple[np.ndarray, np.ndarray]:
    """Views (K, 3) at INCIDENCE and the radiance seen there (K, C)."""
    views = direction(INCIDENCE[:, None], azimuths(m)[None, :]).reshape(-1, 3)
    u = lattice(SAMPLES)
    weights = [m.sample(np.broadcast_to(view, (SAMPLES, 3)), u).weight for view in views]
    return views, np.stack([np.nan_to_num(with_channels(w, u)).mean(axis=0) for w in weights])


def law(m: Reflectance) -> Iterator[Law | str]:
    """The largest radiance."""
    views, L = radiance(m)
    at, c = np.unravel_index(int(L.argmax()), L.shape)
    value = float(L[at, c])
    passed = value <= TOLERANCE
    where = in_channel(m, int(c), L.shape[-1])
    why = "" if passed else f"a body of this material would outshine a surround of radiance 1: L = {value:.4g}{where}"
    yield Law("furnace", passed, value, TOLERANCE, "max L = {value} <= {tolerance}", degrees(wo=views[at]), why)
