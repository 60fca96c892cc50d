"""A material in one figure: slices in the plane of incidence, albedo, a lit sphere; of a map, its places."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.light import Light
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.shown_channels import is_coloured, shown_as
from ..base.sides import said_of_sides
from ..declared.arguments import Declared, checked
from ..errors import ParameterError
from ..evaluate.tracing import at_most
from ..formula import tree
from ..pictures.colour import srgb_encode
from ..scenes.asked import Samples, Size
from ..scenes.rendering import render
from ..tables.gridded import Gridded
from ._curves import draw_cartesian, draw_polar, of_one, points_in_words
from ._drawing import GRAY, check_target, name_of, new_figure
from ._slices import lit_range, one_number, spans
from .albedo_figure import draw_albedo
from .fate_figure import draw_fate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PORTRAIT, SAMPLES = 256, 64
"""Pixels across the sphere of a portrait, and samples of a pixel."""

HELD = "Beyond the data the sphere and the albedo are those of the outermost values"


@checked
def overview(
    m: Reflectance,
    lights: Light | Iterable[Light] | None = None,
    path: str | os.PathLike[str] | None = None,
    title: Annotated[str, Declared("title of the figure", usual="the file of a measurement, else the expression")]
    | None = None,
    size: Size = 256,
    samples: Samples = 32,
    progress: Callable[[int, int], None] | None = None,
    channels: Sequence[str | float] | None = None,
) -> Figure:
    """Draw a material in one figure, as `gonio show` does.

    Above: f in the plane of incidence as polar slices, one per angle of incidence, with a logarithmic radius, and a lit
    sphere. Below: the same slices against the viewing angle, and albedo against the angle of incidence, or by channel
    where there are more than three. Ticks on the half circle mark the light, ticks on the axis the mirror directions.
    The plane of incidence is the x-z plane; of an oriented measurement that of the azimuth of the light that is nearest
    to it.

    Slices of a measurement are those of angles of incidence that were measured. Curves end where its data end; values
    measured in the plane are points, with bars of two standard uncertainties. Of a map, pi f of every place takes the
    place of the sphere, and the rest is that of the place in its middle.

    lights     of the sphere; by default the one of `gn.render`, as are size, samples and channels
    path       file to write: .png, .jpg, .pdf or .svg

    Units      the figure has degrees, and f [1/sr].
    Errors     ParameterError for other names of files, and for maps without data.

    Example
    >>> figure = gn.figures.overview(gn.material("gold", alpha=0.3), path="gold.png", size=32, samples=4)
    >>> print([axes.get_title() for axes in figure.axes][-1])
    Albedo: the fraction of light that leaves again
    """
    check_target(path)
    with new_figure(path, (11.0, 8.6), title or name_of(m)) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
        beside = figure.add_subplot(grid[0, 1])
        if map_shape(m):
            m = _draw_map(beside, m, channels)
        else:
            with at_most(size * size * samples):
                picture = render(m, lights, size=size, samples=samples, progress=progress, channels=channels)
            _sphere(beside, m, picture, channels)
        panel = of_one(m)
        slices = [curve.slice for curve in panel.curves]
        draw_polar(figure.add_subplot(grid[0, 0]), panel, _polar_title(panel.unit))
        below = figure.add_subplot(grid[1, 0])
        points = points_in_words(slices, draw_cartesian(below, panel))
        below.set(title="; ".join(filter(None, ("The same slices", points))))
        below.set_xlabel("viewing angle θₒ [°]; ticks: mirror directions")
        last = figure.add_subplot(grid[1, 1])
        draw_albedo(last, m)
        last.set_title("Albedo: the fraction of light that leaves again")
        low, high = lit_range(m)
        if isinstance(m, Gridded) and m.outside == "hold" and (spans(slices) or high - low < 89.0):
            figure.supxlabel(HELD, fontsize=9, color=GRAY)
    return figure


@checked
def portrait(
    m: Reflectance,
    lights: Light | Iterable[Light] | None = None,
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw a small figure: a lit sphere beside the polar slices of f in the plane of incidence; of a material that
    transmits beside what becomes of light.

    lights     of the sphere; by default the one of `gn.render`
    path       file to write: .png, .jpg, .pdf or .svg

    Units      the figure has degrees, and f [1/sr].
    Errors     ParameterError for other names of files, and for maps.

    Example
    >>> figure = gn.figures.portrait(gn.material("gold", alpha=0.3), path="gold.svg")
    >>> print(figure.get_size_inches())
    [6.4 2.9]
    """
    check_target(path)
    if map_shape(m):
        raise ParameterError(f"{m!r:.60}: a map, expected a material of one place; gn.figures.overview(m) draws all")
    with new_figure(path, (6.4, 2.9)) as figure:
        grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
        with at_most(PORTRAIT * PORTRAIT * SAMPLES):
            picture = render(m, lights, size=PORTRAIT, samples=SAMPLES)
        _sphere(figure.add_subplot(grid[0]), m, picture)
        beside = figure.add_subplot(grid[1])
        if said_of_sides(m):
            draw_fate(beside, m)
        else:
            draw_polar(beside, of_one(m))
        for axes in figure.axes:
            axes.set_title("")
    return figure


def _polar_title(unit: str) -> str:
    return f"f [sr⁻¹]{', ' + unit if unit else ''}\nin the plane of incidence, light from the left"


def _codes(linear: np.ndarray) -> np.ndarray:
    """Linear RGB (..., 3), or gray (..., 1), as sRGB (..., 3) from 0 to 1."""
    rgb = np.repeat(linear, 3, axis=-1) if linear.shape[-1] == 1 else linear
    return np.clip(srgb_encode(np.nan_to_num(rgb)), 0.0, 1.0)


def _sphere(axes: Any, m: Reflectance, picture: Any, channels: Sequence[str | float] | None = None) -> None:
    title = "Sphere, seen by a parallel camera"
    if is_coloured(m, channels):
        shown = _codes(picture.colour)
        title += _of_bands(channels)
    else:
        shown = _codes(picture.colour.mean(axis=-1, keepdims=True))
        title += f",\n{one_number(m)[1]}"
    alpha = picture.alpha if picture.alpha is not None else np.ones(shown.shape[:2])
    axes.imshow(np.concatenate([shown, alpha[..., None]], axis=-1), interpolation="lanczos")
    axes.set_axis_off()
    axes.set_title(title)


def _of_bands(channels: Sequence[str | float] | None) -> str:
    """The end of a title that says which bands a picture shows."""
    if channels is None:
        return ""
    return f",\n{', '.join(map(str, channels))} as {'red, green, blue' if len(channels) == 3 else 'gray'}"


def _draw_map(axes: Any, m: Reflectance, channels: Sequence[str | float] | None) -> Reflectance:
    """Draw pi f of every place of a map, seen along the normal; the material of the place in its middle."""
    shape = map_shape(m)
    f = with_channels(m.f(direction(math.radians(45.0), math.pi), direction(0.0, 0.0)), len(shape))
    number, words = one_number(m)
    finite = np.argwhere(np.isfinite(number(f)))
    if not len(finite):
        raise ParameterError(f"{m!r:.80}: no place of the map has data; expected at least one")
    place = tuple(finite[np.abs(finite - 0.5 * (np.array(shape) - 1.0)).sum(axis=-1).argmin()].tolist())
    if is_coloured(m, channels) and f.shape[-1] > 1:
        matrix = shown_as(m, channels)
        shown = math.pi * (f if matrix is None else f @ matrix)
        axes.imshow(_codes(shown.reshape(-1, shape[-1], shown.shape[-1])), aspect="equal", interpolation="nearest")
    else:
        gray = math.pi * number(f).reshape(-1, shape[-1])
        picture = axes.imshow(gray, aspect="equal", cmap="viridis", interpolation="nearest")
        axes.figure.colorbar(picture, ax=axes, shrink=0.8, label=f"π f{', ' + words if words else ''}")
    y, x = divmod(int(np.ravel_multi_index(place, shape)), shape[-1])
    axes.plot(x, y, "+", color="#d62728", ms=12, mew=2.0)
    axes.set(xlabel="column", ylabel="row")
    axes.grid(False)
    where = ", ".join(map(str, place))
    axes.set_title(
        f"π f of every place: light at 45°, seen at 0°{_of_bands(channels)};\n+ the place ({where}) of the other panels"
    )

    def picked(value: Any) -> Any:
        if getattr(value, "ndim", 0) < 2:
            return value
        return np.broadcast_to(value, (*shape, value.shape[-1]))[place]

    return tree.each(m, picked)
