"""BSDFs that are constant in cells of two hemispheres: common to Klems' matrices and tensor trees.

Directions are drawn from tables of cells of equal or known projected solid angle, constant within a cell.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...arrays import Fixed, ops
from ...base.measured import Measured
from ...errors import ParameterError
from ...formula.direction import Direction
from ...formula.fields import channels
from ...formula.state import note, state

if TYPE_CHECKING:
    from .xml_document import Document

MIRRORED = {"front": -1.0, "back": 1.0}
"""x of a file over x of gonio, by side: the sample is turned about its y axis to see its front."""

DIRECTIONS = {
    "front": "Reflection Front",
    "back": "Reflection Back",
    "forward": "Transmission Front",
    "backward": "Transmission Back",
}
"""How files call the quarters of a `Sheet`; forward is that of light on the front."""

VIEWED = {"front": "front", "back": "back", "forward": "back", "backward": "front"}
"""The side that each quarter is seen from."""

COSINE_SHARE = 0.1  # share of the samples that is cosine-distributed: weights are at most 10 pi f


class Cellwise(Measured):
    """Base of the BSDFs in WINDOW's XML: `values` of cells as in the file, seen from one side of the sample."""

    format = "WINDOW XML"
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "values are kept as they are in the file",
        "energy": "values are kept as they are in the file",
    }

    channel = channels("number of the channel")

    values: np.ndarray
    side: str = state()
    """The side it is seen from, "front" or "back", in WINDOW's words; of a transmission light is on the other."""
    document: Document | None = note()
    """The file around the numbers."""
    chosen: tuple[tuple[int, ...], tuple[Any, ...]] = note(((), ()))
    """Which of its blocks are these numbers; and the numbers of those that were not read."""
    quarter: str = note("")
    """The part of a `Sheet` that it was read as."""
    densities: Any  # tables of formulas, of bound materials only
    sums: Any
    reflected: Any

    def __init__(self, side: str, **fields: Any):
        self._hold(side=side)
        super().__init__(**fields)

    def validate(self) -> None:
        if self.side not in MIRRORED:
            raise ParameterError(f"{type(self).__name__}(side={self.side!r}): expected 'front' or 'back'")

    @property
    def valid(self) -> np.ndarray:
        return np.isfinite(self.values)


def sampling(weights: Callable[[], np.ndarray], solid: np.ndarray) -> dict[str, Fixed]:
    """Tables that directions are drawn by: `densities` and `sums` of `chances`; `reflected`: weights, summed by row."""
    table = Fixed(weights)
    return {
        "densities": Fixed(lambda: chances(table.numbers, solid)[0].reshape(-1)),
        "sums": Fixed(lambda: chances(table.numbers, solid)[1].reshape(-1)),
        "reflected": Fixed(lambda: table.numbers.sum(axis=1)),
    }


def chances(weights: np.ndarray, solid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Probability per projected solid angle [1/sr] of cells, and the sums of probabilities before each, for rows.

    weights  (rows, cells), not negative: value times projected solid angle; rows of zeros are drawn by the cosine
    solid    (cells,) projected solid angles [sr], pi in all
    Shapes   densities: (rows, cells); sums: (rows, cells).
    """
    total = weights.sum(axis=1, keepdims=True)
    by_cosine = solid / solid.sum()
    shares = np.where(total > 0.0, weights / np.where(total > 0.0, total, 1.0), by_cosine)
    probability = (1.0 - COSINE_SHARE) * shares + COSINE_SHARE * by_cosine
    before = np.zeros(probability.shape)
    np.cumsum(probability[:, :-1], axis=1, out=before[:, 1:])
    return probability / solid, before


def with_holes(values: np.ndarray) -> np.ndarray:
    """The values, NaN where they are not finite; they themselves if all are."""
    finite = np.isfinite(values)
    return values if finite.all() else np.where(finite, values, np.nan)


def magnitude(values: np.ndarray) -> np.ndarray:
    """|f| as samples are drawn by: 0 where there is no number, and never so large that sums overflow."""
    return np.minimum(np.abs(np.where(np.isfinite(values), values, 0.0)), 1e100)


def choose(before: Any, start: Any, count: int, u: Any) -> tuple[Any, Any]:
    """The cell that the uniform number u falls into, and where in it, from 0 to 1.

    before  sums of probabilities, flat; `start` is where the row of `count` cells begins.
    """
    cell = ops.to_index(0.0 * u)
    step = 1 << (max(count - 1, 1).bit_length() - 1)
    while step:
        further = ops.minimum(cell + step, count - 1)
        cell = ops.where(ops.take(before, start + further) <= u, further, cell)
        step >>= 1
    low = ops.take(before, start + cell)
    is_last = cell > count - 2
    high = ops.where(is_last, 1.0, ops.take(before, start + ops.where(is_last, cell, cell + 1)))
    return cell, ops.clip((u - low) / (high - low), 0.0, 1.0)


def lifted(x: Any, y: Any) -> Direction:
    """The direction above a point of the unit disc."""
    return Direction(x, y, ops.sqrt(ops.maximum(1.0 - x * x - y * y, 1e-20)))
