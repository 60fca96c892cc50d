"""Charts as SVG: axes, curves, points. Colours are classes of page.css, so that they follow the page's theme."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

WIDTH, HEIGHT = 460.0, 310.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 14.0, 14.0, 46.0
"""Margins about the field of a chart, for the numbers at its axes."""

EXACT = 0.12
"""Distance up to which points of a curve are left out, in units of which a chart is 460 wide."""

STEPS = (1.0, 2.0, 2.5, 5.0)
"""Steps of the numbers at an axis, times powers of ten."""


@dataclass(frozen=True)
class ChartAxis:
    """The range of an axis, its label, and the numbers at it.

    angle   whether its numbers are angles [degrees], which the page turns into radians
    """

    low: float
    high: float
    label: str = ""
    log: bool = False
    angle: bool = False
    ticks: Sequence[float] = ()

    def share(self, values: Any) -> np.ndarray:
        """Where values are between both ends, from 0 to 1; NaN stays."""
        with np.errstate(all="ignore"):
            if self.log:
                ends = math.log10(self.low), math.log10(self.high)
                return np.asarray((np.log10(values) - ends[0]) / (ends[1] - ends[0]))
            return np.asarray((np.asarray(values, float) - self.low) / (self.high - self.low))

    def numbers(self) -> list[float]:
        """The numbers at the axis."""
        if len(self.ticks):
            return list(self.ticks)
        if self.log:
            low, high = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            every = max(1, -(-(high - low + 1) // 6))
            decades = [10.0**k for k in range(low, high + 1, every)]
            if len(decades) >= 2:
                return decades
            fine = [s * 10.0**k for k in range(low - 1, high + 2) for s in (1.0, 2.0, 5.0)]
            return [x for x in fine if self.low <= x <= self.high]
        rough = (self.high - self.low) / 5.0
        power = 10.0 ** math.floor(math.log10(rough))
        step = next((s * power for s in STEPS if s * power >= rough * 0.999), 10.0 * power)
        first = math.ceil(self.low / step - 1e-9)
        return [k * step for k in range(first, math.floor(self.high / step + 1e-9) + 1)]


def fitting(values: Any, label: str, angle: bool = False) -> ChartAxis:
    """An axis of values above 0: logarithmic where they differ by more than three times, at most five decades."""
    positive = np.asarray(values, float)
    positive = positive[np.isfinite(positive) & (positive > 0.0)]
    if not positive.size:
        return ChartAxis(0.0, 1.0, label, angle=angle)
    high = float(positive.max())
    low = max(float(positive.min()), 1e-5 * high)
    if high < 3.0 * low:
        return ChartAxis(0.0, 1.25 * high, label, angle=angle)
    return ChartAxis(low / 1.3, high * 1.6, label, log=True, angle=angle)


def number(value: float) -> str:
    """A number at an axis."""
    if value == 0.0:
        return "0"
    size = abs(value)
    if 1e-3 <= size < 1e5:
        return f"{value:.6g}".replace("-", "−")
    mantissa, exponent = f"{value:.3g}".split("e") if "e" in f"{value:.3g}" else f"{value:.2e}".split("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    head = f"{float(mantissa):g}".replace("-", "−")
    return f"10{power}" if head == "1" else f"{head}·10{power}"


def angle_tick(degrees: float) -> str:
    """An angle as text that the page can turn into radians."""
    return f'<tspan data-deg="{degrees:g}">{number(degrees)}°</tspan>'


def label(text: str) -> str:
    """The label of an axis; [°] becomes a unit that the page can change."""
    return escape(text).replace("[°]", "[<tspan data-unit>°</tspan>]")


def simplified(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Which points of a curve are kept, so that no other is further from it than EXACT (Douglas & Peucker 1973)."""
    keep = np.zeros(len(x), bool)
    keep[[0, -1]] = True
    stack = [(0, len(x) - 1)]
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        dx, dy = x[b] - x[a], y[b] - y[a]
        length, u, v = math.hypot(dx, dy), x[a + 1 : b] - x[a], y[a + 1 : b] - y[a]
        off = np.abs(dx * v - dy * u) / length if length > EXACT else np.hypot(u, v)
        k = int(off.argmax())
        if off[k] > EXACT:
            keep[a + 1 + k] = True
            stack += [(a, a + 1 + k), (a + 1 + k, b)]
    return keep


def path(x: np.ndarray, y: np.ndarray) -> str:
    """The steps of a curve; it has gaps where a coordinate is NaN."""
    finite = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int))).reshape(-1, 2)
    parts = []
    for a, b in edges:
        kept = simplified(x[a:b], y[a:b]) if b - a > 2 else np.ones(b - a, bool)
        points = [f"{px:.1f} {py:.1f}" for px, py in zip(x[a:b][kept], y[a:b][kept], strict=True)]
        parts.append("M" + "L".join(points if len(points) > 1 else points * 2))
    return "".join(parts)


@dataclass
class Chart:
    """A field between two axes, and the curves in it."""

    x: ChartAxis
    y: ChartAxis
    title: str = ""
    width: float = WIDTH
    height: float = HEIGHT
    drawn: list[str] = field(default_factory=list)

    def at(self, x: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
        """Places in the picture of values."""
        across, down = self.width - LEFT - RIGHT, self.height - TOP - BOTTOM
        return LEFT + across * self.x.share(x), TOP + down * (1.0 - self.y.share(y))

    def line(self, x: Any, y: Any, css_class: str) -> None:
        """A curve; of values outside the field nothing is seen."""
        px, _ = self.at(x, y)
        across, down = self.width - LEFT - RIGHT, self.height - TOP - BOTTOM
        py = TOP + down * (1.0 - np.clip(self.y.share(y), -2.0, 3.0))
        x0, y0, down = LEFT, TOP - 2.0, down + 4.0
        box = f'x="{x0}" y="{y0}" width="{across}" height="{down}" viewBox="{x0} {y0} {across} {down}"'
        self.drawn.append(f'<svg class="clip" {box}><path class="line {css_class}" d="{path(px, py)}"/></svg>')

    def points(self, x: Any, y: Any, css_class: str, radius: float = 2.4, bars: Any = None) -> None:
        """Points, and bars of their uncertainty."""
        px, py = self.at(x, y)
        if bars is not None:
            _, above = self.at(x, np.asarray(y) + bars)
            _, below = self.at(x, np.maximum(np.asarray(y) - bars, self.y.low if self.y.log else -np.inf))
            steps = [
                f"M{a:.1f} {b:.1f}V{c:.1f}" for a, b, c in zip(px, above, below, strict=True) if np.isfinite(a + b + c)
            ]
            self.drawn.append(f'<path class="bar {css_class}" d="{"".join(steps)}"/>')
        inside = np.isfinite(px + py) & (py <= self.height - BOTTOM + 1.0) & (py >= TOP - 1.0)
        dots = [f"M{a:.1f} {b:.1f}h0" for a, b in zip(px[inside], py[inside], strict=True)]
        self.drawn.append(f'<path class="dots {css_class}" style="stroke-width:{2.0 * radius:g}" d="{"".join(dots)}"/>')

    def band(self, start: float, stop: float, text: str = "no data") -> None:
        """A range of the first axis without data."""
        (a, b), _ = self.at([start, stop], [self.y.high] * 2)
        down = self.height - TOP - BOTTOM
        self.drawn.append(f'<rect class="nodata" x="{a:.1f}" y="{TOP}" width="{b - a:.1f}" height="{down:.1f}"/>')
        if b - a > 16.0:
            middle = f"{0.5 * (a + b) + 4.0:.1f}", f"{TOP + 0.5 * down:.1f}"
            self.drawn.append(
                f'<text class="remark" text-anchor="middle" transform="translate({middle[0]} {middle[1]}) '
                f'rotate(-90)">{escape(text)}</text>'
            )

    def area(self, x: Any, low: Any, high: Any, css_class: str) -> None:
        """The field between two curves."""
        px, a = self.at(x, low)
        _, b = self.at(x, high)
        points = [*zip(px, a, strict=True), *zip(px[::-1], b[::-1], strict=True)]
        self.drawn.append(f'<path class="area {css_class}" d="M{"L".join(f"{u:.1f} {v:.1f}" for u, v in points)}Z"/>')

    def tick(self, x: float, css_class: str) -> None:
        """A mark at the lower axis."""
        (a,), _ = self.at([x], [self.y.high])
        foot = self.height - BOTTOM
        self.drawn.append(f'<path class="tick {css_class}" d="M{a:.1f} {foot:.1f}v-9"/>')

    def level(self, y: float) -> None:
        """A dashed level across the field."""
        _, (at,) = self.at([self.x.low], [y])
        self.drawn.append(f'<path class="level" d="M{LEFT} {at:.1f}H{self.width - RIGHT}"/>')

    def words(self, text: str) -> None:
        """Text in place of curves."""
        x, y = 0.5 * (LEFT + self.width - RIGHT), 0.5 * (TOP + self.height - BOTTOM)
        self.drawn.append(f'<text class="remark" text-anchor="middle" x="{x:.0f}" y="{y:.0f}">{escape(text)}</text>')

    def svg(self) -> str:
        """The chart."""
        return framed(self.title, self.width, self.height, self._axes() + "".join(self.drawn))

    def _axes(self) -> str:
        right, foot = self.width - RIGHT, self.height - BOTTOM
        parts = [f'<rect class="field" x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{foot - TOP}"/>']
        for value in self.x.numbers():
            (a,), _ = self.at([value], [self.y.high])
            parts.append(f'<path class="grid" d="M{a:.1f} {TOP}V{foot}"/>')
            parts.append(written(a, foot + 17, angle_tick(value) if self.x.angle else number(value)))
        for value in self.y.numbers():
            _, (b,) = self.at([self.x.low], [value])
            parts.append(f'<path class="grid" d="M{LEFT} {b:.1f}H{right}"/>')
            parts.append(written(LEFT - 6, b + 4, angle_tick(value) if self.y.angle else number(value), anchor="end"))
        return "".join(parts) + self.names(label(self.x.label), label(self.y.label))

    def names(self, across: str, up: str) -> str:
        """The labels of both axes, as SVG."""
        middle = 0.5 * (TOP + self.height - BOTTOM)
        below = written(0.5 * (LEFT + self.width - RIGHT), self.height - 8, across, "name")
        turn = f'transform="translate(14 {middle:.1f}) rotate(-90)"'
        return f'{below}<text class="name" text-anchor="middle" {turn}>{up}</text>'


def written(x: float, y: float, text: str, kind: str = "num", anchor: str = "middle") -> str:
    """Text (SVG) at a place."""
    return f'<text class="{kind}" text-anchor="{anchor}" x="{x:.1f}" y="{y:.1f}">{text}</text>'


def framed(title: str, width: float, height: float, inner: str) -> str:
    """A drawing with its title for those who hear the page."""
    return (
        f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(title)}" '
        f'xmlns="http://www.w3.org/2000/svg">{inner}</svg>'
    )


def legend(entries: Sequence[tuple[str, str]], title: str = "") -> str:
    """What curves mean: (class, HTML)."""
    items = "".join(
        f'<li><svg viewBox="0 0 26 10" aria-hidden="true"><path class="line {css_class}" d="M1 5H25"/></svg>{text}</li>'
        for css_class, text in entries
    )
    head = f"<li class='of'>{title}</li>" if title else ""
    return f'<ul class="legend">{head}{items}</ul>'


def figure(drawing: str, caption: str, below: str = "") -> str:
    """A drawing with its caption, as HTML, and its legend."""
    return f'<figure class="chart">{drawing}{below}<figcaption>{caption}</figcaption></figure>'


def gaps(views: np.ndarray, curves: Sequence[np.ndarray], least: float) -> list[tuple[float, float]]:
    """Ranges of an axis, wider than `least`, in which no curve has a value."""
    missing = np.all([~np.isfinite(f) for f in curves], axis=0)
    if missing.all():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(int))).reshape(-1, 2)
    ends = [(float(views[max(a - 1, 0)]), float(views[min(b, len(views) - 1)])) for a, b in edges]
    return [(a, b) for a, b in ends if b - a > least]
