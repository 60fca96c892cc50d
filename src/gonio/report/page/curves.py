"""f of a material as curves and images of numbers: slices in a plane, by half and difference angle, their peaks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ...base.sides import is_lit
from ...figures._slices import bounded, f_in_plane, incidences, one_number, plane, slices_of
from ...figures.half_difference_figure import nodes, slice_of
from ...tables.gridded import Gridded

END = 89.9
"""The flattest viewing angle [degrees] of a slice."""

TURNS = {"in_plane": 0.0, "across": 0.5 * math.pi}
"""Name of a plane -> the angle [rad] from the plane of incidence."""


def views_about(theta: float) -> np.ndarray:
    """Viewing angles [degrees], dense about the mirror direction and about the light, so that no peak is chopped."""
    beside = np.concatenate([[0.0], np.geomspace(0.005, 12.0, 48)])
    near = [sign * theta + side * beside for sign in (-1.0, 1.0) for side in (-1.0, 1.0)]
    views = np.unique(np.concatenate([np.linspace(-END, END, 361), *near]).round(6))
    return views[np.abs(views) <= END]


def slices(m: Reflectance) -> dict[str, Any]:
    """f against the viewing angle [degrees], negative on the side of the light, for angles of incidence."""
    thetas, within = incidences(m), bounded(m)
    views_of = [views_about(theta) for theta in thetas]
    slices_of_m: dict[str, Any] = {"unit": one_number(m)[1], "azimuth_of_light": math.degrees(plane(m))}
    for name, turn in TURNS.items():
        measured = slices_of(m, thetas, turn) if isinstance(m, Gridded) else [None] * len(thetas)
        slices_of_m[name] = []
        for theta, views, points in zip(thetas, views_of, measured, strict=True):
            row = {"theta_i": theta, "views": views.tolist(), "f": f_in_plane(within, theta, views, turn).tolist()}
            if points is not None and points.views.size:
                u = None if points.u is None else points.u.tolist()
                row["measured"] = {"views": points.views.tolist(), "f": points.measured.tolist(), "u": u}
            slices_of_m[name].append(row)
    if is_lit(m, -1.0):
        slices_of_m["through"] = []
        for theta, views in zip(thetas, views_of, strict=True):
            f = f_in_plane(within, theta, views, through=True)
            slices_of_m["through"].append({"theta_i": theta, "views": views.tolist(), "f": f.tolist()})
    return slices_of_m


def peaks(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of slices in the plane of incidence: f at the mirror direction, seen along the normal, and back to the light; the
    largest f, its angle and its full width at half maximum [degrees]; None where nothing is known."""
    peaks_of_rows = []
    for row in rows:
        views, f = np.array(row["views"]), np.array(row["f"])
        theta = row["theta_i"]
        at = {"mirror": theta, "normal": 0.0, "retro": -theta}
        values = {name: float(f[np.abs(views - view).argmin()]) for name, view in at.items()}
        finite = np.where(np.isfinite(f), f, -1.0)
        ties = np.flatnonzero(finite >= finite.max() * (1.0 - 1e-7))
        top = int(ties[np.abs(views[ties] - theta).argmin()])
        largest = {"peak": float("nan"), "peak_at": float("nan"), "width": float("nan")}
        if finite[top] > 0.0:
            largest = {"peak": float(f[top]), "peak_at": float(views[top]), "width": _width(views, finite, top)}
        peaks_of_rows.append({"theta_i": theta, **values, **largest})
    return peaks_of_rows


def _width(views: np.ndarray, f: np.ndarray, top: int) -> float:
    """The full width at half maximum; NaN where f does not fall to its half on both sides."""
    half = 0.5 * f[top]
    ends = []
    for step in (-1, 1):
        k = top
        while 0 <= k < len(f) and f[k] > half:
            k += step
        if not 0 <= k < len(f) or f[k] < 0.0:
            return float("nan")
        share = (f[k - step] - half) / max(f[k - step] - f[k], 1e-300)
        ends.append(views[k - step] + share * (views[k] - views[k - step]))
    return float(ends[1] - ends[0])


def half_difference(m: Reflectance) -> dict[str, Any]:
    """f by half and difference angle [degrees], at a difference azimuth of 90 degrees: rows by difference angle."""
    theta_h, theta_d = (0.5 * (edges[1:] + edges[:-1]) for edges in nodes())
    image = slice_of(m, 0.5 * math.pi)
    return {"theta_h": theta_h.tolist(), "theta_d": theta_d.tolist(), "phi_d": 90.0, "f": image.tolist()}
