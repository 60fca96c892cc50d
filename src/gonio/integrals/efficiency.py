"""The efficiency of a material's own sampling: the scatter of its weights, and the samples lost."""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np

from ..arrays import LIBRARIES
from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.kernels import shares_of, together
from ..base.reflectance import Reflectance
from ..base.sums import weighed
from ..errors import MissingDataWarning
from ..formula import tree
from ..formula.direction import Direction
from ..numerics.lattice import lattice

VIEWS = (0.0, 30.0, 60.0, 75.0, 85.0, 89.0)
"""Angles of view [degrees]."""

SAMPLES = 1 << 16


class Efficiency(NamedTuple):
    """Sampling seen from one angle: of the whole material, or of one of its lobes by itself."""

    theta_o: float
    """Angle of view [degrees]."""
    lobe: str
    """Class of the lobe with its number in the sum, or "all"."""
    chosen: float
    """How often a sum samples this lobe."""
    mean: float
    """Mean weight, over channels too: the reflectance of the hemisphere to this view."""
    scatter: float
    """Standard deviation of the weight over its mean; its square is the variance of one sample, relative."""
    effective: float
    """Effective share of the samples, (sum w)^2 / (N sum w^2): as many of equal weight would say as much."""
    lost: float
    """Share of the samples that fall below the horizon."""


def sampling_efficiency(m: Reflectance) -> list[Efficiency]:
    """The efficiency of `m.sample` at VIEWS: one row for the whole, and in a sum one per lobe.

    Weights are those for light from everywhere: a lobe with equal weights has scatter 0 and effective 1.
    Not random: 65536 evenly spread numbers.
    """
    groups = together(m)
    merged = tree.merged(m, LIBRARIES["numpy"].merge_channels)
    rows = []
    for theta in VIEWS:
        view = direction(math.radians(theta), 0.3)
        rows.append(_row(theta, "all", 1.0, m, view))
        if len(groups) > 1:
            shares = [float(np.ravel(share)[0]) for share, _ in shares_of(merged, Direction(*view))]
            for i, (share, group) in enumerate(zip(shares, groups, strict=True)):
                (weight, lobe), *others = group
                part = weighed(group) if others else weight * lobe
                rows.append(_row(theta, f"{i} {type(lobe).__name__}", share, part, view))
    return rows


def _row(theta: float, lobe: str, chosen: float, m: Reflectance, view: np.ndarray) -> Efficiency:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)  # weights without data count 0 here
        s = m.sample(np.broadcast_to(view, (SAMPLES, 3)), lattice(SAMPLES))
    w = with_channels(np.nan_to_num(s.weight), 1).mean(axis=-1)
    mean, square = float(w.mean()), float((w * w).mean())
    lit = square > 0.0
    effective = mean * mean / square if lit else 0.0
    scatter = math.sqrt(max(square / (mean * mean) - 1.0, 0.0)) if lit and mean != 0.0 else 0.0
    return Efficiency(theta, lobe, chosen, mean, scatter, effective, float((s.pdf == 0.0).mean()))
