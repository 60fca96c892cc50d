"""Losses of fits by name: what is compared in place of f, and how much a large residual counts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..arrays import ops


class Loss(NamedTuple):
    """What is compared: a function of f and of cos(theta_i); a line about it; whether it is f times a number."""

    compared: Callable[[Any, Any], Any]
    doc: str
    is_linear: bool = False


LEAST = 1e-9
"""Least f cos(theta_i) whose cube root or logarithm is taken: both are steep at 0."""


def _cube_root(f: Any, cos_i: Any) -> Any:
    return ops.exp(ops.log(ops.maximum(f * cos_i, LEAST)) / 3.0)


LOSSES: dict[str, Loss] = {
    "plain": Loss(lambda f, cos_i: f, "f", True),
    "cosine": Loss(lambda f, cos_i: f * cos_i, "f cos(theta_i); Ngan, Durand & Matusik 2005", True),
    "log": Loss(lambda f, cos_i: ops.log(1.0 + f * cos_i), "ln(1 + f cos(theta_i)); Löw et al. 2012"),
    "cube_root": Loss(_cube_root, "(f cos(theta_i))^(1/3); Fores, Ferwerda & Gu 2012"),
    "ratio": Loss(lambda f, cos_i: ops.log(ops.maximum(f, LEAST)), "ln f: the ratio of model and data"),
    "likelihood": Loss(lambda f, cos_i: f, "f, over the standard uncertainty of each value", True),
}
"""Name -> loss: the sum of squares of the difference of what is compared."""


def of_starts(loss: str) -> str:
    """The loss by which unknowns that enter linearly are solved for at the start: others are steep, or flat, at 0."""
    return loss if LOSSES[loss].is_linear else "cosine"


class Robust(NamedTuple):
    """Cost of a residual from its square z, the derivative of that by z, and a line about it."""

    cost: Callable[[Any], Any]
    weight: Callable[[Any], Any]
    doc: str


def _huber_cost(z: Any) -> Any:
    return ops.where(z < 1.0, z, 2.0 * ops.sqrt(ops.maximum(z, 1.0)) - 1.0)


ROBUST: dict[str, Robust] = {
    "none": Robust(lambda z: z, lambda z: 1.0 + 0.0 * z, "z: least squares"),
    "soft_l1": Robust(
        lambda z: 2.0 * (ops.sqrt(1.0 + z) - 1.0), lambda z: 1.0 / ops.sqrt(1.0 + z), "2 (sqrt(1 + z) - 1)"
    ),
    "huber": Robust(_huber_cost, lambda z: 1.0 / ops.sqrt(ops.maximum(z, 1.0)), "z up to 1, then 2 sqrt(z) - 1"),
    "cauchy": Robust(lambda z: ops.log(1.0 + z), lambda z: 1.0 / (1.0 + z), "ln(1 + z)"),
}
"""Name -> the cost of a residual, of the square z of its ratio to the scale of residuals."""

SCALES = {"none": 1.0, "soft_l1": 1.0, "huber": 1.345, "cauchy": 2.385}
"""Scale of residuals, in standard deviations: of normal noise these lose 5 % of the precision (Holland & Welsch 1977;
soft_l1 loses less than 10 %)."""
