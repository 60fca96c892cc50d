"""Normal equations of a fit, summed in one pass over the data: no array of derivatives is written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arrays.kinds import COUNT
from ..formula.parametrised import Parametrised
from . import batch
from .tracing import Kernel, Task


class Squares(NamedTuple):
    """Sums over the last axis of the batch, in double precision; P parameters.

    cost      (...) of the cost of each residual
    gradient  (..., P) of w r dr/dp: half the derivative of the cost where w = d(cost)/d(r^2)
    matrix    (..., P, P) of w (dr/dp)(dr/dq)
    """

    cost: np.ndarray
    gradient: np.ndarray
    matrix: np.ndarray


def squares(
    kernel: Kernel,
    material: Parametrised,
    leaves: tuple[int, ...],
    inputs: Sequence[np.ndarray],
    widths: tuple[int, ...],
) -> Squares:
    """The normal equations of the residuals that a kernel gives, over the broadcast batch of `inputs`.

    `kernel(m, mean, *inputs)` gives the residual r, its cost and its weight w. `leaves`: the places of the parameters
    among those of the material, each a number or an array (..., 1) that broadcasts with the batch. The sums run over
    the last axis of the batch.

    Raises TraceError where the formula cannot be traced.

    Example
    >>> from gonio.evaluate.squares import squares
    >>> def residual(m, mean, x, y):
    ...     r = m.rho * x[0] - y[0]
    ...     return r, r * r, 1.0 + 0.0 * r
    ...
    >>> x, y = np.array([[1.0], [2.0]]), np.array([[0.5], [1.2]])
    >>> found = squares(residual, gn.Lambertian(0.5), (0,), (x, y), (1, 1))
    >>> print(found.cost.round(3), found.gradient.round(3), found.matrix.round(3))
    0.04 [-0.4] [[5.]]
    """
    count = len(leaves)
    sums = 1 + count + count * (count + 1) // 2
    cost, *others = batch.compute(Task(kernel, (COUNT,) * sums, widths, squares=leaves), material, inputs)
    matrix, entries = np.empty((*np.shape(cost), count, count)), iter(others[count:])
    for i in range(count):
        for j in range(i, count):
            matrix[..., i, j] = matrix[..., j, i] = next(entries)
    gradient = np.stack(others[:count], axis=-1) if count else np.empty((*np.shape(cost), 0))
    return Squares(np.asarray(cost), gradient, matrix)
