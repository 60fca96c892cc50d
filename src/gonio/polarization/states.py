"""What Stokes vectors and Mueller matrices say: degree and angle of polarization, and whether a matrix can be."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..declared.arguments import Numbers, checked
from ..errors import ShapeError
from .axes import _matrices

TOLERANCE = 1e-6
"""Share of the largest eigenvalue that the smallest may be below 0, for single precision."""

_PAULI = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]]])
"""J = (I, Q, U, V) . these/2 is the coherency matrix E conj(E) of a Stokes vector, U + iV = 2 E_x conj(E_y)."""

_COHERENCY = np.einsum("iab,jcd->ijacbd", _PAULI, _PAULI.conj()).reshape(4, 4, 4, 4) / 4.0


@checked
def dop(S: Numbers, linear: bool = False) -> np.ndarray:
    """Degree of polarization, sqrt(Q^2 + U^2 + V^2)/I; `linear`: without V. NaN where I is 0.

    Shapes   S: (..., 4); result (...).
    Units    1.
    Error    rounding.

    Example
    >>> print(gn.polarization.dop([2.0, 0.6, 0.0, 0.8]), gn.polarization.dop([2.0, 0.6, 0.0, 0.8], linear=True))
    0.5 0.3
    """
    S = _stokes(S)
    size = np.linalg.norm(S[..., 1:3] if linear else S[..., 1:], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        degree: np.ndarray = np.where(S[..., 0] == 0.0, np.nan, size / S[..., 0])[()]
    return degree


@checked
def angle(S: Numbers) -> np.ndarray:
    """Angle of linear polarization from x towards y, atan2(U, Q)/2, in (-pi/2, pi/2].

    Shapes   S: (..., 4); result (...).
    Units    rad.
    Error    rounding.

    Example
    >>> print(np.degrees(gn.polarization.angle([1.0, 0.0, 0.5, 0.0])))
    45.0
    """
    S = _stokes(S)
    half: np.ndarray = 0.5 * np.arctan2(S[..., 2], S[..., 1])
    return half


@checked
def coherency(M: Numbers) -> np.ndarray:
    """The four eigenvalues of Cloude's coherency matrix of a Mueller matrix, the smallest first; their sum is M00.

    Each belongs to a Jones matrix, and M is the sum of what these do to light: so none can be below 0. One alone
    differs from 0 where M does not depolarize; a depolarizer has four equal ones.

    Shapes   M: (..., 4, 4); result (..., 4).
    Units    those of M.
    Error    rounding.
    Source   Cloude 1986, Optik 75(1):26, "Group theory and polarization algebra". The matrix as derived here.

    Example
    >>> print(gn.polarization.coherency(np.diag([1.0, 0.0, 0.0, 0.0])))
    [0.25 0.25 0.25 0.25]
    """
    H = np.einsum("...ij,ijab->...ab", _matrices(M), _COHERENCY)
    missing = ~np.isfinite(H).all(axis=(-1, -2))
    values: np.ndarray = np.linalg.eigvalsh(np.where(missing[..., None, None], 0.0, H))
    values[missing] = np.nan
    return values


@checked
def realizable(M: Numbers, tolerance: float = TOLERANCE) -> Any:
    """Whether a Mueller matrix can be that of a passage or reflection: no eigenvalue of `coherency` is below 0.

    "Below 0": by more than `tolerance` times the largest eigenvalue. NaN is not realizable, a matrix of zeros is.

    Shapes   M: (..., 4, 4); result (...).
    Error    rounding.
    Source   Cloude 1986, Optik 75(1):26.

    Example
    >>> print(gn.polarization.realizable(np.diag([1.0, 1.0, -1.0, -1.0])))  # a mirror
    True
    >>> print(gn.polarization.realizable(np.diag([1.0, 1.0, 1.0, -1.0])))  # turns circular light over, and only that
    False
    """
    values = coherency(M)
    return (values[..., 0] >= -tolerance * np.abs(values[..., -1]))[()]


def _stokes(S: Any) -> np.ndarray:
    S = np.asarray(S, float)
    if S.shape[-1:] != (4,):
        raise ShapeError(f"S: got shape {S.shape}, expected (..., 4): I, Q, U, V")
    return S
