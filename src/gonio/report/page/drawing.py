"""What plots of slices share: a slice as arrays, the axes, the classes of curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .chart import ChartAxis, legend
from .told import angle

VIEW = ChartAxis(-90.0, 90.0, "viewing angle θₒ [°]", angle=True, ticks=range(-90, 91, 30))
INCIDENT = ChartAxis(0.0, 90.0, "angle of incidence θᵢ [°]", angle=True, ticks=range(0, 91, 15))

DENSE = 45
"""Measured values of a slice from which on their points are small."""


class SliceArrays:
    """A slice as arrays."""

    def __init__(self, row: dict[str, Any]):
        self.theta = float(row["theta_i"])
        self.views, self.f = np.array(row["views"], float), np.array(row["f"], float)
        measured = row.get("measured")
        self.measured = None
        if measured is not None:
            u = None if measured["u"] is None else np.array(measured["u"], float)
            self.measured = np.array(measured["views"], float), np.array(measured["f"], float), u
        self.all = self.f if self.measured is None else np.concatenate([self.f, self.measured[1]])


def step(k: int, count: int) -> str:
    """The class of the k-th of several curves in an order."""
    return f"s{round(k * 5 / max(count - 1, 1)) if count > 1 else 2}"


def f_label(unit: str) -> str:
    """The label of f, with the name of the one number that it is."""
    return f"f [sr⁻¹]{', ' + unit.partition(',')[0] if unit else ''}"


def of_incidence(thetas: Sequence[float], more: Sequence[tuple[str, str]] = ()) -> str:
    """The legend of curves for angles of incidence [degrees], and of more: (class, HTML)."""
    return legend([*((step(k, len(thetas)), angle(theta)) for k, theta in enumerate(thetas)), *more], "incidence θᵢ")
