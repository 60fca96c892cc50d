"""The residual of one value as a kernel: one formula is summed up compiled, listed, and differentiated by others."""

from __future__ import annotations

from functools import cache
from typing import Any

from ..arrays import ops
from ..base import kernels
from ..evaluate.tracing import Kernel
from .losses import LOSSES, ROBUST

WIDTHS = (3, 3, 1, 1)
"""Lengths of wi, wo, what the data come to, and weights."""


def _difference(m: Any, mean: Any, wi: Any, wo: Any, target: Any, weight: Any, loss: str) -> Any:
    (f,) = kernels.value(m, mean, wi, wo)
    compared = LOSSES[loss].compared(f, wi[2])
    return weight[0] * (ops.where(weight[0] > 0.0, compared, 0.0) - target[0])


@cache
def difference(loss: str) -> Kernel:
    """weight * (compared(f) - target), 0 where the weight is 0."""

    def kernel(m: Any, mean: Any, wi: Any, wo: Any, target: Any, weight: Any) -> tuple[Any, ...]:
        return (_difference(m, mean, wi, wo, target, weight, loss),)

    return kernel


@cache
def costs(loss: str, robust: str) -> Kernel:
    """The residual, its cost and its weight, for normal equations."""
    function = ROBUST[robust]

    def kernel(m: Any, mean: Any, wi: Any, wo: Any, target: Any, weight: Any) -> tuple[Any, ...]:
        r = _difference(m, mean, wi, wo, target, weight, loss)
        return r, function.cost(r * r), function.weight(r * r)

    return kernel


@cache
def scores(loss: str, robust: str) -> Kernel:
    """The residual, its cost, and the square of weight and residual: the matrix is then that of the squared slopes of
    the cost, which the covariance needs where the noise is not known."""
    function = ROBUST[robust]

    def kernel(m: Any, mean: Any, wi: Any, wo: Any, target: Any, weight: Any) -> tuple[Any, ...]:
        r = _difference(m, mean, wi, wo, target, weight, loss)
        slope = function.weight(r * r) * r
        return r, function.cost(r * r), slope * slope

    return kernel
