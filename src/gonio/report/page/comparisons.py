"""Plots that compare: a material beside a model, and materials beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from .chart import Chart, ChartAxis, figure, fitting, legend
from .drawing import DENSE, INCIDENT, VIEW, SliceArrays, f_label, of_incidence, step
from .told import angle

LIMITS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Ends of the axis of residuals [%]."""


def of_fit(rows: Sequence[dict[str, Any]], model: str, unit: str) -> str:
    """A material beside the best model, and the difference between both."""
    values = np.concatenate([np.array([*row["f"], *row["model"]], float) for row in rows])
    drawn = Chart(VIEW, fitting(values, f_label(unit)), "The best fit")
    off = [_relative(np.array(row["f"], float), np.array(row["model"], float)) for row in rows]
    most = float(np.nanmax(np.abs(np.concatenate(off)), initial=0.0))
    limit = next((x for x in LIMITS if most <= x), LIMITS[-1])
    ticks = [limit * k / 2.0 for k in range(-2, 3)]
    below = Chart(VIEW, ChartAxis(-limit, limit, "model − f [% of f]", ticks=ticks), "Residuals of the best fit")
    below.level(0.0)
    for k, row in enumerate(rows):
        css_class = step(k, len(rows))
        f, of = np.array(row["f"], float), np.array(row["model"], float)
        drawn.line(row["views"], np.where(f > 0.0, f, np.nan), css_class)
        drawn.line(row["views"], np.where(np.isfinite(f) & (of > 0.0), of, np.nan), f"{css_class} dashed")
        below.line(row["views"], off[k], css_class)
    thetas = [row["theta_i"] for row in rows]
    both = of_incidence(thetas, [("ink", "material"), ("ink dashed", "best fit")])
    first = figure(drawn.svg(), f"The material beside the best of the fits, <code>{escape(model)}</code>.", both)
    cut = f", cut off at ±{limit:g} %" if most > limit else ""
    return first + figure(below.svg(), f"Residuals in the plane of incidence{cut}.", of_incidence(thetas))


def _relative(f: np.ndarray, of: np.ndarray) -> np.ndarray:
    """By how much a model is above f [%]."""
    with np.errstate(all="ignore"):
        return np.where(f > 0.0, 100.0 * (of / f - 1.0), np.nan)


def of_several(several: Sequence[dict[str, Any]]) -> str:
    """Overlaid plots of materials: f in the plane of incidence at three angles, and the albedo."""
    entries = [(_kind(k), escape(one["name"])) for k, one in enumerate(several)]
    figures = []
    for wanted in (15.0, 45.0, 75.0):
        rows = []
        for k, one in enumerate(several):
            slices = one["slices"]["in_plane"] if one["slices"] else []
            near = min(slices, key=lambda row: abs(row["theta_i"] - wanted), default=None)
            if near is not None and abs(near["theta_i"] - wanted) <= 10.0:
                rows.append((k, SliceArrays(near)))
        if not rows:
            continue
        units = {several[k]["unit"].partition(",")[0] for k, _ in rows} - {""}
        title = "f in the plane of incidence"
        drawn = Chart(
            VIEW, fitting(np.concatenate([row.all for _, row in rows]), f_label(" or ".join(sorted(units)))), title
        )
        for k, row in rows:
            drawn.line(row.views, np.where(row.f > 0.0, row.f, np.nan), _kind(k))
            if row.measured is not None:
                drawn.points(*row.measured[:2], _kind(k), 2.2 if len(row.measured[0]) <= DENSE else 1.0)
        others = sorted({row.theta for _, row in rows if abs(row.theta - wanted) > 0.01})
        beside = f" (measured: {', '.join(map(angle, others))})" if others else ""
        figures.append(figure(drawn.svg(), f"{title}, light from {angle(wanted)}{beside}.", legend(entries)))
    shown = [(k, one) for k, one in enumerate(several) if one["albedo"]]
    if shown:
        curves = [
            (k, one["albedo"]["curve"]["theta_i"], np.mean(one["albedo"]["curve"]["values"], axis=1))
            for k, one in shown
        ]
        top = max(float(np.nanmax(rho)) for _, _, rho in curves)
        drawn = Chart(INCIDENT, ChartAxis(0.0, max(1.0, 1.08 * top), "albedo, mean of channels"), "Albedo of all")
        drawn.level(1.0)
        for k, theta, rho in curves:
            drawn.line(theta, rho, _kind(k))
        figures.append(figure(drawn.svg(), "Albedo against the angle of incidence.", legend(entries)))
    return "".join(figures)


def _kind(k: int) -> str:
    """The class of the k-th of several materials: colour and dashes."""
    return f"q{k % 7} d{k % 4}"
