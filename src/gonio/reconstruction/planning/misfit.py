"""By how much a model may be off: a random smooth function of the half and difference angles."""

from __future__ import annotations

import math

import numpy as np

from ...base.frames import half_difference

ORDERS = [(i, j, k) for i in range(4) for j in range(4) for k in range(2) if i + j + k <= 3]
"""Orders of cosines of sqrt(theta_h), theta_d and 2 phi_d in the error of a model."""

ERRORS = len(ORDERS)


def smooth_errors(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Functions (N, ERRORS) of pairs of directions, whose sum with random coefficients is smooth, and 1 in root mean
    square: products of cosines over the half and difference angles, half as much of each order more in variance."""
    theta_h, _, theta_d, phi_d = half_difference(wi, wo)
    h, d = np.pi * np.sqrt(theta_h * (2.0 / np.pi)), 2.0 * theta_d
    sizes = np.array([2.0 ** -(0.5 * sum(orders)) for orders in ORDERS])
    # A cosine has the mean square 1/2, that of order 0 has 1.
    spread = np.array([2.0 ** -sum(order > 0 for order in orders) for orders in ORDERS])
    waves = np.stack([np.cos(i * h) * np.cos(j * d) * np.cos(2 * k * phi_d) for i, j, k in ORDERS], axis=-1)
    found: np.ndarray = waves * sizes / math.sqrt(float((sizes**2 * spread).sum()))
    return found
