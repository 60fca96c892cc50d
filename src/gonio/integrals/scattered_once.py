"""What facets lose that scatter light once: it counts as absorbed, and is not."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sides import is_lit
from ..errors import LeftOutWarning, warn
from ..formula import tree
from .albedo import albedo
from .transmittance import transmittance

LOST = 1e-3
"""Share of the light, by facets that absorb nothing, up to which nothing is said."""

DIRECTIONS = 16
"""The most directions at which that is looked for."""


def tell_of_lost_light(who: str, m: Reflectance, wi: Any) -> None:
    """Say how much light the facets of a material lose that scatter it twice, and of which part: for directions that
    an albedo has been found at."""
    parts = [m, *(value for _, _, value, _ in tree.walk(m) if isinstance(value, Reflectance))]
    several = [(part, white) for part in parts if (white := part._single_scatter) is not None]
    every = np.asarray(wi, float).reshape(-1, 3)
    if not several or not len(every):
        return
    every = every[np.argsort(np.abs(every[:, 2]))]
    some = every[np.unique(np.linspace(0, len(every) - 1, DIRECTIONS).astype(int))]
    for part, white in several:
        seen = some[is_lit(white, some[:, 2])]
        if not len(seen):
            continue
        lost = np.nanmax(1.0 - albedo(white, seen, 0.1 * LOST) - transmittance(white, seen, 0.1 * LOST))
        if lost > LOST:
            rule = f"of facets that absorb nothing up to {lost:.2g} of the light, which counts as absorbed"
            cure = "expected a model whose facets pass it on: KullaConty, KullaContyDielectric"
            warn(f"{who}: light that meets facets twice is lost by {part!r:.80}: {rule}; {cure}", LeftOutWarning)
