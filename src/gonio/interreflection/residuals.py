"""Linear equations by least residuals, with sums that are the same on any number of threads."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

RESTART, RESTARTS = 40, 25
"""Directions that are kept, and times that they are begun anew."""


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.einsum("i,i->", a, b))


def gmres(
    apply: Callable[[np.ndarray], np.ndarray], right: np.ndarray, start: np.ndarray, residual: float
) -> np.ndarray | None:
    """x (n,) with |right - A x| <= residual |right|, A x being `apply(x)`; None where it does not settle.

    Source   Saad & Schultz 1986, SIAM J. Sci. Stat. Comput. 7:856: x of least residual among all sums of a start and
             of A applied to its residual, again and again; least squares here by QR of the Hessenberg matrix.
    """
    limit = residual * np.sqrt(_dot(right, right))
    x = start.copy()
    for _ in range(RESTARTS):
        rest = right - apply(x)
        size = np.sqrt(_dot(rest, rest))
        if size <= limit:
            return x
        basis, hessenberg = [rest / size], np.zeros((RESTART + 1, RESTART))
        for k in range(RESTART):
            new = apply(basis[k])
            for j, old in enumerate(basis):
                hessenberg[j, k] = _dot(old, new)
                new -= hessenberg[j, k] * old
            hessenberg[k + 1, k] = np.sqrt(_dot(new, new))
            part, goal = hessenberg[: k + 2, : k + 1], np.append(size, np.zeros(k + 1))
            shares = np.linalg.lstsq(part, goal)[0]
            if np.linalg.norm(goal - part @ shares) <= limit or hessenberg[k + 1, k] == 0.0:
                break
            basis.append(new / hessenberg[k + 1, k])
        for share, vector in zip(shares, basis, strict=False):
            x += share * vector
        if np.linalg.norm(goal - part @ shares) <= limit:
            return x
    return None
