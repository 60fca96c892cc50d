"""Vectors of the world as parameters: positions and directions, each component a number of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..arrays import ops
from ..errors import ParameterError
from . import tree
from .direction import Direction, normalize
from .fields import Part, param
from .parametrised import Parametrised
from .text import literal, shown


class WorldVector(Parametrised):
    """A position or a direction in the world, written as three numbers.

    Source   Cartesian components.

    Example
    >>> lamp = gn.PointLight([0.0, 0.0, 2.0])
    >>> print(lamp.position, lamp.parameters["position.z"].value, np.asarray(lamp.position))
    [0.0, 0.0, 2.0] 2.0 [0. 0. 2.]
    """

    x = param(0.0, -1e30, 1e30, "component x")
    y = param(0.0, -1e30, 1e30, "component y")
    z = param(0.0, -1e30, 1e30, "component z")

    @property
    def vector(self) -> Direction:
        """The components, as formulas take them.

        Example
        >>> print(gn.PointLight([0.0, 0.0, 2.0]).position.vector)
        Direction(x=0.0, y=0.0, z=2.0)
        """
        return Direction(self.x, self.y, self.z)

    @property
    def unit(self) -> Direction:
        """The components of the vector of length 1: of a direction, whatever its numbers are changed to.

        Example
        >>> print(gn.DistantLight([0.0, 0.0, 2.0]).direction.unit.z)
        1.0
        """
        return normalize(self.vector)

    is_numbers: ClassVar[bool] = True
    """It is taken as an array wherever one is expected."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return np.array([ops.to_numpy(x) if ops.dtype_of(x) else x for x in self.vector], dtype)

    def __repr__(self) -> str:
        return f"[{', '.join(map(literal, self.vector))}]"

    def to_json(self) -> Any:
        """The three numbers as a list.

        Example
        >>> print(gn.DistantLight([0, 0, 1], 2.0).to_json())
        {'type': 'DistantLight', 'direction': [0.0, 0.0, 1.0], 'irradiance': 2.0}
        """
        return np.asarray(self).tolist()


class Vector(Part):
    """A field of three numbers in the world; directions (`unit`) are divided by their length, positions (`is_place`)
    move with the world."""

    def __init__(self, default: Any, doc: str, unit: bool = False, is_place: bool = True):
        super().__init__(WorldVector, default, doc, None, "front")
        self.unit, self.is_place = unit, is_place and not unit
        self.range, self.accepts = "three numbers", "Array"

    def check(self, owner: str, value: Any) -> WorldVector:
        if isinstance(value, WorldVector):
            if not self.unit or abs(_length(value) - 1.0) < 1e-6:
                return value
            value = np.asarray(value)
        call = f"{owner}({self.name}={shown(value)})"
        lib = ops.library(value) if ops.dtype_of(value) else ops.LIBRARIES["numpy"]
        if lib.name != "numpy":
            return self._of_library(call, lib, value)
        try:
            array = ops.numbers(value)
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(f"{call}: expected three numbers ({self.doc})") from None
        array = array.astype(float) if array.shape == (3,) else np.full(3, math.nan)
        if not np.all(np.isfinite(array)):
            raise ParameterError(f"{call}: expected three finite numbers ({self.doc})")
        length = math.hypot(*array) if self.unit else 1.0
        if not 0.0 < length < math.inf:
            raise ParameterError(f"{call}: a vector of length {length:g} is no direction; expected {self.doc}")
        return WorldVector(*map(float, array / length))

    def _of_library(self, call: str, lib: ops.Library, value: Any) -> WorldVector:
        """An array of another library stays one: results can be differentiated by it."""
        if lib.channel_loop or lib.shape(value) != (3,) or not lib.dtype(value).startswith(("float", "int")):
            raise ParameterError(f"{call}: expected three numbers ({self.doc}), of NumPy, PyTorch or JAX")
        known = lib.known(value)
        if known is not None and not (np.all(np.isfinite(known)) and (known.any() or not self.unit)):
            raise ParameterError(f"{call}: expected three finite numbers, not all 0 ({self.doc})")
        unit = value / ops.sqrt((value * value).sum()) if self.unit else value
        return WorldVector(*(unit[i] for i in range(3)))


def _length(v: WorldVector) -> float:
    return float(np.linalg.norm(np.asarray(v)))


def vector(default: Any, doc: str, unit: bool = False, is_place: bool = True) -> Any:
    """Three numbers in world space, a position or (`unit`) a direction; formulas read `.vector`, or `.unit`.

    Each is a parameter of its own, such as `position.z`. Pictures move positions to where they see the scene from;
    `is_place=False` is for what is neither a position nor a direction, such as an edge.

    Example
    >>> from gonio.authoring import vector
    >>> print(vector((0.0, 0.0, 1.0), "direction to the light", unit=True).default)
    (0.0, 0.0, 1.0)
    """
    return Vector(default, doc, unit, is_place)


T = TypeVar("T", bound=Parametrised)


def moved(value: T, by: Sequence[float]) -> T:
    """The same with all its positions moved by three lengths along x, y and z; itself where it has none.

    Example
    >>> from gonio.formula.world import moved
    >>> print(moved(gn.SpotLight([0.0, 0.0, 2.0], [0.0, 0.0, -1.0]), (1e6, 0.0, 0.0)).position)
    [1000000.0, 0.0, 2.0]
    """
    places = [(path, held) for path, field, held, _ in tree.walk(value) if isinstance(field, Vector) and field.is_place]
    return tree.with_values(
        value,
        {f"{path}.{axis}": x + d for path, held in places for axis, x, d in zip("xyz", held.vector, by, strict=True)},
    )
