"""Slices drawn as curves: in a half circle with a logarithmic radius, and against the viewing angle."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base.angles import check_angle, numbers_of
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ._drawing import COLOURS, DASHES, NO_DATA, SEQUENCE, label_gap, legend, write
from ._slices import VIEWS, Slice, one_number, slices_of, spans, units_of

DENSE = 45
"""Measured values of a slice from which on their points are small."""


class Curve(NamedTuple):
    """A slice, and how it is drawn."""

    slice: Slice
    colour: str
    dash: Any
    label: str


class Panel(NamedTuple):
    """Curves that are drawn together; what their colours tell apart, and what they have in common, in words."""

    curves: list[Curve]
    legend: str
    title: str
    unit: str


def of_one(m: Reflectance, thetas: Sequence[float] | None = None, turn: float = 0.0) -> Panel:
    """A panel of one material: a curve for each angle of incidence [degrees]."""
    slices = slices_of(m, thetas, turn)
    colours = [SEQUENCE[round(k * (len(SEQUENCE) - 1) / max(len(slices) - 1, 1))] for k in range(len(slices))]
    if len(slices) <= len(SEQUENCE):
        colours = list(SEQUENCE[: len(slices)])
    curves = [Curve(s, colour, "-", f"{s.theta:.3g}°") for s, colour in zip(slices, colours, strict=True)]
    return Panel(curves, "incidence θᵢ", "", one_number(m)[1])


def of_several(materials: Mapping[str, Reflectance], thetas: Iterable[float], turn: float = 0.0) -> list[Panel]:
    """A panel for each angle of incidence [degrees]: a curve for each material."""
    unit = units_of(materials.values())
    found = []
    for theta in thetas:
        curves = [
            Curve(slices_of(m, [theta], turn)[0], *line(k), name) for k, (name, m) in enumerate(materials.items())
        ]
        found.append(Panel(curves, "", f"θᵢ = {theta:.3g}°", unit))
    return found


def line(k: int) -> tuple[str, Any]:
    """The colour and the dashes of the k-th of several things."""
    return COLOURS[k % len(COLOURS)], DASHES[k % len(DASHES)]


def degrees_of(theta_i: Any) -> list[float] | None:
    """Polar angles of incidence [degrees] of those that a caller gave [rad]; None where none were given."""
    if theta_i is None:
        return None
    check_angle("theta_i", theta_i, 0.0, 0.5 * math.pi)
    given = np.atleast_1d(np.asarray(numbers_of("theta_i", theta_i), float))
    found: list[float] = np.degrees(given).round(9).ravel().tolist()
    if not 1 <= len(found) <= 60 or not np.isfinite(found).all():
        raise ParameterError(f"theta_i: {len(found)} angles, or NaN among them; expected 1 to 60 numbers [rad]")
    return found


def value_range(slices: Sequence[Slice]) -> tuple[float, float]:
    """Lowest and highest value worth showing on a logarithmic axis; (0, 0) if there is none."""
    values = np.concatenate([np.concatenate([s.f, s.measured]) for s in slices])
    values = values[(values > 0.0) & np.isfinite(values)]
    if not values.size:
        return 0.0, 0.0
    high = float(values.max())
    return max(float(values.min()), high * 1e-5), high


def _nothing(slices: Sequence[Slice]) -> str:
    """Why there is no curve."""
    known = any(np.isfinite(s.f).any() for s in slices)
    return "f = 0 away from\nthe mirror direction" if known else "no data in this plane"


def draw_polar(host: Any, panel: Panel, title: str = "", has_legend: bool = False) -> None:
    """Draw a half circle: on axes of Matplotlib in their middle, on polar ones in all of it."""
    curves, slices = panel.curves, [c.slice for c in panel.curves]
    low, high = value_range(slices)
    if host.name == "polar":
        axes = host
    else:
        host.set_axis_off()
        axes = host.inset_axes((0.07, -0.5, 0.86, 2.0), projection="polar")  # its box is a square, half of it empty
    axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90)
    axes.set_thetagrids(np.arange(-90, 91, 30), [f"{abs(a)}°" for a in range(-90, 91, 30)])
    host.set_title(title)
    if high == 0.0:
        axes.set_rticks([])
        write(axes, _nothing(slices))
        return
    bottom, top = math.floor(math.log10(low) - 0.3), math.log10(high) + 0.15
    for start, stop in spans(slices):
        width, middle = math.radians(stop - start), math.radians(0.5 * (start + stop))
        axes.bar(middle, top - bottom, width, bottom, **NO_DATA)
        if stop - start > 12.0:
            label_gap(axes, middle, 0.5 * (bottom + top))
    handles = []
    one_light = len({s.theta for s in slices}) == 1 and len(slices) > 1
    for s, colour, dash, _ in curves:
        shown = np.log10(np.maximum(s.f, 10.0**bottom))
        handles += axes.plot(np.radians(VIEWS), shown, color=colour, ls=dash, lw=1.6)
        seen = s.measured > 10.0**bottom
        if seen.any():
            axes.plot(np.radians(s.views[seen]), np.log10(s.measured[seen]), "o", color=colour, ms=point_size(s))
        tick = "black" if one_light else colour
        axes.plot([-math.radians(s.theta)] * 2, [top - 0.08 * (top - bottom), top], color=tick, lw=2.5)
    axes.set_rlim(bottom, top)
    decades = range(bottom + 1, math.floor(top) + 1)
    decades = decades[:: max(1, -(-len(decades) // 3))]  # more labels would touch in small figures
    radii: list[float] = list(decades)
    labels = [f"$10^{{{d}}}$" for d in decades]
    if not radii:  # all within one decade
        values = [x for x in (0.2, 0.5, 1.0, 2.0, 5.0) if bottom < math.log10(x) + bottom + 1.0 < top]
        radii = [math.log10(x) + bottom + 1.0 for x in values]
        labels = [f"{x * 10.0 ** (bottom + 1):g}" for x in values]
    axes.set_rgrids(radii, labels, angle=-90, fontsize="small")
    if has_legend:
        where: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.08), "ncols": min(len(curves), 3)}
        if host.name == "polar":
            where["bbox_to_anchor"] = (0.5, 0.18)
        legend(host, handles, [c.label for c in curves], title=panel.legend or None, **where)


def draw_cartesian(
    axes: Any, panel: Panel, has_legend: bool = True, across: bool = False, beside: Sequence[Slice] = ()
) -> bool:
    """Draw curves against the viewing angle, on a scale that holds slices beside them, too; whether there are bars."""
    slices = [c.slice for c in panel.curves]
    low, high = value_range([*slices, *beside])
    handles, has_bars = [], False
    one_light = len({s.theta for s in slices}) == 1 and len(slices) > 1
    for s, colour, dash, _ in panel.curves:
        handles += axes.plot(VIEWS, np.where(s.f > 0.0, s.f, np.nan), color=colour, ls=dash, lw=1.6)
        if not across:
            axes.axvline(s.theta, ymax=0.03, color="black" if one_light else colour, lw=2.0)
        if s.views.size:
            axes.plot(s.views, s.measured, "o", color=colour, ms=point_size(s))
        if s.u is not None:
            has_bars = True
            axes.errorbar(s.views, s.measured, 2.0 * s.u, fmt="none", ecolor=colour, elinewidth=1.0, capsize=1.5)
    for start, stop in spans(slices):
        axes.axvspan(start, stop, **NO_DATA)
        if stop - start > 4.0:
            label_gap(axes, 0.5 * (start + stop), 0.5, rotation=90, transform=axes.get_xaxis_transform())
    if high == 0.0:
        write(axes, _nothing(slices))
        axes.set_yticks([])
    elif high / low < 3.0:
        axes.set_ylim(0.0, 1.25 * high)
    else:
        axes.set(yscale="log", ylim=(0.7 * low, 2.0 * high))
    axes.set(xlim=(-90, 90), xticks=np.arange(-90, 91, 30))
    axes.set_ylabel(f"BRDF f [sr⁻¹]{', ' + panel.unit.partition(',')[0] if panel.unit else ''}")
    if has_legend:
        legend(axes, handles, [c.label for c in panel.curves], title=panel.legend or None)
    return has_bars


def points_in_words(slices: Sequence[Slice], has_bars: bool) -> str:
    """What points and bars mean, where there are any."""
    if not any(s.views.size for s in slices):
        return ""
    return "points: measured" + (", bars: ±2u" if has_bars else "")


def point_size(s: Slice) -> float:
    """The size of the points of a slice."""
    return 3.2 if len(np.unique(s.views.round(1))) <= DENSE else 1.4
