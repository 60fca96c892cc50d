"""f against the viewing angle in a half circle, or a whole one where light passes, as SVG."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from html import escape
from typing import Any, ClassVar

import numpy as np

from .chart import ChartAxis, angle_tick, framed, number, path, written


@dataclass
class Polar:
    """A half circle of viewing angles, or a whole one where light passes, with a logarithmic radius."""

    low: float
    high: float
    title: str
    through: bool = False
    drawn: list[str] = field(default_factory=list)

    RADIUS: ClassVar[float] = 192.0
    MIDDLE: ClassVar[float] = 230.0

    @property
    def foot(self) -> float:
        """The height of the surface in the picture."""
        return 18.0 + self.RADIUS

    def radius(self, f: Any) -> np.ndarray:
        """Radii of values."""
        with np.errstate(all="ignore"):
            share = (np.log10(np.asarray(f, float)) - self.low) / (self.high - self.low)
        return self.RADIUS * np.clip(np.nan_to_num(share, nan=np.nan, neginf=0.0), 0.0, 1.02)

    def line(self, views: Any, f: Any, css_class: str, through: bool = False) -> None:
        """A curve."""
        r, t = self.radius(f), np.radians(views)
        down = -1.0 if through else 1.0
        d = path(self.MIDDLE + r * np.sin(t), self.foot - down * r * np.cos(t))
        self.drawn.append(f'<path class="line {css_class}" d="{d}"/>')

    def points(self, views: Any, f: Any, css_class: str, radius: float) -> None:
        """Points."""
        r, t = self.radius(f), np.radians(views)
        x, y = self.MIDDLE + r * np.sin(t), self.foot - r * np.cos(t)
        dots = [f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y, strict=True) if np.isfinite(a + b)]
        self.drawn.append(f'<path class="dots {css_class}" style="stroke-width:{2.0 * radius:g}" d="{"".join(dots)}"/>')

    def tick(self, theta: float, css_class: str) -> None:
        """A mark where the light comes from."""
        s, c = math.sin(math.radians(-theta)), math.cos(math.radians(theta))
        ends = [(self.MIDDLE + r * s, self.foot - r * c) for r in (self.RADIUS - 12.0, self.RADIUS + 2.0)]
        self.drawn.append(
            f'<path class="tick {css_class}" d="M{ends[0][0]:.1f} {ends[0][1]:.1f}L{ends[1][0]:.1f} {ends[1][1]:.1f}"/>'
        )

    def band(self, start: float, stop: float) -> None:
        """A range of angles without data."""
        a, b = (math.radians(x) for x in (start, stop))
        x, y, r = self.MIDDLE, self.foot, self.RADIUS
        self.drawn.insert(
            0,
            f'<path class="nodata" d="M{x} {y}L{x + r * math.sin(a):.1f} {y - r * math.cos(a):.1f}A{r} {r} 0 0 1 '
            f'{x + r * math.sin(b):.1f} {y - r * math.cos(b):.1f}Z"/>',
        )

    def words(self, text: str) -> None:
        """Text in place of curves."""
        self.drawn.append(
            f'<text class="remark" text-anchor="middle" x="{self.MIDDLE}" y="{self.foot - 60}">{escape(text)}</text>'
        )

    def svg(self) -> str:
        """The half circle."""
        height = self.foot + (self.RADIUS + 18.0 if self.through else 26.0)
        return framed(self.title, 2.0 * self.MIDDLE, height, self._rings() + "".join(self.drawn))

    def _rings(self) -> str:
        x, y, parts = self.MIDDLE, self.foot, []
        decades = list(range(math.ceil(self.low + 1e-6), math.floor(self.high + 1e-6) + 1))
        numbers = [10.0**d for d in decades[:: max(1, -(-len(decades) // 4))]]
        if len(numbers) < 2:
            numbers = ChartAxis(10.0**self.low, 10.0**self.high, log=True).numbers()
        numbers = [v for v in numbers if math.log10(v) > self.low + 0.08 * (self.high - self.low)]
        for r, css_class in [*((float(self.radius(v)), "grid") for v in numbers), (self.RADIUS, "rim")]:
            parts.append(_arc(x, y, r, css_class, whole=self.through))
        for theta in range(-90, 91, 30):
            s, c = math.sin(math.radians(theta)), math.cos(math.radians(theta))
            for down in (1.0, -1.0) if self.through else (1.0,):
                parts.append(
                    f'<path class="grid" d="M{x} {y}L{x + self.RADIUS * s:.1f} {y - down * self.RADIUS * c:.1f}"/>'
                )
            anchor = "middle" if theta == 0 else "end" if theta < 0 else "start"
            r = self.RADIUS + 6
            lower = 0 if abs(theta) < 90 else 4
            parts.append(written(x + r * s, y - r * c + lower, angle_tick(abs(theta)), anchor=anchor))
        parts += [written(x + float(self.radius(v)), y + 15, number(v), "num small") for v in numbers]
        return "".join(parts)


def _arc(x: float, y: float, r: float, css_class: str, whole: bool) -> str:
    lower = f"A{r:.1f} {r:.1f} 0 0 1 {x - r:.1f} {y}" if whole else ""
    return f'<path class="{css_class}" d="M{x - r:.1f} {y}A{r:.1f} {r:.1f} 0 0 1 {x + r:.1f} {y}{lower}"/>'
