"""A surface as heights at the corners of a periodic grid of cells, two triangles a cell."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Self

import numpy as np

from ..arrays import frozen
from ..declared.arguments import Declared, checked
from ..declared.numbers import numbers
from ..errors import ParameterError, TooLargeError

STEEPEST = 50.0
"""Root mean square of the slopes of a surface up to which it is taken to be one: 89 degrees."""

MOST = 1 << 24
"""Corners of a grid at most."""

UNITS = {"nm": 1e-3, "um": 1.0, "mm": 1e3, "m": 1e6}
"""Units of length by name, in micrometres; "" is a unit of its own."""


class HeightField:
    """A periodic surface: heights at the corners of a grid, two triangles between the four corners of a cell.

    heights   (rows, columns): y grows with the row, x with the column; the first of each follows the last one again
    cell      lengths of a cell along x and y, in the unit of the heights
    unit      "nm", "um", "mm", "m", or "" where only ratios of lengths matter
    turn      the turn about the normal after which the surface is the same, statistically: 0 (any: isotropic), pi, 2 pi
    again     makes another realization from a seed; None for a surface that is what it is
    seed      what this one was made from
    is_part   whether it stands for a larger surface, of which it is a part; `is_mirrored`: and the rest of it are the
              mirror images of its first quarter

    A cell is cut from its corner (0, 0) to (1, 1). Heights are kept in single precision, about their mean.

    Example
    >>> roof = gn.surfaces.HeightField([[0.0, 0.6]])
    >>> print(roof.period, roof.rms_slopes)
    (2.0, 1.0) (0.6, 0.0)
    """

    _noun = "a surface such as gn.surfaces.gaussian(0.3)"

    @checked
    def __init__(
        self,
        heights: Any,
        cell: tuple[float, float] = (1.0, 1.0),
        *,
        unit: str = "",
        turn: Annotated[
            float,
            Declared("after which the surface is the same, statistically: 0 any, isotropic", 0.0, 2.0 * math.pi, "rad"),
        ] = 2.0 * math.pi,
        again: Callable[..., HeightField] | None = None,
        seed: int = 0,
        is_part: bool = False,
        is_mirrored: bool = False,
        title: str = "",
    ):
        try:
            given = numbers(heights)
        except ValueError as error:
            raise ParameterError(f"heights: {error}; expected an array (rows, columns)") from None
        if given.ndim != 2 or not given.size:
            raise ParameterError(f"heights: got shape {given.shape}, expected (rows, columns), at least one of each")
        if given.size > MOST:
            raise TooLargeError(f"heights: {given.size} corners; expected at most {MOST}: take a part of the surface")
        if not np.isfinite(given).all():
            count = int((~np.isfinite(given)).sum())
            raise ParameterError(
                f"heights: {count} of {given.size} are NaN or infinite; expected finite ones: fill the holes first "
                f"(gn.surfaces.from_map does it)"
            )
        if not all(0.0 < x < math.inf for x in cell):
            raise ParameterError(f"cell={cell}: expected two lengths above 0, in the unit of the heights")
        if unit and unit not in UNITS:
            raise ParameterError(f"unit={unit!r}: expected one of {', '.join(map(repr, UNITS))}, or '' for none")
        given = given.astype(float)
        self.heights: np.ndarray = frozen((given - given.mean()).astype(np.float32))
        self.cell, self.unit, self.turn, self.again, self.seed = cell, unit, turn, again, seed
        self.is_part, self.is_mirrored = is_part, is_mirrored
        self.title = title or f"{self.heights.shape[0]} x {self.heights.shape[1]} heights"
        steep = math.hypot(*self.rms_slopes)
        if not steep <= STEEPEST:
            raise ParameterError(
                f"heights: their slopes are {steep:.3g}, {math.degrees(math.atan(steep)):.2f} degrees, rms, "
                f"expected at most {STEEPEST:g}; are heights and cells in one unit? cells are {cell[0]:g} x {cell[1]:g}"
            )

    @property
    def period(self) -> tuple[float, float]:
        """Lengths along x and y after which the surface repeats.

        Example
        >>> print(gn.surfaces.v_grooves(0.6).period)
        (2.0, 1.0)
        """
        rows, columns = self.heights.shape
        return columns * self.cell[0], rows * self.cell[1]

    @property
    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of the triangles along x and y: each is that of two of them.

        Example
        >>> along, across = gn.surfaces.v_grooves(0.6).slopes
        >>> print(along.round(4), across)
        [[ 0.6 -0.6]] [[0. 0.]]
        """
        h = self.heights.astype(float)
        along, across = ((np.roll(h, -1, axis) - h) / length for axis, length in ((1, self.cell[0]), (0, self.cell[1])))
        return along, across

    @property
    def rms_slopes(self) -> tuple[float, float]:
        """Root mean squares of `slopes`; times sqrt(2) they are Beckmann's alpha_x and alpha_y of a Gaussian surface.

        Example
        >>> print(gn.surfaces.v_grooves(0.6).rms_slopes)
        (0.6, 0.0)
        """
        along, across = self.slopes
        return round(float(np.sqrt(np.mean(along**2))), 7), round(float(np.sqrt(np.mean(across**2))), 7)

    @property
    def is_random(self) -> bool:
        """Whether there are other realizations of it.

        Example
        >>> print(gn.surfaces.gaussian(0.3).is_random, gn.surfaces.v_grooves(0.6).is_random)
        True False
        """
        return self.again is not None

    @checked
    def realization(self, seed: int) -> Self | HeightField:
        """An independent surface of the same kind; itself where there is none.

        Example
        >>> one = gn.surfaces.gaussian(0.3)
        >>> print(np.array_equal(one.heights, one.realization(7).heights))
        False
        """
        return self if self.again is None else self.again(seed=seed)

    def __repr__(self) -> str:
        return f"<surface: {self.title}>"
