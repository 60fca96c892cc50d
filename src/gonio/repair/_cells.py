"""A gridded measurement as arrays of f at its nodes, and back: what every repair starts and ends with."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.history import ALBEDO_AT, Repair
from ..base.measured import Measured
from ..base.provenance import derived
from ..base.quantities import from_brdf
from ..errors import MissingDataWarning, ParameterError, ToleranceWarning
from ..integrals.over_directions import integrate
from ..tables.gridded import Gridded
from ..tables.nodes import above
from ..tables.scattered import Scattered

ALBEDO_TOLERANCE = 1e-3
BATCH = 1 << 20
"""How many pairs are evaluated at a time."""


ROUNDING = 1e-14
"""Relative change of f up to which a cell counts as unchanged."""


class Cells:
    """f [1/sr] (grid..., C) at the nodes of a measurement, its standard uncertainty or None, and where the nodes are.

    up      (grid...), whether both directions of a node are above the horizon
    wraps   for each axis, whether it closes to a circle
    """

    def __init__(self, m: Measured):
        grid: Gridded | None = m.as_grid() if isinstance(m, Measured) else None
        if grid is None:
            raise ParameterError(
                f"{m!r:.80}: got a {type(m).__name__}, expected a Gridded measurement; "
                f"make one with gonio.repair.resample, which reports what that changes"
            )
        if isinstance(grid, Scattered):
            grid = grid.with_brdf(grid.brdf(), grid.brdf_uncertainty())
        self.m, self.nodes = grid, list(grid.axes.values())
        self.wi, self.wo = grid.directions()
        self.up = above(self.wi, self.wo)
        self.f = self.with_channels(grid.brdf())
        u = grid.brdf_uncertainty()
        self.u = None if u is None else self.with_channels(u)

    def with_channels(self, values: np.ndarray) -> np.ndarray:
        """Values with a channel axis, where there is none."""
        return values if self.m.channel_names is not None else values[..., None]

    @property
    def grid(self) -> tuple[int, ...]:
        """Nodes along each axis."""
        return tuple(map(len, self.nodes))

    @property
    def wraps(self) -> tuple[bool, ...]:
        return tuple(
            name in self.m.periods and not (self.m.is_mirrored and k == 2) and len(nodes) > 2
            for k, (name, nodes) in enumerate(self.m.axes.items())
        )

    def repaired(
        self,
        operation: str,
        parameters: Mapping[str, Any],
        f: np.ndarray,
        u: np.ndarray | None,
        figures: Mapping[str, float] | None = None,
        before: Gridded | None = None,
    ) -> Gridded:
        """The measurement with other f and uncertainties at the same nodes; cells that do not change stay as stored.

        `before`: what it is a repair of, if not of this measurement itself.
        """
        changed = ~((f == self.f) | (np.isnan(f) & np.isnan(self.f)))
        cosines = (self.wi[..., 2, None], self.wo[..., 2, None])
        stored = np.where(changed, from_brdf(self.m.quantity, f, *cosines), self.with_channels(self.m.stored))
        made = like(self.m, self.m.axes, stored, None if u is None else from_brdf(self.m.quantity, u, *cosines))
        return reported(made, before or self.m, operation, parameters, self.changes(f), figures)

    def changes(self, f: np.ndarray) -> dict[str, Any]:
        """How many cells above the horizon have another value than before, or one for the first time, and by how much.

        A cell counts once, whatever the number of its channels.
        """
        before, after = self.f[self.up], f[self.up]
        known = ~np.isnan(before)
        filled = ~known & ~np.isnan(after)
        step = np.where(known, np.abs(after - before), 0.0)
        step = np.where(step > ROUNDING * np.abs(before), step, 0.0)
        touched = (step > 0.0) | filled | (known & np.isnan(after))
        step = step[np.isfinite(step) & (step > 0.0)]
        cells = int(touched.any(axis=-1).sum())
        return {
            "cells": cells,
            "share": cells / max(len(before), 1),
            "filled": int(filled.any(axis=-1).sum()),
            "largest": float(step.max(initial=0.0)),
            "mean": float(step.mean()) if step.size else 0.0,
        }


def like(
    m: Gridded,
    axes: Mapping[str, np.ndarray],
    stored: np.ndarray,
    uncertainty: np.ndarray | None,
    **other: Any,
) -> Gridded:
    """A measurement like another one, with other axes and values (grid..., C) of the same quantity."""
    if m.channel_names is None:
        stored, uncertainty = stored[..., 0], None if uncertainty is None else uncertainty[..., 0]
    about = {"made_of": repr(m), **m.about}
    return m.with_table(stored, uncertainty, **{"axes": axes, "path": "", "about": about, **other})


def reported(
    made: Gridded,
    before: Measured | None,
    operation: str,
    parameters: Mapping[str, Any],
    changes: Mapping[str, Any],
    figures: Mapping[str, float] | None = None,
) -> Gridded:
    """The measurement with one more record in its history, after those of the one it was made of."""
    record = Repair(
        operation,
        {name: np.asarray(x).tolist() for name, x in parameters.items()},
        **changes,
        albedo_before=None if before is None else black_sky(before),
        albedo_after=black_sky(made),
        figures=dict(figures or {}),
    )
    history = [] if before is None else list(before.about.get("repairs", ()))
    from_ = made.provenance if before is None else derived(before)
    return made.with_notes(about={**made.about, "repairs": [*history, record.to_json()]}, provenance=from_)


def black_sky(m: Any) -> tuple[float, ...]:
    """Albedos of the mean of all channels at `ALBEDO_AT`; directions without data count as 0."""
    if isinstance(m, Gridded) and m.channel_names is not None:
        m = m.with_table(m.brdf().mean(axis=-1), quantity="brdf", channels=None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)
        warnings.simplefilter("ignore", ToleranceWarning)
        found = integrate(m, direction(np.radians(ALBEDO_AT), 0.0), ALBEDO_TOLERANCE)
    return tuple(float(x) for x in found.reshape(len(ALBEDO_AT), -1).mean(axis=-1))


def evaluated(m: Any, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f (..., C) of any reflectance at pairs (..., 3), with a channel axis in any case."""
    shape = np.broadcast_shapes(wi.shape, wo.shape)[:-1]
    flat = [np.broadcast_to(w, (*shape, 3)).reshape(-1, 3) for w in (wi, wo)]
    parts = [m.f(flat[0][k : k + BATCH], flat[1][k : k + BATCH]) for k in range(0, max(len(flat[0]), 1), BATCH)]
    found = np.concatenate(parts)
    return found.reshape(*shape, found.shape[1] if found.ndim > 1 else 1)


class Values(Gridded):
    """Any numbers (grid..., n) on the grid of a measurement, to be interpolated as its f are and never sampled."""

    def __init__(self, m: Gridded, values: np.ndarray):
        super().__init__(
            m.parameterisation,
            m.axes,
            values,
            channels=range(values.shape[-1]),
            mirrored=m.is_mirrored,
            periods=m.periods,
            interpolation=m.interpolation,
            outside=m.outside,
        )

    def _keep(self) -> Any:
        return self._looked_up()  # without the tables of sampling, which take longer than all else


def variances(m: Gridded) -> Values:
    """The square of a measurement's standard uncertainty [1/sr^2], with a channel axis.

    Between nodes that is an upper bound: errors at the nodes are taken as independent, and then a weighted mean has the
    variance sum w^2 u^2, which is at most sum w u^2.
    """
    u = m.brdf_uncertainty()
    assert u is not None
    return Values(m, u**2 if m.channel_names is not None else u[..., None] ** 2)


def relative(found: np.ndarray, true: np.ndarray, of: np.ndarray) -> np.ndarray:
    """|found - true| over |true|, or over a thousandth of the mean |f| of a table where that is larger."""
    floor = 1e-3 * float(np.nanmean(np.abs(of))) + 1e-300
    return np.abs(found - true) / np.maximum(np.abs(true), floor)


def spread(differences: np.ndarray) -> tuple[float, float]:
    """Root mean square and largest of differences, NaNs left out; 0 if there are none."""
    known = differences[np.isfinite(differences)]
    if not known.size:
        return 0.0, 0.0
    return float(np.sqrt(np.mean(known * known))), float(np.abs(known).max())
