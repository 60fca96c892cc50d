"""Where a fitted model agrees with its data, and where it does not: by angle of incidence, and row by row."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..base.angles import angles
from .samples import Samples, names_of

EDGES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
"""Edges of the classes of angles of incidence [degrees]."""


class Incidence(NamedTuple):
    """Agreement in a class of angles of incidence [degrees]: values, the root mean square and the mean of the relative
    difference of model and data, relative to the root mean square of the data there."""

    low: float
    high: float
    values: int
    rms: float
    mean: float

    def __str__(self) -> str:
        return f"{self.low:3.0f} to {self.high:3.0f} degrees {self.values:10d}   {self.rms:6.1%}  {self.mean:+6.1%}"


class Row(NamedTuple):
    """A row of data where the model is wrong: directions, channel, f of data and model [1/sr], and the residual."""

    wi: np.ndarray
    wo: np.ndarray
    channel: str
    data: float
    model: float
    residual: float

    def __str__(self) -> str:
        (theta_i, phi_i), (theta_o, phi_o) = (map(float, np.degrees(angles(w))) for w in (self.wi, self.wo))
        channel = f" [{self.channel}]" if self.channel else ""
        return (
            f"theta_i {theta_i:5.1f}, theta_o {theta_o:5.1f}, phi {round(phi_o - phi_i, 1) % 360.0:5.1f} degrees"
            f"{channel}: data {self.data:.4g}, model {self.model:.4g} /sr"
        )


def by_incidence(samples: Samples, f: np.ndarray) -> list[Incidence]:
    """Of f (N, C) of a model, in classes of 15 degrees that hold data."""
    theta = np.degrees(angles(samples.wi)[0])
    classes = []
    for low, high in pairwise(EDGES):
        rows = (theta >= low) & (theta < high)
        valid = samples.valid[rows]
        if not valid.any():
            continue
        off, size = (f[rows] - samples.f[rows])[valid], samples.f[rows][valid]
        scale = math.sqrt(float(np.mean(size**2))) or 1.0
        rms, mean = math.sqrt(float(np.mean(off**2))) / scale, float(off.mean()) / scale
        classes.append(Incidence(low, high, int(valid.sum()), rms, mean))
    return classes


def worst(samples: Samples, f: np.ndarray, residuals: np.ndarray, count: int) -> list[Row]:
    """The rows with the largest residuals (N, C), NaN where there is no number, of f (N, C) of a model."""
    size = np.where(np.isfinite(residuals), np.abs(residuals), -1.0).reshape(-1)
    top = np.argsort(-size, kind="stable")[: min(count, samples.count)]
    names = names_of(samples.channels)
    return [
        Row(samples.wi[row], samples.wo[row], names[c], *(float(x[row, c]) for x in (samples.f, f, residuals)))
        for row, c in zip(*np.unravel_index(top, residuals.shape), strict=True)
    ]
