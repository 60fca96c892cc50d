"""A picture of the whole sphere: which pixel lies where, radiance between pixels, and sampling.

The picture is equirectangular, as photographed: theta = 0 at its upper edge, phi = 0 at its left edge, falling to the
right, as seen from inside. The pixel in row i and column j of H by W covers theta from pi i/H to pi (i + 1)/H and phi
from -2 pi j/W to -2 pi (j + 1)/W, and holds the radiance at the centre of that. For other tools' pictures see
`_layouts.py`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import AsStored, Fixed, frozen, ops
from ..errors import ArrayTypeError, ParameterError, ShapeError, TooLargeError
from ..formula.direction import Direction, on_circle, polar_angle

MOST = 1 << 27
"""Most pixels of a file that is read as an environment map: 16384 x 8192."""

LARGE = 1 << 20
"""Pixels from which on the tables of a map are not converted to double precision as a whole."""

_BLOCK = 1 << 18  # pixels that are worked on at a time


def pixel_directions(height: int, width: int, rows: slice = slice(None)) -> NDArray[np.float64]:
    """Unit directions (H, W, 3) of the pixel centres, of all rows or of some."""
    theta = (np.arange(height)[rows, None] + 0.5) * (math.pi / height)
    phi = (np.arange(width) + 0.5) * (-2.0 * math.pi / width)
    sin = np.sin(theta)
    return np.stack(np.broadcast_arrays(sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)), -1)


def pixel_count(name: str, value: Any) -> int:
    """A number of rows or columns, or a ParameterError."""
    if not (isinstance(value, (int, np.integer)) and 1 <= value <= 1 << 15):
        raise ParameterError(f"{name}={value!r}: expected a whole number from 1 to {1 << 15}")
    return int(value)


@dataclass(frozen=True, eq=False, repr=False)
class Panorama:
    """A picture of the sphere: pixels (H, W, C), read-only, float32 or float64, and the file of origin."""

    pixels: NDArray[Any]
    path: str | None = None

    def __post_init__(self) -> None:
        frozen(self.pixels)

    @classmethod
    def of(cls, value: Any) -> Panorama:
        """A panorama from an array (H, W, C) or (H, W), an Image, or the path of a picture.

        Raises what `load_image` raises for a picture of at most `MOST` pixels; pixels read here are not copied.
        """
        if isinstance(value, Panorama):
            return value
        from ..pictures.image import Image, load_image

        if isinstance(value, (str, os.PathLike)):
            return cls(load_image(value, MOST).light, os.fspath(value))
        if isinstance(value, Image):
            value = value.light
        if not isinstance(value, (list, tuple, np.ndarray)):
            raise ParameterError(
                f"environment map: got a {type(value).__name__}; expected a NumPy array (H, W, C) or (H, W), "
                f"an Image, or the path of an equirectangular picture"
            )
        try:
            array = np.array(ops.plain(value), order="C")
        except MemoryError:
            raise TooLargeError(f"environment map: no memory for pixels of shape {np.shape(value)}") from None
        except (TypeError, ValueError, OverflowError) as error:
            kind = "lists" if isinstance(value, (list, tuple)) else "arrays"
            raise ParameterError(f"environment map: got {kind} that are not (H, W, C) numbers: {error}") from None
        if array.dtype not in (np.float32, np.float64):
            raise ArrayTypeError(
                f"environment map: pixels are {array.dtype}, expected float32 or float64 radiances; "
                f"8-bit codes: gonio.pictures.colour.srgb_decode(x / 255)"
            )
        if array.ndim not in (2, 3) or 0 in array.shape:
            raise ShapeError(f"environment map: pixels are {array.shape}, expected (H, W, C) or (H, W)")
        return cls(array if array.ndim == 3 else array[..., None])

    def checked(self, replace_invalid: bool) -> Panorama:
        """This, if every value is a radiance; else one with 0 for those that are none, or an error."""
        if self.pixels.min() >= 0.0 and self.pixels.max() < np.inf:  # false of NaN
            return self
        if replace_invalid:
            pixels = self.pixels.copy()
            for block in self._blocks():
                pixels[block][~_good(pixels[block])] = 0.0
            return Panorama(pixels, self.path)
        bad = np.concatenate([~_good(self.pixels[block]).all(axis=-1) for block in self._blocks()])
        row, column = divmod(int(bad.argmax()), bad.shape[1])
        values = ", ".join(f"{v:g}" for v in self.pixels[row, column])
        raise ParameterError(
            f"{self.path or 'environment map'}: {bad.sum()} of {bad.size} pixels are negative, NaN or "
            f"infinite, the first in row {row}, column {column}: ({values}); expected radiances from 0 up; "
            f"repair the picture, or pass invalid='zero' to count such values as 0"
        )

    def _blocks(self) -> Iterator[slice]:
        """Some rows at a time."""
        height, width, _ = self.pixels.shape
        step = max(1, _BLOCK // width)
        return (slice(start, min(start + step, height)) for start in range(0, height, step))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Panorama) and (
            self.pixels is other.pixels or np.array_equal(self.pixels, other.pixels)
        )

    def __hash__(self) -> int:
        return hash(self.pixels.shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return Panorama, (self.pixels, self.path)

    def __repr__(self) -> str:
        height, width, channels = self.pixels.shape
        origin = "" if self.path is None else f", {self.path!r}"
        return f"<{width} x {height}, {channels} channel{'s' * (channels > 1)}{origin}>"

    def _shares(self, rows: slice) -> NDArray[np.float64]:
        """What the probabilities (rows, W) of pixels are proportional to within their row: mean plus maximum of the
        interpolated radiance within the pixel.

        So a black pixel with bright neighbours has its share. With the mean alone, radiance over density would reach
        9 times its average beside the sun of `studio`, where it is 1.5 now (fireflies); with the maximum alone, it
        would have twice the variance.
        """
        height = len(self.pixels)
        near = np.clip(np.arange(rows.start - 1, rows.stop + 1), 0, height - 1)
        tall = self.pixels[near].mean(axis=-1, dtype=np.float64)
        edges, centre = 0.5 * (tall[:-1] + tall[1:]), tall[1:-1]
        mean = largest = np.zeros_like(centre)
        for part, level in ((0.25, edges[:-1]), (0.5, centre), (0.25, edges[1:])):
            left = 0.5 * (level + np.roll(level, 1, axis=1))
            right = np.roll(left, -1, axis=1)
            mean = mean + part * (0.25 * left + 0.5 * level + 0.25 * right)
            largest = np.maximum.reduce([largest, left, level, right])
        return mean + largest

    def looked_up(self) -> dict[str, Fixed]:
        """The tables of `Lookup` by name: the pixels, and those of sampling, which are made when first needed."""
        kind = AsStored if self.pixels[..., 0].size > LARGE else Fixed
        flat = cache(self.tables)
        kinds = {"column": kind, "column_share": kind}
        sampling = {name: kinds.get(name, Fixed)(partial(lambda k: flat()[k], k)) for k, name in enumerate(TABLES)}
        return {"pixels": kind(self.pixels.reshape(-1)), **sampling}

    def tables(self) -> list[NDArray[Any]]:
        """What sampling looks up, flat, in the order of `TABLES`; those of all pixels in the precision of the pixels.

        column, row: sums of the shares of all columns before within their row, and of all rows before. column_share,
        row_share: probabilities of a column within its row, and of a row. row_density: density [1/sr] of a pixel over
        its column_share. down, up: 1 - cos theta and 1 + cos theta at the edges of the rows. level: pi times the mean
        radiance over the sphere and the channels.
        """
        height, width, _ = self.pixels.shape
        totals = np.empty(height)
        columns, within = (np.empty((height, n), self.pixels.dtype) for n in (power_of_two(width), width))
        for rows in self._blocks():
            share = self._shares(rows)
            total = totals[rows] = share.sum(axis=1)
            share[total == 0.0] = 1.0
            share /= share.sum(axis=1, keepdims=True)
            within[rows] = share
            share[within[rows] == 0.0] = 0.0  # rounded to nothing: not to be found
            columns[rows] = _starts(share)
        theta = (np.arange(height) + 0.5) * (math.pi / height)
        solid_angle = 4.0 * math.pi / width * math.sin(0.5 * math.pi / height) * np.sin(theta)
        share = (totals if totals.any() else np.ones(height)) * solid_angle
        share /= share.sum()
        half = np.linspace(0.0, 0.5 * math.pi, height + 1)
        means = self.pixels.mean(axis=(1, 2), dtype=np.float64)
        level = 0.25 * width * (means * solid_angle).sum()
        small = (_starts(share), share, share / solid_angle, 2.0 * np.sin(half) ** 2, 2.0 * np.sin(half[::-1]) ** 2)
        return [columns.reshape(-1), within.reshape(-1), *small, np.array([level])]


TABLES = ("column", "column_share", "row", "row_share", "row_density", "down", "up", "level")


class Lookup(NamedTuple):
    """The formulas of a panorama of (H, W, C) pixels on components, and the tables that they look up."""

    shape: tuple[int, int, int]
    pixels: Any
    column: Any
    column_share: Any
    row: Any
    row_share: Any
    row_density: Any
    down: Any
    up: Any

    def radiance(self, w: Direction, channel: Any) -> Any:
        """Bilinear interpolation of a channel at a direction."""
        height, width, channels = self.shape
        x, y = self._position(w)
        x = x - 0.5
        y = ops.clip(y - 0.5, 0.0, height - 1.0)
        x0, y0 = ops.floor(x), ops.floor(y)
        fx, fy = x - x0, y - y0
        left = ops.where(x0 < 0.0, x0 + float(width), x0)
        right = ops.where(left + 1.0 < width, left + 1.0, 0.0)
        left, right = ops.to_index(left), ops.to_index(right)
        # Rows are scaled as whole numbers: the products would not be exact in float32.
        upper, lower = ops.to_index(y0) * width, ops.to_index(ops.minimum(y0 + 1.0, height - 1.0)) * width
        offset = ops.to_index(channel) if channels > 1 else 0
        corners = [(row + column) * channels + offset for row in (upper, lower) for column in (left, right)]
        a, b, c, d = (ops.take(self.pixels, corner) for corner in corners)
        a, c = a + fx * (b - a), c + fx * (d - c)
        return a + fy * (c - a)

    def _position(self, w: Direction) -> tuple[Any, Any]:
        """Where w lies in the picture, in pixels from its upper left corner.

        x is from -W/2 to W/2: where it is negative, it is counted from the right edge.
        """
        height, width, _ = self.shape
        pole = (w.x == 0.0) & (w.y == 0.0)  # where the azimuth has no derivative
        phi = ops.arctan2(-w.y, ops.where(pole, 1.0 + 0.0 * w.x, w.x))
        return phi * (0.5 * width / math.pi), polar_angle(w) * (height / math.pi)

    def drawn(self, u0: Any, u1: Any) -> tuple[Direction, Any]:
        """A direction and its density [1/sr]: u1 chooses the row and the height in it, u0 column and azimuth."""
        height, width, _ = self.shape
        row, start = _last_at_most(self.row, ops.to_index(0.0 * u1), power_of_two(height), u1)
        t = (u1 - start) / ops.take(self.row_share, row)
        count = power_of_two(width)
        entry, start = _last_at_most(self.column, row * count, count, u0)
        column = entry - row * count
        share = ops.take(self.column_share, row * width + column)
        s = (u0 - start) / share
        # Uniform in cos theta between the edges of the row; from both poles, to keep its digits at either.
        t = ops.clip(t, 0.0, 1.0)
        down, up = ((1.0 - t) * ops.take(edge, row) + t * ops.take(edge, row + 1) for edge in (self.down, self.up))
        sin = ops.sqrt(ops.maximum(down * up, 0.0))
        w = on_circle(sin, (ops.clip(s, 0.0, 1.0) + column) * (-1.0 / width), 0.5 * (up - down))
        return w, share * ops.take(self.row_density, row)

    def density(self, w: Direction) -> Any:
        """The density [1/sr] of `drawn` at a direction."""
        height, width, _ = self.shape
        x, y = self._position(w)
        column = ops.floor(ops.where(x < 0.0, x + float(width), x))
        row = ops.to_index(ops.floor(ops.clip(y, 0.0, height - 1.0)))
        # x + width rounds up to the right edge where x is a tiny negative number.
        pixel = row * width + ops.to_index(ops.minimum(column, width - 1.0))
        return ops.take(self.column_share, pixel) * ops.take(self.row_density, row)


def _last_at_most(table: Any, first: Any, count: int, x: Any) -> tuple[Any, Any]:
    """Index of the last of `count` (a power of two) rising entries from `first` on that is at most x, and the entry."""
    last, reached = first, ops.take(table, first)
    while count := count // 2:
        entry = ops.take(table, last + count)
        below = entry <= x
        last, reached = ops.where(below, last + count, last), ops.where(below, entry, reached)
    return last, reached


def _good(pixels: NDArray[Any]) -> NDArray[np.bool_]:
    return np.isfinite(pixels) & (pixels >= 0.0)


def power_of_two(n: int) -> int:
    """The smallest power of two that is not below n."""
    return 1 << (n - 1).bit_length()


def _starts(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums of the shares before each, along the last axis, which grows to a power of two.

    Infinite where only zeros follow: a search for the last one that is at most u never ends on a share of 0.
    """
    n = share.shape[-1]
    start = np.full((*share.shape[:-1], power_of_two(n)), np.inf)
    start[..., 0] = 0.0
    np.cumsum(share[..., :-1], axis=-1, out=start[..., 1:n])
    rest = np.cumsum(share[..., ::-1], axis=-1)[..., ::-1]
    start[..., :n][rest == 0.0] = np.inf
    return start
