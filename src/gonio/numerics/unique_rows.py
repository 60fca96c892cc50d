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


def first_alike(rows: np.ndarray) -> np.ndarray:
    """Of every row of numbers (N, K) the number of the first that is the same (N,); NaN equals NaN, and 0 equals -0.

    Rows are sorted by a key of 64 bits and compared with their neighbours; by all columns only where two share a key.

    Example
    >>> from gonio.numerics.unique_rows import first_alike
    >>> print(first_alike(np.array([[2.0, np.nan], [0.0, 5.0], [2.0, np.nan], [-0.0, 5.0]])))
    [0 1 0 1]
    """
    bits = np.ascontiguousarray(rows + 0.0).view(np.uint64)
    keys = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        keys = (keys ^ column) * np.uint64(0x9E3779B97F4A7C15)  # as splitmix64
        keys ^= keys >> np.uint64(32)
    order = np.argsort(keys, kind="stable")
    same = (bits[order[1:]] == bits[order[:-1]]).all(axis=1)
    if (~same & (keys[order[1:]] == keys[order[:-1]])).any():
        order = np.lexsort(bits.T)
        same = (bits[order[1:]] == bits[order[:-1]]).all(axis=1)
    starts = np.ones(len(bits), bool)
    starts[1:] = ~same
    first = np.empty(len(bits), np.intp)
    first[order] = order[starts][np.cumsum(starts) - 1]
    return first
