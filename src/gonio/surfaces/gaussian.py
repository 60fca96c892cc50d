"""Surfaces whose heights are a Gaussian process: Beckmann's slopes, and any autocorrelation."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import numpy as np

from ..declared.arguments import Declared, Seed, checked
from ..errors import ParameterError
from ..machine.caches import kept
from .height_field import HeightField

SHAPES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "gaussian": lambda r: np.exp(-r * r),
    "exponential": lambda r: np.exp(-r),
    "lorentzian": lambda r: (1.0 + r * r) ** -1.5,
}
"""Autocorrelations by name, of distances in correlation lengths."""


@checked
def gaussian(
    alpha_x: Annotated[
        float, Declared("sqrt(2) times the rms slope along x, exactly that of the triangles", 1e-4, 10.0)
    ],
    alpha_y: Annotated[float, Declared("the same along y; by default that along x", 1e-4, 10.0)] | None = None,
    autocorrelation: str | Callable[..., Any] = "gaussian",
    *,
    correlation: Annotated[float, Declared("correlation length, in cells", 1.0, 1000.0)] = 10.0,
    size: Annotated[int, Declared("cells along x and y: the surface is periodic", 16, 4096)] = 512,
    seed: Seed = 0,
) -> HeightField:
    """A surface whose heights are a Gaussian process: slopes of its triangles have Beckmann's distribution.

    alpha_x, alpha_y  sqrt(2) times the rms slopes along x and y, exactly those of the triangles
    autocorrelation   "gaussian", "exponential" (rough down to single cells) or "lorentzian", or a function of distances
                      (arrays) in correlation lengths, 1 at 0
    correlation       correlation length, in cells
    size              cells along x and y; a multiple of the correlation length: the surface is periodic

    The unit of length is left open: heights and cells have the ratio that alpha wants, and different alphas cells of
    different lengths along x and y.

    Source: Tsang, Kong, Ding & Ao 2001, "Scattering of Electromagnetic Waves: Numerical Simulations", chapter 4, the
    spectral method.

    Example
    >>> surface = gn.surfaces.gaussian(0.4, 0.1, size=128)
    >>> print(surface.rms_slopes, surface.turn == np.pi)
    (0.2828427, 0.0707107) True
    """
    alpha_y = alpha_x if alpha_y is None else alpha_y
    if size < 4.0 * correlation:
        raise ParameterError(
            f"gaussian(size={size}, correlation={correlation:g}): the surface repeats too soon; expected a size of at "
            f"least {4.0 * correlation:g} cells, 4 correlation lengths"
        )
    rng = np.random.default_rng([17, seed])
    noise = np.fft.rfft2(rng.standard_normal((size, size)))
    heights = np.fft.irfft2(noise * _amplitudes(autocorrelation, correlation, size), (size, size))
    rise_x, rise_y = (float(np.sqrt(np.mean((np.roll(heights, -1, axis) - heights) ** 2))) for axis in (1, 0))
    cell = math.sqrt(2.0) * rise_x / alpha_x, math.sqrt(2.0) * rise_y / alpha_y
    shape = autocorrelation if isinstance(autocorrelation, str) else "given"
    return HeightField(
        heights,
        cell,
        turn=0.0 if alpha_x == alpha_y else math.pi,
        again=partial(gaussian, alpha_x, alpha_y, autocorrelation, correlation=correlation, size=size),
        seed=seed,
        title=f"Gaussian heights, alpha {alpha_x:g} x {alpha_y:g}, {shape} autocorrelation",
    )


@kept
def _amplitudes(autocorrelation: str | Callable[..., Any], correlation: float, size: int) -> np.ndarray:
    """Square roots of the spectrum, as rfft2 lays it out."""
    if isinstance(autocorrelation, str) and autocorrelation not in SHAPES:
        expected = ", ".join(map(repr, SHAPES))
        raise ParameterError(f"autocorrelation={autocorrelation!r:.60}: expected one of {expected}, or a function")
    shape = SHAPES[autocorrelation] if isinstance(autocorrelation, str) else autocorrelation
    lag = np.minimum(np.arange(size), size - np.arange(size)) / correlation
    values = np.asarray(shape(np.hypot(lag[:, None], lag)), float)
    if values.shape != (size, size) or not np.isfinite(values).all() or not abs(values[0, 0] - 1.0) < 1e-6:
        raise ParameterError("autocorrelation: expected a function of an array of distances, finite and 1 at 0")
    spectrum = np.fft.rfft2(values).real
    if spectrum.min() < -0.05 * spectrum.max():
        raise ParameterError("autocorrelation: its spectrum is negative in places; no surface has it")
    amplitudes: np.ndarray = np.sqrt(np.maximum(spectrum, 0.0))
    amplitudes[0, 0] = 0.0
    amplitudes.flags.writeable = False
    return amplitudes
