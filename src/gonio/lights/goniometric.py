"""A luminaire by its measured intensities: IES and EULUMDAT files."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from ..arrays import Fixed, ops
from ..base.light import Light
from ..errors import ParameterError
from ..formula.direction import Direction, cross, dot, normalize
from ..formula.fields import Field, param
from ..formula.table_warp import bracket
from ..formula.world import vector
from ._beam import is_at, to_place
from ._photometry import Photometry
from ._words import Word

DEGREES = 180.0 / math.pi


class _File(Field):
    opens_files = True
    is_table = True
    accepts = "str | PathLike[str] | None"

    def check(self, owner: str, value: Any) -> Photometry:
        return _UNIFORM if value is None else Photometry.of(value)

    def traced(self, value: Photometry) -> Any:
        return value.kind, value.candela.shape, len(value.tilt[0])


_UNIFORM = Photometry("C", np.array([0.0, 180.0]), np.zeros(1), np.ones((1, 2)), (np.zeros(1), np.ones(1)), -1.0)


class GoniometricLight(Light):
    r"""Nearby point source of measured intensity: $E = I(\gamma, C) \cos\theta/r^2$.

    `file`: LM-63 (.ies; types A, B and C, TILT) or EULUMDAT (.ldt; symmetries 0 to 4); without it one candela to all
    sides. The luminaire hangs so that its nadir, gamma = 0, is along `axis` and C = 0 towards `forward`; seen against
    the axis, C runs counterclockwise: 90 degrees is along forward x axis. Of types A and B `axis` is where it aims,
    and vertical angles grow towards `forward`. Between angles intensity is bilinear, beyond the first angles 0.

    Looks    `GoniometricLight("examples/downlight.ies", [-0.5, -1.5, 2.5], forward=[0, 1, 0], efficacy=30.0)`: two
             rings, as a reflector throws them.
    Shapes   position, axis, forward: (3,), of any length; efficacy: a number or (C,).
    Units    position: m. Files hold candela: with an efficacy of 1 results are photometric, E in lux, L in cd m-2.
             `efficacy` K [lm/W], of the light of the lamp, divides: intensity in W sr-1.
    Errors   FormatError for counts that contradict the numbers that follow; NotFoundError.
    Error    rounding.
    Source   IES LM-63-02; Stockmar 1990 for EULUMDAT.

    Example
    >>> import pathlib
    >>> numbers = "1 1000 1 3 1 1 2 0 0 0 1 1 10 0 45 90 0 100 50 0"
    >>> _ = pathlib.Path("lamp.ies").write_text("IESNA:LM-63-2002\nTILT=NONE\n" + numbers)
    >>> lamp = gn.GoniometricLight("lamp.ies", position=[0.0, 0.0, 2.0])
    >>> print(gn.irradiance(lamp, [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]).round(3))  # lux
    [25.     4.419]
    """

    file: Any = _File(None, "an .ies or .ldt file")
    position = vector((0.0, 0.0, 1.0), "where the light is [m]")
    axis = vector((0.0, 0.0, -1.0), "where gamma = 0 points, or it aims", unit=True)
    forward = vector((1.0, 0.0, 0.0), "where C = 0 points, across the axis", unit=True)
    efficacy = param(1.0, 1e-6, 1e6, "candela for each W sr-1", unit="lm W-1")

    first: Any  # tables, of bound lights only
    second: Any
    candela: Any
    tilt_angle: Any
    tilt_factor: Any

    is_delta: ClassVar[bool] = True

    def validate(self) -> None:
        if self.like() is None and np.linalg.norm(np.cross(self.axis, self.forward)) < 1e-6:
            rule = "expected a direction across it"
            raise ParameterError(f"GoniometricLight(forward={self.forward}): it is along the axis, {self.axis}; {rule}")

    def to_json(self) -> dict[str, Any]:
        return {**super().to_json(), "file": self.file.path}

    def _keep(self) -> dict[str, Fixed]:
        names = ("first", "second", "candela", "tilt_angle", "tilt_factor")
        f = self.file
        flat = (f.first, f.second, f.candela.reshape(-1), *f.tilt)
        return {**super()._keep(), **{name: Fixed(numbers) for name, numbers in zip(names, flat, strict=True)}}

    def _angles(self, w: Direction) -> tuple[Any, Any]:
        """The two angles [degrees] of a direction from the luminaire."""
        axis = self.axis.unit
        along = dot(w, axis)
        forward = normalize(self.forward.unit - axis * dot(self.forward.unit, axis))
        ahead, side = dot(w, forward), dot(w, cross(forward, axis))
        if self.file.kind == "C":
            gamma = ops.arctan2(ops.sqrt(ahead * ahead + side * side + 1e-20), along)
            turn = ops.arctan2(side, ops.where((ahead == 0.0) & (side == 0.0), 1.0, ahead))
            return gamma * DEGREES, ops.where(turn < 0.0, turn + 2.0 * math.pi, turn) * DEGREES
        if self.file.kind == "A":
            horizontal, rest = ops.arctan2(side, along), ops.sqrt(along * along + side * side + 1e-20)
            return ops.arctan2(ahead, rest) * DEGREES, horizontal * DEGREES
        vertical, rest = ops.arctan2(ahead, along), ops.sqrt(along * along + ahead * ahead + 1e-20)
        return vertical * DEGREES, ops.arctan2(side, rest) * DEGREES

    def _candela(self, w: Direction) -> Any:
        """Intensity [cd] in a direction from the luminaire."""
        around, count = self.file.candela.shape
        first, second = self._angles(w)
        rows, columns = bracket(self.second, around, second), bracket(self.first, count, first)
        total: Any = 0.0
        for i, v in rows:
            for j, u in columns:
                total = total + v * u * ops.take(self.candela, i * count + j)
        slack = 1e-3  # degrees, for rounding at the last angle
        seen = (first >= ops.take(self.first, 0) - slack) & (first <= ops.take(self.first, count - 1) + slack)
        if self.file.kind != "C":
            last = ops.take(self.second, around - 1) + slack
            seen = seen & (second >= ops.take(self.second, 0) - slack) & (second <= last)
        return ops.where(seen, total, 0.0) * self._of_tilt()

    def _of_tilt(self) -> Any:
        """The factor of the tilt that the luminaire has."""
        axis = self.axis.unit
        angle = ops.arctan2(ops.sqrt(axis.x * axis.x + axis.y * axis.y + 1e-20), -axis.z) * DEGREES
        nodes = bracket(self.tilt_angle, len(self.file.tilt[0]), angle)
        parts = [weight * ops.take(self.tilt_factor, k) for k, weight in nodes]
        return sum(parts[1:], parts[0])

    def holds(self, p: Direction) -> Any:
        return is_at(self.position.vector, p)

    def beam(self, p: Direction) -> tuple[Direction, Any, Any]:
        w, r2, r = to_place(self.position.vector, p)
        return w, self._candela(-w) / (self.efficacy * r2), r


WHERE = (-1.5, -1.5, 2.0)
"""Where the luminaire of a word hangs [m]: on the side of the camera, to the left."""


def _aimed(path: str) -> GoniometricLight:
    """The luminaire of a file, aimed at the sphere, which its greatest intensity lights to irradiance pi."""
    file = Photometry.of(path)
    brightest = float(file.candela.max() * file.tilt[1].max())
    if not brightest > 0.0:
        raise ParameterError(f"{path}: all its intensities are 0, expected a luminaire that shines")
    place = np.array(WHERE)
    return GoniometricLight(file, place, -place, [1.0, -1.0, 0.0], brightest / (math.pi * float(place @ place)))


WORDS = [
    Word(
        "FILE.ies",
        "luminaire, or .ldt, aimed at the sphere from the upper left; its greatest intensity gives irradiance pi",
        _aimed,
        suffixes=(".ies", ".ldt"),
    )
]
