"""Rays over a periodic height field: from cell to cell, and over whole blocks that a ray cannot meet."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Fixed, ops
from ..formula.direction import Direction, normalize
from ..surfaces.height_field import HeightField

NEAR, FAR = 4, 16
"""Cells along blocks whose highest corners are known, and of the nearer ones the steepest slopes too."""

SECTORS = 8
"""Sectors of directions, from 0 to 45 degrees and so on, for each of which the steepest slopes are known."""

GRADES = 256
"""Heights and slopes of blocks are rounded up to so many grades: three of them are one number, read at once."""

MOST_STEPS = 20_000
"""Steps after which a ray counts as lost: along the surface between heights that no light leaves."""

SLOW = 1e-9
"""Least part of a direction along x and y: of rays along the normal a step is as long as a number can be."""

FURTHER, AT_LEAST = 1.0 + 4e-7, 1e-6
"""A way ends so much beyond the end of a cell, as a factor and as a length: more than rounding takes back."""


class RayPlace(NamedTuple):
    """Where a ray is: a cell by its column and row, the place in it in [0, 1], and the height."""

    column: Any
    row: Any
    u: Any
    v: Any
    z: Any


def tables(surface: HeightField) -> dict[str, Any]:
    """What a scene holds of a surface: heights, bounds of blocks, and the numbers to find them by.

    Heights are in units of the cells' mean length, and so are the other numbers. A block that is not whole where the
    surface ends goes on in its next period.
    """
    scale = 1.0 / np.sqrt(surface.cell[0] * surface.cell[1])
    heights = (surface.heights * np.float32(scale)).astype(np.float32)
    rows, columns = heights.shape
    corners = np.pad(heights, ((0, 1), (0, 1)), "wrap")  # no cell's corners wrap, and two of them are neighbours
    wide = np.pad(heights, [(0, 1 + -n % FAR) for n in heights.shape], "wrap")
    cells = np.maximum.reduce([wide[:-1, :-1], wide[:-1, 1:], wide[1:, :-1], wide[1:, 1:]])
    summits = _most(cells, NEAR)
    around = np.repeat(np.repeat(_most(summits, FAR // NEAR), FAR // NEAR, axis=0), FAR // NEAR, axis=1)
    (summit, summit_around), low, high_step = _graded(np.stack([summits, around]))
    slope, gentle, slope_step = _graded(_steepest(wide, scale * surface.cell[0], scale * surface.cell[1]))
    return {
        "heights": Fixed(corners.reshape(-1)),
        "blocks": Fixed(((slope * GRADES + summit) * GRADES + summit_around).reshape(-1)),
        "across": float(summits.shape[1]),
        "count": float(summits.size),
        "low": low,
        "high_step": high_step,
        "gentle": gentle,
        "slope_step": slope_step,
        "steepest": gentle + slope_step * (GRADES - 1),
        "columns": float(columns),
        "rows": float(rows),
        "middle": float(rows // 2),
        "steps": float(MOST_STEPS),
        "highest": float(heights.max()),
        "per_x": 1.0 / (scale * surface.cell[0]),
        "per_y": 1.0 / (scale * surface.cell[1]),
    }


def _graded(values: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Grades of values, the value of grade 0, and the step between grades: rounded up, by more than rounding takes."""
    lowest = float(values.min())
    step = 1.00001 * max(float(values.max()) - lowest, 1e-4) / (GRADES - 1)
    return np.ceil((values - np.float32(lowest)) * np.float32(1.0 / step) + np.float32(1e-3)), lowest, step


def _most(values: np.ndarray, size: int, extreme: np.ufunc = np.maximum) -> np.ndarray:
    """The largest values of blocks."""
    rows = extreme.reduce([values[k::size] for k in range(size)])
    largest: np.ndarray = extreme.reduce([rows[:, k::size] for k in range(size)])
    return largest


def _steepest(corners: np.ndarray, length_x: float, length_y: float) -> np.ndarray:
    """Of the nearer blocks, for each sector, no less than the slope of any triangle along any direction of it.

    Slopes along the two directions on either side of a sector are known. Between them, 2 a apart, a triangle that rises
    is no steeper than the larger one over cos(a).
    """
    along, across = np.diff(corners, axis=1) / np.float32(length_x), np.diff(corners, axis=0) / np.float32(length_y)
    rising, falling = [], []
    for angle in 2.0 * math.pi / SECTORS * np.arange(SECTORS // 2):
        x, y = np.float32(math.cos(angle)) * along, np.float32(math.sin(angle)) * across
        right, left = x[:-1] + y[:, 1:], x[1:] + y[:, :-1]
        rising.append(_most(np.maximum(right, left), NEAR))
        falling.append(-_most(np.minimum(right, left), NEAR, np.minimum))
    sides = np.stack(rising + falling)
    highest = np.maximum(sides, np.roll(sides, -1, 0))
    return np.maximum(highest, highest * np.float32(1.0 / math.cos(math.pi / SECTORS)))


class _Along(NamedTuple):
    """A ray along one axis: where it starts in a cell, cells per unit of length, and the side where it leaves cells."""

    cell: Any
    start: Any
    rate: Any
    inverse: Any
    forward: Any
    count: Any
    per_count: Any

    @classmethod
    def of(cls, cell: Any, start: Any, rate: Any, count: Any) -> _Along:
        forward = ops.where(rate > -SLOW, 1.0, 0.0)
        inverse = (2.0 * forward - 1.0) / ops.maximum(ops.absolute(rate), SLOW)
        return cls(cell, start, rate, inverse, forward, count, 1.0 / count)

    def at(self, t: Any) -> tuple[Any, Any]:
        """The cell, and the place in it in [0, 1)."""
        place = self.start + t * self.rate
        whole = ops.floor(place)
        cell = self.cell + whole
        return cell - self.count * ops.floor((cell + 0.5) * self.per_count), place - whole

    def way(self, local: Any, width: float) -> Any:
        """The way to the end of a stretch of this width."""
        return (self.forward * width - local) * self.inverse


def march(field: Any, place: RayPlace, w: Direction) -> tuple[RayPlace, Any, Any, Any]:
    """Where a ray from a place along w is next on the surface, on which side of the diagonal (1 right, 0 left), whether
    it is there, and whether it has left. After `field.steps` steps it may be on its way still, and neither.

    A block is passed at once where the ray is above its highest corner at both ends, or where it is so far above the
    surface that its steepest slope along the ray does not reach it. The height above the surface is computed at the
    start of each cell, not carried along.
    """
    x = _Along.of(place.column, place.u, w.x * field.per_x, field.columns)
    y = _Along.of(place.row, place.v, w.y * field.per_y, field.rows)
    rise, level = w.z, ops.sqrt(w.x * w.x + w.y * w.y)
    sector = ops.floor(ops.arctan2(w.y, w.x) * (0.5 * SECTORS / math.pi))
    sector = ops.where(sector < 0.0, sector + float(SECTORS), ops.minimum(sector, SECTORS - 1.0))
    free, sinking = rise > level * field.steepest, ops.minimum(rise, 0.0)
    turning = x.rate - y.rate
    per_turning = 1.0 / ops.maximum(ops.absolute(turning), SLOW)

    def step(t: Any, fall: Any, right: Any, fate: Any, steps: Any) -> tuple[Any, ...]:
        (column, u), (row, v), z = x.at(t), y.at(t), place.z + t * rise
        # Within a cell the surface is h + a u + b v + c |u - v|.
        h, a, b, c = _bent(field, column, row)
        near = _less(x.way(u, 1.0), y.way(v, 1.0))
        apart = u - v
        apart_end = apart + near * turning
        rate = rise - a * x.rate - b * y.rate
        above = z - h - a * u - b * v - c * ops.absolute(apart)
        above_end = above + near * rate - c * (ops.absolute(apart_end) - ops.absolute(apart))
        crosses = apart * apart_end < 0.0
        middle = ops.where(crosses, ops.absolute(apart) * per_turning, 0.0)
        above_middle = ops.where(crosses, above + middle * rate + c * ops.absolute(apart), above)

        block = _block(field, sector, column, row)
        way_near = _less(x.way(column - NEAR * block.across + u, NEAR), y.way(row - NEAR * block.down + v, NEAR))
        across, down = ops.floor(column * (1.0 / FAR)), ops.floor(row * (1.0 / FAR))
        way_far = _less(x.way(column - FAR * across + u, FAR), y.way(row - FAR * down + v, FAR))
        clear_far = z + way_far * sinking > block.summit_around
        clear_near = (z + way_near * sinking > block.summit) | (
            above + way_near * (rise - level * block.steepest) > 0.0
        )
        over = clear_near | clear_far
        way = ops.where(clear_far, way_far, ops.where(clear_near, way_near, near))

        before = (above_middle < 0.0) & (above_middle < above)
        meets = (before | ((above_end < 0.0) & (above_end < above_middle))) & ~over
        start, high, low = (
            ops.where(before, p, q) for p, q in ((0.0, middle), (above, above_middle), (above_middle, above_end))
        )
        length = ops.where(before, middle, near - middle)
        part = ops.clip(high / ops.where(meets, high - low, 1.0), 0.0, 1.0)
        fall = ops.where(meets, start + part * length, 0.0)
        right = ops.where(ops.where(before, apart, apart_end) >= 0.0, 1.0, 0.0)
        t = ops.where(meets, t, (t + way) * FURTHER + AT_LEAST)
        gone = ~meets & (rise > 0.0) & (free | (place.z + t * rise >= field.highest))
        steps = steps + 1.0
        fate = ops.where(meets, 1.0, ops.where(gone, -1.0, 0.0))
        return ~(meets | gone) & (steps < field.steps), t, fall, right, fate, steps

    none = 0.0 * w.z
    t, fall, right, fate, _ = ops.loop(step, none, none, none, none, none)
    (column, u), (row, v) = x.at(t), y.at(t)
    u, v = ops.clip(u + fall * x.rate, 0.0, 1.0), ops.clip(v + fall * y.rate, 0.0, 1.0)
    return RayPlace(column, row, u, v, place.z + (t + fall) * rise), right, fate > 0.0, fate < 0.0


def _corners(field: Any, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
    """Heights of a cell's corners (0, 0), (1, 0), (0, 1), (1, 1)."""
    stride = field.columns + 1.0
    # Counted from the middle row: numbers of cells are exact as floats.
    start = ops.to_index((row - field.middle) * stride + column) + ops.to_index(field.middle) * ops.to_index(stride)
    above = start + ops.to_index(stride)
    low, high = ((ops.take(field.heights, i), ops.take(field.heights, i + 1)) for i in (start, above))
    return *low, *high


def _bent(field: Any, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
    """The surface in a cell, h + a u + b v + c |u - v|: two triangles that meet along the diagonal."""
    h00, h10, h01, h11 = _corners(field, column, row)
    low, high = h10 - h00, h11 - h01
    return h00, 0.5 * (low + high), 0.5 * ((h01 - h00) + (h11 - h10)), 0.5 * (low - high)


class _CellBlock(NamedTuple):
    """The nearer block that a cell is in: its column and row, its steepest slope in a sector, its highest corner, and
    that of the farther block around it."""

    across: Any
    down: Any
    steepest: Any
    summit: Any
    summit_around: Any


def _block(field: Any, sector: Any, column: Any, row: Any) -> _CellBlock:
    across, down = ops.floor(column * (1.0 / NEAR)), ops.floor(row * (1.0 / NEAR))
    grades = ops.take(field.blocks, ops.to_index(sector * field.count + down * field.across + across))
    slope = ops.floor(grades * (1.0 / GRADES**2))
    heights = grades - slope * GRADES**2
    summit = ops.floor(heights * (1.0 / GRADES))
    levels = (field.low + field.high_step * grade for grade in (summit, heights - summit * GRADES))
    return _CellBlock(across, down, field.gentle + field.slope_step * slope, *levels)


def _less(a: Any, b: Any) -> Any:
    """The smaller one of two numbers that are not NaN."""
    return ops.where(a < b, a, b)


def facet(field: Any, place: RayPlace, right: Any) -> tuple[Direction, RayPlace]:
    """The normal of the triangle that a place is on, and the place with the triangle's own height."""
    h00, h10, h01, h11 = _corners(field, place.column, place.row)
    on_right = right > 0.5
    x, y = ops.where(on_right, h10 - h00, h11 - h01), ops.where(on_right, h11 - h10, h01 - h00)
    z = h00 + x * place.u + y * place.v
    return normalize(Direction(-x * field.per_x, -y * field.per_y, 1.0 + 0.0 * x)), place._replace(z=z)
