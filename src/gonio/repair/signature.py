"""Subtraction of an instrument's signature: its reading without a sample."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..errors import ParameterError, expect_one_of
from ..tables.gridded import Gridded
from ._cells import GridCells, evaluated, variances

NEGATIVES = ("keep", "zero", "missing")


@checked
def subtract_signature(
    m: Measured,
    signature: Reflectance,
    scale: float = 1.0,
    scale_uncertainty: float = 0.0,
    negatives: str = "keep",
) -> Gridded:
    """f - scale * signature: without the light that reaches the detector when there is no sample.

    signature          any reflectance: the measurement without a sample, in units of the BRDF (its signal divided by
                       the irradiance, solid angle and cosine of the sample's); where it has no value the result has
                       none
    scale              of the signature: 1 if nothing else changed, less where the sample blocks part of the stray light
    scale_uncertainty  standard uncertainty of the scale
    negatives          f below 0 stay ("keep", unbiased), become 0 ("zero"), or NaN ("missing")

    Uncertainties add in quadrature: u^2 = u_m^2 + (scale u_s)^2 + (scale_uncertainty signature)^2; a signature without
    uncertainty has u_s = 0. `figures`: "negative", the number of cells with f below 0 after the subtraction;
    "without_signature", the number of cells that lost their value because the signature has none; "largest_share", the
    largest share of the signature in a cell's f.

    Example
    >>> axes = {"theta_i": [0.0, 0.8, 1.5], "theta_o": [0.0, 0.8, 1.5], "phi": [0.0, np.pi]}
    >>> m = gn.Gridded("angles", axes, np.full((3, 3, 2), 0.11))
    >>> stray = gn.Gridded("angles", axes, np.full((3, 3, 2), 0.01))
    >>> print(gn.repair.subtract_signature(m, stray).f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1
    """
    expect_one_of(NEGATIVES, "negatives", negatives)
    if not (math.isfinite(scale) and scale_uncertainty >= 0.0):
        raise ParameterError(f"scale={scale!r}, scale_uncertainty={scale_uncertainty!r}: expected finite numbers, >= 0")
    cells = GridCells(m)
    stray, channels = np.full(cells.f.shape, np.nan), cells.f.shape[-1]
    reading = evaluated(signature, cells.wi[cells.up], cells.wo[cells.up])
    if reading.shape[-1] not in (1, channels):
        raise ParameterError(f"signature: has {reading.shape[-1]} channels, expected 1 or the measurement's {channels}")
    stray[cells.up] = reading
    f = np.where(cells.up[..., None], cells.f - scale * stray, cells.f)
    up = cells.up[..., None] & ~np.isnan(cells.f)
    with np.errstate(invalid="ignore", divide="ignore"):
        below = up & (f < 0.0)
        share = np.abs(scale * stray / cells.f)[up & (cells.f != 0.0)]
    figures: dict[str, Any] = {
        "negative": int(below.any(axis=-1).sum()),
        "without_signature": int((up & np.isnan(stray)).any(axis=-1).sum()),
        "largest_share": float(np.nanmax(share, initial=0.0)),
    }
    u = _uncertainty(cells, signature, stray, scale, scale_uncertainty)
    if negatives != "keep":
        f = np.where(below, 0.0 if negatives == "zero" else np.nan, f)
    parameters = {
        "signature": repr(signature)[:200],
        "scale": scale,
        "scale_uncertainty": scale_uncertainty,
        "negatives": negatives,
    }
    return cells.repaired("subtract_signature", parameters, f, u, figures)


def _uncertainty(
    cells: GridCells, signature: Reflectance, stray: np.ndarray, scale: float, scale_uncertainty: float
) -> np.ndarray | None:
    uncertain = signature if isinstance(signature, Gridded) and signature.uncertainty is not None else None
    if cells.u is None and uncertain is None and scale_uncertainty == 0.0:
        return None
    total = (scale_uncertainty * stray) ** 2
    if cells.u is not None:
        total = total + cells.u**2
    if uncertain is not None:
        total[cells.up] += scale**2 * evaluated(variances(uncertain), cells.wi[cells.up], cells.wo[cells.up])
    return np.sqrt(total)
