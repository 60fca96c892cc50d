"""Integrals of all places from those of a few, where f is a sum of products of the place and of the directions."""

from __future__ import annotations

import numpy as np

from ...numerics.quadrature import Integrals
from .rows import BLOCK, SPREAD, MaterialRows, Wanted, least_and_most


def by_factors(
    rows: MaterialRows, columns: list[np.ndarray], wanted: Wanted
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    extra = [row for x in columns for row in least_and_most(x)]
    spread = np.linspace(0, rows.length - 1, min(rows.length, SPREAD)).astype(int)
    sample, share = np.unique(np.concatenate([spread, np.array(extra, int)])), 1.0
    while True:
        table = np.stack([x[sample] for x in columns], axis=-1)
        sample, table = sample[np.isfinite(table).all(axis=-1)], table[np.isfinite(table).all(axis=-1)]
        few = sample[_independent(table)]
        integrals = rows.integrals(few, wanted, share / max(1.5 * len(few), 1.0))
        value, error, misfit = _combined(columns, few, integrals)
        goal = wanted.tolerance * np.maximum(wanted.unit[:, None], np.abs(value).max(axis=-1))
        worst = float(np.nanmax(error / goal, initial=0.0))
        if len(misfit):
            sample = np.concatenate([few, misfit[:: max(1, len(misfit) // SPREAD)]])
        elif worst > 1.0 and share > 1e-4:
            share *= 0.5 / worst
        else:
            break
    missing = np.broadcast_to(integrals.missing.max(axis=-1, initial=0.0)[:, None], error.shape)
    return value, np.nan_to_num(error), missing


def _independent(table: np.ndarray) -> list[int]:
    """Rows that others are combinations of, with small coefficients: Gauss's elimination with the largest pivots."""
    rest = table / np.maximum(np.abs(table).max(axis=0, initial=0.0), 1e-300)
    few: list[int] = []
    for _ in range(min(rest.shape)):
        row, column = np.unravel_index(np.abs(rest).argmax(), rest.shape)
        pivot = rest[row, column]
        if abs(pivot) < 1e-12:
            break
        few.append(int(row))
        rest = rest - np.outer(rest[:, column], rest[row] / pivot)
    return few


def _combined(
    columns: list[np.ndarray], few: np.ndarray, integrals: Integrals
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values and errors of all rows from those of a few, and the numbers of rows that are no combination of these."""
    count, directions = len(columns[0]), len(integrals.value)
    value, error = np.empty((directions, count, integrals.value.shape[-1])), np.empty((directions, count))
    table = np.stack([x[few] for x in columns], axis=-1)
    scale = np.maximum(np.abs(table).max(axis=0, initial=0.0), 1e-300)
    inverse = np.linalg.pinv(table / scale, rcond=1e-14) if len(few) else np.zeros((len(columns), 0))
    misfit = []
    for start in range(0, count, BLOCK):
        part = slice(start, start + BLOCK)
        here = np.stack([x[part] for x in columns], axis=-1) / scale
        weights = here @ inverse
        if len(few) < len(columns):
            misfit.append(start + np.flatnonzero((np.abs(here - weights @ (table / scale)) > 1e-9).any(axis=-1)))
        for k in range(directions):
            value[k, part] = weights @ integrals.value[k]
            error[k, part] = np.abs(weights) @ integrals.error[k]
    return value, error, np.concatenate(misfit) if misfit else np.zeros(0, int)
