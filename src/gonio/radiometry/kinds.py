"""Kinds of arguments of radiometric functions: their ranges, and what to look at where a number is out of them."""

from typing import Annotated, Any

import numpy as np

from ..declared.arguments import ABOVE_ZERO, Declared
from ..declared.arrays import Array, VectorArrays

_ONE = 1.0 + 1e-6  # dot products of unit vectors exceed 1 by rounding; this is enough for float32
_SIGN = "check the sign, the unit and the order of the arguments"
_NOT_AN_ANGLE = "pass a cosine, not an angle, of the lit side"
_RADIANS = "angles are in radians"

_Real = Annotated[Any, Declared(_SIGN)]
_Positive = Annotated[Any, Declared(_SIGN, ABOVE_ZERO)]
_NotNegative = Annotated[Any, Declared(_SIGN, 0.0)]
_Wavelength = Annotated[Any, Declared("wavelengths are in nanometres", ABOVE_ZERO, unit="nm")]
_Reflectance = Annotated[Any, Declared("no surface reflects more than arrives", 0.0, 1.0, "share")]
_Cosine = Annotated[Any, Declared(_NOT_AN_ANGLE, 0.0, _ONE)]
_Divisor = Annotated[Any, Declared("leave grazing directions out", ABOVE_ZERO, _ONE)]
_EitherSide = Annotated[Any, Declared(_NOT_AN_ANGLE, -_ONE, _ONE)]
_Polar = Annotated[Any, Declared(_RADIANS, 0.0, np.pi, "rad")]
_Azimuth = Annotated[Any, Declared(_RADIANS, 0.0, 2.0 * np.pi, "rad")]
_VECTOR = VectorArrays()
_Vector = Annotated[Any, _VECTOR]
_Polygon = Annotated[Any, VectorArrays("(..., V, 3), V >= 3", axes=2)]
_Converted = Annotated[
    str, Declared("a quantity of reflectance", words=("brdf", "reflectance_factor", "brdf_cos_theta_i", "dsf"))
]
_Density = Annotated[str, Declared("what a density is per", words=("wavelength", "frequency", "wavenumber"))]


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)
