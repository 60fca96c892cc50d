"""Rows of numbers that are alike."""

from __future__ import annotations

import numpy as np


def unique_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of rows (N, K) each once, in rising order: where it comes first (M,), which of these every row is (N,), and how
    often each is there (M,).

    `numpy.unique(rows, axis=0)` compares records, in Python: a signal's exception that arrives there gets another name.

    Example
    >>> from gonio.numerics.unique_rows import unique_rows
    >>> print(*unique_rows(np.array([[2, 1], [0, 5], [2, 1]])))
    [1 0] [1 0 1] [1 2]
    """
    order = np.lexsort(rows.T[::-1])
    is_new = np.ones(len(rows), bool)
    is_new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    which = np.empty(len(rows), np.intp)
    which[order] = np.cumsum(is_new) - 1
    return order[is_new], which, np.bincount(which)
