"""The plots of a report, from its contents."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from . import chart
from .chart import Chart, ChartAxis, figure, fitting, legend, written
from .drawing import DENSE, INCIDENT, VIEW, SliceArrays, f_label, of_incidence, step
from .encoded import heat_image
from .polar import Polar
from .told import angle

TICKS = (0, 2, 10, 30, 60, 90)
"""Half angles [degrees] at the axis of the slice by half and difference angle, which is spaced by their root."""


def of_slices(slices: Sequence[dict[str, Any]], unit: str, title: str, across: bool = False) -> str:
    """Slices of one material against the viewing angle: a curve for each angle of incidence."""
    rows = [SliceArrays(row) for row in slices]
    drawn = Chart(VIEW, fitting(np.concatenate([r.all for r in rows]), f_label(unit)), title)
    _draw(drawn, rows)
    for k, row in enumerate(rows):
        css_class = step(k, len(rows))
        drawn.line(row.views, np.where(row.f > 0.0, row.f, np.nan), css_class)
        if row.measured is not None:
            views, f, u = row.measured
            drawn.points(views, f, css_class, 2.6 if len(views) <= DENSE else 1.1, None if u is None else 2.0 * u)
        if not across:
            drawn.tick(row.theta, css_class)
    return figure(drawn.svg(), _caption(title, rows, across), of_incidence([row.theta for row in rows]))


def of_polar(slices: Sequence[dict[str, Any]], through: Sequence[dict[str, Any]], title: str) -> str:
    """The same with the viewing angle around."""
    rows, below = [SliceArrays(row) for row in slices], [SliceArrays(row) for row in through]
    drawn = Polar(*_ends(fitting(np.concatenate([r.all for r in [*rows, *below]]), "")), title, bool(below))
    _draw(drawn, rows, below)
    for k, row in enumerate(rows):
        css_class = step(k, len(rows))
        drawn.line(row.views, row.f, css_class)
        if below:
            drawn.line(below[k].views, below[k].f, css_class, through=True)
        if row.measured is not None:
            drawn.points(*row.measured[:2], css_class, 2.2 if len(row.measured[0]) <= DENSE else 1.0)
        drawn.tick(row.theta, css_class)
    where = "; below the line what passes to the other side" if below else ""
    caption = f"{title}. Radius: log f; light from the left, from the angle that the tick on the rim marks{where}."
    return figure(drawn.svg(), caption, of_incidence([row.theta for row in rows]))


def _draw(drawn: Chart | Polar, rows: Sequence[SliceArrays], below: Sequence[SliceArrays] = ()) -> None:
    """What is behind curves: where there are no data; words where there is no curve."""
    views = rows[0].views
    for start, stop in chart.gaps(views, [np.interp(views, r.views, r.f) for r in rows], 4.0):
        drawn.band(-90.0 if start <= -89.0 else start, 90.0 if stop >= 89.0 else stop)
    if not any((r.all > 0.0).any() for r in [*rows, *below]):
        is_known = any(np.isfinite(r.f).any() for r in rows)
        drawn.words("f = 0 away from the mirror direction" if is_known else "no data in this plane")


def _ends(axis: ChartAxis) -> tuple[float, float]:
    """Powers of ten in the middle and at the rim of a half circle."""
    if axis.log:
        return math.log10(axis.low) - 0.15, math.log10(axis.high)
    return math.log10(max(axis.high, 1e-30)) - 1.2, math.log10(max(axis.high, 1e-30)) + 0.05


def _caption(title: str, rows: Sequence[SliceArrays], across: bool) -> str:
    parts = [title + "."] + ([] if across else ["Ticks: mirror directions."])
    if any(row.measured is not None for row in rows):
        bars = any(row.measured is not None and row.measured[2] is not None for row in rows)
        parts.append("Points: measured values" + (", bars: ±2 standard uncertainties." if bars else "."))
    return " ".join(parts)


def of_half_difference(table: dict[str, Any], unit: str) -> str:
    """f by half and difference angle, as an image."""
    f = np.array(table["f"], float)
    positive = f[np.isfinite(f) & (f > 0.0)]
    ticks = (0.0, 30.0, 60.0, 90.0)
    drawn = Chart(ChartAxis(0.0, math.sqrt(90.0)), ChartAxis(0.0, 90.0), "f by half and difference angle")
    low, high = (0.0, 1.0)
    if positive.size:
        low, high = (float(x) for x in np.quantile(positive, [0.005, 0.99]))
        low, high = max(low, 1e-5 * high), max(high, 1.05 * low)
    across, foot = drawn.width - chart.RIGHT - chart.LEFT, drawn.height - chart.BOTTOM
    box = f'x="{chart.LEFT}" y="{chart.TOP}" width="{across:.1f}" height="{foot - chart.TOP:.1f}"'
    inner = f'<rect class="nodata" {box}/><image href="{heat_image(f, low, high)}" {box} preserveAspectRatio="none"/>'
    for half in TICKS:
        (a,), _ = drawn.at([math.sqrt(half)], [0.0])
        inner += written(a, foot + 17, chart.angle_tick(half))
    for theta in ticks:
        _, (b,) = drawn.at([0.0], [theta])
        inner += written(chart.LEFT - 6, b + 4, chart.angle_tick(theta), anchor="end")
    difference = (
        'difference angle θ<tspan class="sub" dy="3">d</tspan><tspan dy="-3"> </tspan>[<tspan data-unit>°</tspan>]'
    )
    inner += drawn.names(chart.label("half angle θₕ [°]"), difference)
    svg = chart.framed(drawn.title, drawn.width, drawn.height, inner)
    scale = (
        f'<div class="scale"><span>{chart.number(float(f"{low:.2g}"))}</span><i></i>'
        f"<span>{chart.number(float(f'{high:.2g}'))}</span><span>{escape(f_label(unit))}</span></div>"
    )
    caption = (
        f"f by half and difference angle at a difference azimuth of {angle(90.0)}: highlights at the left, "
        f"retro-reflection below, grazing angles above."
    )
    return figure(svg, caption, scale)


def of_albedo(one: dict[str, Any]) -> str:
    """Albedo against the angle of incidence."""
    table, curve = one["albedo"]["table"], one["albedo"]["curve"]
    values = np.array(curve["values"], float)
    shown = table["shown"] if values.shape[1] <= 4 else [table["shown"][k] for k in (0, len(table["shown"]) // 2, -1)]
    bars = np.array(table["total"], float) if "total" in table else None
    top = float(np.nanmax(values, initial=0.0))
    drawn = Chart(INCIDENT, ChartAxis(0.0, max(1.0, 1.08 * top), "albedo"), "Albedo against the angle of incidence")
    low, high = one["albedo"]["low"], one["albedo"]["high"]
    for start, stop in ((0.0, low), (high, 90.0)):
        if stop - start > 1.0:
            drawn.band(start, stop)
    drawn.level(1.0)
    names = table["channels"]
    kinds = (
        ["ch0"] if values.shape[1] == 1 else ["r", "g", "b"] if names == ["R", "G", "B"] else ["s0", "s2", "s4", "s5"]
    )
    entries = []
    for css_class, channel in zip(kinds, shown, strict=False):
        drawn.line(curve["theta_i"], values[:, channel], css_class)
        at, measured = np.array(table["theta_i"]), np.array(table["values"], float)[:, channel]
        drawn.points(at, measured, css_class, 2.6, None if bars is None else 2.0 * bars[:, channel])
        words = {"R": "red", "G": "green", "B": "blue"}
        entries.append((css_class, escape(words.get(names[channel], names[channel]))))
    note = " Bars: ±2 standard uncertainties." if bars is not None else ""
    caption = f"Albedo: the share of the light that leaves again. No more than 1 can.{note}"
    return figure(drawn.svg(), caption, legend(entries) if len(entries) > 1 else "")


def of_fate(shares: dict[str, Any], unit: str) -> str:
    """What becomes of light, as stacked shares."""
    drawn = Chart(INCIDENT, ChartAxis(0.0, 1.0, "share of the light"), "What becomes of light")
    theta, low = np.array(shares["theta_i"]), np.zeros(len(shares["theta_i"]))
    entries = []
    for css_class, name in (("q0", "reflected"), ("q2", "transmitted"), ("q4", "absorbed")):
        high = low + np.clip(np.array(shares[name], float), 0.0, None)
        drawn.area(theta, low, high, css_class)
        drawn.line(theta, high, css_class)
        low = high
        entries.append((css_class, name))
    of = f" ({escape(unit)})" if unit else ""
    caption = f"Shares of the light that are reflected, transmitted and absorbed{of}, one above the other."
    return figure(drawn.svg(), caption, legend(entries))


def of_polarization(rows: Sequence[dict[str, Any]]) -> str:
    """The degree of linear polarization in the plane of incidence."""
    drawn = Chart(VIEW, ChartAxis(0.0, 1.0, "degree of linear polarization"), "Degree of linear polarization")
    for k, row in enumerate(rows):
        drawn.line(row["views"], np.array(row["degree"], float), step(k, len(rows)))
        drawn.tick(row["theta_i"], step(k, len(rows)))
    caption = "Of light that arrives unpolarized and leaves in the plane of incidence. Ticks: mirror directions."
    return figure(drawn.svg(), caption, of_incidence([row["theta_i"] for row in rows]))


def of_spectrum(spectrum: dict[str, Any]) -> str:
    """Albedo by wavelength."""
    x, values = np.array(spectrum["wavelengths"], float), np.array(spectrum["values"], float)
    wide = max(x[-1] - x[0], 1.0)
    top = float(np.nanmax(values, initial=0.0))
    drawn = Chart(
        ChartAxis(x[0] - 0.02 * wide, x[-1] + 0.02 * wide, "wavelength [nm]"),
        ChartAxis(0.0, max(1.0, 1.08 * top), "albedo"),
        "Spectrum",
    )
    drawn.level(1.0)
    kinds = ["s0", "s3", "s5"]
    for css_class, row in zip(kinds, values, strict=False):
        drawn.line(x, row, css_class)
        if len(x) <= 40:
            drawn.points(x, row, css_class)
    entries = [(css_class, angle(theta)) for css_class, theta in zip(kinds, spectrum["theta_i"], strict=False)]
    return figure(drawn.svg(), f"Albedo by wavelength, {len(x)} channels.", legend(entries, "incidence θᵢ"))
