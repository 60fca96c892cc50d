"""Points that pixels are sampled at: a lattice of rank 1 in six dimensions, shifted at random in each pixel."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..machine.caches import kept

DIMENSIONS = 6
GENERATOR = 60123
"""Of the numbers below 2^16 whose lattices of 8 to 1024 points have P_2 within 15 % of the best found, one with little
noise in pictures of glossy and matt spheres at 32, 64 and 256 points."""


@kept
def points(start: int, stop: int) -> np.ndarray:
    """Points start to stop (n, 6) of a lattice sequence, float32 in [0, 1): of its first 2^m points, and of every 2^m
    after these, each dimension and each pair of them is evenly filled.

    Point k is the fractional part of phi(k) (1, a, a^2, ...), where phi(k) mirrors the binary digits of k at the point.

    Source: Hickernell, Hong, L'Ecuyer & Lemieux 2000, SIAM J. Sci. Comput. 22(3):1117 (extensible Korobov lattices).
    """
    k = np.arange(start, stop, dtype=np.uint64)
    phi = np.zeros(len(k), np.uint64)
    for bit in range(32):
        phi |= ((k >> np.uint64(bit)) & np.uint64(1)) << np.uint64(31 - bit)
    powers = [pow(GENERATOR, j, 1 << 32) for j in range(DIMENSIONS)]
    whole = np.stack([(phi * np.uint64(z)) & np.uint64(0xFFFFFFFF) for z in powers], -1)
    found = (whole >> np.uint64(8)).astype(np.float32) * np.float32(2.0**-24)
    found.flags.writeable = False
    return found


def shifted(u: Any, shift: Any) -> Any:
    """The fractional part of the sum of two numbers in [0, 1)."""
    total = u + shift
    return ops.where(total >= 1.0, total - 1.0, total)
