"""f by half and difference angle: the slice of Rusinkiewicz's coordinates in which Burley reads materials."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.frames import from_half_difference
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ._drawing import GRAY, materials_of, panels
from ._slices import bounded, one_number, units_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CELLS = (120, 90)
"""Cells by half and by difference angle."""

COLOURS = "cividis"
"""Made so that people who see fewer colours see the same."""

TICKS = (0, 2, 10, 30, 60, 90)


@checked
def half_difference(
    materials: Mapping[str, Reflectance] | Sequence[Reflectance] | Reflectance,
    phi_d: float = 0.5 * math.pi,
    path: str | os.PathLike[str] | None = None,
    axes: Any = None,
) -> Figure:
    """Draw f by half and difference angle, at one difference azimuth: a panel for each material, on one scale.

    Highlights stand at the left, where the half vector is near the normal; retro-reflection below, where the directions
    are near each other; grazing angles above. The half angle is spaced by its square root, as in MERL's tables. Gray is
    where there are no data, or a direction is below the horizon.

    materials  one, a list, or label -> material
    phi_d      azimuth of the difference vector; at the default both directions are above the horizon in all the panel
    path       file to write: .png, .jpg, .pdf or .svg
    axes       of Matplotlib to draw into, one for each material; by default a new figure

    Units      phi_d [rad]; the figure has degrees, and f [1/sr].
    Errors     ParameterError for other names of files, for maps, and for no material.
    Source     coordinates: Rusinkiewicz 1998, Rendering Techniques, p. 11; reading: Burley 2012, SIGGRAPH courses.

    Example
    >>> metals = {name: gn.material(name, alpha=0.2) for name in ("gold", "copper")}
    >>> figure = gn.figures.half_difference(metals, path="metals.png")
    >>> print([axes.get_title() for axes in figure.axes[:2]])
    ['gold', 'copper']
    """
    shown = materials_of(materials)
    images = [slice_of(m, phi_d) for m in shown.values()]
    unit = units_of(shown.values())
    with panels(path, axes, len(shown), (4.0, 3.5)) as (figure, where):
        drawn = draw_slices(where, images, list(shown) if len(shown) > 1 else [""])
        colour_bar(drawn, where, f"f [sr⁻¹]{', ' + unit if unit else ''}")
        if abs(phi_d - 0.5 * math.pi) > 1e-6:
            where[0].set_xlabel(rf"half angle $\theta_h$ [°]; $\varphi_d$ = {math.degrees(phi_d):.3g}°")
    return figure


def nodes() -> tuple[np.ndarray, np.ndarray]:
    """Edges of the cells by half and by difference angle [degrees]; finer near 0, where highlights are."""
    return 90.0 * (np.arange(CELLS[0] + 1) / CELLS[0]) ** 2, np.linspace(0.0, 90.0, CELLS[1] + 1)


def slice_of(m: Reflectance, phi_d: float) -> np.ndarray:
    """f as one number at the middles of the cells [difference, half]; NaN where there are no data."""
    number, _ = one_number(m)
    theta_h, theta_d = (np.radians(0.5 * (edges[1:] + edges[:-1])) for edges in nodes())
    wi, wo = from_half_difference(theta_h[None, :], 0.0, theta_d[:, None], phi_d)
    f = np.asarray(number(with_channels(bounded(m).f(wi, wo), 2)), float)
    return np.where((wi[..., 2] > 0.0) & (wo[..., 2] > 0.0), f, np.nan)


def draw_slices(where: Sequence[Any], images: Sequence[np.ndarray], titles: Sequence[str], edges: Any = None) -> Any:
    """Draw values by half and difference angle on one logarithmic scale of colours; what a colour bar is made of."""
    from matplotlib.colors import LogNorm, Normalize

    known = np.concatenate([image[np.isfinite(image)] for image in images])
    positive = known[known > 0.0]
    norm: Any = Normalize(0.0, max(float(known.max(initial=0.0)), 1e-3))
    if positive.size and positive.max() > 1.001 * positive.min():
        low, high = (float(x) for x in np.quantile(positive, [0.005, 0.98]))
        norm = LogNorm(max(low, 1e-5 * high), max(high, 1.001 * low))
    for k, (axes, image, title) in enumerate(zip(where, images, titles, strict=True)):
        lowest: Any = norm.vmin if isinstance(norm, LogNorm) else -np.inf  # 0 is dark, not unknown
        drawn = axes.pcolormesh(
            *(edges or nodes()), np.ma.masked_invalid(np.maximum(image, lowest)), norm=norm, cmap=COLOURS,
            rasterized=True,
        )  # fmt: skip
        half_difference_axes(axes, title, k == 0)
    return drawn


def colour_bar(drawn: Any, where: Sequence[Any], label: str, **more: Any) -> None:
    """The scale of panels, and what its numbers are."""
    where[0].figure.colorbar(drawn, ax=list(where), label=label, extend="both", **more).ax.grid(False)


def half_difference_axes(axes: Any, title: str, is_first: bool = True) -> None:
    """Name and scale the axes of a panel by half and difference angle."""
    axes.set_facecolor("#d9d9d9")
    axes.grid(False)
    axes.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0.0)), np.square))
    axes.set(xticks=TICKS, xlim=(0.0, 90.0), ylim=(0.0, 90.0), yticks=np.arange(0, 91, 30))
    axes.set_xlabel(r"half angle $\theta_h$ [°]")
    if is_first:
        axes.set_ylabel(r"difference angle $\theta_d$ [°]")
    axes.tick_params(colors=GRAY, labelcolor="black")
    axes.set_title(title[:60], fontsize="medium", parse_math=False)
