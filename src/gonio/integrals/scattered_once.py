"""What facets lose that scatter light once: it counts as absorbed, and is not."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..errors import LeftOutWarning, warn
from .albedo import albedo
from .transmittance import transmittance

LOST = 1e-3
"""Share of the light, by facets that absorb nothing, up to which nothing is said."""

DIRECTIONS = 16
"""The most directions at which that is looked for."""


def tell_of_lost_light(who: str, m: Reflectance, wi: Any) -> None:
    """Say how much light the facets of a material lose that scatter it twice, and of which part."""
    known = ops.library(wi).known(wi) if ops.dtype_of(wi) else np.asarray(wi, float)
    if known is None:  # while a function of JAX is traced
        return
    every = np.asarray(known, float).reshape(-1, 3)
    every = every[np.argsort(np.abs(every[:, 2]))]
    some = every[np.unique(np.linspace(0, len(every) - 1, DIRECTIONS).astype(int))]
    parts = [m, *(value for _, _, value, _ in m.walk() if isinstance(value, Reflectance))]
    for part in parts:
        white = part.single_scatter
        if white is None:
            continue
        seen = some[some[:, 2] > 0.0] if white.sides == "front" else some
        if not len(seen):
            continue
        lost = np.nanmax(1.0 - albedo(white, seen, 0.1 * LOST) - transmittance(white, seen, 0.1 * LOST))
        if lost > LOST:
            rule = f"of facets that absorb nothing up to {lost:.2g} of the light, which counts as absorbed"
            cure = "expected a model whose facets pass it on: KullaConty, KullaContyDielectric"
            warn(f"{who}: light that meets facets twice is lost by {part!r:.80}: {rule}; {cure}", LeftOutWarning)
