"""Refractive indices for the three channels of linear sRGB, from one over the spectrum."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..formula.fresnel.conductor import fresnel_conductor
from ..pictures.colour import to_rgb

_COSINES = np.linspace(0.0, 1.0, 21)
_LOWEST, _HIGHEST = np.log([[0.02, 0.02], [15.0, 40.0]])  # log n and log k in a fit, within the bounds of `Conductor`
_STEP = 1e-5  # of log n and log k, for differences
_ROUNDS = 30


def rgb_index(wavelengths: Any, n: Any, k: Any, opaque: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """n and k for red, green and blue: those whose Fresnel reflectance has the colour of the spectrum's at all angles.

    Least squares over cosines from 0 to 1, each channel by itself. A substance that is not opaque gets k = 0, and n by
    the reflectance at normal incidence. A channel in which more light would come back than came (gold's red, 1.038: not
    within sRGB) is held at the reflectance of the best wavelength.

    Shapes   wavelengths, n, k: (N,); results: (3,).
    Units    wavelengths: nm; n, k: 1.
    Error    in the reflectance, of the metals of `materials`: 0.0014 at most, of copper's red 0.0031; where a channel
             is held, what is cut off besides. Of the dielectrics 2e-5.
    Source   derived here.
    """
    to_channels = to_rgb(wavelengths)
    F = fresnel_conductor(_COSINES[:, None], n, k)
    target = F @ to_channels
    target = np.where(target[-1] > 1.0, F.max(axis=1)[:, None], target)
    if not opaque:
        amplitude = np.sqrt(target[-1])
        return (1.0 + amplitude) / (1.0 - amplitude), np.zeros(3)
    mean = np.abs(to_channels) / np.abs(to_channels).sum(axis=0)
    fits = [_fitted(np.log([n @ share, k @ share]), each) for share, each in zip(mean.T, target.T, strict=True)]
    eta, extinction = np.exp(fits).T
    return eta, extinction


def _fitted(p: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log n and log k whose reflectance is nearest a target at `_COSINES`, from a first guess: Levenberg–Marquardt."""
    shifts = _STEP * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    best, damping, curvature, slope = np.inf, 1e-3, np.eye(2), np.zeros(2)
    trial = p
    for _ in range(_ROUNDS):
        eta, k = np.exp(trial + shifts).T[..., None]
        F = fresnel_conductor(_COSINES, eta, k)
        residual = F[0] - target
        if (error := float(residual @ residual)) < best:
            best, p, damping = error, trial, 0.1 * damping
            gradient = (F[1::2] - F[2::2]) / (2.0 * _STEP)
            curvature, slope = gradient @ gradient.T, gradient @ residual
        else:
            damping *= 10.0
        step = np.linalg.solve(curvature * (1.0 + damping * np.eye(2)), slope)
        trial = np.clip(p - step, _LOWEST, _HIGHEST)
        if np.abs(trial - p).max() < 1e-10:
            break
    return p
