"""Tabulated facets: any isotropic distribution of normals, given by its values at polar angles."""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..errors import ParameterError
from ..formula.direction import Direction
from ..formula.distribution import Distribution, facing, facing_density
from ..formula.fields import table
from ..formula.smith import gauss
from ..formula.text import literal

CELLS = 512  # between values, equally wide in t = sqrt(2 theta/pi), which resolves any lobe; a power of 2


class TabulatedFacets(Distribution):
    """Isotropic distribution from a table: D(theta_m) proportional to `values` at angles `theta`, linear in between.

    `theta` increases, within [0, pi/2]; below the first and above the last angle D stays. The values need no
    normalization: the integral of D cos(theta_m) is made 1. They are resampled once, to 513 values that are equally
    spaced in sqrt(theta), and linear in it in between.

    Looks    `TabulatedFacets([0, 0.2, 0.25], [1, 1, 0])` reflects a lamp as an even disc with an edge;
             `TabulatedFacets([0, 0.2, 0.3, 0.4], [0, 0, 1, 0])` as a ring.
    Shapes   theta, values: (N,), N at least 2.
    Units    theta: rad; values: any; D: 1/sr.
    Error    of resampling a smooth lobe whose width is alpha: relative 1e-4 at alpha = 0.05, 2e-3 at 0.001. Lambda,
             tabulated at 513 elevations: G1 relative 1e-5. Normals: drawn per cell, within 2 % of the density D cos,
             of two that are opposite as they are seen.
    Source   definition. Lambda: Smith's integral, see `gonio.formula.smith.smith`.

    Example
    >>> facets = gn.TabulatedFacets(theta=[0.0, 0.2, 0.6, 1.5], values=[1.0, 0.5, 0.1, 0.0])
    >>> print(gn.Microfacet(facets).f_angles(0.0, 0.0, [0.0, 0.4, 0.8], 0.0).round(4))
    [0.5568 0.3021 0.2332]
    """

    theta = table("polar angles [rad], increasing")
    values = table("D at these angles, in any unit")

    def __init__(self, theta: Any = (0.0, 0.5 * math.pi), values: Any = (1.0, 0.0)):
        try:
            theta, values = (ops.numbers(x) for x in (theta, values))
        except (TypeError, ValueError, OverflowError) as error:
            raise ParameterError(
                f"TabulatedFacets: not numbers: {error}; expected theta (N,) [rad] and values (N,)"
            ) from None
        if theta.ndim != 1 or theta.shape != values.shape or len(theta) < 2:
            raise ParameterError(
                f"TabulatedFacets: got shapes {theta.shape} and {values.shape}, expected theta (N,) and values (N,)"
            )
        super().__init__(theta=theta.astype(float), values=values.astype(float))

    def validate(self) -> None:
        theta, values = self.theta, self.values
        if not (np.isfinite(values).all() and values.min() >= 0.0 and values.max() > 0.0):
            raise ParameterError("TabulatedFacets(values): expected finite numbers of at least 0, not all of them 0")
        if not (theta[0] >= 0.0 and theta[-1] <= 0.5 * math.pi + 1e-9 and (np.diff(theta) > 0.0).all()):
            raise ParameterError("TabulatedFacets(theta): expected increasing angles in [0, pi/2] rad")

    def _keep(self) -> dict[str, Fixed]:
        """Tables made of those given, when first needed."""
        tables = cache(lambda: _tables(self.theta, self.values))
        return {
            name: Fixed(partial(lambda i: tables()[i], i)) for i, name in enumerate(("facets", "cumulated", "shown"))
        }

    def __getattr__(self, name: str) -> Any:  # tables, in formulas where nothing is bound
        if name in self._kept:
            return self._kept[name].numbers
        raise AttributeError(f"TabulatedFacets has no attribute {name!r}")

    def __repr__(self) -> str:
        return f"TabulatedFacets(theta={literal(self.theta)}, values={literal(self.values)})"

    def to_json(self) -> dict[str, Any]:
        return {"type": type(self).__name__, "theta": self.theta.tolist(), "values": self.values.tolist()}

    def D(self, wm: Direction) -> Any:
        i, rest = cell_of(*angles_of(wm))
        low, high = ops.take(self.facets, i), ops.take(self.facets, i + 1)
        return high + rest * (low - high)

    def Lambda(self, w: Direction) -> Any:
        # z Lambda, which is smooth, by a cubic through four of its values; there is one more of them at each end.
        i, rest = cell_of(*angles_of(w)[::-1])
        v = 1.0 - rest
        f = [ops.take(self.shown, i + k) for k in range(4)]
        a, b, c = v + 1.0, v - 1.0, v - 2.0
        inner, outer = a * b * c * f[1] * 0.5 - v * b * c * f[0] * (1.0 / 6), a * v * c * f[2] * 0.5
        return ops.maximum(inner - outer + a * v * b * f[3] * (1.0 / 6), 0.0) / w.z

    # Drawn is a cell of theta, and in it sin^2(theta) uniformly: the density is a step function times cos(theta).

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        i = ops.to_index(0.0 * u1)
        step = CELLS
        while step := step // 2:
            i = ops.where(ops.take(self.cumulated, i + step) <= u1, i + step, i)
        before, after = ops.take(self.cumulated, i), ops.take(self.cumulated, i + 1)
        share = ops.clip((u1 - before) / ops.maximum(after - before, 1e-30), 0.0, 1.0)
        inner, outer = (ops.take(self.cumulated, i + (_ROW + k)) for k in (0, 1))
        sin2 = inner + share * (outer - inner)
        return facing(wo, ops.sqrt(sin2 + 1e-30), u0, ops.sqrt(ops.maximum(1.0 - sin2, 0.0)))

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        i, _ = cell_of(*angles_of(wm))
        return ops.take(self.cumulated, i + 2 * _ROW) * wm.z * facing_density(wo, wm, cos_d)


_ROW = CELLS + 1


def angles_of(w: Direction) -> tuple[Any, Any]:
    """The angles of w to the normal and to the horizon, both to rounding."""
    s = ops.sqrt(w.x * w.x + w.y * w.y + 1e-20)
    return ops.arctan2(s, w.z), ops.arctan2(w.z, s)


def cell_of(angle: Any, complement: Any, cells: int = CELLS) -> tuple[Any, Any]:
    """The cell of an angle in [0, pi/2], of so many, and how far its outer edge is, from 1 to 0.

    `complement` is pi/2 - angle. Cells beyond pi/4 are counted from the end: D may vanish there.
    """
    outer = angle > complement
    # The floor keeps the derivative finite at 0.
    t = ops.sqrt(ops.clip(angle * (2.0 / math.pi), 1e-8, 1.0))
    gap = cells * (2.0 / math.pi) * ops.clip(complement, 0.0, 0.5 * math.pi) / (1.0 + t)
    count, left = ops.floor(cells * t), ops.floor(gap)
    i = ops.where(outer, cells - 1.0 - left, ops.minimum(count, cells - 1.0))
    return ops.to_index(i), ops.where(outer, gap - left, 1.0 + count - cells * t)


def _tables(theta: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """D at the edges of cells; for sampling, rows of cumulated probability, sin^2 and density; z Lambda."""
    t = np.arange(_ROW) / CELLS
    angles = 0.5 * math.pi * t * t
    D = np.interp(angles, theta, values)
    x, weight = (np.array(a) for a in zip(*gauss(6), strict=True))
    inside = (t[:-1, None] + x / CELLS).ravel()
    angle, width = 0.5 * math.pi * inside * inside, np.tile(weight, CELLS) * math.pi * inside / CELLS

    def between(at: np.ndarray) -> np.ndarray:
        return np.interp(np.sqrt(at * (2.0 / math.pi)), t, D)

    share = (between(angle) * math.pi * np.sin(2.0 * angle) * width).reshape(CELLS, -1).sum(axis=1)
    D /= share.sum()
    share = share / share.sum()
    sampling = np.zeros((3, _ROW))
    sampling[0, 1:] = np.cumsum(share)
    sampling[0, -1] = 1.0
    sampling[1] = np.sin(angles) ** 2
    sampling[2, :-1] = share / (math.pi * np.diff(sampling[1]))
    # Smith's integral along the circle of facets that w just grazes, as in `smith` but in angles.
    z, s = np.sin(angles)[:, None], np.cos(angles)[:, None]
    sin, cos = np.sin(angle), np.cos(angle)
    tilt = np.arctan2(np.hypot(sin, z * cos), s * cos)
    kernel = sin - z * cos * np.arctan2(sin, z * cos)
    shown = 2.0 * s[:, 0] ** 2 * ((between(tilt) * kernel) @ (sin * width))
    ends = shown[1], 4.0 * shown[-1] - 6.0 * shown[-2] + 4.0 * shown[-3] - shown[-4]
    return D, sampling.reshape(-1), np.concatenate([ends[:1], shown, ends[1:]])
