"""Rows of numbers that are alike."""

from __future__ import annotations

import numpy as np
import pytest

from gonio.numerics.unique_rows import first_alike


def by_loop(rows):
    """The first row with the same numbers, one by one."""
    seen: dict = {}
    return [seen.setdefault(str((row + 0.0).tolist()), k) for k, row in enumerate(rows)]


@pytest.mark.parametrize("seed", range(4))
def test_the_first_of_each(seed):
    rows = np.random.default_rng(seed).choice([0.0, -0.0, 1.0, 2.5, np.nan, np.inf], (200, 1 + seed))
    assert first_alike(rows).tolist() == by_loop(rows)
    assert first_alike(rows[:1]).tolist() == [0] and first_alike(rows[:0]).tolist() == []


def test_rows_of_one_key_are_told_apart():
    """Of two columns a, b the key is the same where b takes back what a did."""
    odd = np.uint64(0x9E3779B97F4A7C15)
    bits = np.random.default_rng(0).integers(1 << 62, 1 << 62 | 1 << 51, 50).astype(np.uint64)
    with np.errstate(over="ignore"):
        first = bits * odd
        first ^= first >> np.uint64(32)
    target = np.uint64(0x3FF0000000000000)
    rows = np.stack([bits, first ^ target], axis=1)
    rows = np.concatenate([rows, rows[::-1]]).view(float)
    keep = np.isfinite(rows).all(axis=1)
    assert keep.sum() > 20
    rows = rows[keep]
    assert first_alike(rows).tolist() == by_loop(rows)
