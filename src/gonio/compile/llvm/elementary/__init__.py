"""Elementary functions on vectors of reals, composed of arithmetic, selections and bit operations only.

No function branches, reads tables or calls a library. Each is written once for both dtypes, which differ in the
coefficients of their polynomials. Errors in the docstrings are the largest ones measured, in units in the last place
(ulp). NaN passes through; `exp` and `power` flush results below the smallest normal number to zero.

Coefficients were fitted by Remez exchange in 50 digits and rounded to the dtype; the comment at each set gives the
interval and the largest relative error of the function composed with the rounded ones.
"""

from __future__ import annotations

from collections.abc import Callable

from ....arrays.ops import ELEMENTARY
from ..lanes import IRValue
from . import angles, error_function, exponential

FUNCTIONS: dict[str, Callable[..., IRValue]] = {
    name: function
    for family in (exponential, angles, error_function)
    for name, function in vars(family).items()
    if name in ELEMENTARY
}
"""The operations of a graph that are computed so, by their names: those of `ops` that these files have."""
