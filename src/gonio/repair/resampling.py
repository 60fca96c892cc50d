"""Resampling to another grid or parameterization, with an estimate of its error."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..base.angles import lattice_pairs
from ..base.measured import Measured, tabular_shape
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..errors import ParameterError
from ..formula import tree
from ..tables.angle_systems import AZIMUTHS, angle_system
from ..tables.axes import laid_out, nodes_of
from ..tables.gridded import Gridded, real
from ..tables.nodes import above, channels_named, f_at
from ._cells import GridCells, changes_of_all, evaluated, relative, reported, spread, variances


@checked
def resample(
    m: Reflectance,
    parameterization: str = "half_difference",
    axes: Mapping[str, Any] | None = None,
    resolution: Sequence[int] | None = None,
    periods: Mapping[str, float] | None = None,
) -> Gridded:
    """Any reflectance as a Gridded measurement: f at the nodes of a grid, no data where the horizon cuts nodes off.

    axes         nodes [rad] of each axis, in the system's order; azimuths around the circle, or from 0 to half of it
                 for a material that is its own mirror image (`Gridded.mirrored`)
    resolution   numbers of nodes instead: theta_h and radial are spaced as their square roots, others evenly, from 0
                 to pi/2 (radial: pi) and around the circle; if neither is given, steps are 2 to 5 degrees for isotropic
                 materials
    periods      of azimuths [rad] where they are not 2 pi: {"phi_d": math.pi} for a reciprocal table

    `figures`, all of relative differences |f - true f|/true f:
    "error_rms", "error_largest"   from the original at 16384 pairs with cosines above 0.1
    "back_rms", "back_largest"     there and back: from a Gridded original at its nodes
    "half_rms"                     of every second node from its interpolation between the others: the error of a grid
                                   half as fine, and about four times that of this one where f is smooth

    `largest` and `mean` of the record are those of |f - true f| [1/sr] at these pairs. Uncertainties are interpolated
    as variances, an upper bound for independent errors at the nodes. Raises ParameterError for a material with a delta
    lobe or with maps, and for azimuths that leave out a part of the circle whose values do not follow from the others.

    Error    by default "error_rms" for 0.3 Lambertian + GGX(0.3), glass: half_difference 2e-3,
             specular 3e-3, angles 9e-3.

    Example
    >>> m = gn.repair.resample(gn.Lambertian(0.5), resolution=(9, 9, 18))
    >>> print(m.parameterization, m.brdf().shape)
    half_difference (9, 9, 18)
    """
    shape, system = tabular_shape(m), angle_system(parameterization)
    if axes is None:
        isotropic = not tree.is_oriented(m) if isinstance(m, Gridded) else m.is_isotropic()
        nodes = nodes_of(system, not isotropic, resolution, system.fine)
    elif resolution is None:
        nodes = {name: real(f"axes: {name}", x).astype(float).reshape(-1) for name, x in axes.items()}
        laid_out(parameterization, nodes, False, {})
    else:
        raise ParameterError("resample(axes=..., resolution=...): expected one of the two")
    mirrored = _is_half(m, nodes, periods or {})
    wi, wo = system.directions(nodes)
    f = f_at(m, wi, wo)
    names = (m.channel_names or channels_named(*shape)) if shape else None
    u = None
    if isinstance(m, Gridded) and m.uncertainty is not None:
        u = np.sqrt(f_at(variances(m), wi, wo)).reshape(f.shape)
    about = {"made_of": repr(m), **(m.about if isinstance(m, Measured) else {})}
    outside = m.outside if isinstance(m, Gridded) else "hold"
    kept: dict[str, Any] = {"channels": names, "about": about, "periods": periods, "outside": outside}
    table = Gridded(parameterization, nodes, f, uncertainty=u, mirrored=mirrored, **kept)
    pairs = lattice_pairs(1 << 14)
    true, tabulated = evaluated(m, *pairs), evaluated(table, *pairs)
    figures = dict(zip(("error_rms", "error_largest"), spread(relative(tabulated, true, true)), strict=True))
    if isinstance(m, Gridded):
        cells = GridCells(m)
        back = evaluated(table, cells.wi[cells.up], cells.wo[cells.up])
        off = relative(back, cells.f[cells.up], cells.f)
        figures |= dict(zip(("back_rms", "back_largest"), spread(off), strict=True))
    figures["half_rms"] = _half_error(table)
    parameters = {"parameterization": parameterization, "nodes": [len(x) for x in nodes.values()]}
    changes = changes_of_all(int(above(wi, wo).sum()), 1.0, tabulated - true)
    return reported(table, m if isinstance(m, Measured) else None, "resample", parameters, changes, figures)


def _is_half(m: Reflectance, nodes: Mapping[str, np.ndarray], periods: Mapping[str, float]) -> bool:
    """Whether the third of three axes covers half a circle, whose other half is its mirror image."""
    for name, x in nodes.items():
        period = periods.get(name, 2.0 * math.pi)
        if name not in AZIMUTHS or len(x) < 3:
            continue
        steps = np.diff(x)
        gap = period - (x[-1] - x[0])
        if gap <= max(2.5 * steps.max(), 1e-9):
            continue
        half = math.degrees(0.5 * period)
        ways = f"expected nodes around the circle, numpy.arange(n) * {period:.6g} / n"
        if len(nodes) == 3 and name == list(nodes)[2]:
            is_half = abs(x[0]) < 1e-9 and abs(x[-1] - 0.5 * period) < 1e-9
            if is_half and _is_own_image(m):
                return True
            ways += f", or of a material that is its own mirror image from 0° to {half:.6g}°"
            ways += "; this one is not" if is_half else ""
        raise ParameterError(
            f"axes: {name} goes from {math.degrees(x[0]):.6g}° to {math.degrees(x[-1]):.6g}° and leaves out "
            f"{math.degrees(gap):.6g}° of {2.0 * half:.6g}°; {ways}"
        )
    return False


def _is_own_image(m: Reflectance) -> bool:
    """Whether f stays as both directions are mirrored at the x-z plane, to a thousandth."""
    wi, wo = lattice_pairs(1 << 12)
    image = np.array([1.0, -1.0, 1.0])
    a, b = evaluated(m, wi, wo), evaluated(m, wi * image, wo * image)
    return bool(np.allclose(a, b, rtol=1e-3, atol=1e-6 * np.nanmax(np.abs(a)), equal_nan=True))


def _half_error(table: Gridded) -> float:
    """Root mean square of the relative error at the nodes that a grid of every second node leaves out."""
    cells = GridCells(table)
    every = tuple(slice(None, None, 2) if len(x) > 2 else slice(None) for x in cells.nodes)
    left = np.ones(cells.grid, bool)
    left[every] = False
    axes = {name: x[part] for (name, x), part in zip(table.axes.items(), every, strict=True)}
    kept: dict[str, Any] = {"channels": table.channel_names, "outside": table.outside}
    coarse = Gridded(table.parameterization, axes, table.stored[every], mirrored=table.is_mirrored, **kept)
    at = left & cells.up
    return spread(relative(evaluated(coarse, cells.wi[at], cells.wo[at]), cells.f[at], cells.f))[0]
