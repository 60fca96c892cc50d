"""Cavity: between two plates of the material light bounces on and on, and never gets brighter.

The space between two endless parallel plates is closed. Filled with radiance 1, after k bounces it holds
L_k(wo) = integral of f(wi, wo) L_(k-1)(wi') cos(theta_i) dwi, where wi' is wi as the other plate sees it leave: at
the same angle to the normal. Inside a sphere every chord has the same angle at both ends too, so that for isotropic
materials the same numbers hold there. A Lambertian of albedo a has L_k = a^k; if the plates emit e, e/(1 - a) settles.

Measured   radiance between two plates of the material, filled with radiance 1, after 1 to 8 bounces, in 32 directions
Holds if   <= 1.005
Tolerance  as for the furnace; three standard errors are taken off first
"""

from __future__ import annotations

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..base.sides import is_lit
from ..numerics.lattice import lattice
from ._probes import degrees, in_channel, largest, together, weights
from ._verdict import Findings, at_most

ORDER = 23
FOLLOWS = ("energy", "reciprocity")
BOUNCES = 8
STARTS, PATHS = 32, 1024
BLOCKS = 16  # of paths: their scatter gives the error of the mean
TOLERANCE = 1.0 + 5e-3  # as for the furnace, after three standard errors are taken off

ACROSS = np.array([-1.0, 1.0, 1.0])
"""wi, as the other plate sees that light leave: reversed, and turned over with the plate about the x axis."""


def starts() -> np.ndarray:
    """Directions (STARTS, 3) spread over the hemisphere and its azimuths, none of them among the furnace's."""
    u = lattice(STARTS)
    return direction(0.5 * np.pi * 0.998 * u[:, 0], 2.0 * np.pi * u[:, 1])


def radiance(m: Reflectance, bounces: int = BOUNCES) -> tuple[np.ndarray, np.ndarray]:
    """L_k seen from `starts` and its standard errors, both (bounces, STARTS, C), by paths through `sample`."""
    step = together(m, STARTS, PATHS)
    parts = [_radiance(m, wo, bounces) for wo in np.split(starts(), range(step, STARTS, step))]
    mean, error = (np.concatenate(x, axis=1) for x in zip(*parts, strict=True))
    return mean, error


def _radiance(m: Reflectance, some_starts: np.ndarray, bounces: int) -> tuple[np.ndarray, np.ndarray]:
    u = lattice(PATHS, 2 * bounces)
    wo = np.repeat(some_starts[:, None, :], PATHS, axis=1)
    mean, error = [], []
    throughput = np.ones(1)
    for k in range(bounces):
        s = m.sample(wo, u[:, 2 * k : 2 * k + 2])
        throughput = throughput * weights(s, 2)
        block = throughput.reshape(len(wo), -1, BLOCKS, throughput.shape[-1]).mean(axis=1)
        mean.append(block.mean(axis=1))
        error.append(block.std(axis=1, ddof=1) / BLOCKS**0.5)
        alive = (s.pdf > 0.0)[..., None]
        wo = np.where(alive, s.wi * ACROSS, [0.0, 0.0, 1.0])
    return np.stack(mean), np.stack(error)


def steady(m: Reflectance, emission: float = 1.0, bounces: int = BOUNCES) -> np.ndarray:
    """Radiance (STARTS, C) that settles where the plates emit `emission`; infinite where light does not die out.

    The bounces that are not followed count as a geometric series with the last ratio.
    """
    L = radiance(m, bounces)[0]
    ratio = L[-1] / np.maximum(L[-2], 1e-300)
    ratio = np.where(L[-1] > 0.0, ratio, 0.0)
    rest = np.where(ratio < 1.0, L[-1] * ratio / np.where(ratio < 1.0, 1.0 - ratio, 1.0), np.inf)
    return emission * (1.0 + L.sum(axis=0) + rest)


def law(m: Reflectance) -> Findings:
    """The largest radiance after any number of bounces up to BOUNCES, less three standard errors."""
    if is_lit(m, -1.0):
        yield "cavity: left out, for light leaves through plates that transmit; energy and furnace look at both sides"
        return
    mean, error = radiance(m)
    value, (k, at, c) = largest(mean - 3.0 * error)
    channel = in_channel(m, c, mean.shape[-1])
    why = f"between two plates radiance 1 has grown to {mean[k, at, c]:.4g} at bounce {k + 1}{channel}"
    rule = f"max L in {BOUNCES} bounces = {{value}} <= {{tolerance}}"
    yield at_most("cavity", value, TOLERANCE, rule, degrees(wo=starts()[at]), why)
