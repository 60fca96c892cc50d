"""The figure of a fit: data against model in the plane of incidence and by half and difference angle."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.angles import angles, direction
from ..base.frames import half_difference
from ..declared.arguments import checked
from ..fitting.result import Fit
from ..fitting.samples import names_of
from ._drawing import COLOURS as SIDE_BY_SIDE
from ._drawing import SEQUENCE as COLOURS
from ._drawing import new_figure
from .half_difference_figure import colour_bar, draw_slices, half_difference_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SLICES = 5
"""Angles of incidence that are drawn."""

NEAR_PLANE = np.radians(4.0)
"""Largest azimuth from the plane of incidence of rows that count as in it."""

WIDTH = np.radians(3.0)
"""Half the width of a class of angles of incidence."""

DECADE = 10.0
"""Ratio of f from which its axis is logarithmic."""

CELLS = (30, 30)
"""Cells by half and by difference angle."""


@checked
def fit(result: Fit, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw a fit: the data beside the model, and how far they are apart.

    Above: f in the plane of incidence by viewing angle, data as points, the model as lines; rows within 4 degrees of
    the plane and 3 degrees of each angle of incidence. Beside it the relative difference by angle of incidence. Below:
    the medians over cells of half and difference angle, of the data, of the model, and of their relative difference.
    Of several channels their mean.

    result     a result of `gn.fit`
    path       file to write: .png, .jpg, .pdf or .svg

    Units      the figure has degrees, and f [1/sr].
    Errors     ParameterError for other names of files.

    Example
    >>> data = gn.tables.tabulate(gn.Lambertian(0.3), resolution=(9, 9, 18))
    >>> figure = gn.figures.fit(gn.fit(data, gn.Lambertian()), path="fit.png")
    >>> print(figure.axes[1].get_ylabel())
    model − data [% of the data's rms]
    """
    s = result.problem.samples
    f = result.model.f(s.wi, s.wo)
    model = np.broadcast_to(np.reshape(f, (len(s), -1)), s.f.shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        count = s.valid.sum(axis=1)
        data = np.where(s.valid, s.f, 0.0).sum(axis=1) / count
        model = np.where(s.valid, model, 0.0).sum(axis=1) / count
    title = f"{result.title}, fitted to {s.source}"
    with new_figure(path, (12.0, 8.4), title) as figure:
        grid = figure.add_gridspec(2, 6)
        _plane(figure.add_subplot(grid[0, :4]), result, data)
        _incidence(figure.add_subplot(grid[0, 4:]), result)
        _half_difference(
            figure, [figure.add_subplot(grid[1, 2 * k : 2 * k + 2]) for k in range(3)], result, data, model
        )
    return figure


def _plane(axes: Any, fit: Fit, data: np.ndarray) -> None:
    s = fit.problem.samples
    (theta_i, phi_i), (theta_o, phi_o) = angles(s.wi), angles(s.wo)
    phi = np.mod(phi_o - phi_i, 2.0 * np.pi)
    aside = np.abs(np.mod(phi + 0.5 * np.pi, np.pi) - 0.5 * np.pi)
    in_plane = (aside < NEAR_PLANE) | (theta_o < np.radians(2.0)) | (theta_i < np.radians(2.0))
    signed = np.degrees(np.where(np.cos(phi) < 0.0, theta_o, -theta_o))
    drawn = False
    for k, centre in enumerate(_incidences(theta_i[in_plane])):
        rows = in_plane & (np.abs(theta_i - centre) < WIDTH)
        if rows.sum() < 3:
            continue
        drawn = True
        points = np.flatnonzero(rows)
        points = points[np.linspace(0, len(points) - 1, min(len(points), 400)).astype(int)]
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(signed[points], data[points], ".", color=colour, markersize=4, alpha=0.6)
        view = np.radians(np.linspace(-89.0, 89.0, 357))
        line = fit.model.f(direction(centre, np.pi), direction(np.abs(view), np.where(view < 0.0, np.pi, 0.0)))
        line = line if np.ndim(line) == 1 else np.mean(line, axis=-1)
        axes.plot(np.degrees(view), line, "-", color=colour, linewidth=1.4, label=f"{np.degrees(centre):.0f}°")
    if not drawn:
        axes.text(0.5, 0.5, "no rows in the plane of incidence", ha="center", va="center", transform=axes.transAxes)
        return
    low, high = np.quantile(data[in_plane & (data > 0.0)], [0.005, 1.0]) if (data[in_plane] > 0.0).any() else (0.0, 0.0)
    if high > DECADE * low > 0.0:
        axes.set_yscale("log")
        axes.set_ylim(0.5 * low, 2.0 * high)
    else:
        axes.set_ylim(0.0, 1.15 * high if high > 0.0 else None)
    axes.set_xlim(-90.0, 90.0)
    axes.set_xticks(np.arange(-90, 91, 30))
    axes.set_xlabel("viewing angle θₒ [°], light from the left")
    axes.set_ylabel("f [sr⁻¹]")
    axes.legend(title="incidence θᵢ")
    axes.set_title("in the plane of incidence; points: data, lines: model", fontsize=10)


def _incidences(theta: np.ndarray) -> list[float]:
    """Angles of incidence to be drawn: of many, some that many rows are near to."""
    if not theta.size:
        return []
    counts, edges = np.histogram(theta, bins=np.radians(np.arange(0.0, 93.0, 3.0)))
    full = np.flatnonzero(counts >= 3)
    chosen = full[np.unique(np.linspace(0, len(full) - 1, SLICES).round().astype(int))] if len(full) else []
    middles = [theta[(theta >= edges[k]) & (theta < edges[k + 1])] for k in chosen]
    return [float(np.median(x)) for x in middles]


def _incidence(axes: Any, fit: Fit) -> None:
    classes = fit.by_incidence()
    middle = [0.5 * (c.low + c.high) for c in classes]
    axes.bar(middle, [100.0 * c.rms for c in classes], width=12.0, color="#c9d8e6", label="rms")
    axes.plot(middle, [100.0 * c.mean for c in classes], "o-", color=SIDE_BY_SIDE[1], markersize=4, label="mean")
    axes.axhline(0.0, color="#444444", linewidth=0.8)
    axes.set(xlim=(0.0, 90.0), xticks=np.arange(0, 91, 15), xlabel="angle of incidence θᵢ [°]")
    axes.set_ylabel("model − data [% of the data's rms]")
    axes.legend()
    names = names_of(fit.problem.samples.channels)
    axes.set_title("difference" if len(names) == 1 else f"difference, {len(names)} channels", fontsize=10)


def _half_difference(figure: Any, panels: list[Any], fit: Fit, data: np.ndarray, model: np.ndarray) -> None:
    s = fit.problem.samples
    theta_h, _, theta_d, _ = half_difference(s.wi, s.wo)
    # finer near theta_h = 0, where highlights are
    column = np.clip((np.sqrt(theta_h / (0.5 * np.pi)) * CELLS[0]).astype(int), 0, CELLS[0] - 1)
    row = np.clip((theta_d / (0.5 * np.pi) * CELLS[1]).astype(int), 0, CELLS[1] - 1)
    cell = row * CELLS[0] + column
    off = (model - data) / np.maximum(0.5 * (np.abs(model) + np.abs(data)), 1e-12)
    images = [_medians(x, cell) for x in (data, model, 100.0 * off)]
    edges = (np.degrees(0.5 * np.pi * (np.arange(CELLS[0] + 1) / CELLS[0]) ** 2), np.linspace(0.0, 90.0, CELLS[1] + 1))
    drawn = draw_slices(panels[:2], images[:2], ("data", "model"), edges)
    colour_bar(drawn, panels[:2], "f [sr⁻¹]", shrink=0.9)
    largest = float(np.nanquantile(np.abs(images[2]), 0.95)) if np.isfinite(images[2]).any() else 1.0
    spread = max(largest, 0.1)
    apart = panels[2].pcolormesh(
        *edges, np.ma.masked_invalid(images[2]), cmap="RdBu_r", vmin=-spread, vmax=spread, rasterized=True
    )
    half_difference_axes(panels[2], "difference", False)
    colour_bar(apart, panels[2:], "(model − data) / mean [%]", shrink=0.9)


def _medians(values: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """The median of the values in each cell, NaN where there are none."""
    order = np.lexsort((values, cell))
    cells, first, count = np.unique(cell[order], return_index=True, return_counts=True)
    image = np.full(CELLS[0] * CELLS[1], np.nan)
    image[cells] = values[order][first + count // 2]
    return image.reshape(CELLS[1], CELLS[0])
