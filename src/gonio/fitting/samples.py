"""Data to be fitted as rows: pairs of directions, f, and standard uncertainties where they are known."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.frames import from_half_difference
from ..base.reflectance import Reflectance
from ..base.sides import refuse_transmission
from ..declared.numbers import numbers
from ..errors import MissingDataWarning, ParameterError, ShapeError, shown, warn
from ..formats import load
from ..formula import tree
from ..formula.direction import HORIZON
from ..numerics.lattice import lattice
from ..tables.dataset import from_dataset
from ..tables.gridded import Gridded
from ..tables.scattered import Scattered

PAIRS = 30_000
"""Pairs of directions at which a reflectance without nodes is sampled."""

UNIT = 1e-3
"""Largest deviation of the length of a direction from 1."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Rows of data: f (N, C) [1/sr] at pairs of directions wi, wo (N, 3).

    u          (N, C) standard uncertainty, or None
    valid      (N, C) where there is a number
    channels   the names of the channels, or None for data without a channel axis, of which C is 1
    left_out   how many rows were left out, by the reason
    source     what the data are, in words
    weights    (N, 1) or (N, C) of the squares of residuals, or None for 1
    """

    wi: np.ndarray
    wo: np.ndarray
    f: np.ndarray
    u: np.ndarray | None
    valid: np.ndarray
    channels: tuple[Any, ...] | None
    left_out: dict[str, int]
    source: str
    weights: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.wi)

    @property
    def count(self) -> int:
        """The number of values."""
        return int(self.valid.sum())

    def of_channel(self, c: int) -> Samples:
        """One of the channels."""
        keep = slice(c, c + 1)
        weights = self.weights
        if weights is not None and weights.shape[1] > 1:
            weights = weights[:, keep]
        u = None if self.u is None else self.u[:, keep]
        return replace(self, f=self.f[:, keep], u=u, valid=self.valid[:, keep], channels=None, weights=weights)

    def at(self, rows: Any) -> Samples:
        """Some of the rows."""
        u, weights = (None if x is None else x[rows] for x in (self.u, self.weights))
        part = {name: getattr(self, name)[rows] for name in ("wi", "wo", "f", "valid")}
        return replace(self, **part, u=u, weights=weights)


def _within(theta_max: float) -> float:
    """The largest polar angle of rows. Raises ParameterError where it is none."""
    if not 0.0 < theta_max <= 0.5 * math.pi + 1e-9:
        degrees = f"; in degrees? numpy.radians({theta_max:g})" if theta_max > 2.0 else ""
        raise ParameterError(f"theta_max={theta_max:g}: expected an angle [rad] in (0, pi/2]{degrees}")
    return theta_max


def samples(data: Any, theta_max: float = math.pi / 2.0, weights: Any = None, called: str = "data") -> Samples:
    """The rows of a reflectance, a path, arrays (wi, wo, f) or (wi, wo, f, u), a dataset of xarray, a frame of pandas.

    Of a measurement on a grid or in rows they are its nodes or its rows; of another reflectance f at 30 000 pairs,
    dense about the mirror direction. Rows with a direction below the horizon, or farther than `theta_max` from the
    normal, and rows without any number are left out and counted.

    Raises ParameterError and ShapeError for data that are none of these, and where nothing is left.
    """
    least = max(math.cos(_within(theta_max)), HORIZON)
    if isinstance(data, Samples):
        return data
    wi, wo, f, u, channels, source = _rows(data, called)
    finite = np.isfinite(f)
    left_out: dict[str, int] = {}
    keep = np.ones(len(f), bool)
    lowest = np.minimum(wi[:, 2], wo[:, 2])
    reasons = {
        "a direction that is no number": ~np.isfinite(sum(w[:, k] for w in (wi, wo) for k in range(3))),
        "no number": ~finite.any(axis=1),
        "below the horizon": ~(lowest > HORIZON),
        f"beyond {math.degrees(theta_max):g} degrees": ~(lowest >= least),
    }
    for reason, out in reasons.items():
        if count := int((keep & out).sum()):
            left_out[reason] = count
        keep &= ~out
    if u is not None:
        unknown = finite & ~((u > 0.0) & np.isfinite(u))
        if unknown[keep].all():
            raise ParameterError(f"{source}: none of the uncertainties is a number above 0; expected (wi, wo, f) alone")
        finite &= ~unknown
        if count := int((unknown & keep[:, None]).sum()):
            left_out["values without an uncertainty"] = count
            keep &= finite.any(axis=1)
    if not keep.any():
        told = "; ".join(f"{n} rows: {reason}" for reason, n in left_out.items()) or "no rows"
        raise ParameterError(
            f"{source}: nothing to fit: {told}; expected rows of two directions above the surface and f"
        )
    weights = None if weights is None else _weights(weights, f)
    every = Samples(wi, wo, np.where(finite, f, 0.0), u, finite, channels, left_out, source, weights)
    return every if keep.all() else every.at(keep)


Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, tuple[Any, ...] | None, str]


def _rows(data: Any, called: str) -> Rows:
    if isinstance(data, (str, os.PathLike)):
        data = load(data)
    if hasattr(type(data), "data_vars"):
        data = from_dataset(data)
    elif hasattr(data, "to_csv") and hasattr(data, "columns"):
        data = _of_frame(data)
    if isinstance(data, Reflectance):
        return _of_reflectance(data)
    if isinstance(data, (tuple, list)) and len(data) in (3, 4):
        return _of_arrays(*data)
    raise ParameterError(
        f"{called}={shown(data)}: expected a measurement, a path, (wi, wo, f) or (wi, wo, f, u) with directions (N, 3) "
        f"and values (N,) or (N, C), an xarray.Dataset in gonio's layout, or a pandas.DataFrame with columns of angles"
    )


def _of_frame(frame: Any) -> Reflectance:
    """A frame of pandas, whose columns are named as those of a CSV table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.csv"
        frame.to_csv(path, index=False)
        return tree.with_notes(load(path), path="")


def _of_reflectance(m: Reflectance) -> Rows:
    refuse_transmission(
        m, f"{m!r:.80}: it transmits light; a fit is of one side: gn.Across and gn.Sheet hold the parts"
    )
    names, source = m.channel_names, f"{m!r:.80}"
    if isinstance(m, Scattered):
        rows = m.rows
        wi, wo = (_direction(rows[:, k], rows[:, k + 1]) for k in (0, 2))
        f, u = m.row_brdf()
    elif isinstance(m, Gridded):
        wi, wo = (w.reshape(-1, 3) for w in m.directions())
        f, u = m.brdf(), m.brdf_uncertainty()
    else:
        if m.has_delta:
            raise ParameterError(f"{m!r:.80}: a perfect mirror has no f to be fitted; take the material without it")
        wi, wo = spread_pairs(PAIRS)
        f, u = m.f(wi, wo), None
        source += f" at {len(wi)} pairs of directions"
    channels = None if m.channels is None else m.channels
    width = 1 if channels is None else channels
    f = np.reshape(f, (-1, width))
    u = None if u is None else np.reshape(u, (-1, width))
    if channels is not None and names is None:
        names = tuple(range(channels))
    return wi, wo, f, u, names, source


def spread_pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions (n, 3) above the surface, of at most `count`: a quarter of them uniform, the others denser
    towards the mirror direction, as the tables of measured materials have them."""
    u = lattice(count, 4)
    quarter = count // 4
    theta_h = 0.5 * math.pi * u[quarter:, 0] ** 2
    theta_d = 0.5 * math.pi * u[quarter:, 1]
    wi, wo = from_half_difference(theta_h, 2.0 * math.pi * u[quarter:, 3], theta_d, 2.0 * math.pi * u[quarter:, 2])
    even = [_direction(np.arccos(1.0 - u[:quarter, k]), 2.0 * math.pi * u[:quarter, k + 1]) for k in (0, 2)]
    wi, wo = (np.concatenate([a, b]) for a, b in zip(even, (wi, wo), strict=True))
    up = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    return wi[up], wo[up]


def _direction(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def _of_arrays(wi: Any, wo: Any, f: Any, u: Any = None) -> Rows:
    wi, wo, f = (real(name, x) for name, x in (("wi", wi), ("wo", wo), ("f", f)))
    for name, w in (("wi", wi), ("wo", wo)):
        if w.ndim != 2 or w.shape[1] != 3:
            rule = "expected (N, 3): gn.direction(theta, phi) makes directions of angles [rad]"
            raise ShapeError(f"{name}: got shape {w.shape}; {rule}")
        suspected_lengths(name, w)
    count = max(len(wi), len(wo))
    wi, wo = (np.broadcast_to(w, (count, 3)) if len(w) == 1 else w for w in (wi, wo))
    if len(wi) != len(wo) or f.ndim not in (1, 2) or len(f) != count:
        rule = f"expected one row for each pair of directions: ({count},) or ({count}, C)"
        raise ShapeError(f"f: got shape {f.shape} with wi {wi.shape} and wo {wo.shape}; {rule}")
    channels = tuple(range(f.shape[1])) if f.ndim == 2 else None
    f = f if f.ndim == 2 else f[:, None]
    if u is not None:
        u = real("u", u)
        try:
            u = np.broadcast_to(u[:, None] if u.ndim == 1 else u, f.shape)
        except ValueError:
            raise ShapeError(f"u: got shape {u.shape}; expected a number, or the shape of f, {f.shape}") from None
    return wi, wo, f, u, channels, f"{count} rows"


def suspected_lengths(name: str, w: np.ndarray) -> None:
    """Raises ParameterError for directions (..., 3) that are no unit vectors."""
    off = np.abs(np.einsum("...k,...k->...", w, w) - 1.0)
    if (off > 2.0 * UNIT).any():
        off = float(np.sqrt((w[off > 2.0 * UNIT][0] ** 2).sum()))
        raise ParameterError(
            f"{name}: a direction of length {off:g}; expected unit vectors: gn.directions.normalize({name})"
        )


def _weights(weights: Any, f: np.ndarray) -> np.ndarray:
    """Weights (N, 1) or (N, C) of the squares of residuals."""
    array = real("weights", weights)
    array = array[:, None] if array.shape == (len(f),) else array
    if array.shape not in ((len(f), 1), f.shape):
        raise ShapeError(
            f"weights: got shape {array.shape}; expected ({len(f)},) or {f.shape}, one for each row of data"
        )
    if not (array >= 0.0).all() or not np.isfinite(array).all():
        raise ParameterError("weights: got negative numbers, or none; expected weights of squares from 0")
    return array


def real(name: str, values: Any) -> np.ndarray:
    """An argument as numbers; NaN for what is masked."""
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values
    try:
        return numbers(values).astype(float)
    except ValueError as error:
        raise ParameterError(f"{name}: {error}; expected an array of numbers") from None


def warn_of_missing(s: Samples) -> None:
    """A MissingDataWarning where many rows were left out that had a direction above the surface."""
    lost = s.left_out.get("no number", 0) + s.left_out.get("a direction that is no number", 0)
    if lost > len(s):
        warn(f"{s.source}: {lost} of {lost + len(s)} rows hold no number", MissingDataWarning)


def names_of(channels: Sequence[Any] | None) -> list[str]:
    """The names of channels as text; one "" without a channel axis."""
    return [""] if channels is None else [f"{c:g}" if isinstance(c, float) else str(c) for c in channels]
