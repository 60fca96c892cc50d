"""A gridded measurement as arrays of f at its nodes, and back: the first and the last step of every repair."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.history import ALBEDO_AT, Repair
from ..base.measured import Measured
from ..base.provenance import derived
from ..base.quantities import from_brdf
from ..errors import MissingDataWarning, ParameterError, ToleranceWarning
from ..formula import tree
from ..integrals.over_hemisphere import integrate
from ..tables.gridded import Gridded
from ..tables.nodes import above
from ..tables.scattered import Scattered

ALBEDO_TOLERANCE = 1e-3
BATCH = 1 << 20
"""Number of pairs that are evaluated at a time."""

ROUNDING = 1e-14
"""Relative change of f up to which a cell counts as unchanged."""


class GridCells:
    """A measurement `m` on a grid: f and u [1/sr] (grid..., C) at its nodes, and the directions wi and wo of these.

    u       standard uncertainty of f, or None
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
        self.f = with_channels(grid.brdf(), len(self.nodes))
        u = grid.brdf_uncertainty()
        self.u = None if u is None else with_channels(u, len(self.nodes))

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
        before: Measured | None = None,
    ) -> Gridded:
        """The measurement with other f and uncertainties at the same nodes; cells that do not change stay as stored.

        `before`: the measurement that is repaired, if not this one itself.
        """
        changed = ~((f == self.f) | (np.isnan(f) & np.isnan(self.f)))
        cosines = (self.wi[..., 2, None], self.wo[..., 2, None])
        stored = with_channels(self.m.stored, len(self.nodes))
        stored = np.where(changed, from_brdf(self.m.quantity, f, *cosines), stored)
        after = like(self.m, self.m.axes, stored, None if u is None else from_brdf(self.m.quantity, u, *cosines))
        return reported(after, before or self.m, operation, parameters, self.changes(f), figures)

    def changes(self, f: np.ndarray) -> dict[str, Any]:
        """Number of cells above the horizon whose value changed, appeared or vanished, and the size of the changes.

        A cell counts once, whatever the number of its channels.
        """
        before, after = self.f[self.up], f[self.up]
        had_value = ~np.isnan(before)
        filled = ~had_value & ~np.isnan(after)
        step = np.where(had_value, np.abs(after - before), 0.0)
        step = np.where(step > ROUNDING * np.abs(before), step, 0.0)
        touched = (step > 0.0) | filled | (had_value & np.isnan(after))
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


def changes_of_all(cells: int, share: float, differences: np.ndarray) -> dict[str, Any]:
    """What `GridCells.changes` counts, of a new grid: all its cells have changed, by `differences` of f."""
    off = np.abs(differences)
    off = {"largest": float(np.nanmax(off, initial=0.0)), "mean": float(np.nanmean(off)) if off.size else 0.0}
    return {"cells": cells, "share": share, "filled": 0, **off}


def reported(
    after: Gridded,
    before: Measured | None,
    operation: str,
    parameters: Mapping[str, Any],
    changes: Mapping[str, Any],
    figures: Mapping[str, float] | None = None,
) -> Gridded:
    """The measurement `after` a repair, with the history of the one `before` and one more record."""
    record = Repair(
        operation,
        {name: np.asarray(x).tolist() for name, x in parameters.items()},
        **changes,
        albedo_before=None if before is None else black_sky(before),
        albedo_after=black_sky(after),
        figures=dict(figures or {}),
    )
    history = [] if before is None else list(before.about.get("repairs", ()))
    provenance = after.provenance if before is None else derived(before)
    return tree.with_notes(after, about={**after.about, "repairs": [*history, record.to_json()]}, provenance=provenance)


def black_sky(m: Any) -> tuple[float, ...]:
    """Albedos of the mean of all channels at `ALBEDO_AT`; directions without data count as 0."""
    if isinstance(m, Gridded) and m.channel_names is not None:
        m = m.with_table(m.brdf().mean(axis=-1), quantity="brdf", channels=None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)  # these count as 0, as said above
        warnings.simplefilter("ignore", ToleranceWarning)  # before and after have the same error
        albedos = integrate(m, direction(np.radians(ALBEDO_AT), 0.0), ALBEDO_TOLERANCE).value
    return tuple(map(float, albedos.reshape(len(ALBEDO_AT), -1).mean(axis=-1)))


def evaluated(m: Any, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f (..., C) of any reflectance at pairs (..., 3), always with a channel axis."""
    shape = np.broadcast_shapes(wi.shape, wo.shape)[:-1]
    flat = [np.broadcast_to(w, (*shape, 3)).reshape(-1, 3) for w in (wi, wo)]
    parts = [m.f(flat[0][k : k + BATCH], flat[1][k : k + BATCH]) for k in range(0, max(len(flat[0]), 1), BATCH)]
    f = with_channels(np.concatenate(parts), 1)
    return f.reshape(*shape, f.shape[1])


class Values(Gridded):
    """Any numbers (grid..., n) on the grid of a measurement, interpolated like its f and never sampled."""

    def __init__(self, m: Gridded, values: np.ndarray):
        other = {"channels": range(values.shape[-1]), "quantity": "brdf", "path": "", "about": None}
        super().__init__(values=values, **{**m._arguments(), **other})

    def _keep(self) -> Any:
        return self._looked_up()  # without the tables of sampling, which take longer than all else


def variances(m: Gridded) -> Values:
    """The square of a measurement's standard uncertainty [1/sr^2], with a channel axis.

    Between nodes that is an upper bound: errors at the nodes are taken as independent, and then a weighted mean has the
    variance sum w^2 u^2, which is at most sum w u^2.
    """
    u = m.brdf_uncertainty()
    assert u is not None
    return Values(m, with_channels(u, len(m.axes)) ** 2)


def floor(f: np.ndarray) -> float:
    """A thousandth of the mean |f| of a table: smaller f have relative differences to this instead."""
    return 1e-3 * float(np.nanmean(np.abs(f))) + 1e-300


def relative(f: np.ndarray, true: np.ndarray, table: np.ndarray) -> np.ndarray:
    """|f - true| over |true|, or over the `floor` of a table where that is larger."""
    return np.abs(f - true) / np.maximum(np.abs(true), floor(table))


def spread(differences: np.ndarray) -> tuple[float, float]:
    """Root mean square and largest of differences, NaNs left out; 0 if there are none."""
    finite = differences[np.isfinite(differences)]
    if not finite.size:
        return 0.0, 0.0
    return float(np.sqrt(np.mean(finite * finite))), float(np.abs(finite).max())
