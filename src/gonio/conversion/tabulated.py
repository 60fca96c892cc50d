"""Any reflectance as a table: values on a grid of angles, interpolated, with sampling and the error this makes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from ..base.measured import tabular_shape
from ..base.provenance import derived
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..formula.state import note
from ..numerics.filling import filled_in_layers
from ..tables.angle_systems import SYSTEMS, AngleSystem, angle_system
from ..tables.axes import nodes_of
from ..tables.gridded import Gridded
from ..tables.nodes import f_at
from .comparison import ResamplingError, lattice_pairs, resampling_error

GRAZING = 0.01  # cosine; the grids end there


class Tabulated(Gridded):
    """The table that `gonio.tabulate` makes of a reflectance: a `Gridded` that knows the error this makes.

    Error    of the grid, in `error`. By default mean, largest and albedo's for GGX(0.1), glass: half_difference 6e-3,
             7e-2, 7e-3, angles 1e-2, 13 (at the peak), 0.12; for 0.3 Lambertian + GGX(0.3): 6e-4, 4e-2, 1e-3 and
             1e-3, 0.3, 7e-4.
    Source   that of `Gridded`: Rusinkiewicz 1998, "A new change of variables for efficient BRDF representation".
    """

    breaks: ClassVar[dict[str, str]] = note(
        {"energy": "values between nodes are linear interpolations, which may lie above those of the material"}
    )

    error: ResamplingError = note()


def tabulate(
    m: Reflectance,
    parameterisation: str = "half_difference",
    resolution: Sequence[int] | None = None,
    anisotropic: bool | None = None,
    channels: Sequence[int] | None = None,
) -> Tabulated:
    """A reflectance as a table, with the error that this makes: see `Tabulated` and its `error`.

    `resolution`: nodes along each axis. `anisotropic`: whether the table has an axis more, found out if not given.
    `channels`: numbers of the channels to keep, all if not given. Holes of a measurement are filled from what is next
    to them. Raises ParameterError for a material with a delta lobe or with maps: no such table could hold it.
    """
    shape, system = tabular_shape(m), angle_system(parameterisation)
    if system.tabulated is None:
        offered = " or ".join(repr(name) for name, known in SYSTEMS.items() if known.tabulated)
        raise ParameterError(f"parameterisation={parameterisation!r}: expected {offered}")
    four = not m.is_isotropic() if anisotropic is None else anisotropic
    keep = _Kept(m, shape, channels)
    reciprocal = keep.reciprocal()
    period = math.pi if reciprocal else 2.0 * math.pi
    periods = {"phi_d": period} if "phi_d" in system.isotropic else None
    axes = nodes_of(system, four, resolution, system.tabulated, periods)
    sizes = [*map(len, axes.values())]
    if parameterisation == "angles" and (sizes[0] != sizes[1] or (four and sizes[2] != sizes[3])):
        raise ParameterError(f"resolution={resolution!r}: expected as many nodes for wo as for wi, for reciprocity")
    values = _on_grid(keep, system, axes)
    if reciprocal and parameterisation == "angles":
        back = values.transpose(1, 0, 3, 2, 4) if four else _back(values)
        values = 0.5 * (values + back)
    names = m.channel_names
    if names is not None and channels is not None:
        names = tuple(names[c] for c in channels)
    table = Tabulated(
        parameterisation,
        axes,
        values if shape else values[..., 0],
        channels=(names or tuple(map(str, range(keep.width)))) if shape else None,
        periods=periods,
        about={"made_of": repr(m)},
    )
    error = resampling_error(m, table, keep.chosen)
    breaks = {**Tabulated.breaks, **m.breaches()}
    return table.with_notes(channel_names=names, provenance=derived(m), breaks=breaks, error=error)


def _back(values: np.ndarray) -> np.ndarray:
    """What a table of theta_i, theta_o, phi holds for wi and wo exchanged: phi becomes -phi."""
    return np.roll(values.transpose(1, 0, 2, 3)[:, :, ::-1], 1, axis=2)


class _Kept:
    """A reflectance with a channel axis, some of its channels left out."""

    def __init__(self, m: Reflectance, shape: tuple[int, ...], chosen: Sequence[int] | None):
        count = shape[0] if shape else 1
        self.m, self.chosen = m, list(range(count)) if chosen is None else list(chosen)
        if not self.chosen or not all(c in range(count) for c in self.chosen):
            raise ParameterError(f"channels={chosen!r}: expected numbers from 0 to {count - 1}")
        self.plain, self.width = not shape, len(self.chosen)

    def f(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        f = self.m.f(wi, wo)
        return f[..., None] if self.plain else f[..., self.chosen]

    def reciprocal(self) -> bool:
        wi, wo = lattice_pairs(512)
        return np.allclose(self.f(wi, wo), self.f(wo, wi), rtol=1e-6, atol=1e-12, equal_nan=True)


def _on_grid(keep: _Kept, system: AngleSystem, axes: Mapping[str, np.ndarray]) -> np.ndarray:
    """f (grid..., C) at the nodes, those without a value filled from what is next to them."""
    highest = {"theta_i": math.acos(GRAZING), "theta_o": math.acos(GRAZING)}
    grid = {name: np.minimum(nodes, highest.get(name, np.inf)) for name, nodes in axes.items()}
    values = f_at(keep, *system.directions(grid), least=0.999 * GRAZING)
    return filled_in_layers(values, (False,) * len(axes))[0]
