"""Any reflectance as a table: values on a grid of angles, interpolated, with sampling and the error of the grid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ..base.angles import lattice_pairs
from ..base.calls import breaches
from ..base.measured import tabular_shape
from ..base.provenance import derived
from ..base.reflectance import Reflectance
from ..base.reradiation import warn_of_reradiation
from ..declared.arguments import checked
from ..errors import ParameterError
from ..formula import tree
from ..formula.state import note
from ..models._quarters import quarters, sheet_of
from ..numerics.filling import filled_in_layers
from ..tables.angle_systems import SYSTEMS, AngleSystem, angle_system
from ..tables.axes import nodes_of
from ..tables.gridded import Gridded
from ..tables.nodes import channels_named, f_at
from .comparison import ResamplingError, resampling_error

GRAZING = 0.01
"""Cosine of the last polar angles of the grids."""


class Tabulated(Gridded):
    """A table that `gonio.tables.tabulate` made of a reflectance: a `Gridded` with the error of its grid.

    Error    of the grid, in `error`. By default mean, largest and albedo's for GGX(0.1), glass: half_difference 6e-3,
             7e-2, 7e-3, angles 1e-2, 13 (at the peak), 0.12; for 0.3 Lambertian + GGX(0.3): 6e-4, 4e-2, 1e-3 and
             1e-3, 0.3, 7e-4.
    Source   that of `Gridded`: Rusinkiewicz 1998, "A new change of variables for efficient BRDF representation".

    Example
    >>> table = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
    >>> print(table.stored.shape, gn.albedo(table, [0, 0, 1]).round(3))
    (9, 9, 18) 0.5
    """

    breaks: ClassVar[dict[str, str]] = note(
        {"energy": "values between nodes are linear interpolations, which may lie above those of the material"}
    )

    error: ResamplingError = note()


@checked
def tabulate(
    m: Reflectance,
    parameterization: str = "half_difference",
    resolution: Sequence[int] | None = None,
    anisotropic: bool | None = None,
    channels: Sequence[int] | None = None,
) -> Any:
    """A reflectance as a table, with the error of its grid: see `Tabulated` and its `error`.

    `resolution`: nodes along each axis. `anisotropic`: whether the table has a fourth axis, by default if the material
    needs one. `channels`: numbers of the channels of the table, by default all. Holes of a measurement are filled from
    their neighbours. What transmits, or has two sides, becomes a `Sheet` of tables. Of fluorescence a table holds f
    alone, and a FluorescenceWarning says so. Raises ParameterError for a material with a delta lobe or with maps, which
    no table can hold.

    Example
    >>> table = gn.tables.tabulate(gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5)))
    >>> print(table.parameterization, table.stored.shape)
    half_difference (90, 46, 36)
    """
    warn_of_reradiation(m, "gn.save(m, 'm.json')")
    tables = {q: _table(part, parameterization, resolution, anisotropic, channels) for q, part in quarters(m).items()}
    return sheet_of(tables)


def _table(
    m: Reflectance,
    parameterization: str,
    resolution: Sequence[int] | None,
    anisotropic: bool | None,
    channels: Sequence[int] | None,
) -> Any:
    """The table of what is reflected in front."""
    shape, system = tabular_shape(m), angle_system(parameterization)
    if system.tabulated is None:
        offered = " or ".join(repr(name) for name, other in SYSTEMS.items() if other.tabulated)
        raise ParameterError(f"parameterization={parameterization!r}: expected {offered}")
    four = not m.is_isotropic() if anisotropic is None else anisotropic
    chosen = _Channels(m, shape, channels)
    reciprocal = chosen.reciprocal()
    period = math.pi if reciprocal else 2.0 * math.pi
    periods = {"phi_d": period} if "phi_d" in system.isotropic else None
    axes = nodes_of(system, four, resolution, system.tabulated, periods)
    sizes = [*map(len, axes.values())]
    if parameterization == "angles" and (sizes[0] != sizes[1] or (four and sizes[2] != sizes[3])):
        raise ParameterError(f"resolution={resolution!r}: expected as many nodes for wo as for wi, for reciprocity")
    values = _on_grid(chosen, system, axes)
    if reciprocal and parameterization == "angles":  # averaged with the exchange of wi and wo; phi becomes -phi
        exchanged = values.transpose(1, 0, 3, 2, 4) if four else values.transpose(1, 0, 2, 3)[:, :, ::-1]
        values = 0.5 * (values + (exchanged if four else np.roll(exchanged, 1, axis=2)))
    names = m.channel_names or channels_named(m.channels or 1)
    table = Tabulated(
        parameterization,
        axes,
        values if shape else values[..., 0],
        channels=[names[c] for c in chosen.numbers] if shape else None,
        periods=periods,
        about={"made_of": repr(m)},
    )
    error = resampling_error(m, table, chosen.numbers)
    breaks = {**Tabulated.breaks, **breaches(m)}
    return tree.with_notes(table, provenance=derived(m), breaks=breaks, error=error)


class _Channels:
    """Some channels of a reflectance; f always has a channel axis."""

    def __init__(self, m: Reflectance, shape: tuple[int, ...], channels: Sequence[int] | None):
        count = shape[0] if shape else 1
        self.m, self.shape, self.numbers = m, shape, list(range(count)) if channels is None else list(channels)
        if not self.numbers or not all(c in range(count) for c in self.numbers):
            raise ParameterError(f"channels={channels!r}: expected numbers from 0 to {count - 1}")

    def f(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        f = self.m.f(wi, wo)
        return f[..., self.numbers] if self.shape else f[..., None]

    def reciprocal(self) -> bool:
        wi, wo = lattice_pairs(512)
        return np.allclose(self.f(wi, wo), self.f(wo, wi), rtol=1e-6, atol=1e-12, equal_nan=True)


def _on_grid(m: _Channels, system: AngleSystem, axes: Mapping[str, np.ndarray]) -> np.ndarray:
    """f (grid..., C) at the nodes; nodes without a value are filled from their neighbours."""
    highest = {"theta_i": math.acos(GRAZING), "theta_o": math.acos(GRAZING)}
    grid = {name: np.minimum(nodes, highest.get(name, np.inf)) for name, nodes in axes.items()}
    values = f_at(m, *system.directions(grid), least=0.999 * GRAZING)
    return filled_in_layers(values, (False,) * len(axes))[0]
