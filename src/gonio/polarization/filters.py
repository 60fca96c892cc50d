"""Ideal polarizing filters as Mueller matrices, in the axes of the light that they stand in."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..declared.arguments import checked
from .axes import plain_angle, rotator


@checked
def polarizer(psi: Any) -> np.ndarray:
    """The Mueller matrix of an ideal linear polarizer whose axis is psi from x towards y.

    Shapes   psi: (...); result (..., 4, 4).
    Units    psi: rad.
    Error    rounding.

    Example
    >>> crossed = gn.polarization.polarizer(0.0) @ gn.polarization.polarizer(np.pi / 2)
    >>> print(np.abs(crossed).max().round(9))
    0.0
    """
    row = 2.0 * analyser(psi)
    product: np.ndarray = 0.5 * row[..., :, None] * row[..., None, :]
    return product


@checked
def analyser(psi: Any) -> np.ndarray:
    """The row (1, cos 2 psi, sin 2 psi, 0)/2: analyser(psi) @ S is the radiance behind a polarizer of that axis.

    Shapes   psi: (...); result (..., 4).
    Units    psi: rad.
    Error    rounding.

    Example
    >>> print(gn.polarization.analyser(0.0) @ [1.0, 0.6, 0.0, 0.0])
    0.8
    """
    twice = 2.0 * plain_angle("psi", psi)
    return 0.5 * np.stack([np.ones_like(twice), np.cos(twice), np.sin(twice), np.zeros_like(twice)], -1)


@checked
def retarder(delay: Any, psi: Any = 0.0) -> np.ndarray:
    """The Mueller matrix of a retarder: light across its fast axis, which is psi from x towards y, is late by `delay`.

    Shapes   delay, psi: (...), broadcast; result (..., 4, 4).
    Units    rad; a quarter-wave plate delays by pi/2.
    Error    rounding.

    Example
    >>> plate = gn.polarization.retarder(np.pi / 2, np.pi / 4)
    >>> print((plate @ [1, 1, 0, 0]).round(3))  # circular
    [1. 0. 0. 1.]
    """
    delay, psi = plain_angle("delay", delay), plain_angle("psi", psi)
    ops.broadcast_shape([delay.shape, psi.shape], "delay and psi")
    delay, psi = np.broadcast_arrays(delay, psi)
    plate = np.zeros((*delay.shape, 4, 4))
    plate[..., 0, 0] = plate[..., 1, 1] = 1.0
    plate[..., 2, 2] = plate[..., 3, 3] = np.cos(delay)
    plate[..., 2, 3], plate[..., 3, 2] = np.sin(delay), -np.sin(delay)
    turned: np.ndarray = rotator(-psi) @ plate @ rotator(psi)
    return turned
