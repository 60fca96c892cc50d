"""Sampling of measurements and of tables, by tables of their values over half vectors, made when first needed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..base.angles import direction
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..base.results import Hints
from ..formula import tree
from ..formula.direction import Direction, half_and_cosine, polar_angle, reflect, select
from ..formula.table_warp import MarginalWarp, Slices, both, gather, tables_when_needed
from ..formula.warp import cosine_hemisphere, cosine_hemisphere_density
from .angle_systems import azimuth_of
from .axes import between

COSINE_SHARE = 0.2
"""Share of samples that is cosine-distributed: weights are at most 5 pi f."""

VIEWS, TURNS, ROWS, COLUMNS = 16, 16, 32, 64
"""Polar angles and azimuths of wo, one table each; azimuths and polar angles of half vectors in a table."""

STEEPEST = math.radians(88.0)
GRAZING = 0.01  # cosine, below which f is not looked at

KINDS = ("lobe_cells", "lobe_rows", "lobe_conditional", "lobe_marginal", "lobe_integral")


class Drawn(Reflectance):
    """Base of reflectances of which only f is known. Half vectors are drawn by tables of f cos(theta_i), one for each
    of 16 polar angles of wo (and 16 azimuths, if turning the sample changes f), mixed with the cosine hemisphere; the
    density is exact.

    Source   Dupuy & Jakob 2018, "An adaptive parameterization for efficient material acquisition and rendering",
             ACM TOG 37(6):274, for half vectors drawn by tables over their angles; here the tables are those of f.

    Example
    >>> from gonio.tables.drawing import Drawn
    >>> table = gn.tables.tabulate(gn.Lambertian(0.5), "angles", resolution=(4, 4, 8))
    >>> print(isinstance(table, Drawn), (table.pdf(gn.direction(0.5, 0.0), [0, 0, 1]) > 0.0))
    True True
    """

    hints = Hints(seam=COSINE_SHARE)

    lobe_cells: Any  # tables of sampling, of bound materials only
    lobe_rows: Any
    lobe_conditional: Any
    lobe_marginal: Any
    lobe_integral: Any

    def _keep(self) -> dict[str, Fixed]:
        """The tables of `_looked_up`, and those of sampling, which are made from them when first needed."""
        bare = self._looked_up()

        def lobes() -> np.ndarray:
            return lobe_tables(self._changed({}, bare), tree.is_oriented(self))

        return {**bare, **tables_when_needed(KINDS, lobes)}

    def _looked_up(self) -> dict[str, Fixed]:
        """The tables that `formula` looks up, by name."""
        return super()._keep()

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        diffuse = u0 < COSINE_SHARE
        flat = cosine_hemisphere(ops.minimum(u0 * (1.0 / COSINE_SHARE), 1.0), u1)
        at, phi_o = self._seen_from(wo)
        u = ops.clip((u0 - COSINE_SHARE) / (1.0 - COSINE_SHARE), 0.0, 1.0)
        x, y = self._lobe.sample(at, u1, u)
        theta, phi = (0.5 * math.pi) * x * x, (2.0 * y - 1.0) * math.pi + phi_o
        s = ops.sin(theta)
        wi = reflect(wo, Direction(s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta)))
        return select(diffuse, flat, wi)

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        at, phi_o = self._seen_from(wo)
        sin_m = ops.sqrt(wm.x * wm.x + wm.y * wm.y + 1e-20)
        x = ops.sqrt(polar_angle(wm) * (2.0 / math.pi))
        turns = (azimuth_of(wm) - phi_o + math.pi) * (0.5 / math.pi)
        solid = (8.0 * math.pi**2) * x * sin_m * cos_d  # of wi, per area of the square
        lobe = self._lobe.eval(at, x, turns - ops.floor(turns)) / ops.maximum(solid, 1e-12)
        return COSINE_SHARE * cosine_hemisphere_density(wi) + (1.0 - COSINE_SHARE) * lobe

    def estimate(self, wo: Direction) -> Any:
        return gather(self.lobe_integral, self._seen_from(wo)[0], 1, 0)

    def _seen_from(self, wo: Direction) -> tuple[Slices, Any]:
        """The sampling tables around wo with their weights, and the azimuth from which their azimuths count."""
        theta = between(polar_angle(wo) * ((VIEWS - 1) / STEEPEST), VIEWS)
        if not tree.is_oriented(self):
            return theta, azimuth_of(wo)
        phi = between((azimuth_of(wo) + math.pi) * (TURNS / (2.0 * math.pi)), TURNS + 1)
        return both(phi, theta, VIEWS), 0.0

    @property
    def _lobe(self) -> MarginalWarp:
        count = VIEWS * (TURNS + 1) if tree.is_oriented(self) else VIEWS
        return MarginalWarp(
            self.lobe_cells, self.lobe_rows, self.lobe_conditional, self.lobe_marginal, (ROWS, COLUMNS), count
        )


class Sampled(Drawn, Measured):
    """Base of measurements of which only f is known, drawn as `Drawn` says.

    Example
    >>> from gonio.tables.drawing import Sampled
    >>> print(isinstance(gn.tables.tabulate(gn.Lambertian(0.5), "angles", resolution=(4, 4, 8)), Sampled))
    True
    """


def lobe_tables(m: Reflectance, oriented: bool) -> np.ndarray:
    """f cos(theta_i) (azimuths, polar angles, ROWS, COLUMNS) by half vector, per area of the square of its angles."""
    y, x = np.meshgrid(np.linspace(0.0, 1.0, ROWS), np.linspace(0.0, 1.0, COLUMNS), indexing="ij")
    theta = 0.5 * math.pi * x * x
    wm = direction(theta, (2.0 * y - 1.0) * math.pi)
    phis = np.linspace(-math.pi, math.pi, TURNS + 1) if oriented else np.zeros(1)
    density = np.zeros((len(phis), VIEWS, ROWS, COLUMNS))
    for i, phi_o in enumerate(phis):
        wo = direction(np.linspace(0.0, STEEPEST, VIEWS), phi_o)
        cos_d = np.stack([wm @ w for w in wo])
        wi = 2.0 * cos_d[..., None] * wm - wo[:, None, None]
        up = (wi[..., 2] > GRAZING) & (cos_d > 0.0)
        f = np.zeros(up.shape)
        values = m.f(wi[up], np.broadcast_to(wo[:, None, None], wi.shape)[up]).reshape(int(up.sum()), -1)
        f[up] = np.maximum(np.nan_to_num(values.mean(axis=-1)), 0.0)
        density[i] = f * wi[..., 2] * cos_d * np.sin(theta) * x * (8.0 * math.pi**2)
    mean = density.mean(axis=(-2, -1), keepdims=True)
    return density + np.where(mean > 0.0, 1e-3 * mean, 1.0)
